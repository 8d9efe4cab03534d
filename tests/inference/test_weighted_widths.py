"""Are weighted draws that pass their own checks as wide as the posterior? Beside integrals, on the average of cables."""

import numpy as np
import pytest
from own_angle_tables import of_rows
from scipy import stats

from bowdenfit.description import PriorDefaults, SamplerSettings
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.batch.programs import BatchSettings
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.models import build_model

pytestmark = pytest.mark.extended

ANGLES = np.deg2rad([
    (200.0, 30.0, 20.0), (150.0, 80.0, 20.0), (90.0, 30.0, 60.0), (240.0, 60.0, 90.0), (60.0, 90.0, 30.0), (120.0, 20.0, 80.0),
])  # fmt: skip
OF_FLEETS = BatchSettings(SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=20_000, target_ess=1000), nuts=False)
MU, TAU = PriorDefaults().friction, PriorDefaults().run_scatter


def losses(count: int) -> list[np.ndarray]:
    """Six runs of three contacts each, of coefficients of 0.08 to 0.2 and mountings that differ by 1 to 3 %."""
    random, results = np.random.default_rng(5), []
    for _ in range(count):
        mu, tau = random.uniform(0.08, 0.2, 3), random.uniform(0.01, 0.03)
        results.append(ANGLES @ mu + tau * random.standard_normal(len(ANGLES)))
    return results


def exact_sds(loss: np.ndarray, n: int = 4096) -> np.ndarray:
    """Standard deviations of log mu over that of its prior, by a sum over tau and draws of mu at each.

    Half of these are of the prior, half of the normal that the readings say with this tau; each is weighted by the density
    over that of both, so that neither end of tau is left out.
    """
    n_runs, even = len(loss), stats.norm.ppf(stats.qmc.Sobol(6, rng=0).random(n))
    precision = ANGLES.T @ ANGLES
    middle, root = np.linalg.solve(precision, ANGLES.T @ loss), np.linalg.cholesky(np.linalg.inv(precision))
    norm = np.linalg.slogdet(root)[1]
    of_prior = MU.median * np.exp(MU.log_sd * even[:, :3])
    unit = even[:, 3:] @ root.T
    z, log_weights = [], []
    for log_tau in np.linspace(np.log(1e-4), np.log(30.0), 60):
        tau = np.exp(log_tau)
        mu = np.concatenate([of_prior, middle + tau * unit])
        mu = mu[(mu > 0).all(axis=1)]
        standardized = np.log(mu / MU.median) / MU.log_sd
        prior = -(standardized**2).sum(axis=1) / 2 - np.log(mu).sum(axis=1) - 3 * np.log(MU.log_sd)
        squares = ((mu @ ANGLES.T - loss) ** 2).sum(axis=1)
        apart = (mu - middle) @ precision
        normal = -(apart * (mu - middle)).sum(axis=1) / (2 * tau**2) - 3 * log_tau - norm
        of_tau = -np.log1p((tau / TAU) ** 2) + log_tau
        log_weights.append(prior + of_tau - squares / (2 * tau**2) - n_runs * log_tau - np.logaddexp(prior, normal))
        z.append(standardized)
    every, weight = np.concatenate(z), np.concatenate(log_weights)
    weight = np.exp(weight - weight.max()) / np.exp(weight - weight.max()).sum()
    return np.sqrt(weight @ (every - weight @ every) ** 2)


@pytest.mark.slow
@pytest.mark.parametrize("count", [32, pytest.param(512, marks=pytest.mark.slow)])
def test_weighted_draws_are_as_wide_as_the_posterior(count):
    """Standard deviations of three coefficients; on the average of 32 cables within 3 %, of 512 within 1.5 %.

    Those of one cable are known to 6 %, with the draws that are kept of it, 1 % of the average of 32 and 0.3 % of that of 512.
    Of 2560 fits the second comes out 0.85 % too narrow, so that 512 of them fail by chance once in seventy sets of seeds, and
    128 would once in seven. Draws too few where mountings scatter much passed once and came out 3 to 7 % too narrow; draws
    about the maximum alone leave out that a coefficient that readings hardly tell may be nearly nothing.
    """
    read = losses(count)
    posteriors = [LogDensity(build_model(of_rows(loss, ANGLES))) for loss in read]
    weighted = fit_batch(posteriors[0], [posterior.data for posterior in posteriors], range(count), OF_FLEETS)
    draws = [i for i, fit in enumerate(weighted) if fit.engine == "laplace"]
    assert len(draws) > 0.9 * count
    ratios = np.array([np.std(weighted[i].z[:, :3], axis=0) / exact_sds(read[i]) for i in draws])
    assert np.all(np.abs(np.log(ratios).mean(axis=0)) < (0.03 if count < 100 else 0.015)), np.log(ratios).mean(axis=0)
