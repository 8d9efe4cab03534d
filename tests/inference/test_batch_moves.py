"""What walkers of a batch do, on targets known in closed form; controls that fail."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_proposals import (
    CHART,
    IN_BOTH,
    IN_Z,
    MOVES,
    below_quantiles,
    draw_t,
    log_t,
    p_value,
    without_its_factor,
    without_its_volume,
)

from bowdenfit.dataset import load_dataset
from bowdenfit.inference.batch.programs import walker_round
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.coordinates import Conditional, value_map
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.moves import fitted_t
from bowdenfit.models import build_model

pytestmark = pytest.mark.extended

DATA = Path(__file__).parents[2] / "datasets"
ENSEMBLES, WALKERS = 16, 64


def states(moves, seed: int, rounds: int, width: float = 1.0, frames=IN_Z) -> np.ndarray:
    """Stored states of ensembles started in the target or around it, (state, ensemble, walker, dimension)."""
    with jax.enable_x64(True):
        start = width * draw_t(np.random.default_rng(seed), ENSEMBLES * WALKERS).reshape(ENSEMBLES, WALKERS, -1)
        z, results, numbers = start, [], np.zeros((), np.uint32)
        one_round = compile_program(walker_round(log_t, moves, frames), numbers, numbers, z, None)
        for number in range(rounds):
            path = one_round(np.uint32(seed), np.uint32(number), z, None)
            z, results = path[-1], [*results, np.asarray(path)]
    return np.concatenate(results)


def test_the_moves_of_a_batch_leave_a_heavy_tailed_target_as_it_is():
    """From starts in the target; p < 0.001 by chance once in a thousand seeds."""
    assert p_value(below_quantiles(states(MOVES, seed=3, rounds=6, frames=IN_BOTH)[30:])) > 0.001


@pytest.mark.filterwarnings("ignore:Precision loss")  # all ensembles without any tails
def test_the_same_test_sees_that_a_factor_is_missing_in_a_batch():
    """The negative control of the test above."""
    assert p_value(below_quantiles(states([(without_its_factor(fitted_t), 1.0)], seed=3, rounds=6)[30:])) < 1e-4


@pytest.mark.filterwarnings("ignore:Precision loss")
def test_the_same_test_sees_that_the_volume_of_coordinates_is_missing():
    frames = ((without_its_volume(value_map(CHART)), 1.0),)
    assert p_value(below_quantiles(states(MOVES, seed=3, rounds=6, frames=frames)[30:])) < 1e-4


def test_the_moves_of_a_batch_find_the_target_from_starts_far_outside():
    """Started 5 times too wide; p < 0.001 by chance once in a thousand seeds."""
    assert p_value(below_quantiles(states(MOVES, seed=2, rounds=8, width=5.0, frames=IN_BOTH)[60:])) > 0.001


@pytest.mark.parametrize(
    "name",
    ["on-body-exoskeleton", *(pytest.param(n, marks=pytest.mark.slow) for n in ("synthetic-haptic-loop", "synthetic-bench"))],
)
def test_coefficients_given_everything_else_have_a_way_back_and_the_volume_of_their_derivatives(name):
    with jax.enable_x64(True):
        posterior = LogDensity(build_model(load_dataset(DATA / name)))
        given_others, data = Conditional(posterior), posterior.data
        z = jnp.asarray(np.random.default_rng(1).standard_normal((20, posterior.model.space.size)))
        both_of = jax.jit(jax.vmap(given_others.map_point, (0, None, None)))
        w, _, of_z = both_of(z, True, data)
        _, back, volume = both_of(w, False, data)
        np.testing.assert_allclose(back, z, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(of_z, volume, rtol=1e-6, atol=1e-6)
        slopes = jax.jit(jax.vmap(jax.jacfwd(lambda first: given_others.map_point(first, False, data)[1])))(w)
        np.testing.assert_allclose(volume, np.linalg.slogdet(slopes)[1], rtol=1e-6, atol=1e-6)
