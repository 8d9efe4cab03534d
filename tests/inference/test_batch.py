"""Many data sets in one program: each as if it were alone, and as a single fit has it."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from own_angle_tables import of_rows

import bowdenfit as bf
from bowdenfit.dataset import load_dataset
from bowdenfit.description import SamplerSettings
from bowdenfit.inference import compilation
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.batch.programs import BatchPrograms, BatchSettings
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.models import build_model
from bowdenfit.questions.calibrate.replicator import RANK_SETTINGS

pytestmark = pytest.mark.extended

DATA = Path(__file__).parents[2] / "datasets"
DATA_SETS = sorted(path.parent.name for path in DATA.glob("*/cable.toml"))
RIDGE = np.deg2rad([(200.0, 30.0, 20.0), (60.0, 90.0, 30.0), (90.0, 30.0, 60.0)])  # angles of rows and contacts
ON_BODY, YARN = "on-body-exoskeleton", "yarn-on-cylinder"
QUICK = BatchSettings(
    SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=600, target_ess=300, target_r_hat=1.05),
    target_sd_error=np.inf,
    nuts=False,
)
ACCURATE = BatchSettings(
    SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=160_000, target_ess=3000, target_r_hat=1.02),
    n_kept=4096,
    nuts=False,
)


@pytest.fixture(scope="module", autouse=True)
def compiled_as_for_many(options_for_many_cables):
    """Here the programs are those of long calibrations."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(compilation, "_RUN_OFTEN", options_for_many_cables)
        yield


@pytest.fixture(scope="module", params=[pytest.param(ON_BODY, marks=pytest.mark.slow), YARN])
def programs(request):
    """One data set some of whose cables need ensembles, and one whose weighted draws are good enough."""
    return BatchPrograms(LogDensity(build_model(load_dataset(DATA / request.param))), QUICK)


def several(posterior, count: int):
    """Data that differ a little from one another: every float, by a thousandth at the most."""
    random = np.random.default_rng(1)

    def disturbed(array):
        return array * (1 + 1e-3 * random.uniform(-1, 1, array.shape)) if array.dtype.kind == "f" else array

    return [jax.tree.map(disturbed, posterior.data) for _ in range(count)]


def test_what_a_cable_draws_does_not_depend_on_what_else_is_fitted(programs):
    """To the last bit: alone, and in another order; where cables are quick, in another chunk too."""
    count = 3 if programs.posterior.model.description.name.startswith("On-body") else 17
    data, seeds = several(programs.posterior, count), list(range(count))
    together = fit_batch(programs.posterior, data, seeds, programs=programs)
    for rows in ([count - 1], list(range(count - 1, -1, -2))):
        apart = fit_batch(programs.posterior, [data[i] for i in rows], [seeds[i] for i in rows], programs=programs)
        for i, fit in zip(rows, apart, strict=True):
            assert fit.engine == together[i].engine
            np.testing.assert_array_equal(fit.z, together[i].z)


def test_a_data_set_that_cannot_be_computed_says_so_and_hurts_no_other(programs):
    data = several(programs.posterior, 3)
    spoiled = [
        data[0],
        jax.tree.map(lambda array: array * np.nan if array.dtype.kind == "f" else array, data[1]),
        data[2],
    ]
    fits, alone = (fit_batch(programs.posterior, d, range(3), programs=programs) for d in (spoiled, data))
    assert len(fits[1].z) == 0
    assert fits[1].reasons[0].startswith("the model cannot be computed")
    for i in (0, 2):
        np.testing.assert_array_equal(fits[i].z, alone[i].z)


@pytest.mark.slow
def test_small_scatters_are_drawn_as_often_as_quadrature_says():
    """Three rows for three coefficients: the smaller the scatter between mountings, the narrower their ridge, without end.

    Shares of draws below four quantiles, of sixteen seeds: one of them is 4.5 errors off by chance once in five hundred sets
    of seeds. That small ones are found often enough for an error of 0.002 is what the coordinates of the ridge are for: it is
    0.0010 with them and 0.0026 without.
    """
    posterior = LogDensity(build_model(of_rows(RIDGE @ np.array([0.1, 0.15, 0.12]), RIDGE)))
    levels = np.array([0.02, 0.05, 0.5, 0.95])
    fits = fit_batch(posterior, [posterior.data] * 16, range(16), RANK_SETTINGS)
    shares = np.array(
        [[np.mean(fit.z[:, -1] < scatter) for scatter in quantiles_of_scatter(posterior, levels)] for fit in fits]
    )
    errors = shares.std(axis=0, ddof=1) / np.sqrt(len(fits))
    assert not any(fit.reasons for fit in fits)
    assert errors[0] < 0.002
    np.testing.assert_array_less(np.abs(shares.mean(axis=0) - levels), 4.5 * errors)


def quantiles_of_scatter(posterior: LogDensity, levels: np.ndarray) -> np.ndarray:
    """Of tau in z, with the coefficients integrated out over the errors of the rows: at each tau the readings less errors drawn
    at random say what the coefficients are, and their prior density there is averaged.
    """
    mu, tau = (posterior.model.space.free[i].prior for i in (0, -1))
    grid, errors = np.linspace(-5, 5, 401), np.random.default_rng(0).standard_normal((20_000, 3))
    loss, density = RIDGE @ np.array([0.1, 0.15, 0.12]), []
    for scatter in np.asarray(tau.constrain(jnp.asarray(grid))):
        computed = (loss + scatter * errors) @ np.linalg.inv(RIDGE).T
        positive = np.where(computed > 0, computed, 1.0)
        z = np.log(positive / mu.median) / mu.log_sd
        density.append(np.mean(np.all(computed > 0, axis=1) * np.exp(-0.5 * np.sum(z**2, axis=1)) / positive.prod(axis=1)))
    points = np.array(density) * np.exp(-(grid**2) / 2)
    return np.interp(levels, (np.cumsum(points) - points / 2) / points.sum(), grid)


@pytest.mark.parametrize("name", [YARN, *(pytest.param(n, marks=pytest.mark.slow) for n in DATA_SETS if n != YARN)])
def test_a_batch_agrees_with_a_single_fit(name):
    """Means to 0.1 sd and sds to 10 % of every parameter, at one seed.

    Sds need many draws where tails are long in z (on-body, a coefficient's kurtosis is 28): the batch knows them to 3.3 %, six
    thousand effective draws of a single fit to 3.4 %, so that chance takes the worst one beyond 10 % once in thirty seeds. A
    thousand of the batch would not do: a tail not seen yet makes the error look small (on the synthetic bench a curvature of
    kurtosis 44 stopped at 1400 with its sd 18 % too small), so three thousand are asked for.
    """
    longer = ["sampler.target_ess=6000", "sampler.max_steps=12000"] if name != YARN else []
    single = bf.fit(DATA / name, seed=1, settings=longer).posterior.z
    posterior = LogDensity(build_model(load_dataset(DATA / name)))
    (fit,) = fit_batch(posterior, [posterior.data], [1], ACCURATE)
    assert fit.reasons == ()
    mean, sd = single.mean(axis=(0, 1)), single.std(axis=(0, 1))
    np.testing.assert_array_less(np.abs(fit.z.mean(axis=0) - mean) / sd, 0.1)
    np.testing.assert_array_less(np.abs(fit.z.std(axis=0) / sd - 1), 0.1)
