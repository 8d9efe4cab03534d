"""The equations themselves: known answers, symmetries, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax.test_util import check_grads

from bowdenfit.physics.friction import capstan_output_force, friction_exponent, transmission_efficiency
from bowdenfit.physics.geometry import (
    gaussian_coefficients,
    gaussian_wrap_angle,
    log_quadratic_coefficients,
    log_quadratic_wrap_angle,
)

steady = settings(deadline=None, derandomize=True, max_examples=50)  # the first example compiles
FORCES = st.floats(1e-3, 1e4)
EXPONENTS = st.floats(0.0, 10.0)
PULL, RETURN = jnp.asarray(1.0), jnp.asarray(-1.0)
COEFFICIENTS = st.tuples(st.floats(-3.0, 3.0), st.floats(-5.0, 5.0), st.floats(0.05, 3.0))
RANGES = st.tuples(st.floats(100.0, 2000.0), st.floats(10.0, 90.0))


@steady
@given(FORCES)
def test_capstan_loses_nothing_without_wrap(force):
    for stroke in (PULL, RETURN):
        assert float(capstan_output_force(jnp.asarray(force), jnp.asarray(0.0), stroke)) == force


def test_half_a_turn_at_a_coefficient_of_one_tenth_transmits_73_percent():
    exponent = friction_exponent(jnp.array([0.1]), jnp.array([np.pi]))
    assert float(transmission_efficiency(exponent)) == pytest.approx(0.7304026910486456, rel=1e-15)  # exp(-pi/10)
    assert float(capstan_output_force(jnp.asarray(50.0), exponent, PULL)) == pytest.approx(36.52013455243228, rel=1e-15)


@steady
@given(FORCES, EXPONENTS)
def test_the_return_stroke_undoes_the_pulling_stroke(force, exponent):
    there = capstan_output_force(jnp.asarray(force), jnp.asarray(exponent), PULL)
    back = capstan_output_force(there, jnp.asarray(exponent), RETURN)
    assert float(back) == pytest.approx(force, rel=1e-14)


@steady
@given(FORCES, EXPONENTS)
def test_pulling_loses_what_returning_gains(force, exponent):
    pulled = float(capstan_output_force(jnp.asarray(force), jnp.asarray(exponent), PULL))
    returned = float(capstan_output_force(jnp.asarray(force), jnp.asarray(exponent), RETURN))
    assert pulled <= force <= returned
    assert pulled * returned == pytest.approx(force**2, rel=1e-13)
    assert pulled / force == pytest.approx(float(transmission_efficiency(jnp.asarray(exponent))), rel=1e-14)


@steady
@given(st.lists(st.tuples(st.floats(0.01, 0.5), st.floats(0.0, 6.0)), min_size=1, max_size=6), FORCES)
def test_contacts_in_series_are_capstans_one_after_the_other(contacts, force):
    mu, theta = (jnp.array(column) for column in zip(*contacts, strict=True))
    tension = jnp.asarray(force)
    for k in range(len(contacts)):
        tension = capstan_output_force(tension, mu[k] * theta[k], PULL)
    whole = capstan_output_force(jnp.asarray(force), friction_exponent(mu, theta), PULL)
    assert float(whole) == pytest.approx(float(tension), rel=1e-13)


def test_friction_exponent_adds_over_the_last_axis_only():
    mu, theta = jnp.array([0.1, 0.2]), jnp.array([[1.0, 2.0], [3.0, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(friction_exponent(jnp.broadcast_to(mu, theta.shape), theta), [0.5, 0.3, 0.0], rtol=1e-15)


@steady
@given(COEFFICIENTS, RANGES)
def test_gaussian_and_log_quadratic_coefficients_are_one_another_s_inverse(coefficients, window):
    abc = tuple(jnp.asarray(x) for x in coefficients)
    back = log_quadratic_coefficients(*gaussian_coefficients(*abc, *window), *window)
    np.testing.assert_allclose(back, abc, rtol=1e-9, atol=1e-9)


@steady
@given(COEFFICIENTS, RANGES, st.floats(-1.5, 1.5))
def test_both_forms_are_the_same_curve(coefficients, window, z):
    abc = tuple(jnp.asarray(x) for x in coefficients)
    middle, half_width = window
    printed = gaussian_wrap_angle(jnp.asarray(middle + half_width * z), *gaussian_coefficients(*abc, *window))
    assert float(log_quadratic_wrap_angle(jnp.asarray(z), *abc)) == pytest.approx(float(printed), rel=1e-8)


def test_the_printed_coefficients_are_peak_place_and_width():
    A, B, C = jnp.asarray(2.0), jnp.asarray(600.0), jnp.asarray(80.0)
    points = gaussian_wrap_angle(jnp.array([600.0, 520.0, 680.0]), A, B, C)
    np.testing.assert_allclose(points, [2.0, 2.0 / np.e, 2.0 / np.e], rtol=1e-14)


def test_without_curvature_the_curve_is_an_exponential_and_has_no_peak():
    a, b, zero = jnp.asarray(-0.5), jnp.asarray(1.5), jnp.asarray(0.0)
    z = jnp.linspace(-1, 1, 9)
    slope = np.diff(np.log(log_quadratic_wrap_angle(z, a, b, zero))) / np.diff(z)
    np.testing.assert_allclose(slope, 1.5, rtol=1e-12)
    assert all(np.isinf(x) for x in gaussian_coefficients(a, b, zero, 480.0, 50.0))


DIFFERENTIABLE = {
    "friction exponent": (friction_exponent, (jnp.array([0.1, 0.2]), jnp.array([1.0, 3.0]))),
    "efficiency": (transmission_efficiency, (jnp.array([0.0, 0.3, 4.0]),)),
    "capstan": (lambda f, x: capstan_output_force(f, x, RETURN), (jnp.asarray(20.0), jnp.asarray(0.3))),
    "gaussian": (gaussian_wrap_angle, tuple(jnp.asarray(x) for x in (480.0, 9.8, 660.0, 105.0))),
    "log-quadratic": (log_quadratic_wrap_angle, tuple(jnp.asarray(x) for x in (0.7, -0.7, 1.6, 0.2))),
    "log-quadratic without curvature": (
        log_quadratic_wrap_angle,
        tuple(jnp.asarray(x) for x in (-1.0, -0.7, 1.6, 0.0)),
    ),
    "A, B, C": (
        lambda a, b, c: gaussian_coefficients(a, b, c, 480.0, 50.0),
        tuple(jnp.asarray(x) for x in (-0.7, 1.6, 0.2)),
    ),
    "a, b, c": (
        lambda A, B, C: log_quadratic_coefficients(A, B, C, 480.0, 50.0),
        tuple(jnp.asarray(x) for x in (9.8, 660.0, 105.0)),
    ),
}


@pytest.mark.parametrize("name", DIFFERENTIABLE)
def test_gradients_agree_with_finite_differences(name):
    function, arguments = DIFFERENTIABLE[name]
    check_grads(jax.jit(function), arguments, order=1, modes=("fwd", "rev"), rtol=1e-5, atol=1e-5)


def test_the_normal_tail_has_the_right_value_and_slope_at_any_distance():
    import scipy.stats

    from bowdenfit.physics.distributions import log_normal_cdf

    far, near = (-1e12, -1e8, -1e4, -40.0, -30.001, -29.999), (-3.0, -1e-9, 0.0, 1e-9, 2.999, 3.001, 8.0, 30.0)
    x = jnp.array([*far, *near])
    slope = jax.vmap(jax.grad(log_normal_cdf))(x)
    np.testing.assert_allclose(log_normal_cdf(x), scipy.stats.norm.logcdf(x), rtol=1e-12)
    close = np.maximum(x, -100)
    mills = np.where(x < -100, -x - 1 / x, np.exp(scipy.stats.norm.logpdf(close) - scipy.stats.norm.logcdf(close)))
    np.testing.assert_allclose(slope, mills, rtol=1e-7)
