"""Least squares of the residuals of the likelihood: classical estimates, and the start of the samplers.

Without priors the estimates are those of a published curve fit; a parameter that runs to an end of its range, or does not
affect any residual, is reported as not identified. With priors (z itself as further residuals) the solution is the maximum of
the posterior with noise scales at their prior medians.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.display import Display, Rows
from bowdenfit.errors import ConvergenceError, UsageError, suggest_name
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.disagreement import Disagreement, find_disagreements
from bowdenfit.inference.interval import NORMAL_90
from bowdenfit.inference.lack_of_fit import Departure, FarReading, find_departures
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.minimum import PINS, LocalMinimum, find_lowest_minimum, find_rivals, range_of_minima
from bowdenfit.inference.objective import Objective, Problem, Solution, noise_scales, sum_of_squares, total_squares
from bowdenfit.inference.profiles import UNKNOWN_LIMITS, ProfileIntervals
from bowdenfit.inference.scalar_priors import FARTHEST, clipped_z, value_at, z_at
from bowdenfit.inference.solver import ROUGH
from bowdenfit.parameters.priors import LogNormal
from bowdenfit.parameters.space import Parameter, ParameterSpace
from bowdenfit.words import shown, significant

UNDETERMINED = "the measurements do not determine it"
KINKED = "no profile interval, since the solver is stuck at kinks of the sum of squares on the way to its ends"


@dataclass(frozen=True)
class Estimate:
    """Least-squares estimate of one parameter, in its shown unit.

    Args:
        value: Estimate; NaN where not identified.
        standard_error: Standard error from the Jacobian; NaN where not identified.
        identified: Whether the data identify it.
        remark: Why it is not identified, that it is fixed, or why it has no interval; empty otherwise.
        lower, upper: 90 % profile interval, cut off at the ends of the parameter's range; infinite where there is no limit, NaN
            where it was not computed.
        at_bound: Whether the sum of squares falls all the way to an end of its range.
    """

    value: float
    standard_error: float
    identified: bool
    remark: str = ""
    lower: float = float("nan")
    upper: float = float("nan")
    at_bound: bool = False

    JSON: ClassVar = (..., "open")

    @property
    def open(self) -> list[str]:
        """The sides on which there is no limit."""
        return [side for side in ("lower", "upper") if np.isinf(getattr(self, side))]

    @property
    def reach(self) -> float:
        """Half of the 90 % interval; that of a normal distribution where the interval was not computed or has no end."""
        half = (self.upper - self.lower) / 2
        return half if np.isfinite(half) else NORMAL_90 * self.standard_error


@dataclass(frozen=True, repr=False)
class LeastSquares(Display):
    """Classical least squares, without priors but those of the weights of departures.

    Args:
        estimates: Estimates by parameter name; noise scales are not among them.
        residual_sd: Standard deviation of the residuals by table, in the shown unit of the table's noise scale; NaN
            without degrees of freedom.
        readings: Expected readings of each table at the solution, in the table's unit.
        condition_number: Condition number of the Jacobian with columns in units of the prior's standard deviation; infinite
            where a direction is undetermined. Parameters that ran to an end of their range do not count.
        sum_of_squares: Sum of squares of the standardized residuals.
        z: Solution in z (noise scales at their prior medians).
        converged: Whether the solver met its tolerance.
        message: Why it did not; empty if it did.
        disagreements: How well each table agrees with everything else; empty for a single table.
        departures: How residuals depend on where the readings were taken, the smallest p-value first.
        far_readings: Outliers, the farthest first.
        units: Units of the estimates.
    """

    estimates: dict[str, Estimate]
    residual_sd: dict[str, float]
    readings: dict[str, np.ndarray]
    condition_number: float
    sum_of_squares: float
    z: np.ndarray
    converged: bool
    message: str
    disagreements: tuple[Disagreement, ...] = ()
    departures: tuple[Departure, ...] = ()
    far_readings: tuple[FarReading, ...] = ()
    units: dict[str, str] | None = None

    def sentences(self) -> list[str]:
        """How many parameters are identified."""
        identified = [name for name, estimate in self.estimates.items() if estimate.identified]
        sentence = f"Least squares determine {len(identified)} of {len(self.estimates)} parameters"
        return [f"{sentence}." if self.converged else f"{sentence}, but did not converge: {self.message}."]

    def _table(self) -> Rows:
        shown = ("value", "standard_error", "lower", "upper", "remark")
        return [
            {"parameter": n} | {key: vars(e)[key] for key in shown} for n, e in self.estimates.items()
        ], self.units or {}


@dataclass(frozen=True)
class MaximumPosterior:
    """Start of the samplers: maximum of the posterior at given noise scales, and its Gauss-Newton covariance in z."""

    z: np.ndarray
    covariance: np.ndarray


def find_maximum_posterior(
    posterior: LogDensity, objective: Objective, start: np.ndarray | None = None
) -> MaximumPosterior:
    """Find the maximum of the posterior with noise scales at their prior medians, from every start that a parameter names.

    Args:
        posterior: The posterior.
        objective: Its compiled objective.
        start: One more z to start from; see `read_start`.

    Raises:
        ConvergenceError: The residuals are not finite at the start.
    """
    n = posterior.model.space.size
    problem = Problem(posterior, objective, with_priors=True)
    starts = [*product(*map(_starting_z, posterior.model.space.free)), *([] if start is None else [start])]
    solution = min((problem.solve(np.array(start)) for start in starts), key=_squares_with_priors)
    if not all(np.all(np.isfinite(r)) for r in solution["residuals"].values()):
        raise ConvergenceError(
            "the model cannot be computed at the prior medians; the usual cause is a prior or a fixed value that is "
            "orders of magnitude off: check the units under [friction] and [prior]."
        )
    # The prior of each z has unit information; a noise scale gets that alone, its residuals say nothing here.
    information = solution["jacobian"].T @ solution["jacobian"] + np.eye(n)
    return MaximumPosterior(solution["z"], np.linalg.inv(information))


def read_start(space: ParameterSpace, values: Mapping[str, float]) -> np.ndarray | None:
    """Return z at which some parameters have stated values, and all others their first start; None where none is stated.

    Args:
        space: The parameters.
        values: Values by name, in the units in which they are shown.

    Raises:
        UsageError: There is no such parameter that is searched for, or it can never have that value.
    """
    z = np.array([_starting_z(parameter)[0] for parameter in space.free])
    for name, value in values.items():
        if name not in space.index:
            fault = "is fixed" if name in {p.name for p in space.fixed} else "is not a parameter of this fit"
            raise UsageError(f"start: {shown(name)} {fault}{suggest_name(name, list(space.index))}")
        parameter = space.free[space.index[name]]
        if parameter.role == "noise":
            raise UsageError(f"start: {name} is the size of the noise, which the search holds; leave it out.")
        z_value = z_at(parameter.prior, value / parameter.shown_scale)
        if not abs(z_value) <= FARTHEST:
            low, high = (value_at(parameter.prior, end) * parameter.shown_scale for end in (-FARTHEST, FARTHEST))
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            raise UsageError(
                f"start: {name} = {value:g}{unit} is outside of what its prior ({parameter.prior_text}) allows, "
                f"{low:.3g} to {high:.3g}{unit}; start from a value in between, or state another prior."
            )
        z[space.index[name]] = z_value
    return z if values else None


def _starting_z(parameter: Parameter) -> tuple[float, ...]:
    if np.isnan(parameter.first_look):
        return parameter.starts
    return (*parameter.starts, clipped_z(parameter.prior, parameter.first_look))


def _squares_with_priors(solution: Solution) -> float:
    squares = total_squares(solution)
    return squares if np.isfinite(squares) else float("inf")


def fit_least_squares(
    posterior: LogDensity, objective: Objective, start: np.ndarray, intervals: bool = True
) -> LeastSquares:
    """Fit by least squares, from the maximum of the posterior; weights of departures keep their priors.

    The relative weights of the tables are the prior medians of the noise scales, or the scatter of single readings where runs
    consist of such. The standard errors use the scatter of the residuals (sandwich form), table by table; a force table
    scatters between its runs and within them.

    Args:
        posterior: The posterior.
        objective: Its compiled objective.
        start: z to start from.
        intervals: Whether to compute the profile intervals, which take some twenty solves a parameter.
    """
    minimum, profiled = find_lowest_minimum(Problem(posterior, objective), start, intervals)
    basin, solution, space, terms = minimum.basin, minimum.basin.solution, posterior.model.space, posterior.model.terms
    others = _solve_pinned_elsewhere(basin.problem, start)
    rivals = find_rivals(solution, others, minimum.scale, minimum.linearized.readings.shape[1])
    estimates = _make_estimates(minimum, rivals, profiled.limits)
    message = _describe_failure(solution, profiled)
    shown = {p.name: v * p.shown_scale for p, v in zip(space.free, solution["values"], strict=True)}
    shown |= {p.name: (p.fixed or 0.0) * p.shown_scale for p in space.fixed}
    return LeastSquares(
        estimates | {p.name: Estimate(shown[p.name], np.nan, True, "fixed") for p in space.fixed},
        {t.name: minimum.residual_sd[t.name] * float(shown[t.noise]) for t in terms},
        solution["readings"],
        minimum.linearized.condition_number,
        sum_of_squares(solution),
        solution["z"],
        not message,
        message,
        find_disagreements(terms, space.free, solution),
        *find_departures(
            basin, minimum.scale, {name: estimate.reach for name, estimate in estimates.items() if estimate.identified}
        ),
        units={p.name: p.unit for p in space.parameters},
    )


def _describe_failure(solution: Solution, profiled: ProfileIntervals) -> str:
    """Say why the solver has found no minimum; empty where it has."""
    if not solution["succeeded"]:
        return "the solver stopped before it met its tolerance"
    if profiled.stuck:
        return "the solver is stuck at a kink of the sum of squares, which may be far lower elsewhere; sampling gets past kinks"
    return "" if profiled.lower is None else "every minimum that was found led to a lower one; sampling needs none"


def _solve_pinned_elsewhere(problem: Problem, start: np.ndarray) -> list[Solution]:
    """Return solutions with one elastic parameter, or one friction parameter beside it, pinned away from the minimum."""
    parameters = problem.posterior.model.space.free
    roles = ["friction", "elastic"] if any(p.role == "elastic" for p in parameters) else []
    masks = [np.arange(len(start)) == i for i, p in enumerate(parameters) if p.role in roles]
    return [problem.solve(start, mask, np.where(mask, z, 0.0), ROUGH) for mask, z in product(masks, PINS)]


def _make_estimates(
    minimum: LocalMinimum, rivals: Sequence[Solution], profiled: Mapping[str, tuple[float, float]]
) -> dict[str, Estimate]:
    """Return estimates of the free parameters other than noise scales, from standard errors in z and limits."""
    basin, error, determined = minimum.basin, minimum.error, minimum.determined
    solution, estimates = basin.solution, {}
    for i, p in enumerate(basin.parameters):
        if basin.problem.noise[i]:
            continue
        value, limit = float(solution["values"][i] * p.shown_scale), profiled.get(p.name, UNKNOWN_LIMITS)
        sd = float(abs(solution["slope"][i] * error[i]) * p.shown_scale)
        remaining = [float(r["values"][i]) * p.shown_scale for r in rivals]
        if basin.at_end[i]:
            remark = _describe_bound(value, limit, solution["z"][i] > 0)
            estimates[p.name] = Estimate(np.nan, np.nan, False, remark, *limit, at_bound=True)
        elif not determined[i] or (p.role == "elastic" and isinstance(p.prior, LogNormal) and sd > value):
            # A positive quantity that may as well be 0 or twice as large is none that was measured.
            estimates[p.name] = Estimate(np.nan, np.nan, False, UNDETERMINED)
        elif (ends := range_of_minima(value, sd, remaining)) is not None:
            remark = f"values from {significant(ends[0])} to {significant(ends[1])} fit about as well"
            estimates[p.name] = Estimate(np.nan, np.nan, False, remark, *limit)
        else:
            kinked = p.name in profiled and np.isnan(limit[0])
            estimates[p.name] = Estimate(value, sd, True, KINKED if kinked else "", *limit)
    return estimates


def _describe_bound(value: float, limit: tuple[float, float], at_upper_end: bool) -> str:
    """Describe a parameter whose sum of squares falls all the way to an end of its range."""
    lower, upper = limit
    if at_upper_end:
        least = "" if np.isnan(lower) else f"; at least {significant(lower)}"
        return f"no minimum inside its range: runs to its upper end, {significant(value)}{least}"
    most = (
        "" if np.isnan(upper) else "; nothing limits it above" if np.isinf(upper) else f"; at most {significant(upper)}"
    )
    return f"no finite minimum: runs to its lower end, {significant(value)}{most}"


def predict_posterior(posterior: LogDensity, z: np.ndarray) -> MaximumPosterior:
    """Return the posterior that readings without noise would give at true values z, in the Gauss-Newton approximation."""

    def residuals(at: Array, data: Any) -> Array:
        return jnp.concatenate(list(posterior.residuals(at, data).values()))

    jacobian = compile_program(
        jax.jacfwd(residuals), jax.ShapeDtypeStruct(z.shape, jnp.float64), posterior.data, run_once=True
    )
    slopes = np.where(noise_scales(posterior), 0.0, np.asarray(jacobian(z, posterior.data)))
    return MaximumPosterior(z, np.linalg.inv(slopes.T @ slopes + np.eye(len(z))))
