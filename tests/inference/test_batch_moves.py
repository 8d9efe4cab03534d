"""What walkers of a batch do: every move of `ensemble`, in JAX, on a target known in closed form; controls that fail."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_proposals import CHART, DEGREES_OF_FREEDOM, DIMENSIONS, ROOT, below_quantiles, draw_t, moves_alone, p_value

from bowdenfit.inference import proposals, value_chart
from bowdenfit.inference.batch.ensembles import walker_round
from bowdenfit.inference.batch.moves import (
    batch_moves,
    differential_evolution,
    in_values,
    independent,
    numbers_of_move,
    stretch,
)
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.ensemble import default_moves

ENSEMBLES, WALKERS, INVERSE = 16, 64, np.linalg.inv(ROOT)
MOVES = moves_alone(stretch, differential_evolution, independent, in_values)


def log_t(x, _):
    standardized = INVERSE @ x
    return -(DEGREES_OF_FREEDOM + DIMENSIONS) / 2 * jnp.log1p(jnp.sum(standardized**2) / DEGREES_OF_FREEDOM)


def states(moves, seed: int, rounds: int, width: float = 1.0) -> np.ndarray:
    """Stored states of ensembles started in the target or around it, (state, ensemble, walker, dimension)."""
    with jax.enable_x64(True):
        start = width * draw_t(np.random.default_rng(seed), ENSEMBLES * WALKERS).reshape(ENSEMBLES, WALKERS, -1)
        z, found, numbers = start, [], np.zeros((), np.uint32)
        values = jax.vmap(jax.vmap(lambda x: log_t(x, None)))(z)
        one_round = compile_program(walker_round(log_t, moves), numbers, numbers, z, values, None)
        for number in range(rounds):
            path, values = one_round(np.uint32(seed), np.uint32(number), z, values, None)
            z, found = path[-1], [*found, np.asarray(path)]
    return np.concatenate(found)


@pytest.mark.parametrize("name", MOVES)
def test_every_move_of_a_batch_leaves_a_heavy_tailed_target_as_it_is(name):
    """Alone, from starts in the target; p < 0.001 by chance once in a thousand seeds."""
    assert p_value(below_quantiles(states([(MOVES[name], 1.0)], seed=3, rounds=6)[30:])) > 0.001


def without_its_factor(move):
    """The same places, as if the proposal were symmetrical."""
    return lambda *args: (move(*args)[0], jnp.zeros(len(args[1])))


@pytest.mark.filterwarnings("ignore:Precision loss")  # all ensembles without any tails
@pytest.mark.parametrize("name", ["stretch", "independent", "differential evolution in values"])
def test_the_same_test_sees_that_a_factor_is_missing_in_a_batch(name):
    """The negative control of the test above."""
    assert p_value(below_quantiles(states([(without_its_factor(MOVES[name]), 1.0)], seed=3, rounds=6)[30:])) < 1e-4


def test_the_moves_of_a_batch_find_the_target_from_starts_far_outside():
    """Started 5 times too wide; p < 0.001 by chance once in a thousand seeds."""
    assert p_value(below_quantiles(states(batch_moves(CHART), seed=2, rounds=8, width=5.0)[60:])) > 0.001


def test_a_batch_makes_the_moves_of_a_single_fit_as_often():
    """By the names of the functions; charts move other coordinates than z."""
    single = [(_name(proposal), share) for proposal, share in default_moves(CHART, WALKERS)]
    assert [(_name(move), share) for move, share in batch_moves(CHART)] == single


def _name(move) -> str:
    function = move.func if isinstance(move, partial) else move
    return {"propose": "in values", "moved": "in values"}.get(function.__name__, function.__name__)


def test_a_batch_has_the_factors_of_a_single_fit_for_the_same_places():
    """Of draws from a fitted t distribution in values, whose factors depend on the places alone."""
    random = np.random.default_rng(1)
    moving, resting = random.standard_normal((2, WALKERS // 2, DIMENSIONS))
    with jax.enable_x64(True):
        numbers = random.uniform(size=(WALKERS // 2, numbers_of_move(DIMENSIONS)))
        given = (jnp.asarray(part) for part in (numbers, moving, resting))
        places, factors = (np.asarray(part) for part in in_values(independent, CHART)(*given))

    def drawn_before(present, rest, _):
        """`proposals.independent`, with the places that are told."""
        at, _ = CHART.from_z(places[None])
        mean, covariance = rest[0].mean(axis=0), np.cov(rest[0].T)
        standardized = [np.linalg.solve(np.linalg.cholesky(covariance), (x[0] - mean).T).T for x in (present, at)]
        return at, (proposals._log_t(standardized[0]) - proposals._log_t(standardized[1]))[None]

    z, expected = value_chart.in_values(drawn_before, CHART)(moving[None], resting[None], np.random.RandomState(1))
    np.testing.assert_allclose(z[0], places, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(expected[0], factors, rtol=1e-6, atol=1e-6)
