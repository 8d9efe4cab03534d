"""What walkers of a batch do: every move, in all coordinates, on targets known in closed form; controls that fail."""

from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_proposals import CHART, DEGREES_OF_FREEDOM, DIMENSIONS, ROOT, below_quantiles, draw_t, p_value

from bowdenfit.dataset import load_dataset
from bowdenfit.inference import proposals
from bowdenfit.inference.batch.ensembles import walker_round
from bowdenfit.inference.batch.frames import IN_Z, Frame, in_values
from bowdenfit.inference.batch.moves import MOVES, differential_evolution, independent, numbers_of_move, stretch
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.conditional import Conditional
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.model import build_model

DATA = Path(__file__).parents[2] / "datasets"
ENSEMBLES, WALKERS, INVERSE = 16, 64, np.linalg.inv(ROOT)
ALONE = {
    "stretch": stretch,
    "differential evolution": differential_evolution,
    "gamma 1": partial(differential_evolution, gamma=1.0),
    "independent": independent,
}
VALUES, BOTH = ((in_values(CHART), 1.0),), ((IN_Z, 0.5), (in_values(CHART), 0.5))


def log_t(x, _):
    standardized = INVERSE @ x
    return -(DEGREES_OF_FREEDOM + DIMENSIONS) / 2 * jnp.log1p(jnp.sum(standardized**2) / DEGREES_OF_FREEDOM)


def states(moves, seed: int, rounds: int, width: float = 1.0, frames=((IN_Z, 1.0),)) -> np.ndarray:
    """Stored states of ensembles started in the target or around it, (state, ensemble, walker, dimension)."""
    with jax.enable_x64(True):
        start = width * draw_t(np.random.default_rng(seed), ENSEMBLES * WALKERS).reshape(ENSEMBLES, WALKERS, -1)
        z, found, numbers = start, [], np.zeros((), np.uint32)
        values = jax.vmap(jax.vmap(lambda x: log_t(x, None)))(z)
        one_round = compile_program(walker_round(log_t, moves, frames), numbers, numbers, z, values, None)
        for number in range(rounds):
            path, values = one_round(np.uint32(seed), np.uint32(number), z, values, None)
            z, found = path[-1], [*found, np.asarray(path)]
    return np.concatenate(found)


@pytest.mark.parametrize("frames", [((IN_Z, 1.0),), VALUES], ids=["z", "values"])
@pytest.mark.parametrize("name", ALONE)
def test_every_move_of_a_batch_leaves_a_heavy_tailed_target_as_it_is(name, frames):
    """Alone, from starts in the target; p < 0.001 by chance once in a thousand seeds."""
    found = states([(ALONE[name], 1.0)], seed=3, rounds=6, frames=frames)
    assert p_value(below_quantiles(found[30:])) > 0.001


def without_its_factor(move):
    """The same places, as if the proposal were symmetrical."""
    return lambda *args: (move(*args)[0], jnp.zeros(len(args[1])))


def without_its_volume(frame: Frame) -> Frame:
    """The same places, as if a unit were as large everywhere."""
    return Frame(frame.to_w, lambda w, data: (frame.from_w(w, data)[0], jnp.zeros(len(w))))


@pytest.mark.filterwarnings("ignore:Precision loss")  # all ensembles without any tails
@pytest.mark.parametrize("name", ["stretch", "independent"])
def test_the_same_test_sees_that_a_factor_is_missing_in_a_batch(name):
    """The negative control of the test above."""
    assert p_value(below_quantiles(states([(without_its_factor(ALONE[name]), 1.0)], seed=3, rounds=6)[30:])) < 1e-4


@pytest.mark.filterwarnings("ignore:Precision loss")
def test_the_same_test_sees_that_the_volume_of_coordinates_is_missing():
    frames = ((without_its_volume(in_values(CHART)), 1.0),)
    assert p_value(below_quantiles(states(MOVES, seed=3, rounds=6, frames=frames)[30:])) < 1e-4


def test_the_moves_of_a_batch_find_the_target_from_starts_far_outside():
    """Started 5 times too wide; p < 0.001 by chance once in a thousand seeds."""
    assert p_value(below_quantiles(states(MOVES, seed=2, rounds=8, width=5.0, frames=BOTH)[60:])) > 0.001


def test_values_are_those_of_the_chart():
    z = 2 * np.random.default_rng(1).standard_normal((WALKERS, DIMENSIONS))
    expected, volume = CHART.from_z(z)
    with jax.enable_x64(True):
        w = in_values(CHART).to_w(jnp.asarray(z), None)
        back, of_w = in_values(CHART).from_w(w, None)
        np.testing.assert_allclose(w, expected, rtol=1e-12)
        np.testing.assert_allclose(back, z, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(of_w, -volume, rtol=1e-9)


@pytest.mark.parametrize(
    "name",
    ["on-body-exoskeleton", *(pytest.param(n, marks=pytest.mark.slow) for n in ("synthetic-haptic-loop", "synthetic-bench"))],
)
def test_coefficients_given_everything_else_have_a_way_back_and_the_volume_of_their_derivatives(name):
    with jax.enable_x64(True):
        posterior = LogDensity(build_model(load_dataset(DATA / name)))
        given_others, data = Conditional(posterior), posterior.data
        z = jnp.asarray(np.random.default_rng(1).standard_normal((20, posterior.model.space.size)))
        w = jax.jit(jax.vmap(lambda one: given_others.to_w(one, data)))(z)
        back, volume = jax.jit(jax.vmap(lambda one: given_others.from_w(one, data)))(w)
        np.testing.assert_allclose(back, z, rtol=1e-6, atol=1e-6)
        slopes = jax.jit(jax.vmap(jax.jacfwd(lambda one: given_others.from_w(one, data)[0])))(w)
        np.testing.assert_allclose(volume, np.linalg.slogdet(slopes)[1], rtol=1e-6, atol=1e-6)


def test_a_batch_has_the_factors_of_a_single_fit_for_the_same_places():
    """Of draws from a fitted t distribution, whose factors depend on the places alone."""
    random = np.random.default_rng(1)
    moving, resting = random.standard_normal((2, WALKERS // 2, DIMENSIONS))
    with jax.enable_x64(True):
        numbers = random.uniform(size=(WALKERS // 2, numbers_of_move(DIMENSIONS)))
        places, factors = (np.asarray(part) for part in independent(*map(jnp.asarray, (numbers, moving, resting))))
    root = np.linalg.cholesky(np.cov(resting.T))
    present, drawn = (np.linalg.solve(root, (x - resting.mean(axis=0)).T).T for x in (moving, places))
    np.testing.assert_allclose(factors, proposals._log_t(present) - proposals._log_t(drawn), rtol=1e-6, atol=1e-6)
