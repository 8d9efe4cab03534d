"""Profile intervals: exact where there is an exact answer, cut off at bounds, open where nothing limits them."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from cables import cable, measured
from own_angle_tables import of_rows
from scipy import optimize, stats
from strd import Problem, problem

from bowdenfit.dataset import Dataset
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.least_squares import LeastSquares, find_maximum_posterior, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import Objective, make_objective
from bowdenfit.inference.profiles import compute_profile, find_crossing, find_interval_ends, satterthwaite_freedom
from bowdenfit.inference.solver import minimize, orthogonalize
from bowdenfit.models import build_model

pytestmark = pytest.mark.extended


def fitted(dataset: Dataset) -> tuple[LogDensity, Objective, LeastSquares]:
    posterior = LogDensity(build_model(dataset))
    objective = make_objective(posterior)
    return posterior, objective, fit_least_squares(posterior, objective, find_maximum_posterior(posterior, objective).z)


def _rows(seed: int, n: int = 9, truth: tuple[float, ...] = (0.15, 0.1)) -> tuple[np.ndarray, np.ndarray]:
    """Losses and angles of rows that scatter by 0.01."""
    rng = np.random.default_rng(seed)
    angle = np.deg2rad(rng.uniform(20.0, 160.0, (n, len(truth))))
    return angle @ np.array(truth) + 0.01 * rng.standard_normal(n), angle


# Exact answers ----------------------------------------------------------------------------------------------------


def test_of_a_linear_model_the_profile_interval_is_the_t_interval():
    loss, angle = _rows(1)
    _, _, least_squares_fit = fitted(of_rows(loss, angle))
    solution, remainder, *_ = np.linalg.lstsq(angle, loss)
    freedom = len(loss) - angle.shape[1]
    error = np.sqrt(float(remainder[0]) / freedom * np.diag(np.linalg.inv(angle.T @ angle)))
    t = stats.t.ppf(0.95, freedom)
    for k, name in enumerate(("mu1", "mu2")):
        estimate = least_squares_fit.estimates[name]
        assert estimate.value == pytest.approx(solution[k], rel=1e-9)
        assert estimate.standard_error == pytest.approx(error[k], rel=1e-9)
        assert (estimate.lower, estimate.upper) == pytest.approx(
            (solution[k] - t * error[k], solution[k] + t * error[k]), abs=1e-3 * error[k]
        )


def test_of_a_curved_model_the_interval_is_that_of_a_brute_force_grid():
    """The others fitted again by SciPy's trust region at every grid point, and the level crossed between two of them."""
    posterior, _, solution = fitted(measured(cable(1, ("angles",)), seed=3)[0])
    size, index = posterior.model.space.size, posterior.model.space.index["free_angle_c"]
    free = np.array([i for i, p in enumerate(posterior.model.space.free) if p.role == "curve" and i != index])

    def stacked(part, pin, data):
        z = jnp.zeros(size).at[free].set(part).at[index].set(pin)
        return posterior.residuals(z, data)["wrap_angle"]

    start, data = solution.z[free], posterior.data
    residuals = compile_program(stacked, start, solution.z[index], data, run_once=True)

    def least(pin: float) -> float:
        solved = optimize.least_squares(
            lambda part: np.asarray(residuals(part, pin, data)), start, xtol=1e-12, ftol=1e-12
        )
        return 2 * float(solved.cost)

    spare = len(posterior.data[0].angle) - 3
    level = solution.sum_of_squares * (1 + stats.f.ppf(0.9, 1, spare) / spare)
    grid = solution.z[index] + np.linspace(-1.0, 1.0, 61)
    rises = np.array([least(pin) for pin in grid]) - level
    crossings = [
        grid[i] - rises[i] * (grid[i + 1] - grid[i]) / (rises[i + 1] - rises[i])
        for i in np.flatnonzero(np.diff(np.sign(rises)))
    ]
    prior = posterior.model.space.free[index].prior
    expected = [float(prior.constrain(jnp.asarray(z))) for z in crossings]
    estimate = solution.estimates["free_angle_c"]
    assert (estimate.lower, estimate.upper) == pytest.approx(expected, abs=0.02 * estimate.standard_error)
    skew = (estimate.upper - estimate.value) / (estimate.value - estimate.lower)
    assert abs(skew - 1) > 0.01  # else the test would not tell a profile from standard errors


def _profiled(regression: Problem, index: int) -> tuple[float, float, float, float]:
    """Certified value and standard deviation of a parameter, and the limits of its interval."""
    evaluate, best = regression.evaluate(), regression.certified
    center, error = float(best[index]), float(regression.standard_deviation[index])
    remaining = np.delete(np.arange(len(best)), index)
    spare = len(regression.y) - len(best)

    def rise(scaled: float) -> float:  # the search is made for numbers of the order of 1
        def pinned(part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            b = best.copy()
            b[index], b[remaining] = center + error * scaled, part
            residuals, jacobian = evaluate(b)
            return residuals, jacobian[:, remaining]

        return minimize(pinned, best[remaining]).sum_of_squares - regression.residual_sum_of_squares

    low, high = find_interval_ends(rise, 0.0, 1.0, regression.residual_sum_of_squares / spare, float(spare))
    return center, error, center + error * low, center + error * high


@pytest.mark.parametrize(("name", "index"), [("misra1c", 0), ("danwood", 1), ("eckerle4", 0), ("gauss1", 3)])
def test_of_nearly_linear_certified_problems_the_interval_is_t_certified_standard_deviations(name, index):
    regression = problem(name)
    center, error, low, high = _profiled(regression, index)
    t = stats.t.ppf(0.95, len(regression.y) - len(regression.certified))
    assert ((center - low) / error, (high - center) / error) == pytest.approx((t, t), rel=0.03)


def test_of_a_strongly_curved_certified_problem_the_interval_is_lopsided():
    regression = problem("boxbod")
    center, error, low, high = _profiled(regression, 1)
    t = stats.t.ppf(0.95, 4)
    assert high - center > 1.3 * t * error
    assert center - low < 0.9 * t * error


def test_standard_errors_by_qr_are_those_of_the_normal_equations_where_these_are_sound():
    jacobian = np.random.default_rng(5).standard_normal((12, 3)) * np.array([1.0, 1e-5, 1e6])
    _, root = orthogonalize(jacobian)
    size = np.array([1.0, 1e-5, 1e6])
    exact = np.linalg.inv((jacobian / size).T @ (jacobian / size)) / np.outer(size, size)
    np.testing.assert_allclose(root @ root.T, exact, rtol=1e-10)


def test_degrees_of_freedom_follow_what_decides():
    assert satterthwaite_freedom(np.array([1.0, 0.0]), np.array([3.0, 50.0])) == pytest.approx(3.0)
    assert satterthwaite_freedom(np.array([1.0, 1.0]), np.array([6.0, 6.0])) == pytest.approx(12.0)
    assert satterthwaite_freedom(np.array([1.0]), np.array([np.inf])) > 1e8  # a scatter that is known, not estimated
    assert satterthwaite_freedom(np.array([1.0]), np.array([0.6])) == 1.0


# Bounds and open ends ---------------------------------------------------------------------------------------------


def test_an_interval_is_open_where_the_sum_of_squares_stops_rising():
    low, high = find_interval_ends(lambda z: z**2 if z < 0 else 1.5 * np.tanh(z) ** 2, 0.0, 1.0, 1.0, 1e9)
    assert low == pytest.approx(-stats.norm.ppf(0.95), abs=1e-3)
    assert high == np.inf


def test_an_interval_is_open_where_the_model_cannot_be_computed():
    low, high = find_interval_ends(lambda z: z**2 if z < 1.0 else float("nan"), 0.0, 1.0, 1.0, 1e9)
    assert np.isfinite(low) and high == np.inf


def test_where_the_model_cannot_be_computed_short_of_the_limit_the_interval_is_the_wider_one():
    low, high = find_interval_ends(lambda z: float("nan") if 1.6 < z < 1.7 else z**2, 0.0, 1.0, 1.0, 1e9)
    assert -low == pytest.approx(stats.norm.ppf(0.95), abs=1e-3)
    assert stats.norm.ppf(0.95) < high <= 1.71


def test_a_limit_just_beyond_a_step_or_far_beyond_a_flat_stretch_is_found():
    """A first step that falls short by any little must not leave steps too small to get on with."""
    quantile = stats.norm.ppf(0.95)
    for short in 10.0 ** -np.arange(1, 14):
        _, high = find_interval_ends(lambda z, s=short: z**2 * (1 - s) ** 2, 0.0, 1.0, 1.0, 1e9)
        assert high == pytest.approx(quantile / (1 - short), rel=1e-3)
        flat = (quantile * (1 - short)) ** 2  # where it stays from the first step to 20, and then rises
        _, high = find_interval_ends(lambda z, f=flat: max(min(z**2, f), (z - 20.0) ** 3), 0.0, 1.0, 1.0, 1e9)
        near = quantile if short < 3e-4 else 20.0 + quantile ** (2 / 3)  # within the precision of a limit, or not
        assert near - 0.01 < high < 20.0 + quantile ** (2 / 3) + 0.01


@pytest.mark.parametrize(("bend", "most"), [(0.0, 2), (0.02, 6), (0.1, 8)])
def test_an_interval_takes_few_solves(bend, most):
    """One a side where the rise is a parabola and the error is that of it, four where it is about one."""
    request, quantile = set(), stats.norm.ppf(0.95)

    def rise(z):
        request.add(z)
        return (z / 0.1) ** 2 * (1 + bend * z / 0.1)

    low, high = find_interval_ends(rise, 0.0, 0.1, 1.0, 1e9)
    assert [rise(low), rise(high)] == pytest.approx([quantile**2] * 2, rel=1e-3)
    assert len(request - {0.0, low, high}) + 2 <= most


def test_an_interval_that_reaches_zero_is_cut_off_there():
    angle = np.deg2rad(np.linspace(20.0, 160.0, 8))[:, None]
    loss = 0.006 * angle[:, 0] + 0.02 * np.array([1, -1, 1, 1, -1, -1, 1, -1])
    _, _, solution = fitted(of_rows(loss, angle))
    estimate = solution.estimates["mu1"]
    assert estimate.identified and not estimate.at_bound
    assert estimate.lower == pytest.approx(0.0, abs=1e-9)
    slope = float(angle[:, 0] @ loss / (angle[:, 0] @ angle[:, 0]))
    error = np.sqrt(np.sum((loss - slope * angle[:, 0]) ** 2) / 7 / (angle[:, 0] @ angle[:, 0]))
    assert estimate.upper == pytest.approx(slope + stats.t.ppf(0.95, 7) * error, rel=1e-3)


def test_a_coefficient_at_its_bound_has_an_upper_limit_and_says_so():
    """Its best value would be negative: the limit is where the sum of squares has risen from that at zero."""
    loss, angle = _rows(4, truth=(0.2, 0.0))
    loss = loss - 0.01 * angle[:, 1]
    _, _, solution = fitted(of_rows(loss, angle))
    estimate = solution.estimates["mu2"]
    assert estimate.at_bound and not estimate.identified
    assert "no finite minimum: runs to its lower end, " in estimate.remark and "; at most " in estimate.remark
    assert estimate.lower == pytest.approx(0.0, abs=1e-9)

    def least(mu: float) -> float:
        remainder = loss - mu * angle[:, 1]
        return float(np.sum((remainder - angle[:, 0] * (angle[:, 0] @ remainder) / (angle[:, 0] @ angle[:, 0])) ** 2))

    spare = len(loss) - 1
    level = least(0.0) * (1 + stats.t.ppf(0.95, spare) ** 2 / spare)
    # Of the scatter about the bound one degree of freedom more is spare than the linearized problem with it counts.
    assert estimate.upper == pytest.approx(optimize.brentq(lambda mu: least(mu) - level, 0.0, 1.0), rel=0.1)


@pytest.mark.parametrize("seed", [0, 2, 11])
def test_beside_a_coefficient_at_its_bound_limits_are_those_of_non_negative_least_squares(seed):
    """It leaves its bound where another is moved, and the limits of the others lie far from where they are with it there."""
    rng = np.random.default_rng(seed)
    angle = np.deg2rad(rng.uniform(20.0, 160.0, (12, 3)))
    angle[:, 0] = (angle[:, 0] + angle[:, 1]) / 2
    angle[:, 2] = angle[:, 1] + np.deg2rad(rng.uniform(-8.0, 8.0, 12))
    loss = angle @ np.array([0.15, 0.01, 0.1]) + 0.01 * rng.standard_normal(12)
    estimates = fitted(of_rows(loss, angle))[2].estimates
    mu, remainder = optimize.nnls(angle, loss)
    assert mu[1] == 0.0 and estimates["mu2"].at_bound
    level = remainder**2 * (1 + stats.t.ppf(0.95, 10) ** 2 / 10)
    for k in (0, 2):
        remaining = np.delete(angle, k, axis=1)

        def above(pin, k=k, remaining=remaining):
            return optimize.nnls(remaining, loss - pin * angle[:, k])[1] ** 2 - level

        estimate, limits = estimates[f"mu{k + 1}"], [optimize.brentq(above, mu[k], end) for end in (0.0, 1.0)]
        assert estimate.value == pytest.approx(mu[k], rel=1e-6)
        assert (estimate.lower, estimate.upper) == pytest.approx(limits, abs=2e-3 * estimate.standard_error)


def test_data_without_scatter_give_no_interval_wider_than_rounding():
    loss, angle = _rows(2)
    _, _, solution = fitted(of_rows(angle @ np.array([0.15, 0.1]), angle))
    assert solution.converged  # rounding leads nowhere
    estimate = solution.estimates["mu1"]
    assert estimate.lower == pytest.approx(0.15, rel=1e-6) and estimate.upper == pytest.approx(0.15, rel=1e-6)


def test_a_fixed_parameter_and_an_undetermined_one_have_no_interval():
    loss, angle = _rows(1)
    _, _, solution = fitted(of_rows(loss, np.column_stack([angle[:, 0], angle[:, 0]])))
    assert all(np.isnan(solution.estimates[name].lower) for name in ("mu1", "mu2"))
    _, _, solution = fitted(of_rows(loss, angle, friction={"mu1": {"fixed": 0.15}}))
    assert np.isnan(solution.estimates["mu1"].upper) and np.isfinite(solution.estimates["mu2"].upper)


# Profiles for figures ---------------------------------------------------------------------------------------------


def test_a_profile_is_a_parabola_of_a_linear_model():
    loss, angle = _rows(1)
    posterior, objective, solution = fitted(of_rows(loss, angle))
    plain = compute_profile(posterior, objective, "mu1", solution.z, np.linspace(-0.5, 0.5, 9))
    curvature = plain.rise / (plain.values - solution.estimates["mu1"].value) ** 2
    np.testing.assert_allclose(curvature, curvature[0], rtol=1e-5)
    values = [0.12 * np.exp(1.4 * z) for z in np.linspace(-0.5, 0.5, 9)]
    np.testing.assert_allclose(plain.values, values, rtol=1e-9)


def test_the_profile_of_what_readings_do_not_tell_is_flat_until_the_prior_counts():
    loss, angle = _rows(1)
    posterior, objective, solution = fitted(of_rows(loss, np.column_stack([angle[:, 0], 0 * angle[:, 0]])))
    flat = compute_profile(posterior, objective, "mu2", solution.z, [-2.0, 0.0, 2.0])
    np.testing.assert_allclose(flat.rise, 0.0, atol=1e-9)
    informed = compute_profile(posterior, objective, "mu2", solution.z, [-2.0, 0.0, 2.0], with_priors=True)
    np.testing.assert_allclose(informed.rise, [4.0, 0.0, 4.0], atol=1e-6)


# Coverage ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("experiments", [50, pytest.param(200, marks=pytest.mark.slow)])
def test_nine_in_ten_intervals_hold_the_truth(experiments):
    """Of 200 experiments of 6 rows 180 intervals of a coefficient hold it on average, sd 4.2; false alarm once in 4000 seeds.

    Of 50 it is 45, sd 2.1; of either coefficient fewer than 37 hold it once in 1700 seeds, and more than 50 cannot.
    """
    truth, hits, objective, space = (0.15, 0.1), np.zeros(2), None, None
    for seed in range(experiments):
        loss, angle = _rows(seed, n=6, truth=truth)
        posterior = LogDensity(build_model(of_rows(loss, angle)))
        space = space or posterior.model.space
        posterior = LogDensity(replace(posterior.model, space=space))
        objective = objective or make_objective(posterior)
        solution = fit_least_squares(posterior, objective, np.zeros(space.size))
        ends = [(solution.estimates[name].lower, solution.estimates[name].upper) for name in ("mu1", "mu2")]
        hits += [low <= value <= high for (low, high), value in zip(ends, truth, strict=True)]
    assert np.all(np.abs(hits - 0.9 * experiments) < 3.8 * np.sqrt(experiments * 0.9 * 0.1))


def test_a_coefficient_at_the_upper_limit_of_its_prior_has_a_lower_limit_and_says_so():
    """The truth, 0.15, lies beyond the uniform prior's 0.12: the limit is where the sum has risen from that at 0.12."""
    loss, angle = _rows(6, truth=(0.15,))
    _, _, solution = fitted(of_rows(loss, angle, friction={"mu1": {"prior": {"uniform": {"low": 0.01, "high": 0.12}}}}))
    estimate = solution.estimates["mu1"]
    assert estimate.at_bound and not estimate.identified
    assert "runs to its upper end, 0.12" in estimate.remark
    assert estimate.upper == pytest.approx(0.12, rel=1e-6)
    assert 0.01 < estimate.lower < 0.12


def test_a_limit_is_found_to_its_tolerance_between_any_two_points_and_on_plateaus():
    rng = np.random.default_rng(1)
    for power in (0.3, 0.5, 1.0, 2.0, 5.0):
        for level in rng.uniform(0.01, 0.99, 40):
            computed = find_crossing(lambda x, p=power, r=level: np.copysign(abs(abs(x) - r) ** p, abs(x) - r), 0.0, -1.0, 1e-3)
            assert computed == pytest.approx(-level, abs=1e-3)
            assert find_crossing(lambda x, r=level: 1e150 if x > r else -1.0, 0.0, 1.0, 1e-3) == pytest.approx(level, abs=1e-3)


def test_a_limit_is_looked_for_between_its_points_even_where_these_are_nearer_than_the_tolerance():
    requests = []
    computed = find_crossing(lambda x: requests.append(x) or x - 37.99995, 37.9999, 38.0, 1e-2)
    assert all(37.9999 <= x <= 38.0 for x in (computed, *requests))
