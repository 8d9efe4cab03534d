"""Least squares of the residuals that the likelihood is made of: classical estimates, and the sampler's start.

Without priors the estimates are those a published curve fit gives; what runs to an end of its range, or has no influence
on any residual, is reported as not identified. With priors (z itself as further residuals) they are the maximum of the
posterior at the noise scales' prior medians.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import ClassVar

import numpy as np

from bowdenfit.errors import ConvergenceError
from bowdenfit.inference.disagreement import Disagreement, disagreements
from bowdenfit.inference.linearized import linearized
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import (
    LOWER_END,
    Objective,
    Solution,
    make_objective,
    may_end,
    noise_scales,
    prior_weights,
    solve,
    sum_of_squares,
)
from bowdenfit.inference.other_minima import PINS, contested, fitting_as_well
from bowdenfit.inference.profiles import Basin, limits
from bowdenfit.inference.scatter import scatter_about
from bowdenfit.parameters.priors import Uniform
from bowdenfit.parameters.space import Parameter

UNDETERMINED = "the measurements do not determine it"
_SUSPECT = -2.0  # below this z an estimate may be on its way to the lower end, above its negative to the upper
_UNKNOWN = (float("nan"), float("nan"))
_FAR = 50.0  # standard error in units of the prior's sd beyond which data say nothing of a parameter

__all__ = [
    "Estimate",
    "LeastSquares",
    "MaximumPosterior",
    "Objective",
    "least_squares",
    "make_objective",
    "maximum_posterior",
]


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


@dataclass(frozen=True)
class LeastSquares:
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


@dataclass(frozen=True)
class MaximumPosterior:
    """Where the samplers start: maximum of the posterior at given noise scales, and its Gauss-Newton covariance in z."""

    z: np.ndarray
    covariance: np.ndarray


def maximum_posterior(posterior: LogDensity, objective: Objective) -> MaximumPosterior:
    """Maximum of the posterior with the noise scales at their prior medians.

    Raises:
        ConvergenceError: The residuals are not finite at the start.
    """
    noise = noise_scales(posterior)
    n = len(noise)
    found = solve(posterior, objective, np.zeros(n), noise, np.zeros(n), prior_weights(noise, True))
    if not all(np.all(np.isfinite(r)) for r in found["residuals"].values()):
        raise ConvergenceError(
            "the model cannot be computed at the prior medians; the usual cause is a prior or a fixed value that is "
            "orders of magnitude off: check the units under [friction] and [prior]."
        )
    # The prior of each z has unit information; a noise scale gets that alone, its residuals say nothing here.
    information = found["jacobian"].T @ found["jacobian"] + np.eye(n)
    return MaximumPosterior(found["z"], np.linalg.inv(information))


def least_squares(
    posterior: LogDensity, objective: Objective, start: np.ndarray, intervals: bool = True
) -> LeastSquares:
    """Least squares without priors, from the maximum of the posterior.

    The weights of the tables against each other are the prior medians of the noise scales; the standard errors use the
    scatter that is left (sandwich form), table by table; a force table scatters between its runs and within them.

    Args:
        posterior: The posterior.
        objective: Its compiled solve.
        start: z to start from.
        intervals: Whether to compute the profile intervals, which take some twenty solves a parameter.
    """
    found, at_end = _minimum(posterior, objective, start)
    trials = _pinned_elsewhere(posterior, objective, start)
    noise = noise_scales(posterior)
    basin = Basin(posterior, objective, found, noise, at_end, prior_weights(noise, False))
    return _summarized(basin, trials, intervals)


def _minimum(posterior: LogDensity, objective: Objective, start: np.ndarray) -> tuple[Solution, np.ndarray]:
    """The minimum without priors, and which parameters have run to an end of their range there."""
    parameters, noise = posterior.model.space.free, noise_scales(posterior)
    pin, weight = np.zeros(len(noise)), prior_weights(noise, False)
    found = solve(posterior, objective, start, noise, pin, weight)
    at_end = np.zeros_like(noise)
    for i in np.flatnonzero(_suspect(parameters, found["z"]) & ~noise):
        this, end = np.arange(len(noise)) == i, np.copysign(LOWER_END, found["z"][i])
        # A step can leap over the minimum into the flat tail of the map from z; only what ends there from the middle too
        # has its minimum there.
        again = solve(posterior, objective, np.where(this, 0.0, found["z"]), noise | at_end, pin, weight)
        found = min(found, again, key=sum_of_squares)
        if not _suspect(parameters, found["z"])[i]:
            continue
        trial_pin = np.where(this, end, pin)
        trial = solve(posterior, objective, found["z"], noise | at_end | this, trial_pin, weight)
        if sum_of_squares(trial) <= sum_of_squares(found) * (1 + 1e-7) + 1e-14:
            at_end, pin, found = at_end | this, trial_pin, trial
    return found, at_end


def _suspect(parameters: tuple[Parameter, ...], z: np.ndarray) -> np.ndarray:
    """Which parameters may be on their way to an end of their range."""
    limited = np.array([isinstance(p.prior, Uniform) for p in parameters], dtype=bool)
    return (may_end(parameters) & (z < _SUSPECT)) | (limited & (z > -_SUSPECT))


def _pinned_elsewhere(posterior: LogDensity, objective: Objective, start: np.ndarray) -> list[Solution]:
    """Solutions with one parameter of the elastic side, or of friction beside it, pinned away from the minimum."""
    parameters, noise = posterior.model.space.free, noise_scales(posterior)
    roles = ["friction", "elastic"] if any(p.role == "elastic" for p in parameters) else []
    weight, trials = prior_weights(noise, False), []
    for i, z in product([i for i, p in enumerate(parameters) if p.role in roles], PINS):
        this = np.arange(len(noise)) == i
        trials.append(solve(posterior, objective, start, noise | this, np.where(this, z, 0.0), weight))
    return trials


def _summarized(basin: Basin, trials: Sequence[Solution], intervals: bool) -> LeastSquares:
    posterior, found, at_end = basin.posterior, basin.found, basin.at_end
    space, terms = posterior.model.space, posterior.model.terms
    active = np.flatnonzero(~basin.pinned & ~at_end)
    about = linearized(found["jacobian"][:, active])
    scale, residual_sd = scatter_about(terms, found["residuals"], about.leverage)
    rivals = fitting_as_well(found, trials, scale, about.readings.shape[1])
    error, determined = np.full(space.size, np.nan), at_end.copy()
    error[active] = np.linalg.norm(about.moves(scale), axis=1)
    determined[active] = about.determined & (np.abs(found["z"][active]) <= _FAR) & (about.unit_error <= _FAR)
    profiled = limits(basin, scale, determined) if intervals else {}
    estimates: dict[str, Estimate] = {}
    for i, p in enumerate(space.free):
        value, limit = float(found["values"][i] * p.shown_scale), profiled.get(p.name, _UNKNOWN)
        if basin.pinned[i]:
            continue
        if at_end[i]:
            estimates[p.name] = Estimate(
                np.nan, np.nan, False, _at_bound(value, limit, found["z"][i] > 0), *limit, at_bound=True
            )
        elif not determined[i]:
            estimates[p.name] = Estimate(np.nan, np.nan, False, UNDETERMINED)
        else:
            sd = float(abs(found["slope"][i] * error[i]) * p.shown_scale)
            others = [float(r["values"][i]) * p.shown_scale for r in rivals]
            estimates[p.name] = _estimate(value, sd, others, limit)
    for p in space.fixed:
        estimates[p.name] = Estimate((p.fixed or 0.0) * p.shown_scale, np.nan, True, "fixed")
    message = "" if found["succeeded"] else "the solver stopped before it met its tolerance"
    total = sum_of_squares(found)
    scales = {p.name: v * p.shown_scale for p, v in zip(space.free, found["values"], strict=True)}
    scales |= {p.name: (p.fixed or 0.0) * p.shown_scale for p in space.fixed}
    residual_sd = {t.name: residual_sd[t.name] * float(scales[t.noise]) for t in posterior.model.terms}
    agreement = disagreements(
        posterior.model.terms, found["residuals"], _by_term(posterior, found), space.free, found["z"]
    )
    return LeastSquares(
        estimates,
        residual_sd,
        found["readings"],
        about.condition_number,
        total,
        found["z"],
        bool(found["succeeded"]),
        message,
        agreement,
    )


def _estimate(value: float, sd: float, rivals: Sequence[float], limit: tuple[float, float]) -> Estimate:
    """An estimate, unless solutions that fit about as well lie far outside its standard error."""
    ends = contested(value, sd, rivals)
    if ends is None:
        return Estimate(value, sd, True, "", *limit)
    return Estimate(np.nan, np.nan, False, f"values from {ends[0]:.3g} to {ends[1]:.3g} fit about as well", *limit)


def _at_bound(value: float, limit: tuple[float, float], at_upper_end: bool) -> str:
    """What is known of a parameter whose sum of squares falls all the way to an end of its range."""
    lower, upper = limit
    if at_upper_end:
        least = "" if np.isnan(lower) else f"; at least {lower:.3g}"
        return f"no minimum inside its range: runs to its upper end, {value:.3g}{least}"
    most = "" if np.isnan(upper) else "; nothing limits it above" if np.isinf(upper) else f"; at most {upper:.3g}"
    return f"no finite minimum: runs to its lower end, {value:.3g}{most}"


def _by_term(posterior: LogDensity, found: Solution) -> dict[str, np.ndarray]:
    """The Jacobian's rows of each table."""
    names = [term.name for term in posterior.model.terms]
    ends = np.cumsum([len(found["residuals"][name]) for name in names])
    return dict(zip(names, np.split(found["jacobian"], ends[:-1]), strict=True))
