"""The least-squares engine: exact on exact data, right about its errors, and plain about what it cannot know."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cables import CONTACTS, TRUTH, cable, measured, other_design
from scipy import optimize

from bowdenfit.dataset import Dataset
from bowdenfit.inference import solver
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.least_squares import LeastSquares, find_maximum_posterior, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import Objective, make_objective
from bowdenfit.inference.solver import minimize
from bowdenfit.kinds.efficiencies.kind import EfficiencyTable
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.kinds.terms import draw_readings
from bowdenfit.models import build_model
from bowdenfit.questions.simulate.tables import replace_readings


def fitted(dataset: Dataset) -> tuple[LogDensity, LeastSquares]:
    posterior = LogDensity(build_model(dataset))
    objective = make_objective(posterior)
    return posterior, fit_least_squares(posterior, objective, find_maximum_posterior(posterior, objective).z)


@cache
def plain() -> tuple[LogDensity, Objective, LeastSquares]:
    """Three contacts with noise, nothing set by the user."""
    posterior = LogDensity(build_model(measured(cable(3), seed=1, once=True)[0]))
    objective = make_objective(posterior)
    return posterior, objective, fit_least_squares(posterior, objective, np.zeros(posterior.model.space.size))


@pytest.mark.parametrize(("n_contacts", "tables"), [(2, "forces"), (3, "efficiencies"), (4, "forces"), (5, "forces")])
def test_data_without_noise_return_the_truth_to_six_digits(n_contacts, tables):
    dataset, truth = measured(cable(n_contacts, ("angles", tables)), noise=False, once=True)
    posterior, solution = fitted(dataset)
    assert solution.converged
    estimated = {
        p.name: solution.estimates[p.name].value / p.shown_scale for p in posterior.model.space.free if p.role != "noise"
    }
    assert (
        len(estimated) == {2: 2 + 6, 3: 3 + 6, 4: 3 + 9, 5: 4 + 9}[n_contacts]
    )  # two free sheaths share a coefficient
    for name, value in estimated.items():
        assert value == pytest.approx(truth[name], rel=1e-6), name
    assert solution.sum_of_squares < 1e-12


@pytest.mark.extended
def test_scipy_s_trust_region_with_a_jax_jacobian_finds_the_same_minimum():
    posterior, _, solution = plain()
    size = posterior.model.space.size
    free = np.flatnonzero([p.role != "noise" for p in posterior.model.space.free])

    def stacked(part, data):
        z = jnp.zeros(size).at[free].set(part)
        return jnp.concatenate(list(posterior.residuals(z, data).values()))

    start = np.zeros(len(free))
    residuals, jacobian = (
        compile_program(f, start, posterior.data, run_once=True) for f in (stacked, jax.jacfwd(stacked))
    )
    theirs = optimize.least_squares(
        lambda part: np.asarray(residuals(part, posterior.data)),
        start,
        lambda part: np.asarray(jacobian(part, posterior.data)),
        method="trf",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-12,
    )
    assert 2 * theirs.cost == pytest.approx(solution.sum_of_squares, rel=1e-9)
    np.testing.assert_allclose(solution.z[free], theirs.x, atol=1e-5)


def test_the_solution_does_not_depend_on_the_start():
    posterior, objective, solution = plain()
    for seed in range(8):  # the first of them leaps to zero curvature, and must find its way back
        start = np.random.default_rng(seed).standard_normal(posterior.model.space.size)
        again = fit_least_squares(posterior, objective, start, intervals=False)
        for name, estimate in solution.estimates.items():
            assert again.estimates[name].value == pytest.approx(estimate.value, rel=1e-5, abs=1e-6), name
            assert again.estimates[name].standard_error == pytest.approx(estimate.standard_error, rel=1e-4), name


# Standard errors --------------------------------------------------------------------------------------------------


def _experiments(description, n: int) -> Iterator[Dataset]:
    """One cable measured again and again, by one program."""
    dataset, truth = measured(description, noise=False, once=True)
    one_cable, values = build_model(dataset).cable, {name: jnp.asarray(value) for name, value in truth.items()}
    draw = jax.jit(lambda key: draw_readings(one_cable, dataset.measurements, values, key))
    for seed in range(n):
        yield replace_readings(dataset, draw(jax.random.key(seed)))


def _many_fits(description, n: int) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Estimates and standard errors of many simulated data sets, all by the program compiled for the first."""
    space = objective = None
    values, errors = {}, {}
    for dataset in _experiments(description, n):
        model = build_model(dataset)
        # One space for all: its priors follow the first data set's angles, and without priors that is only a scale.
        space = space or model.space
        posterior = LogDensity(replace(model, space=space))
        objective = objective or make_objective(posterior)
        solution = fit_least_squares(posterior, objective, np.zeros(space.size), intervals=False)
        for name, estimate in solution.estimates.items():
            values.setdefault(name, []).append(estimate.value)
            errors.setdefault(name, []).append(estimate.standard_error)
    return tuple({name: np.array(v) for name, v in d.items()} for d in (values, errors))


def _check_standard_errors(tables: tuple[str, ...], n: int, low: float, high: float) -> None:
    values, errors = _many_fits(cable(3, tables), n)
    for name in ("mu_free", "mu_squeezed", "mu_edge", *(f"{k}_angle_{x}" for k in ("free", "squeezed") for x in "abc")):
        identified = np.isfinite(values[name])  # now and then noise sends a coefficient to 0, and the fit says so
        assert identified.mean() > 0.95
        scatter = np.std(values[name][identified])
        predicted_sd = np.sqrt(np.mean(errors[name][identified] ** 2))
        assert low < predicted_sd / scatter < high, name
        assert abs(np.mean(values[name][identified]) - TRUTH[name]) < (4.5 / np.sqrt(n) + 0.1) * scatter, name


@pytest.mark.slow
@pytest.mark.extended
@pytest.mark.parametrize(
    "tables",
    [("angles", "efficiencies"), pytest.param(("angles", "forces"), marks=pytest.mark.slow)],
    ids=["efficiencies", "forces"],
)
def test_standard_errors_are_what_many_experiments_scatter_by(tables):
    """150 experiments: stated over true error is known to 7 %, and is 1.0 to 1.1; outside 0.8 to 1.4 once in 5000 seeds."""
    _check_standard_errors(tables, 150, 0.8, 1.4)


@pytest.mark.slow
@pytest.mark.parametrize("tables", [("angles", "efficiencies"), ("angles", "forces")], ids=lambda x: x[1])
def test_standard_errors_are_what_many_experiments_scatter_by_to_a_tenth(tables):
    """1000 experiments: stated over true error is known to 3 %; the rest is the curvature of the model."""
    _check_standard_errors(tables, 1000, 0.9, 1.2)


@pytest.mark.extended
def test_readings_and_scatter_are_those_of_the_fit():
    """The scatter of an efficiency table is that of its log efficiencies; of an angle table, that of its angles."""
    dataset, _ = measured(cable(2, ("angles", "efficiencies")), seed=1, once=True)
    _, solution = fitted(dataset)
    angles, efficiencies = dataset.measurements.table(AngleTable), dataset.measurements.table(EfficiencyTable)
    loss = np.log(efficiencies.efficiency / solution.readings["efficiency"])
    assert solution.residual_sd["efficiency"] == pytest.approx(np.sqrt(np.sum(loss**2) / (len(loss) - 2)), rel=0.2)
    readings = solution.readings["wrap_angle"].reshape(2, -1).T
    deviation = np.rad2deg(angles.angle) - readings
    assert solution.residual_sd["wrap_angle"] == pytest.approx(
        np.sqrt(np.sum(deviation**2) / (deviation.size - 6)), rel=0.02
    )


# What cannot be known ---------------------------------------------------------------------------------------------


def _constant(name: str, friction: str, angle: float) -> dict:
    return {"name": name, "friction": friction, "wrap_angle": {"value": angle, "unit": "deg"}}


@pytest.mark.extended
def test_two_coefficients_at_constant_angles_are_not_told_apart():
    contacts = [CONTACTS[0], _constant("one edge", "mu_edge", 45), _constant("other edge", "mu_clamp", 70)]
    _, solution = fitted(measured(cable(3, contact=contacts), seed=1, once=True)[0])
    for name in ("mu_edge", "mu_clamp"):
        assert not solution.estimates[name].identified
        assert np.isnan(solution.estimates[name].value) and np.isnan(solution.estimates[name].standard_error)
        assert "do not determine" in solution.estimates[name].remark
    assert solution.estimates["mu_free"].identified
    assert solution.condition_number == np.inf


@pytest.mark.extended
def test_one_coefficient_at_two_constant_angles_is_identified():
    contacts = [CONTACTS[0], _constant("one edge", "mu_edge", 45), _constant("other edge", "mu_edge", 70)]
    _, solution = fitted(measured(cable(3, contact=contacts), seed=1, once=True)[0])
    assert all(estimate.identified for estimate in solution.estimates.values())
    assert np.isfinite(solution.condition_number)


@pytest.mark.extended
def test_a_gain_error_is_not_told_from_a_constant_angle_by_pulling_alone_but_is_by_both_strokes():
    sensors = {"sensors": {"input_gain_error_sd": 0, "output_gain_error_sd": 0.02}}
    description = cable(3, **sensors)
    _, pulling = fitted(measured(description, seed=1, design=other_design(strokes=("pull",)), once=True)[0])
    _, both = fitted(measured(description, seed=1, once=True)[0])
    for name in ("mu_edge", "gain_error"):
        assert not pulling.estimates[name].identified
        assert both.estimates[name].identified


@pytest.mark.extended
def test_a_contact_without_wrap_says_nothing_of_its_coefficient():
    contacts = [CONTACTS[0], CONTACTS[1], _constant("straight", "mu_edge", 0.0)]
    _, solution = fitted(measured(cable(3, contact=contacts), seed=1, once=True)[0])
    assert not solution.estimates["mu_edge"].identified
    assert np.isnan(solution.estimates["mu_edge"].value)
    assert solution.estimates["mu_free"].identified and solution.estimates["mu_squeezed"].identified


def test_a_coefficient_that_would_be_negative_is_not_given_a_number():
    weights = {"tau": 0.02, "sigma_theta": 5.0}  # so that efficiencies count enough for the angles not to give way
    prior = {name: {"prior": {"half_normal": {"sd": sd}}} for name, sd in weights.items()}
    dataset, _ = measured(cable(2, ("angles", "efficiencies"), prior=prior), seed=1, noise=False, once=True)
    table = dataset.measurements.table(
        EfficiencyTable
    )  # all loss grows with the free angle, and falls with the squeezed one
    loss = np.linspace(0.1, 0.9, len(table.route))
    changed = dataset.measurements.with_tables(replace(table, efficiency=np.exp(-loss)))
    _, solution = fitted(replace(dataset, measurements=changed))
    estimate = solution.estimates["mu_squeezed"]
    assert not estimate.identified and np.isnan(estimate.value)
    assert estimate.at_bound and "runs to its lower end" in estimate.remark


@pytest.mark.extended
def test_fixed_parameters_keep_their_value_and_have_no_error():
    description = cable(3, friction={"mu_edge": {"fixed": 0.17}}, prior={"sigma_theta": {"fixed": 2.0}})
    posterior, solution = fitted(measured(description, seed=1, once=True)[0])
    assert solution.estimates["mu_edge"].value == 0.17
    assert np.isnan(solution.estimates["mu_edge"].standard_error)
    assert solution.estimates["mu_edge"].remark == "fixed"
    assert {p.name for p in posterior.model.space.fixed} == {"mu_edge", "sigma_theta"}
    _, _, free = plain()
    assert solution.estimates["mu_free"].standard_error < free.estimates["mu_free"].standard_error


@pytest.mark.extended
def test_a_prior_moves_the_maximum_of_the_posterior_and_not_the_classical_estimate():
    """Least squares is without priors: another one changes the coordinates and nothing else."""
    _, _, without = plain()
    description = cable(3, friction={"mu_free": {"measured": {"value": 0.2, "sd": 0.005}}})
    posterior = LogDensity(build_model(measured(description, seed=1, once=True)[0]))
    objective = make_objective(posterior)
    best = find_maximum_posterior(posterior, objective)
    assert float(jax.jit(posterior.model.space.constrain)(best.z)["mu_free"]) > 0.17
    assert np.all(np.linalg.eigvalsh(best.covariance) > 0)
    assert np.all(np.diag(best.covariance) <= 1 + 1e-9)  # never wider than the prior
    solution = fit_least_squares(posterior, objective, np.zeros(posterior.model.space.size))
    for name, estimate in without.estimates.items():
        if name != "mu_free":  # 23 sd away from its prior, in whose units the data say little
            assert solution.estimates[name].value == pytest.approx(estimate.value, rel=1e-6), name


# The solver -------------------------------------------------------------------------------------------------------


def _exponential(x: np.ndarray, y: np.ndarray):
    """Residuals and Jacobian of a exp(b x)."""

    def evaluate(p):
        grown = np.exp(p[1] * x)
        return p[0] * grown - y, np.column_stack([grown, p[0] * x * grown])

    return evaluate


def test_the_solver_finds_an_exact_minimum_to_the_last_digits():
    x = np.linspace(0.0, 2.0, 9)
    solution = minimize(_exponential(x, 3.0 * np.exp(0.7 * x)), np.array([1.0, 0.0]))
    assert solution.succeeded
    np.testing.assert_allclose(solution.x, [3.0, 0.7], rtol=1e-14)


def test_the_solver_avoids_where_residuals_cannot_be_computed():
    """The square root of what is left of 0 is not a number; the first step from far out would go there."""

    def evaluate(p):
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.array([np.sqrt(p[0]) - 0.1, 0.01 * (p[0] - 1.0)]), np.array([[0.5 / np.sqrt(p[0])], [0.01]])

    solution = minimize(evaluate, np.array([25.0]))
    assert solution.succeeded and 0.0 < solution.x[0] < 0.1


def test_the_solver_says_that_residuals_at_the_start_are_not_numbers():
    solution = minimize(lambda p: (np.full(2, np.nan), np.zeros((2, 1))), np.array([1.0]))
    assert not solution.succeeded


def test_the_solver_leaves_what_has_no_parameters_alone():
    solution = minimize(lambda p: (np.array([3.0, 4.0]), np.zeros((2, 0))), np.zeros(0))
    assert solution.succeeded and solution.sum_of_squares == 25.0


@pytest.mark.parametrize(("precision", "digits"), [(solver.QUICK, 8), (solver.ROUGH, 5)])
def test_a_quick_solve_has_its_digits_of_the_sum_of_squares_with_fewer_evaluations(precision, digits):
    x, rng = np.linspace(0.0, 2.0, 30), np.random.default_rng(1)
    y = 3.0 * np.exp(0.7 * x) + 0.2 * rng.standard_normal(30)
    counts, sums = [], []
    for request in (solver.PRECISE, precision):
        calls = []
        evaluate = _exponential(x, y)
        solution = minimize(lambda p, history=calls, f=evaluate: history.append(p) or f(p), np.array([1.0, 0.0]), request)
        counts.append(len(calls))
        sums.append(solution.sum_of_squares)
    assert sums[1] == pytest.approx(sums[0], rel=10.0**-digits)
    assert counts[1] < counts[0]


def test_the_solver_says_when_it_did_not_get_there():
    x, two = np.linspace(0.0, 2.0, 9), solver.PRECISE._replace(evaluations=2)
    assert not minimize(_exponential(x, 3.0 * np.exp(5.0 * x)), np.array([1.0, -3.0]), two).succeeded
