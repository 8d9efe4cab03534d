"""Least squares of the residuals that the likelihood is made of: classical estimates, and the sampler's start.

Without priors the estimates are those a published curve fit gives; what runs to an end of its range, or has no influence
on any residual, is reported as not identified. With priors (z itself as further residuals) they are the maximum of the
posterior at the noise scales' prior medians.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.errors import ConvergenceError
from bowdenfit.inference.departure import Departure, FarReading
from bowdenfit.inference.disagreement import Disagreement, disagreements
from bowdenfit.inference.interval import NORMAL_90
from bowdenfit.inference.lack_of_fit import departures
from bowdenfit.inference.linearized import linearize, scatter_about
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import LOWER_END, Objective, Problem, Solution, may_end, sum_of_squares
from bowdenfit.inference.other_minima import PINS, fitting_as_well, range_of_minima
from bowdenfit.inference.prior_numbers import z_at
from bowdenfit.inference.profiles import Basin, limits
from bowdenfit.inference.solver import ROUGH
from bowdenfit.parameters.priors import HalfCauchy, LogNormal, Uniform
from bowdenfit.parameters.space import Parameter
from bowdenfit.words import significant

UNDETERMINED = "the measurements do not determine it"
_SUSPECT = -2.0  # below this z an estimate may be on its way to the lower end, above its negative to the upper
_FARTHEST = 6.0  # z of a noise scale
_UNKNOWN = (float("nan"), float("nan"))
_FAR = 50.0  # standard error in units of the prior's sd beyond which data say nothing of a parameter


@dataclass(frozen=True)
class Estimate:
    """Least-squares estimate of one parameter, in its shown unit.

    Args:
        value: Estimate; NaN where not identified.
        standard_error: From the Jacobian; NaN where not identified.
        identified: Whether the data determine it.
        remark: Why not, or that it is fixed; empty otherwise.
        lower, upper: 90 % interval by the profile of the sum of squares, cut off at the ends of the parameter's range;
            infinite where nothing limits it, NaN where it was not computed.
        at_bound: Whether the sum of squares falls all the way to the lower end of its range.
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
        """The sides on which nothing limits it."""
        return [side for side in ("lower", "upper") if np.isinf(getattr(self, side))]

    @property
    def reach(self) -> float:
        """Half of the 90 % interval; that of a normal distribution where the interval was not computed or has no end."""
        half = (self.upper - self.lower) / 2
        return half if np.isfinite(half) else NORMAL_90 * self.standard_error


@dataclass(frozen=True, repr=False)
class LeastSquares(Display):
    """Classical least squares without priors.

    Args:
        estimates: By parameter name; noise scales are not among them.
        residual_sd: Standard deviation of the residuals by table, in the shown unit of the table's noise scale; NaN
            without degrees of freedom.
        readings: Expected readings of each table at the solution, in the table's unit.
        condition_number: Of the Jacobian with columns in units of the prior's sd; infinite where the measurements leave
            a direction undetermined. Parameters that ran to an end of their range do not count.
        sum_of_squares: Of the standardized residuals.
        z: Solution in z (noise scales at their prior median).
        converged: Whether the solver met its tolerance.
        message: What it said.
        disagreements: How well each table agrees with everything else; empty of one table alone.
        departures: How residuals depend on where the readings were taken, the least likely by chance first.
        far_readings: Single readings farther out than chance puts one, the farthest first.
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
        """How many estimates there are."""
        told = [name for name, estimate in self.estimates.items() if estimate.identified]
        said = f"Least squares tell {len(told)} of {len(self.estimates)} parameters"
        return [f"{said}." if self.converged else f"{said}, but did not converge: {self.message}."]

    def _table(self) -> Rows:
        shown = ("value", "standard_error", "lower", "upper", "remark")
        return [{"parameter": n} | {key: vars(e)[key] for key in shown} for n, e in self.estimates.items()], self.units or {}


@dataclass(frozen=True)
class MaximumPosterior:
    """Where the samplers start: maximum of the posterior at given noise scales, and its Gauss-Newton covariance in z."""

    z: np.ndarray
    covariance: np.ndarray


def maximum_posterior(posterior: LogDensity, objective: Objective) -> MaximumPosterior:
    """Maximum of the posterior with the noise scales at their prior medians, from every start that a parameter names.

    Raises:
        ConvergenceError: The residuals are not finite at the start.
    """
    n = posterior.model.space.size
    problem = Problem(posterior, objective, with_priors=True)
    starts = product(*map(_starts, posterior.model.space.free))
    found = min((problem.solve(np.array(start)) for start in starts), key=_squares_with_priors)
    if not all(np.all(np.isfinite(r)) for r in found["residuals"].values()):
        raise ConvergenceError(
            "the model cannot be computed at the prior medians; the usual cause is a prior or a fixed value that is "
            "orders of magnitude off: check the units under [friction] and [prior]."
        )
    # The prior of each z has unit information; a noise scale gets that alone, its residuals say nothing here.
    information = found["jacobian"].T @ found["jacobian"] + np.eye(n)
    return MaximumPosterior(found["z"], np.linalg.inv(information))


def _starts(parameter: Parameter) -> tuple[float, ...]:
    if np.isnan(parameter.first_look):
        return parameter.starts
    look = z_at(parameter.prior, parameter.first_look)
    return (*parameter.starts, float(np.clip(look, -_FARTHEST, _FARTHEST)))


def _squares_with_priors(found: Solution) -> float:
    total = float(np.sum(found["stacked"] ** 2))
    return total if np.isfinite(total) else float("inf")


def least_squares(
    posterior: LogDensity, objective: Objective, start: np.ndarray, intervals: bool = True
) -> LeastSquares:
    """Least squares without priors, from the maximum of the posterior.

    The weights of the tables against each other are the prior medians of the noise scales, or what single readings of a run
    each tell of these; the standard errors use the
    scatter that is left (sandwich form), table by table; a force table scatters between its runs and within them.

    Args:
        posterior: The posterior.
        objective: Its compiled solve.
        start: z to start from.
        intervals: Whether to compute the profile intervals, which take some twenty solves a parameter.
    """
    basin = _weighed(_minimum(Problem(posterior, objective), start))
    found, space, terms = basin.found, posterior.model.space, posterior.model.terms
    active = np.flatnonzero(~basin.problem.noise & ~basin.at_end)
    about = linearize(found["jacobian"][:, active])
    scale, residual_sd = scatter_about(terms, found["residuals"], about.leverage)
    rivals = fitting_as_well(found, _pinned_elsewhere(basin.problem, start), scale, about.readings.shape[1])
    error, determined = np.full(space.size, np.nan), basin.at_end.copy()
    error[active] = np.linalg.norm(about.moves(scale), axis=1)
    determined[active] = about.determined & (np.abs(found["z"][active]) <= _FAR) & (about.unit_error <= _FAR)
    estimates = _estimates(basin, error, determined, rivals, limits(basin, scale, determined) if intervals else {})
    shown = {p.name: v * p.shown_scale for p, v in zip(space.free, found["values"], strict=True)}
    shown |= {p.name: (p.fixed or 0.0) * p.shown_scale for p in space.fixed}
    return LeastSquares(
        estimates | {p.name: Estimate(shown[p.name], np.nan, True, "fixed") for p in space.fixed},
        {t.name: residual_sd[t.name] * float(shown[t.noise]) for t in terms},
        found["readings"],
        about.condition_number,
        sum_of_squares(found),
        found["z"],
        bool(found["succeeded"]),
        "" if found["succeeded"] else "the solver stopped before it met its tolerance",
        disagreements(terms, space.free, found),
        *departures(basin, scale, {name: each.reach for name, each in estimates.items() if each.identified}),
        units={p.name: p.unit for p in space.parameters},
    )


def _minimum(problem: Problem, start: np.ndarray) -> Basin:
    """The minimum without priors, and which parameters have run to an end of their range there."""
    parameters, n = problem.posterior.model.space.free, len(start)
    pin, at_end, found = np.zeros(n), np.zeros(n, dtype=bool), problem.solve(start)
    for i in np.flatnonzero(_suspect(parameters, found["z"]) & ~problem.noise):
        this, end = np.arange(n) == i, np.copysign(LOWER_END, found["z"][i])
        # A step can leap over the minimum into the flat tail of the map from z; only what ends there from the middle too
        # has its minimum there.
        again = problem.solve(np.where(this, 0.0, found["z"]), at_end, pin)
        found = min(found, again, key=sum_of_squares)
        if not _suspect(parameters, found["z"])[i]:
            continue
        trial_pin = np.where(this, end, pin)
        trial = problem.solve(found["z"], at_end | this, trial_pin)
        if sum_of_squares(trial) <= sum_of_squares(found) * (1 + 1e-7) + 1e-14:
            at_end, pin, found = at_end | this, trial_pin, trial
    return Basin(problem, found, at_end)


def _weighed(basin: Basin) -> Basin:
    """The minimum with the noise scales that single readings of a run each tell; the same where there are no such runs.

    Their prior medians say how much more readings scatter at low loads than at high ones, which nothing else corrects.
    """
    problem, space = basin.problem, basin.problem.posterior.model.space
    values = dict(zip((p.name for p in space.free), basin.found["values"], strict=True))
    values |= {p.name: np.asarray(p.fixed) for p in space.fixed}
    told: dict[str, float] = {}
    for term in problem.posterior.model.terms:
        if hasattr(term, "scatter_of_single_readings"):
            told |= term.scatter_of_single_readings(values)
    weighed = [name for name in told if name in space.index and isinstance(space.free[space.index[name]].prior, HalfCauchy)]
    if not weighed or len(weighed) < len(told):
        return basin
    noise_z = np.zeros(space.size)
    for name in weighed:
        at = space.index[name]
        noise_z[at] = np.clip(z_at(space.free[at].prior, float(told[name])), -_FARTHEST, _FARTHEST)
    return _minimum(replace(problem, noise_z=noise_z), basin.found["z"])


def _suspect(parameters: tuple[Parameter, ...], z: np.ndarray) -> np.ndarray:
    """Which parameters may be on their way to an end of their range."""
    limited = np.array([isinstance(p.prior, Uniform) for p in parameters], dtype=bool)
    return (may_end(parameters) & (z < _SUSPECT)) | (limited & (z > -_SUSPECT))


def _pinned_elsewhere(problem: Problem, start: np.ndarray) -> list[Solution]:
    """Solutions with one parameter of the elastic side, or of friction beside it, pinned away from the minimum."""
    parameters = problem.posterior.model.space.free
    roles = ["friction", "elastic"] if any(p.role == "elastic" for p in parameters) else []
    each = [np.arange(len(start)) == i for i, p in enumerate(parameters) if p.role in roles]
    return [problem.solve(start, this, np.where(this, z, 0.0), ROUGH) for this, z in product(each, PINS)]


def _estimates(
    basin: Basin,
    error: np.ndarray,
    determined: np.ndarray,
    rivals: Sequence[Solution],
    profiled: Mapping[str, tuple[float, float]],
) -> dict[str, Estimate]:
    """Estimates of the free parameters but for noise scales, from their standard errors in z and their limits."""
    found, estimates = basin.found, {}
    for i, p in enumerate(basin.parameters):
        if basin.problem.noise[i]:
            continue
        value, limit = float(found["values"][i] * p.shown_scale), profiled.get(p.name, _UNKNOWN)
        sd = float(abs(found["slope"][i] * error[i]) * p.shown_scale)
        others = [float(r["values"][i]) * p.shown_scale for r in rivals]
        if basin.at_end[i]:
            remark = _at_bound(value, limit, found["z"][i] > 0)
            estimates[p.name] = Estimate(np.nan, np.nan, False, remark, *limit, at_bound=True)
        elif not determined[i] or (p.role == "elastic" and isinstance(p.prior, LogNormal) and sd > value):
            # A positive quantity that may as well be 0 or twice as large is none that was measured.
            estimates[p.name] = Estimate(np.nan, np.nan, False, UNDETERMINED)
        elif (ends := range_of_minima(value, sd, others)) is not None:
            remark = f"values from {significant(ends[0])} to {significant(ends[1])} fit about as well"
            estimates[p.name] = Estimate(np.nan, np.nan, False, remark, *limit)
        else:
            estimates[p.name] = Estimate(value, sd, True, "", *limit)
    return estimates


def _at_bound(value: float, limit: tuple[float, float], at_upper_end: bool) -> str:
    """What is known of a parameter whose sum of squares falls all the way to an end of its range."""
    lower, upper = limit
    if at_upper_end:
        least = "" if np.isnan(lower) else f"; at least {significant(lower)}"
        return f"no minimum inside its range: runs to its upper end, {significant(value)}{least}"
    most = "" if np.isnan(upper) else "; nothing limits it above" if np.isinf(upper) else f"; at most {significant(upper)}"
    return f"no finite minimum: runs to its lower end, {significant(value)}{most}"
