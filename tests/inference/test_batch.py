"""Many data sets in one program: each as if it were alone, and as a single fit has it."""

from pathlib import Path

import jax
import numpy as np
import pytest

from bowdenfit.dataset import load_dataset
from bowdenfit.inference.batch import fit_batch
from bowdenfit.inference.batch_programs import BatchPrograms, BatchSettings
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.model import build_model

DATA = Path(__file__).parents[2] / "datasets"
ON_BODY, YARN = "on-body-exoskeleton", "yarn-on-cylinder"


@pytest.fixture(scope="module", params=[ON_BODY, YARN])
def programs(request):
    """One data set whose cables need ensembles, and one whose weighted draws are good enough."""
    return BatchPrograms(LogDensity(build_model(load_dataset(DATA / request.param))), BatchSettings())


def several(posterior, count: int):
    """Data that differ a little from one another: every float, a thousandth at the most."""
    random = np.random.default_rng(1)

    def disturbed(array):
        array = np.asarray(array)
        return array * (1 + 1e-3 * random.uniform(-1, 1, array.shape)) if array.dtype.kind == "f" else array

    return [jax.tree.map(disturbed, posterior.data) for _ in range(count)]


def test_what_a_cable_draws_does_not_depend_on_what_else_is_fitted(programs):
    """To the last bit: alone, among others, in another order, in another chunk; and threads do not matter."""
    data, seeds = several(programs.posterior, 18), list(range(18))
    together = fit_batch(programs.posterior, data, seeds, programs=programs)
    for where in ([17], [3, 0, 17], list(range(17, -1, -1))):
        apart = fit_batch(programs.posterior, [data[i] for i in where], [seeds[i] for i in where], programs=programs)
        for i, fit in zip(where, apart, strict=True):
            assert fit.engine == together[i].engine
            np.testing.assert_array_equal(fit.z, together[i].z)
