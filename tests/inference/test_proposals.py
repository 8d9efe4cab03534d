"""What walkers do: emcee's own proposals given the same random numbers, targets known in closed form, controls that fail."""

from functools import cache, partial

import emcee
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from emcee.moves.de import _get_nondiagonal_pairs
from scipy import stats
from snooker import snooker

from bowdenfit.description import SamplerSettings
from bowdenfit.description.defaults import THIN
from bowdenfit.inference.coordinates import NODES, CoordinateMap, PriorGrid, value_map, z_map
from bowdenfit.inference.ensemble import EnsembleMove, make_initial_state
from bowdenfit.inference.moves import (
    count_move_numbers,
    default_moves,
    differential_evolution,
    fitted_t,
    random_numbers,
    stretch,
)
from bowdenfit.inference.walkers import compile_density_walkers

DEGREES_OF_FREEDOM, DIMENSIONS = 4, 5
_ROOT = np.linalg.cholesky(np.array([[2.0 ** (-abs(i - j)) for j in range(DIMENSIONS)] for i in range(DIMENSIONS)]))
ROOT = _ROOT * np.array([0.1, 1.0, 1.0, 3.0, 10.0])[:, None]  # correlated, and of unlike scales
INVERSE = np.linalg.inv(ROOT)


# Two coordinates are bent, as those of positive quantities are; walkers leave the nodes on both sides.
CHART = PriorGrid(DIMENSIONS, np.array([1, 4]), np.stack([np.exp(0.5 * NODES), np.sinh(NODES)], axis=1))
IN_Z, IN_VALUES = ((z_map, 1.0),), ((value_map(CHART), 1.0),)
IN_BOTH = ((z_map, 0.5), (value_map(CHART), 0.5))
MOVES = default_moves(DIMENSIONS, 64)


def log_t(x, data=None):
    """Multivariate t, heavy-tailed as the posteriors of few measurements are, of one place."""
    standardized = INVERSE @ x
    return -(DEGREES_OF_FREEDOM + DIMENSIONS) / 2 * jnp.log1p(jnp.sum(standardized**2) / DEGREES_OF_FREEDOM)


def log_t_of_rows(x: np.ndarray) -> np.ndarray:
    """The same of many, by NumPy."""
    standardized = np.linalg.solve(ROOT, x.T)
    return -(DEGREES_OF_FREEDOM + DIMENSIONS) / 2 * np.log1p(np.sum(standardized**2, axis=0) / DEGREES_OF_FREEDOM)


def draw_t(generator: np.random.Generator, n: int) -> np.ndarray:
    mixing = np.sqrt(DEGREES_OF_FREEDOM / generator.chisquare(DEGREES_OF_FREEDOM, n))
    return (generator.standard_normal((n, DIMENSIONS)) @ ROOT.T) * mixing[:, None]


def programs_of(log_density, data, walkers: int, dimensions: int, frames, moves):
    """What is compiled for ensembles of so many walkers."""
    settings = SamplerSettings.model_construct(n_walkers=walkers)
    return compile_density_walkers(log_density, data, dimensions, settings, frames, moves)


compiled_once = cache(programs_of)  # where there are no data, which have no hash


def run_side_by_side(moves, log_density, start: np.ndarray, steps: int, seed: int, frames=IN_BOTH, data=None) -> np.ndarray:
    """States after every sweep, (state, ensemble, walker, dimension)."""
    ensembles, walkers, dimensions = start.shape
    with jax.enable_x64(True):
        find = compiled_once if data is None else programs_of
        programs = find(log_density, data, walkers, dimensions, tuple(frames), tuple(moves))
        sweep, flat = EnsembleMove(programs, data, ensembles), start.reshape(-1, dimensions)
        sampler = emcee.EnsembleSampler(*flat.shape, log_density, moves=sweep)
        sampler.run_mcmc(make_initial_state(flat, np.random.RandomState(seed)), steps // THIN, skip_initial_state_check=True)
        return sampler.get_chain().reshape(-1, ensembles, walkers, dimensions)


LEVELS = np.array([0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99])


def below_quantiles(states: np.ndarray) -> np.ndarray:
    """Share of each ensemble's draws below known quantiles of every coordinate, (ensemble, coordinate x level)."""
    scale = np.sqrt(np.sum(ROOT**2, axis=1))
    quantiles = stats.t(DEGREES_OF_FREEDOM).ppf(LEVELS) * scale[:, None]
    shares = (states[..., None] < quantiles).mean(axis=(0, 2))
    return shares.reshape(len(shares), -1)


def p_value(shares: np.ndarray) -> float:
    """Smallest p over all coordinates and levels, times their number; independent ensembles give the standard error."""
    expected = np.tile(LEVELS, DIMENSIONS)
    return float(min(1.0, stats.ttest_1samp(shares, expected, axis=0).pvalue.min() * len(expected)))


def sampled_t(moves, seed: int, ensembles: int = 16, walkers: int = 64, frames=IN_Z) -> np.ndarray:
    """Ensembles started in the target itself, so that only wrong moves can lead away."""
    start = draw_t(np.random.default_rng(seed), ensembles * walkers).reshape(ensembles, walkers, DIMENSIONS)
    return run_side_by_side(moves, log_t, start, 1200, seed, frames)


def test_the_default_moves_reproduce_a_heavy_tailed_target():
    """A multivariate t with 4 degrees of freedom in 5 dimensions; p < 0.001 by chance once in a thousand seeds."""
    assert p_value(below_quantiles(sampled_t(MOVES, seed=1, frames=IN_BOTH)[30:])) > 0.001


def test_the_snooker_move_does_not_reproduce_the_heavy_tailed_target():
    """The negative control of the test above, although it starts in the target."""
    assert p_value(below_quantiles(sampled_t([(snooker, 1.0)], seed=1, ensembles=8, walkers=20)[30:])) < 1e-4


def test_the_default_moves_find_the_target_from_starts_far_outside():
    """Started 5 times too wide; the median distance from the middle is right after 600 steps.

    p < 0.001 by chance once in a thousand seeds.
    """
    start = 5 * draw_t(np.random.default_rng(2), 16 * 64).reshape(16, 64, DIMENSIONS)
    assert p_value(below_quantiles(run_side_by_side(MOVES, log_t, start, 1500, 2)[60:])) > 0.001


# Each move --------------------------------------------------------------------------------------------------------


PROPOSALS = {
    "stretch": stretch,
    "differential evolution": differential_evolution,
    "gamma 1": partial(differential_evolution, gamma=1.0),
    "fitted t": fitted_t,
}
ALONE = {name: (proposal, IN_Z) for name, proposal in PROPOSALS.items()}
ALONE |= {f"{name} in values": (proposal, IN_VALUES) for name, proposal in PROPOSALS.items()}


@pytest.mark.parametrize("name", ALONE)
def test_every_move_leaves_a_heavy_tailed_target_as_it_is(name):
    """Alone, from starts in the target; p < 0.001 by chance once in a thousand seeds."""
    proposal, frames = ALONE[name]
    assert p_value(below_quantiles(sampled_t([(proposal, 1.0)], seed=3, frames=frames)[30:])) > 0.001


def without_its_factor(proposal):
    """The same places, as if the proposal were symmetrical."""
    return lambda *args: (proposal(*args)[0], jnp.zeros(len(args[1])))


@pytest.mark.filterwarnings("ignore:Precision loss")  # all ensembles without any tails
@pytest.mark.parametrize("name", ["stretch", "fitted t"])
def test_the_same_test_sees_that_a_factor_is_missing(name):
    """The negative control of the test above."""
    assert p_value(below_quantiles(sampled_t([(without_its_factor(PROPOSALS[name]), 1.0)], seed=3)[30:])) < 1e-4


def without_its_volume(frame: CoordinateMap) -> CoordinateMap:
    """The same places, as if a unit were as large everywhere."""
    return lambda places, is_z, data: (*frame(places, is_z, data)[:2], jnp.zeros(len(places)))


@pytest.mark.filterwarnings("ignore:Precision loss")
def test_the_same_test_sees_that_the_volume_of_coordinates_is_missing_in_a_single_fit():
    frames = ((without_its_volume(value_map(CHART)), 1.0),)
    moves = [(differential_evolution, 1.0)]
    assert p_value(below_quantiles(sampled_t(moves, seed=3, frames=frames)[30:])) < 1e-4


class Told:
    """Random numbers told beforehand, by the name of the function that is asked for them."""

    def __init__(self, **numbers):
        self.numbers = numbers

    def __getattr__(self, name):
        return lambda *_, **__: self.numbers[name]


@pytest.fixture
def fixed_numbers() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Uniform numbers, moving and resting walkers, (walker, number or dimension)."""
    random = np.random.default_rng(1)
    return random.uniform(size=(9, count_move_numbers(DIMENSIONS))), *random.standard_normal((2, 9, DIMENSIONS))


def proposed(move, outcome):
    with jax.enable_x64(True):
        uniform, moving, resting = map(jnp.asarray, outcome)
        return tuple(np.asarray(part) for part in move(random_numbers(uniform), moving, resting))


def test_stretch_moves_are_emcee_s_own_given_the_same_random_numbers(fixed_numbers):
    uniform, moving, resting = fixed_numbers
    random = Told(rand=uniform[:, 0], randint=(9 * uniform[:, 1]).astype(int))
    places, factors = emcee.moves.StretchMove().get_proposal(moving, [resting], random)
    computed = proposed(stretch, fixed_numbers)
    np.testing.assert_allclose(computed[0], places, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(computed[1], factors, rtol=1e-12)


@pytest.mark.parametrize("gamma", [None, 1.0])
def test_differential_evolution_is_emcee_s_own_given_the_same_random_numbers(fixed_numbers, gamma):
    uniform, moving, resting = fixed_numbers
    theirs = emcee.moves.DEMove(gamma0=gamma)
    theirs.setup(moving)
    pairs = [tuple(pair) for pair in _get_nondiagonal_pairs(9)]
    first, further = (9 * uniform[:, 0]).astype(int), 1 + (8 * uniform[:, 1]).astype(int)
    choice = [pairs.index((single, (single + more) % 9)) for single, more in zip(first, further, strict=True)]
    random = Told(choice=choice, randn=2 * uniform[:, 2:3] - 1)
    places, factors = theirs.get_proposal(moving, [resting], random)
    computed = proposed(partial(differential_evolution, gamma=gamma), fixed_numbers)
    np.testing.assert_allclose(computed[0], places, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(computed[1], factors)


class ToldOneByOne:
    """What emcee's snooker move asks for, walker by walker: three integers and an order."""

    def __init__(self, uniform):
        self.integers = iter((3 * uniform[:, :3]).astype(int).ravel())
        self.orders = iter(np.argsort(uniform[:, 3:6], axis=1))

    def randint(self, _):
        return next(self.integers)

    def shuffle(self, rows):
        rows[:] = rows[next(self.orders)]


def test_the_snooker_move_of_controls_is_emcee_s_own_given_the_same_random_numbers(fixed_numbers):
    uniform, moving, resting = fixed_numbers
    expected = emcee.moves.DESnookerMove().get_proposal(moving, np.array_split(resting, 3), ToldOneByOne(uniform))
    for computed, reference in zip(proposed(snooker, fixed_numbers), expected, strict=True):
        np.testing.assert_allclose(computed, reference, rtol=1e-12, atol=1e-12)


def test_draws_from_a_fitted_distribution_have_the_factors_of_their_places(fixed_numbers):
    """The t distribution's density at both, with the mean and covariance of the resting walkers."""
    uniform, moving, resting = fixed_numbers
    places, factors = proposed(fitted_t, fixed_numbers)
    fitted = stats.multivariate_t(resting.mean(axis=0), np.cov(resting.T), df=5)
    np.testing.assert_allclose(factors, fitted.logpdf(moving) - fitted.logpdf(places), rtol=1e-6, atol=1e-6)


EMCEE_MOVES = {
    "stretch": emcee.moves.StretchMove(),
    "differential evolution": emcee.moves.DEMove(),
    "gamma 1": emcee.moves.DEMove(gamma0=1.0),
}


@pytest.mark.extended
@pytest.mark.parametrize("move", EMCEE_MOVES)
def test_side_by_side_with_one_ensemble_is_distributed_as_emcee_s_own_sampler(move):
    """8 runs of each with one move; p < 0.001 of a t-test (times the number of quantiles) once in a thousand seeds."""
    walkers, steps = 32, 600
    shares = {"side by side": [], "emcee": []}
    for seed in range(8):
        start = draw_t(np.random.default_rng(seed), walkers)
        alone = run_side_by_side([(PROPOSALS[move], 1.0)], log_t, start[None], steps, seed, IN_Z)
        sampler = emcee.EnsembleSampler(walkers, DIMENSIONS, log_t_of_rows, vectorize=True, moves=EMCEE_MOVES[move])
        state = emcee.State(start, random_state=np.random.RandomState(seed + 100).get_state())
        sampler.run_mcmc(state, steps // THIN, thin_by=THIN, skip_initial_state_check=True)
        remaining = sampler.get_chain()[:, None]
        for name, states in (("side by side", alone), ("emcee", remaining)):
            shares[name].append(below_quantiles(states)[0])
    p = stats.ttest_ind(*shares.values(), axis=0, equal_var=False).pvalue
    assert np.nanmin(p) * p.size > 0.001


# The ends of coordinates and densities -------------------------------------------------------------------------------


def starts_on_both_sides() -> np.ndarray:
    """Of one ensemble, with every second walker below 0 in the first dimension."""
    start = np.random.default_rng(5).standard_normal((1, 32, DIMENSIONS))
    start[0, :, 0] = np.abs(start[0, :, 0]) * np.where(np.arange(32) % 2, -1, 1)
    return start


def normal_above_zero(x, _):
    """A standard normal where the first dimension is positive, nothing elsewhere."""
    return jnp.where(x[0] > 0, -0.5 * jnp.sum(x**2), jnp.nan)


def test_walkers_that_start_where_the_density_cannot_be_computed_come_in_and_none_leaves():
    states = run_side_by_side(MOVES, normal_above_zero, starts_on_both_sides(), 400, 1)
    assert np.all(states[-1, ..., 0] > 0)


def without_coordinates_below_zero(arguments, is_z, data):
    w, z, volume = z_map(arguments, is_z, data)
    return w, z, jnp.where(z[:, 0] > 0, volume, jnp.nan)


def test_walkers_beyond_the_reach_of_coordinates_stay_and_no_others_go_there():
    """The density is positive there, so that leaving without a way back would draw it too seldom."""
    start, frames = starts_on_both_sides(), ((without_coordinates_below_zero, 1.0),)
    states = run_side_by_side(MOVES, lambda x, _: -0.5 * jnp.sum(x**2), start, 400, 1, frames)[:, 0]
    beyond = start[0, :, 0] < 0
    np.testing.assert_array_equal(states[:, beyond], np.broadcast_to(start[0, beyond], states[:, beyond].shape))
    assert np.all(states[:, ~beyond, 0] > 0)
    assert np.all(np.any(states[-1, ~beyond] != start[0, ~beyond], axis=-1))


# Ensembles --------------------------------------------------------------------------------------------------------

def log_two_modes(x, _):
    """Two standard normals, 40 apart in every dimension."""
    left, right = (-0.5 * jnp.sum((x - center) ** 2) for center in (-20.0, 20.0))
    return jnp.logaddexp(left, right)


def test_ensembles_never_mix():
    """An ensemble that starts in one mode stays there: only positions of another ensemble could lead it across."""
    modes = np.array([-20.0, 20.0, -20.0, 20.0])
    start = modes[:, None, None] + np.random.default_rng(1).standard_normal((4, 32, DIMENSIONS))
    states = run_side_by_side(MOVES, log_two_modes, start, 1000, 1)
    assert np.all(np.sign(states) == np.sign(modes)[:, None, None])
    spread = states[30:].std(axis=(0, 2))
    np.testing.assert_allclose(spread, 1.0, atol=0.2)  # and it does sample its mode


def test_one_ensemble_across_both_modes_does_jump():
    """The control of the test above: within one ensemble differential evolution with gamma 1 carries walkers over."""
    start = np.repeat([-20.0, 20.0], 64)[:, None] + np.random.default_rng(1).standard_normal((128, DIMENSIONS))
    states = run_side_by_side(MOVES, log_two_modes, start[None], 1000, 1)
    assert np.any(np.sign(states[-1]) != np.sign(states[0]))
