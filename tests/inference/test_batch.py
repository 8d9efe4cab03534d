"""Many data sets in one program: each as if it were alone, and as a single fit has it."""

from pathlib import Path

import jax
import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.dataset import load_dataset
from bowdenfit.description import SamplerSettings
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.batch.programs import BatchPrograms, BatchSettings
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.model import build_model

DATA = Path(__file__).parents[2] / "datasets"
DATA_SETS = sorted(path.parent.name for path in DATA.glob("*/cable.toml"))
ON_BODY, YARN = "on-body-exoskeleton", "yarn-on-cylinder"
QUICK = BatchSettings(
    SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=600, target_ess=300, target_r_hat=1.05), nuts=False
)
ACCURATE = BatchSettings(SamplerSettings(n_ensembles=2, n_walkers=64, target_ess=1000, target_r_hat=1.02), n_kept=4096)


@pytest.fixture(scope="module", params=[ON_BODY, YARN])
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
    for where in ([count - 1], list(range(count - 1, -1, -2))):
        apart = fit_batch(programs.posterior, [data[i] for i in where], [seeds[i] for i in where], programs=programs)
        for i, fit in zip(where, apart, strict=True):
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


@pytest.mark.parametrize("name", [YARN, *(pytest.param(n, marks=pytest.mark.slow) for n in DATA_SETS if n != YARN)])
def test_a_batch_agrees_with_a_single_fit(name):
    """Means to 0.1 sd and sds to 10 % of every parameter, at one seed.

    Where both have 1000 effective draws, the difference of means has an error of 0.045 sd and that of sds one of 3 % of a
    normal posterior, more of one with wide tails: bounds that catch a wrong posterior and not small bias.
    """
    single = bf.fit(DATA / name, seed=1).posterior.z
    posterior = LogDensity(build_model(load_dataset(DATA / name)))
    (fit,) = fit_batch(posterior, [posterior.data], [1], ACCURATE)
    assert fit.reasons == ()
    mean, sd = single.mean(axis=(0, 1)), single.std(axis=(0, 1))
    np.testing.assert_array_less(np.abs(fit.z.mean(axis=0) - mean) / sd, 0.1)
    np.testing.assert_array_less(np.abs(fit.z.std(axis=0) / sd - 1), 0.1)
