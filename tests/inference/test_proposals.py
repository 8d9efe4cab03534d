"""What walkers do: emcee's own proposals given the same random numbers, targets known in closed form, controls that fail."""

from functools import partial

import emcee
import numpy as np
import pytest
from emcee.moves.de import _get_nondiagonal_pairs
from scipy import stats
from snooker import snooker

from bowdenfit.description.defaults import THIN
from bowdenfit.inference.coordinates import Z
from bowdenfit.inference.ensemble import Sweep, default_moves
from bowdenfit.inference.proposals import differential_evolution, independent, stretch
from bowdenfit.inference.value_chart import NODES, Chart

DEGREES_OF_FREEDOM, DIMENSIONS = 4, 5
_ROOT = np.linalg.cholesky(np.array([[2.0 ** (-abs(i - j)) for j in range(DIMENSIONS)] for i in range(DIMENSIONS)]))
ROOT = _ROOT * np.array([0.1, 1.0, 1.0, 3.0, 10.0])[:, None]  # correlated, and of unlike scales


# Two coordinates are bent, as those of positive quantities are; walkers leave the nodes on both sides.
CHART = Chart(DIMENSIONS, np.array([1, 4]), np.stack([np.exp(0.5 * NODES), np.sinh(NODES)], axis=1))
MOVES, IN_Z, IN_BOTH = default_moves(DIMENSIONS, 64), ((Z(), 1.0),), ((Z(), 0.5), (CHART, 0.5))


def log_t(x: np.ndarray) -> np.ndarray:
    """Multivariate t, heavy-tailed as the posteriors of few measurements are."""
    standardized = np.linalg.solve(ROOT, x.T)
    return -(DEGREES_OF_FREEDOM + DIMENSIONS) / 2 * np.log1p(np.sum(standardized**2, axis=0) / DEGREES_OF_FREEDOM)


def draw_t(generator: np.random.Generator, n: int) -> np.ndarray:
    mixing = np.sqrt(DEGREES_OF_FREEDOM / generator.chisquare(DEGREES_OF_FREEDOM, n))
    return (generator.standard_normal((n, DIMENSIONS)) @ ROOT.T) * mixing[:, None]


def run_side_by_side(moves, log_density, start: np.ndarray, steps: int, seed: int, frames=IN_BOTH) -> np.ndarray:
    """States after every sweep, (state, ensemble, walker, dimension)."""
    ensembles, walkers, dimensions = start.shape
    sweeps = [(Sweep(moves, coordinates, ensembles), share) for coordinates, share in frames]
    flat = start.reshape(-1, dimensions)
    sampler = emcee.EnsembleSampler(*flat.shape, log_density, vectorize=True, moves=sweeps)
    return _run(sampler, flat, steps // THIN, seed).reshape(-1, ensembles, walkers, dimensions)


def _run(sampler: emcee.EnsembleSampler, start: np.ndarray, states: int, seed: int, thin: int = 1) -> np.ndarray:
    state = emcee.State(start, random_state=np.random.RandomState(seed).get_state())
    sampler.run_mcmc(state, states, thin_by=thin, skip_initial_state_check=True)
    return sampler.get_chain()


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
    "independent": independent,
}
ALONE = {name: (proposal, IN_Z) for name, proposal in PROPOSALS.items()}
ALONE |= {f"{name} in values": (proposal, ((CHART, 1.0),)) for name, proposal in PROPOSALS.items()}


@pytest.mark.parametrize("name", ALONE)
def test_every_move_leaves_a_heavy_tailed_target_as_it_is(name):
    """Alone, from starts in the target; p < 0.001 by chance once in a thousand seeds."""
    proposal, frames = ALONE[name]
    assert p_value(below_quantiles(sampled_t([(proposal, 1.0)], seed=3, frames=frames)[30:])) > 0.001


def without_its_factor(proposal):
    """The same places, as if the proposal were symmetrical."""
    return lambda *args: (proposal(*args)[0], np.zeros(args[0].shape[:2]))


@pytest.mark.filterwarnings("ignore:Precision loss")  # all ensembles without any tails
@pytest.mark.parametrize("name", ["stretch", "independent"])
def test_the_same_test_sees_that_a_factor_is_missing(name):
    """The negative control of the test above."""
    assert p_value(below_quantiles(sampled_t([(without_its_factor(PROPOSALS[name]), 1.0)], seed=3)[30:])) < 1e-4


class WithoutItsVolume:
    """The coordinates of the chart, as if a unit were as large everywhere."""

    def from_z(self, z):
        return CHART.from_z(z)[0], np.zeros(len(z))

    def to_z(self, w):
        return CHART.to_z(w)[0], np.zeros(len(w))


@pytest.mark.filterwarnings("ignore:Precision loss")
def test_the_same_test_sees_that_the_volume_of_coordinates_is_missing_in_a_single_fit():
    frames = ((WithoutItsVolume(), 1.0),)
    moves = [(differential_evolution, 1.0)]
    assert p_value(below_quantiles(sampled_t(moves, seed=3, frames=frames)[30:])) < 1e-4


class Told:
    """Random numbers told beforehand, by the name of the function that is asked for them."""

    def __init__(self, **numbers):
        self.numbers = numbers

    def __getattr__(self, name):
        return lambda *_, **__: self.numbers[name]


@pytest.fixture
def halves() -> np.ndarray:
    """Moving and resting walkers, (half, ensemble, walker, dimension)."""
    return np.random.default_rng(1).standard_normal((2, 3, 8, DIMENSIONS))


def test_stretch_moves_of_all_ensembles_are_emcee_s_own_given_the_same_random_numbers(halves):
    moving, resting = halves
    proposed, factors = stretch(moving, resting, np.random.RandomState(2))
    again = np.random.RandomState(2)
    rand, randint = again.rand(3, 8), again.randint(8, size=(3, 8))
    for e in range(3):
        told = Told(rand=rand[e], randint=randint[e])
        expected = emcee.moves.StretchMove().get_proposal(moving[e], [resting[e]], told)
        np.testing.assert_array_equal(proposed[e], expected[0])
        np.testing.assert_array_equal(factors[e], expected[1])


@pytest.mark.parametrize("gamma", [None, 1.0])
def test_differential_evolution_of_all_ensembles_is_emcee_s_own_given_the_same_random_numbers(halves, gamma):
    moving, resting = halves
    theirs = emcee.moves.DEMove(gamma0=gamma)
    theirs.setup(moving[0])
    proposed, factors = differential_evolution(moving, resting, np.random.RandomState(2), gamma)
    again = np.random.RandomState(2)
    first, further, randn = again.randint(8, size=(3, 8)), again.randint(1, 8, size=(3, 8)), again.randn(3, 8, 1)
    pairs = [tuple(pair) for pair in _get_nondiagonal_pairs(8)]
    for e in range(3):
        choice = [pairs.index((one, (one + more) % 8)) for one, more in zip(first[e], further[e], strict=True)]
        expected = theirs.get_proposal(moving[e], [resting[e]], Told(choice=choice, randn=randn[e]))
        np.testing.assert_array_equal(proposed[e], expected[0])
        np.testing.assert_array_equal(factors[e], expected[1])


EMCEE_MOVES = {
    "stretch": emcee.moves.StretchMove(),
    "differential evolution": emcee.moves.DEMove(),
    "gamma 1": emcee.moves.DEMove(gamma0=1.0),
}


@pytest.mark.parametrize("move", EMCEE_MOVES)
def test_side_by_side_with_one_ensemble_is_distributed_as_emcee_s_own_sampler(move):
    """8 runs of each with one move; p < 0.001 of a t-test (times the number of quantiles) once in a thousand seeds."""
    walkers, steps = 32, 600
    shares = {"side by side": [], "emcee": []}
    for seed in range(8):
        start = draw_t(np.random.default_rng(seed), walkers)
        alone = run_side_by_side([(PROPOSALS[move], 1.0)], log_t, start[None], steps, seed, IN_Z)
        sampler = emcee.EnsembleSampler(walkers, DIMENSIONS, log_t, vectorize=True, moves=EMCEE_MOVES[move])
        others = _run(sampler, start, steps // THIN, seed + 100, THIN)[:, None]
        for name, states in (("side by side", alone), ("emcee", others)):
            shares[name].append(below_quantiles(states)[0])
    p = stats.ttest_ind(*shares.values(), axis=0, equal_var=False).pvalue
    assert np.nanmin(p) * p.size > 0.001


# Ensembles --------------------------------------------------------------------------------------------------------

def log_two_modes(x: np.ndarray) -> np.ndarray:
    """Two standard normals, 40 apart in every dimension."""
    left, right = (-0.5 * np.sum((x - center) ** 2, axis=1) for center in (-20.0, 20.0))
    return np.logaddexp(left, right)


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
