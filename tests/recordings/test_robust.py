"""The hysteresis loop that follows a recording best, against SciPy's least squares and differences of the model."""

import numpy as np
import pytest
from scipy import optimize

from bowdenfit.recordings import loop_strokes, rope_strokes
from bowdenfit.recordings.preparation.hysteresis import robust_cost, robust_minimum, smooth_input

pytestmark = pytest.mark.extended

FREE = np.array([[-np.inf, -np.inf], [np.inf, np.inf]])


def line(seed: int, outliers: int = 0):
    """Residuals of a straight line about points, with slopes."""
    generator = np.random.default_rng(seed)
    x = np.linspace(-1, 1, 60)
    y = 3 + 2 * x + generator.normal(size=60)
    y[generator.choice(60, outliers, replace=False)] += 40
    slopes = np.stack([np.ones(60), x], axis=1)
    return lambda p: (slopes @ p - y, slopes)


def by_scipy(model, start, limits):
    """The same minimum by SciPy, to its last digits."""
    return optimize.least_squares(
        lambda p: model(p)[0], start, bounds=limits, loss="soft_l1", ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=2000
    )


@pytest.mark.parametrize("outliers", [0, 3, 20])
def test_the_minimum_of_a_line_is_scipy_s(outliers):
    model = line(1, outliers)
    minimum, cost = robust_minimum(model, np.array([30.0, -50.0]), *FREE)
    expected = by_scipy(model, [30.0, -50.0], FREE)
    np.testing.assert_allclose(minimum, expected.x, rtol=1e-6)
    assert cost == pytest.approx(expected.cost, rel=1e-12)


@pytest.mark.parametrize("limits", [[[3.5, -np.inf], [np.inf, np.inf]], [[-np.inf, -np.inf], [np.inf, 1.5]]])
def test_a_parameter_beyond_its_limit_stays_there_and_the_other_goes_on(limits):
    model = line(2)
    minimum, cost = robust_minimum(model, np.array([4.0, 1.0]), *np.array(limits))
    expected = by_scipy(model, [4.0, 1.0], limits)
    np.testing.assert_allclose(minimum, expected.x, rtol=1e-6)
    assert cost == pytest.approx(expected.cost, rel=1e-9)


def cycles(exponent: float, drag: float):
    """Input and output force of a rope that is pulled and given back, without noise [N]."""
    force_in = 40 + 25 * np.sin(np.linspace(0, 20, 900)) + 3 * np.sin(np.linspace(0, 171, 900))
    output, _ = rope_strokes.play(np.log(force_in + drag), exponent)
    return force_in, np.exp(output) - drag


def rope_model(generator):
    force_in, force_out = cycles(0.25, 3.0)
    noisy = [force + 0.2 * generator.normal(size=len(force)) for force in (force_in, force_out)]
    return lambda p: rope_strokes._residuals(noisy[0], smooth_input(noisy[0]), noisy[1], (0.2, 0.2), 40.0, p)


def loop_model(generator):
    x = 60 * np.sin(np.linspace(0, 20, 900)) + 0.2 * generator.normal(size=900)
    y = loop_strokes.play_between(*loop_strokes.loop_limits(x, 12.0, 0.4), 0.0)[0] + 0.2 * generator.normal(size=900)
    return lambda p: loop_strokes._residuals(x, smooth_input(x), y, 40.0, 0.3, p)


@pytest.mark.parametrize(
    ("make", "time"),
    [(rope_model, [0.23, 0.01, 0.05]), (rope_model, [0.3, -0.02, 0.0]), (loop_model, [0.28, 0.37, 0.02])],
)
def test_slopes_are_differences_of_the_residuals(make, time):
    model, point = make(np.random.default_rng(3)), np.array(time)
    slopes = model(point)[1]
    for k in range(3):
        step = 1e-7 * np.eye(3)[k]
        differences = (model(point + step)[0] - model(point - step)[0]) / 2e-7
        assert np.mean(np.abs(differences - slopes[:, k]) < 1e-5 * np.abs(slopes[:, k]).max()) > 0.99  # few on a kink


@pytest.mark.parametrize(("exponent", "drag"), [(0.02, 0.0), (0.25, 0.0), (0.25, 3.0), (0.6, 0.5)])
def test_a_rope_without_noise_is_followed_exactly(exponent, drag):
    computed = rope_strokes.fit_loop(*cycles(exponent, drag))
    assert computed.cost < 1e-3
    assert (computed.exponent, computed.lost) == pytest.approx((exponent, drag), rel=2e-3, abs=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_no_start_nearby_leads_scipy_to_a_lower_cost_of_a_noisy_rope(seed):
    generator = np.random.default_rng(seed)
    model = rope_model(generator)
    limits = np.array([[1e-9, -np.inf, 0.0], [np.inf] * 3])
    minimum, cost = robust_minimum(model, np.array([0.3, 0.0, 0.01]), *limits)
    assert cost == pytest.approx(robust_cost(model(minimum)[0]), rel=1e-14)
    for _ in range(3):
        start = np.maximum(minimum * generator.uniform(0.8, 1.2, 3), limits[0] + 1e-6)
        assert cost < by_scipy(model, start, limits).cost * (1 + 1e-9)
