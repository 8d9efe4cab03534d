"""Friction that builds up after a turn: against Lambert's function, a play operator, and SciPy's integrator."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from creeping_rope import Truth, creep, pulled
from scipy.special import lambertw

from bowdenfit.physics.friction import play_operator
from bowdenfit.physics.presliding import MOST_LET_GO
from bowdenfit.physics.presliding import creep as creep_of_step
from bowdenfit.physics.presliding import presliding_operator as operator_of_arrays

presliding_operator = jax.jit(operator_of_arrays)
RATE = {"stribeck": 0.3, "viscous": 0.002, "reference_speed": 20.0}


def _arguments(n=2000):
    """Changes, friction to build up and stiffnesses of all sizes, some of them 0."""
    generator = np.random.default_rng(1)
    change, build_up = generator.uniform(0.0, 2.0, (2, n)) * generator.choice([0.0, 0.01, 1.0], (2, n))
    return change, build_up, np.exp(generator.uniform(-3.0, 9.0, n))


def test_a_step_of_any_length_is_lambert_s():
    change, build_up, stiffness = _arguments()
    d = np.asarray(jax.jit(creep_of_step)(change, build_up, stiffness))
    np.testing.assert_allclose(d - build_up * np.expm1(-stiffness * d), change, rtol=0, atol=1e-10)
    assert np.all((d >= 0) & (d <= change))
    argument = stiffness * build_up * np.exp(np.minimum(stiffness * (build_up - change), 600.0))
    mask = stiffness * (build_up - change) < 600.0
    by_scipy = change - build_up + np.real(lambertw(argument)) / stiffness
    np.testing.assert_allclose(d[mask], by_scipy[mask], rtol=0, atol=1e-11)


def test_a_step_in_which_friction_is_let_go_solves_its_equation():
    """Friction above its limit, up to as much as falls nine tenths as fast as the output moves."""
    change, _, stiffness = _arguments()
    build_up = -np.linspace(0, MOST_LET_GO, len(change)) / stiffness
    d = np.asarray(jax.jit(creep_of_step)(change, build_up, stiffness))
    np.testing.assert_allclose(d - build_up * np.expm1(-stiffness * d), change, rtol=1e-12, atol=1e-10)
    assert np.all(d >= change)


def test_the_derivatives_of_a_step_are_those_of_its_equation():
    change, build_up, stiffness = (values[:60] + 0.02 for values in _arguments())
    for i, sign in itertools.product(range(3), (1, -1)):
        values = [change, np.where(sign > 0, build_up, -0.8 / stiffness), np.minimum(stiffness, 200.0)]
        tangents = [np.where(i == k, 1.0, 0.0) * np.ones(60) for k in range(3)]
        _, slope = jax.jvp(creep_of_step, tuple(map(jnp.asarray, values)), tuple(map(jnp.asarray, tangents)))
        more, less = ([v + s * 1e-6 * t for v, t in zip(values, tangents, strict=True)] for s in (1, -1))
        by_differences = (creep_of_step(*map(jnp.asarray, more)) - creep_of_step(*map(jnp.asarray, less))) / 2e-6
        np.testing.assert_allclose(slope, by_differences, rtol=1e-5, atol=1e-8)
    assert np.all(np.isfinite(jax.grad(creep_of_step, 1)(*map(jnp.asarray, (0.0, 0.0, 20.0)))))


def test_an_infinitely_stiff_rope_is_the_play_operator_with_bands_that_change_and_inputs_that_are_lost():
    generator = np.random.default_rng(2)
    x = np.cumsum(0.1 * generator.standard_normal((300, 3)), axis=0)
    pulling, returning = 0.25 + 0.1 * generator.uniform(size=(2, 300, 3))
    restart = np.where(generator.uniform(size=x.shape) < 0.02, x, np.nan)
    computed = presliding_operator(x, (pulling, returning), jnp.full(x.shape, 1e9), jnp.asarray(x[0] + 0.1), restart)
    expected, _ = play_operator(x - pulling, x + returning, jnp.asarray(x[0] + 0.1), restart=restart)
    np.testing.assert_allclose(computed, expected, atol=1e-7)


def _followed(truth: Truth, time):
    """The package's output for the same motion."""
    force, speed = pulled(time)
    x, steady = np.log(force)[:, None], truth.steady(speed)[:, None]
    start = jnp.asarray(x[0] - 0.3 * truth.exponent)
    stiffness = truth.stiffness * truth.exponent / steady
    step = time[1] - time[0]
    return np.exp(np.asarray(presliding_operator(x, (steady, steady), stiffness, start, None, truth.damping / step)))[:, 0]


@pytest.mark.parametrize(
    ("rate", "more", "most"),
    [
        (100, {}, 2e-7),
        pytest.param(20, {}, 2e-7, marks=pytest.mark.extended),
        pytest.param(1000, {"stiffness": 200.0}, 2e-7, marks=pytest.mark.extended),
        pytest.param(20, RATE, 3e-4, marks=pytest.mark.extended),
        pytest.param(1000, RATE, 3e-7, marks=pytest.mark.extended),
        pytest.param(20, {"damping": 0.02}, 3e-3, marks=pytest.mark.extended),
        pytest.param(1000, {"damping": 0.02}, 2e-4, marks=pytest.mark.extended),
        pytest.param(100, RATE | {"damping": 0.01}, 4e-4, marks=pytest.mark.extended),
    ],
)
def test_it_follows_the_differential_equation_at_any_sampling(rate, more, most):
    """Without rate and damping the steps are exact; with rate the error is of second order, with damping of first."""
    truth, time = Truth(**more), np.arange(0, 33.9, 1 / rate)
    by_solver = creep(truth, time)
    assert np.abs(np.log(_followed(truth, time) / by_solver)).max() < most
    stands = np.abs(np.log(_followed(Truth(**more | {"stiffness": 1e9}), time) / by_solver)).max()
    assert stands > 0.02 if truth.stiffness < 100 else stands > 1e-3  # of which a play operator knows nothing


def test_after_enough_motion_friction_is_that_of_steady_sliding():
    x = np.concatenate([np.linspace(0, 3, 7), np.linspace(3, -3, 9)])[:, None]
    y = np.asarray(presliding_operator(x, (np.full_like(x, 0.4), np.full_like(x, 0.3)), jnp.full(x.shape, 20.0), x[0]))
    assert y[6, 0] == pytest.approx(3 - 0.4, abs=1e-9) and y[-1, 0] == pytest.approx(-3 + 0.3, abs=1e-9)


def test_no_step_is_too_long_or_leaves_the_friction_band():
    generator = np.random.default_rng(3)
    x, band = np.cumsum(generator.standard_normal((400, 2)), axis=0), 0.1 + 0.3 * generator.uniform(size=(400, 2))
    for stiffness, damping in ((0.01, 0.0), (30.0, 0.0), (1e12, 0.0), (30.0, 5.0)):
        computed = presliding_operator(x, (band, band), jnp.full(x.shape, stiffness), jnp.asarray(x[0]), None, damping)
        friction, most = (
            x - np.asarray(computed),
            np.maximum.accumulate(band),
        )  # which friction that is let go falls below in time
        assert np.all(np.abs(friction) <= most * (1 + 2 * damping) + 1e-9) and np.all(np.isfinite(friction))
        if stiffness > 1e9:
            assert np.all(np.abs(friction) <= band + 1e-9)
