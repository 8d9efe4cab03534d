"""A funnel whose every marginal is known: walkers of a single fit reach its narrow end, from where they start, in 600 steps.

Three readings of three coefficients that scatter by tau: the smaller tau, the narrower is where the coefficients can be. With
normal priors of the coefficients everything but tau integrates out in closed form, and tau's own density is a sum on a grid.
"""

from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from test_proposals import LEVELS, PROPOSALS, run_side_by_side, without_its_volume

from bowdenfit.description import SamplerSettings
from bowdenfit.inference.chain import Sampling
from bowdenfit.inference.conditional import Conditional
from bowdenfit.inference.coordinates import in_ridge
from bowdenfit.inference.ensemble import sample
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.moves import default_moves
from bowdenfit.inference.walkers import walker_programs
from bowdenfit.parameters.priors import LogNormal, Normal
from bowdenfit.parameters.space import Parameter, ParameterSpace

ANGLES = np.array([(3.5, 0.5, 0.35), (1.0, 1.6, 0.5), (1.6, 0.5, 1.0)])
COUNT, MEDIAN, LOG_SD = 3, 0.03, 1.5
READ = ANGLES @ np.array([0.3, -0.2, 0.1])
GRID = np.linspace(-6.0, 6.0, 4001)
ENSEMBLES, WALKERS = 16, 64
SETTINGS = SamplerSettings(n_ensembles=ENSEMBLES, n_walkers=WALKERS, max_steps=600, target_ess=100)


class Readings:
    """What a kind of table adds to the likelihood, and nothing else."""

    name, data = "readings", {"angles": ANGLES, "read": READ}

    def residuals(self, values, data):
        expected = data["angles"] @ jnp.stack([values[f"mu{i}"] for i in range(COUNT)])
        return (data["read"] - expected) / values["tau"]

    def log_likelihood(self, values, data):
        return -0.5 * self.residuals(values, data) ** 2 - jnp.log(values["tau"])


@pytest.fixture(scope="module")
def posterior() -> LogDensity:
    coefficients = [Parameter(f"mu{i}", "", "", "friction", Normal(0.0, 1.0)) for i in range(COUNT)]
    tau = Parameter("tau", "", "", "noise", LogNormal(MEDIAN, LOG_SD))
    return LogDensity(SimpleNamespace(space=ParameterSpace((*coefficients, tau)), terms=(Readings(),)))


def quantile_of_tau(share: np.ndarray) -> np.ndarray:
    """Of tau in z: the readings are normal with covariance tau^2 + angles angles^T."""
    covariance = ANGLES @ ANGLES.T + np.exp(2 * (np.log(MEDIAN) + LOG_SD * GRID))[:, None, None] * np.eye(COUNT)
    fit = np.einsum("i,gij,j->g", READ, np.linalg.inv(covariance), READ)
    density = np.exp(-0.5 * (GRID**2 + fit + np.linalg.slogdet(covariance)[1]))
    below = np.cumsum(density) - density / 2
    return np.interp(share, below / np.sum(density), GRID)


def given_tau(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean of the coefficients at tau (in z), and root of their covariance."""
    tau = MEDIAN * np.exp(LOG_SD * z)
    covariance = np.linalg.inv(ANGLES.T @ ANGLES / tau[..., None, None] ** 2 + np.eye(COUNT))
    mean = covariance @ (ANGLES.T @ READ) / tau[..., None] ** 2
    return mean, np.linalg.cholesky(covariance)


def draw(seed: int) -> np.ndarray:
    """From the posterior itself, (ensemble, walker, parameter)."""
    generator = np.random.default_rng(seed)
    tau = quantile_of_tau(generator.uniform(size=(ENSEMBLES, WALKERS)))
    mean, root = given_tau(tau)
    own = mean + (root @ generator.standard_normal((ENSEMBLES, WALKERS, COUNT, 1)))[..., 0]
    return np.concatenate([own, tau[..., None]], axis=-1)


def p_value(states: np.ndarray) -> float:
    """Of the shares below known quantiles of tau, and of the coefficients made standard normal at their tau; of the smallest,
    times their number. Ensembles are independent and give the standard error; states are (state, ensemble, walker, parameter).
    """
    mean, root = given_tau(states[..., -1])
    standard = np.linalg.solve(root, (states[..., :COUNT] - mean)[..., None])[..., 0]
    shares = [states[..., -1, None] < quantile_of_tau(LEVELS)]
    shares += [standard[..., i, None] < stats.norm.ppf(LEVELS) for i in range(COUNT)]
    of_ensembles = np.concatenate([share.mean(axis=(0, 2)) for share in shares], axis=1)
    expected = np.tile(LEVELS, 1 + COUNT)
    return float(min(1.0, stats.ttest_1samp(of_ensembles, expected, axis=0).pvalue.min() * len(expected)))


def moved_along_the_ridge(posterior, moves, change=lambda frame: frame) -> np.ndarray:
    """States of walkers that start in the posterior and move in these coordinates alone."""
    frames, data = ((change(in_ridge(Conditional(posterior))), 1.0),), posterior.data
    return run_side_by_side(moves, posterior.log_density, draw(3), 1200, 3, frames, data)[30:]


@pytest.mark.parametrize("name", PROPOSALS)
def test_every_move_along_the_ridge_leaves_the_funnel_as_it_is(name, posterior):
    """Alone, from starts in the funnel; p < 0.001 by chance once in a thousand seeds."""
    assert p_value(moved_along_the_ridge(posterior, [(PROPOSALS[name], 1.0)])) > 0.001


@pytest.mark.filterwarnings("ignore:Precision loss")
def test_the_same_test_sees_that_the_width_of_the_ridge_is_not_counted(posterior):
    """The negative control of the test above."""
    moves = default_moves(COUNT + 1, WALKERS)
    assert p_value(moved_along_the_ridge(posterior, moves, without_its_volume)) < 1e-4


def sampled(posterior, moves=None) -> np.ndarray:
    """Draws of the shortest path that is trusted, from the starts of a fit, (draw, ensemble, walker, parameter)."""
    start = MaximumPosterior(np.append(np.linalg.solve(ANGLES, READ), 0.0), np.diag([0.01, 0.01, 0.01, 1.0]))
    z = sample(Sampling(posterior, start, SETTINGS, 1), walker_programs(posterior, SETTINGS, moves)).z
    return z.reshape(ENSEMBLES, WALKERS, -1, COUNT + 1).transpose(2, 0, 1, 3)


def test_walkers_of_a_single_fit_reach_the_narrow_end_of_a_funnel(posterior):
    """p < 0.001 by chance once in a thousand seeds."""
    assert p_value(sampled(posterior)) > 0.001


@pytest.mark.filterwarnings("ignore:Precision loss")
def test_walkers_that_move_in_z_alone_do_not_reach_it(posterior):
    """The negative control: without the ridge hardly any walker is where one in a hundred should be."""
    z = sampled(posterior, default_moves(COUNT + 1, WALKERS))
    assert np.mean(z[..., -1] < quantile_of_tau(0.01)) < 0.002
    assert p_value(z) < 1e-4


def test_the_way_along_the_ridge_and_back_are_inverse(posterior):
    frame, z = in_ridge(Conditional(posterior)), jnp.asarray(draw(1)[0])
    w, given, volume = frame(z, True, posterior.data)
    kept, back, same = frame(w, False, posterior.data)
    np.testing.assert_array_equal(given, z)
    np.testing.assert_array_equal(kept, w)
    np.testing.assert_allclose(back, z, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(same, volume, rtol=1e-9)
