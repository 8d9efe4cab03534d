"""A funnel whose every marginal is known: walkers of a single fit reach its narrow end, from where they start, in 600 steps.

Three readings of three coefficients that scatter by tau: the smaller tau, the narrower is where the coefficients can be. With
normal priors of the coefficients everything but tau integrates out in closed form, and tau's own density is a sum on a grid.
"""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from slow_cases import some_slow
from test_proposals import LEVELS, PROPOSALS, run_side_by_side, without_its_volume

from bowdenfit.description import SamplerSettings
from bowdenfit.inference.chain import SamplingRequest
from bowdenfit.inference.coordinates import Conditional, ridge_map
from bowdenfit.inference.ensemble import sample
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.moves import default_moves
from bowdenfit.inference.walkers import compile_walkers
from bowdenfit.parameters.priors import LogNormal, Normal
from bowdenfit.parameters.space import Parameter, ParameterSpace
from bowdenfit.run.preparing import start_checkpoint

pytestmark = pytest.mark.extended

COUNT, MEDIAN, LOG_SD = 3, 0.03, 1.5
GRID = np.linspace(-6.0, 6.0, 4001)
ENSEMBLES, WALKERS = 16, 64
SETTINGS = SamplerSettings(n_ensembles=ENSEMBLES, n_walkers=WALKERS, max_steps=600, target_ess=100)


class Readings:
    """What a kind of table adds to the likelihood, and nothing else."""

    name = "readings"

    def __init__(self, angles, read):
        self.data, self.residual_blocks = {"angles": angles, "read": read}, ((len(read), len(read)),)

    def observed(self):
        return self.data["read"]

    def residuals(self, values, data):
        expected = data["angles"] @ jnp.stack([values[f"mu{i}"] for i in range(COUNT)])
        return (data["read"] - expected) / values["tau"]

    def log_likelihood(self, values, data):
        return -0.5 * self.residuals(values, data) ** 2 - jnp.log(values["tau"])


class Funnel:
    """Readings, the posterior, and what is known of it."""

    def __init__(self, angles, read):
        self.angles, self.read = angles, read
        coefficients = [Parameter(f"mu{i}", "", "", "friction", Normal(0.0, 1.0)) for i in range(COUNT)]
        space = ParameterSpace((*coefficients, Parameter("tau", "", "", "noise", LogNormal(MEDIAN, LOG_SD))))
        self.posterior = LogDensity(SimpleNamespace(space=space, terms=(Readings(angles, read),), is_slow=False))

    def quantile_of_tau(self, share: np.ndarray) -> np.ndarray:
        """Of tau in z: the readings are normal with covariance tau^2 + angles angles^T."""
        scatter = np.exp(2 * (np.log(MEDIAN) + LOG_SD * GRID))[:, None, None] * np.eye(len(self.read))
        covariance = self.angles @ self.angles.T + scatter
        fit = np.einsum("i,gij,j->g", self.read, np.linalg.inv(covariance), self.read)
        log_density = -0.5 * (GRID**2 + fit + np.linalg.slogdet(covariance)[1])
        density = np.exp(log_density - log_density.max())
        below = np.cumsum(density) - density / 2
        return np.interp(share, below / np.sum(density), GRID)

    def given_tau(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean of the coefficients at tau (in z), and root of their covariance."""
        tau = MEDIAN * np.exp(LOG_SD * z)
        covariance = np.linalg.inv(self.angles.T @ self.angles / tau[..., None, None] ** 2 + np.eye(COUNT))
        mean = covariance @ (self.angles.T @ self.read) / tau[..., None] ** 2
        return mean, np.linalg.cholesky(covariance)

    def draw(self, seed: int) -> np.ndarray:
        """From the posterior itself, (ensemble, walker, parameter)."""
        generator = np.random.default_rng(seed)
        tau = self.quantile_of_tau(generator.uniform(size=(ENSEMBLES, WALKERS)))
        mean, root = self.given_tau(tau)
        samples = mean + (root @ generator.standard_normal((ENSEMBLES, WALKERS, COUNT, 1)))[..., 0]
        return np.concatenate([samples, tau[..., None]], axis=-1)

    def p_value(self, states: np.ndarray) -> float:
        """Of the shares below known quantiles of tau, and of the coefficients made standard normal at their tau; of the
        smallest, times their number. Ensembles are independent and give the standard error; states are (state, ensemble,
        walker, parameter).
        """
        mean, root = self.given_tau(states[..., -1])
        standard = np.linalg.solve(root, (states[..., :COUNT] - mean)[..., None])[..., 0]
        shares = [states[..., -1, None] < self.quantile_of_tau(LEVELS)]
        shares += [standard[..., i, None] < stats.norm.ppf(LEVELS) for i in range(COUNT)]
        of_ensembles = np.concatenate([share.mean(axis=(0, 2)) for share in shares], axis=1)
        expected = np.tile(LEVELS, 1 + COUNT)
        return float(min(1.0, stats.ttest_1samp(of_ensembles, expected, axis=0).pvalue.min() * len(expected)))

    def sampled(self, moves=None, settings=SETTINGS, programs=None, **options) -> np.ndarray:
        """Draws of the shortest path that is trusted, from the starts of a fit, (draw, ensemble, walker, parameter)."""
        middle = np.linalg.lstsq(self.angles, self.read, rcond=None)[0]
        start = MaximumPosterior(np.append(middle, 0.0), np.diag([0.01, 0.01, 0.01, 1.0]))
        programs = programs or compile_walkers(self.posterior, settings, moves)
        z = sample(SamplingRequest(self.posterior, start, settings, 1, **options), programs).z
        return z.reshape(ENSEMBLES, WALKERS, -1, COUNT + 1).transpose(2, 0, 1, 3)


@pytest.fixture(scope="module")
def narrow() -> Funnel:
    """As many readings as coefficients."""
    angles = np.array([(3.5, 0.5, 0.35), (1.0, 1.6, 0.5), (1.6, 0.5, 1.0)])
    return Funnel(angles, angles @ np.array([0.3, -0.2, 0.1]))


@pytest.fixture(scope="module")
def wide() -> Funnel:
    """Four readings more, ten times as exact as is likely before."""
    generator = np.random.default_rng(1)
    angles = generator.uniform(0.3, 3.5, (COUNT + 4, COUNT))
    return Funnel(angles, angles @ np.array([0.3, 0.2, 0.1]) + 0.003 * generator.standard_normal(COUNT + 4))


def moved_along_the_ridge(funnel, moves, change=lambda frame: frame) -> np.ndarray:
    """States of walkers that start in the posterior and move in these coordinates alone."""
    frames, posterior = ((change(ridge_map(Conditional(funnel.posterior))), 1.0),), funnel.posterior
    return run_side_by_side(moves, posterior.log_density, funnel.draw(3), 1200, 3, frames, posterior.data)[30:]


@pytest.mark.parametrize("name", some_slow(PROPOSALS, ("independent", "differential evolution")))
def test_every_move_along_the_ridge_leaves_the_funnel_as_it_is(name, narrow):
    """Alone, from starts in the funnel; p < 0.001 by chance once in a thousand seeds."""
    assert narrow.p_value(moved_along_the_ridge(narrow, [(PROPOSALS[name], 1.0)])) > 0.001


@pytest.mark.filterwarnings("ignore:Precision loss")
def test_the_same_test_sees_that_the_width_of_the_ridge_is_not_counted(narrow):
    """The negative control of the test above."""
    moves = default_moves(COUNT + 1, WALKERS)
    assert narrow.p_value(moved_along_the_ridge(narrow, moves, without_its_volume)) < 1e-4


def test_walkers_of_a_single_fit_reach_the_narrow_end_of_a_funnel(narrow):
    """p < 0.001 by chance once in a thousand seeds."""
    assert narrow.p_value(narrow.sampled()) > 0.001


@pytest.mark.filterwarnings("ignore:Precision loss")
def test_walkers_that_move_in_z_alone_do_not_reach_it(narrow):
    """The negative control: without the ridge hardly any walker is where one in a hundred should be."""
    z = narrow.sampled(default_moves(COUNT + 1, WALKERS))
    assert np.mean(z[..., -1] < narrow.quantile_of_tau(0.01)) < 0.002
    assert narrow.p_value(z) < 1e-4


def test_where_enough_readings_tell_the_scatter_walkers_do_without_the_ridge(wide, narrow):
    """From a start that is far wider, and at another scatter; p < 0.001 by chance once in a thousand seeds."""
    programs = compile_walkers(wide.posterior, SETTINGS)
    assert len(programs.shares.frames) == 2 and compile_walkers(narrow.posterior, SETTINGS).later is None
    assert wide.p_value(wide.sampled(programs=programs)) > 0.001


def test_readings_that_are_alike_tell_no_scatter_however_many(wide):
    assert not Conditional(wide.posterior).is_narrow
    assert Conditional(Funnel(wide.angles, np.full(len(wide.read), 0.7)).posterior).is_narrow


@pytest.fixture(scope="module")
def surprised(narrow):
    """Programs for a funnel that was not expected to be narrow."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Conditional, "is_narrow", False)
        return compile_walkers(narrow.posterior, SETTINGS)


def lasting(steps):
    return SETTINGS.model_copy(update={"max_steps": steps, "target_ess": 10**6})


def test_what_has_no_ridge_is_not_compiled_again(surprised, monkeypatch):
    monkeypatch.setattr(Conditional, "has_coefficients", False)
    assert surprised.later.__wrapped__().sweep is surprised.sweep  # not the one that is kept for the tests below


@pytest.mark.filterwarnings("ignore:Precision loss")
def test_walkers_that_have_not_settled_turn_to_the_ridge(narrow, surprised):
    """After 1200 steps; the draws of 2400 are those since. p < 0.001 by chance once in a thousand seeds."""
    assert narrow.p_value(narrow.sampled(settings=lasting(1200), programs=surprised)) < 1e-4
    assert narrow.p_value(narrow.sampled(settings=lasting(2400), programs=surprised)) > 0.001


@pytest.fixture(scope="module")
def whole(narrow, surprised):
    """Draws of a sampling in one go, a little beyond where it turns to the ridge."""
    return narrow.sampled(settings=lasting(1300), programs=surprised)


@pytest.mark.slow
@pytest.mark.parametrize("interrupted", [1150, 1250])
def test_a_sampling_that_is_resumed_turns_to_it_where_one_in_one_go_does(interrupted, narrow, surprised, whole, tmp_path):
    path = tmp_path / "parts"
    start_checkpoint(path, {})
    narrow.sampled(settings=lasting(interrupted), programs=surprised, checkpoint=path)
    remainder = narrow.sampled(settings=lasting(1300), programs=surprised, checkpoint=path, resume=True)
    np.testing.assert_array_equal(remainder, whole)


def test_the_way_along_the_ridge_and_back_are_inverse(narrow):
    posterior = narrow.posterior
    frame, z = jax.jit(ridge_map(Conditional(posterior))), jnp.asarray(narrow.draw(1)[0])
    w, point, volume = frame(z, True, posterior.data)
    saved, back, same = frame(w, False, posterior.data)
    np.testing.assert_array_equal(point, z)
    np.testing.assert_array_equal(saved, w)
    np.testing.assert_allclose(back, z, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(same, volume, rtol=1e-9)
