"""The solver that is composed of optimistix's parts, by itself and stepped from outside."""

import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
import pytest
from cables import cable, measured
from strd import digits_alike, problem

from bowdenfit.inference import levenberg_marquardt, solver
from bowdenfit.inference.least_squares import fit_least_squares
from bowdenfit.inference.levenberg_marquardt import LevenbergMarquardt, RadiusSearch, ScaledDescent
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.inference.solver import minimize
from bowdenfit.kinds.term import round_up_count
from bowdenfit.models import build_model


def _counted(evaluate):
    calls = []
    return calls, lambda x: calls.append(x) or evaluate(x)


def _of_itself(arguments, start, steps: int):
    """What optimistix's own loop finds, with the model in the program, of as many rows as are stepped from outside.

    Rows of zeros change nothing but the rounding of singular values, which hundreds of steps along a bent valley add up.
    """
    method, none = LevenbergMarquardt(1e-14, 1e-13, 0.3), jnp.zeros(round_up_count(len(arguments.y)) - len(arguments.y))

    def residuals(b, _):
        return jnp.concatenate([arguments.model(b, arguments.x) - arguments.y, none])

    return optx.least_squares(residuals, method, jnp.asarray(start), max_steps=steps, throw=False)


def test_of_three_decays_from_afar_the_solver_finds_the_certified_minimum_with_no_other_start():
    regression = problem("mgh17")
    calls, evaluate = _counted(regression.evaluate())
    solution = minimize(evaluate, regression.starts[0])
    assert solution.succeeded
    assert digits_alike(solution.x, regression.certified) > 8
    assert len(calls) < 500
    assert sum(np.array_equal(x, regression.starts[0]) for x in calls) == 1


@pytest.mark.extended
@pytest.mark.parametrize("name", ["mgh17", "hahn1", "misra1a"])
def test_stepped_from_outside_it_takes_the_steps_of_optimistix_s_own_loop(name, monkeypatch):
    regression = problem(name)
    monkeypatch.setattr(solver, "_MOST_POLISHING", 0)
    calls, evaluate = _counted(regression.evaluate())
    solution = minimize(evaluate, regression.starts[0])
    alone = _of_itself(regression, regression.starts[0], 1000)
    assert alone.result == optx.RESULTS.successful
    assert abs(int(alone.stats["num_steps"]) - len(calls)) <= 3  # rounding may put off the end
    # Both end where the sum of squares changes by 1e-14 of itself, and so within some 5e-7 standard errors of the minimum.
    np.testing.assert_array_less(np.abs(solution.x - alone.value), 1e-6 * regression.standard_deviation)


def test_without_enough_steps_it_does_not_claim_an_end():
    regression = problem("mgh17")
    assert _of_itself(regression, regression.starts[0], 20).result != optx.RESULTS.successful


@pytest.mark.extended
def test_a_fit_whose_solver_did_not_end_says_so(monkeypatch):
    posterior = LogDensity(build_model(measured(cable(2, ("angles", "efficiencies")), seed=1)[0]))
    objective, start = make_objective(posterior), np.zeros(posterior.model.space.size)
    assert fit_least_squares(posterior, objective, start, intervals=False).message == ""
    monkeypatch.setattr(solver, "_MOST_POLISHING", 0)

    def one_evaluation(*request):
        return objective(*request[:-1], request[-1]._replace(evaluations=1))

    solution = fit_least_squares(posterior, one_evaluation, start, intervals=False)
    assert not solution.converged
    assert "stopped before it met its tolerance" in solution.message


@pytest.mark.parametrize("start", [[5.0, -3.0], [-40.0, 8.0], [0.0, 0.0]])
def test_where_residuals_have_a_kink_the_solver_ends_on_it(start):
    def evaluate(x):
        side = np.sign(x[0] - 0.3)
        return np.array([1 + 2 * abs(x[0] - 0.3), x[0] + x[1], x[1] - 1]), np.array([[2 * side, 0], [1, 1], [0, 1.0]])

    solution = minimize(evaluate, np.array(start))
    assert solution.x[0] == pytest.approx(0.3, abs=1e-9)
    assert solution.sum_of_squares < 1.02 * 1.845  # along the kink no tangent leads to its minimum, 1.845


def test_a_parameter_without_influence_stays_where_it_is_and_disturbs_nothing():
    regression = problem("hahn1")
    evaluate = regression.evaluate()

    def wider(x):
        residuals, jacobian = evaluate(np.delete(x, 3))
        return residuals, np.insert(jacobian, 3, 0.0, axis=1)

    solution = minimize(wider, np.insert(regression.starts[1], 3, 17.0))
    assert solution.succeeded and solution.x[3] == 17.0
    np.testing.assert_allclose(np.delete(solution.x, 3), minimize(evaluate, regression.starts[1]).x, rtol=1e-7)


def _tangent(jacobian: np.ndarray, residuals: np.ndarray):
    """The descent, and its state at a point with this Jacobian and these residuals."""
    descent = ScaledDescent()
    points = jnp.zeros(jacobian.shape[1])
    info = optx.FunctionInfo.ResidualJac(jnp.asarray(residuals), lx.MatrixLinearOperator(jnp.asarray(jacobian)))
    return descent, descent.query(points, info, descent.init(points, info))


def test_a_long_radius_gives_the_gauss_newton_step_and_a_short_one_a_scaled_step_of_that_length():
    rng = np.random.default_rng(3)
    size = np.array([1.0, 1e-6, 1e5, 30.0])
    jacobian, residuals = rng.standard_normal((12, 4)) * size, rng.standard_normal(12)
    descent, state = _tangent(jacobian, residuals)
    whole = -np.linalg.lstsq(jacobian / size, residuals, rcond=None)[0] / size
    np.testing.assert_allclose(descent.step(jnp.asarray(1e9), state)[0], whole, rtol=1e-9)
    lengths = np.linalg.norm(jacobian, axis=0)
    for share in (0.5, 1e-2, 1e-5):
        radius = share * float(np.linalg.norm(lengths * whole))
        step = np.asarray(descent.step(jnp.asarray(radius), state)[0])
        assert np.linalg.norm(lengths * step) == pytest.approx(radius, rel=1e-6)
    steepest = -(jacobian / lengths).T @ residuals  # where a short step heads, with each column of length 1
    assert lengths * step @ steepest == pytest.approx(radius * np.linalg.norm(steepest), rel=1e-6)


def test_the_search_goes_where_the_sum_of_squares_falls_as_predicted_and_back_where_it_does_not():
    def info(residuals):
        return optx.FunctionInfo.ResidualJac(jnp.asarray(residuals), lx.MatrixLinearOperator(jnp.eye(2)))

    search = RadiusSearch(1.0)
    zero, initial = jnp.zeros(2), info([1.0, 1.0])
    _, accepted, _, state = search.step(jnp.asarray(True), zero, zero, initial, initial, search.init(zero, initial))
    assert bool(accepted) and float(state.radius) == 1.0
    there = jnp.array([-0.7, -0.7])
    longer, good, *_ = search.step(jnp.asarray(False), zero, there, initial, info([0.3, 0.3]), state)
    shorter, bad, *_ = search.step(jnp.asarray(False), zero, there, initial, info([9.0, 9.0]), state)
    lost, nowhere, *_ = search.step(jnp.asarray(False), zero, there, initial, info([1e100, 1e100]), state)
    assert bool(good) and float(longer) > 1.0
    assert not bool(bad) and not bool(nowhere)
    assert float(lost) <= float(shorter) < 1.0


def test_tables_that_differ_by_a_few_rows_are_stepped_by_one_program():
    """The certified minima above are those of such tables: the 33 rows of mgh17 are stepped as 40."""
    rows, initial = 33, levenberg_marquardt._compile_step.cache_info().misses
    assert round_up_count(rows) == 40
    for count in range(rows, 41):
        levenberg_marquardt.compile_stepper(count, 2)
    assert levenberg_marquardt._compile_step.cache_info().misses <= initial + 1
