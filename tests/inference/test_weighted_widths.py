"""Are weighted draws that pass their own checks as wide as the posterior? Beside walkers of the same cables, on the average."""

import numpy as np
import pytest
from rows import of_rows

from bowdenfit.description import SamplerSettings
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.batch.programs import BatchSettings
from bowdenfit.inference.batch.weights import Weighted
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.model import build_model

ANGLES = np.deg2rad([
    (200.0, 30.0, 20.0), (150.0, 80.0, 20.0), (90.0, 30.0, 60.0), (240.0, 60.0, 90.0), (60.0, 90.0, 30.0), (120.0, 20.0, 80.0),
])  # fmt: skip
OF_FLEETS = BatchSettings(SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=4000, target_ess=1000), nuts=False)


def cables(count: int) -> list[LogDensity]:
    """Six runs of three contacts each, of coefficients of 0.08 to 0.2 and mountings that differ by 1 to 3 %."""
    random, found = np.random.default_rng(5), []
    for _ in range(count):
        mu, tau = random.uniform(0.08, 0.2, 3), random.uniform(0.01, 0.03)
        found.append(LogDensity(build_model(of_rows(ANGLES @ mu + tau * random.standard_normal(len(ANGLES)), ANGLES))))
    return found


@pytest.mark.parametrize("count", [16, pytest.param(128, marks=pytest.mark.slow)])
def test_weighted_draws_are_as_wide_as_walkers_find_the_posterior(count, monkeypatch):
    """Standard deviations of three coefficients; on the average of 16 cables within 3 %, of 128 within 1.5 %.

    Walkers know that of one cable to about 4 %, which is 1 % of the average of 16. Draws too few where mountings scatter much
    passed and came out 3 to 7 % too narrow.
    """
    posteriors = cables(count)
    data = [posterior.data for posterior in posteriors]
    weighted = fit_batch(posteriors[0], data, range(count), OF_FLEETS)
    monkeypatch.setattr(Weighted, "shortfalls", lambda *_: ("to be walked",))
    walked = fit_batch(posteriors[0], data, range(count), OF_FLEETS)
    both = [(one.z, other.z) for one, other in zip(weighted, walked, strict=True) if one.engine == "laplace"]
    assert len(both) > 0.6 * count
    assert all(fit.engine == "ensembles" and not fit.reasons for fit in walked)
    ratios = np.array([np.std(one[:, :3], axis=0) / np.std(other[:, :3], axis=0) for one, other in both])
    assert np.all(np.abs(np.log(ratios).mean(axis=0)) < (0.03 if count < 100 else 0.015)), np.log(ratios).mean(axis=0)
