"""Least squares of the residuals that the likelihood is made of: classical estimates, and the sampler's start.

Without priors the estimates are those a published curve fit gives; what runs to an end of its range, or has no influence
on any residual, is reported as not identified. With priors (z itself as further residuals) they are the maximum of the
posterior at the noise scales' prior medians.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array

from bowdenfit.errors import ConvergenceError
from bowdenfit.inference.compilation import compiled
from bowdenfit.inference.disagreement import Disagreement, disagreements
from bowdenfit.inference.posterior import Posterior
from bowdenfit.inference.rivals import PINS, contested, fitting_as_well
from bowdenfit.inference.scatter import scatter_about
from bowdenfit.parameters.priors import HalfNormal, LogNormal, TruncatedNormal, Uniform
from bowdenfit.parameters.space import Parameter

LOWER_END = -38.0  # z at which a quantile reaches the lower end of its support in double precision
UNDETERMINED = "the measurements do not determine it"
_SUSPECT = -2.0  # below this z an estimate may be on its way to the lower end
_SINGULAR = 1e-8  # singular values below this fraction of the largest carry no information
_FAR = 50.0  # standard error in units of the prior's sd beyond which data say nothing of a parameter

Solution = dict[str, Any]
Objective = Callable[..., Solution]


@dataclass(frozen=True)
class Estimate:
    """Least-squares estimate of one parameter, in its shown unit.

    Args:
        value: Estimate; NaN where not identified.
        standard_error: From the Jacobian; NaN where not identified.
        identified: Whether the data determine it.
        remark: Why not, or that it is fixed; empty otherwise.
    """

    value: float
    standard_error: float
    identified: bool
    remark: str = ""


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


def make_objective(posterior: Posterior) -> Objective:
    """One compiled solve for every use: which parameters are pinned and whether priors count are arguments."""
    space = posterior.model.space

    def residuals(free: Array, args: Any) -> tuple[Any, Any]:
        pinned, pin, weight, data = args
        z = jnp.where(pinned, pin, free)
        by_term = posterior.residuals(z, data)
        return jnp.concatenate([*by_term.values(), weight * z]), by_term

    def solve(start: Array, pinned: Array, pin: Array, weight: Array, data: Any) -> dict[str, Any]:
        args = (pinned, pin, weight, data)
        solver: optx.LevenbergMarquardt = optx.LevenbergMarquardt(rtol=1e-10, atol=1e-12)
        solution: optx.Solution = optx.least_squares(
            residuals, solver, start, args, has_aux=True, max_steps=500, throw=False
        )
        z = jnp.where(pinned, pin, solution.value)
        values, slope = jax.jvp(space.vector, (z,), (jnp.ones_like(z),))
        jacobian, by_term = jax.jacfwd(residuals, has_aux=True)(solution.value, args)
        succeeded = solution.result == optx.RESULTS.successful
        named = space.constrain(z)
        terms = zip(posterior.model.terms, data, strict=True)
        found = {"z": z, "values": values, "slope": slope, "residuals": by_term}
        found["readings"] = {term.name: term.expected(named, d) for term, d in terms}
        return found | {"jacobian": jacobian[: -z.shape[0]], "succeeded": succeeded}

    vector, flags = jax.ShapeDtypeStruct((space.size,), jnp.float64), jax.ShapeDtypeStruct((space.size,), jnp.bool_)
    return compiled(solve, vector, flags, vector, vector, posterior.data, run_once=True)


def maximum_posterior(posterior: Posterior, objective: Objective) -> MaximumPosterior:
    """Maximum of the posterior with the noise scales at their prior medians.

    Raises:
        ConvergenceError: The residuals are not finite at the start.
    """
    noise = _noise(posterior)
    n = len(noise)
    found = _solve(posterior, objective, np.zeros(n), noise, np.zeros(n), np.where(noise, 0.0, 1.0))
    if not all(np.all(np.isfinite(r)) for r in found["residuals"].values()):
        raise ConvergenceError(
            "the model cannot be computed at the prior medians; the usual cause is a prior or a fixed value that is "
            "orders of magnitude off: check the units under [friction] and [prior]."
        )
    # The prior of each z has unit information; a noise scale gets that alone, its residuals say nothing here.
    information = found["jacobian"].T @ found["jacobian"] + np.eye(n)
    return MaximumPosterior(found["z"], np.linalg.inv(information))


def least_squares(posterior: Posterior, objective: Objective, start: np.ndarray) -> LeastSquares:
    """Least squares without priors, from the maximum of the posterior.

    The weights of the tables against each other are the prior medians of the noise scales; the standard errors use the
    scatter that is left (sandwich form), table by table; a force table scatters between its runs and within them.

    Args:
        posterior: The posterior.
        objective: Its compiled solve.
        start: z to start from.
    """
    found, at_end = _minimum(posterior, objective, start)
    trials = _pinned_elsewhere(posterior, objective, start)
    return _summarized(posterior, found, _noise(posterior), at_end, trials)


def _minimum(posterior: Posterior, objective: Objective, start: np.ndarray) -> tuple[Solution, np.ndarray]:
    """The minimum without priors, and which parameters have run to their lower end there."""
    parameters, noise = posterior.model.space.free, _noise(posterior)
    nothing = np.zeros(len(noise))
    found = _solve(posterior, objective, start, noise, nothing, nothing)
    at_end = np.zeros_like(noise)
    for i in np.flatnonzero(_may_end(parameters) & ~noise & (found["z"] < _SUSPECT)):
        this, pin = np.arange(len(noise)) == i, np.where(at_end, LOWER_END, 0.0)
        # A step can leap over the minimum into the flat tail of the map from z; only what ends there from the middle too
        # has its minimum there.
        again = _solve(posterior, objective, np.where(this, 0.0, found["z"]), noise | at_end, pin, nothing)
        found = min(found, again, key=_sum_of_squares)
        if found["z"][i] >= _SUSPECT:
            continue
        trial_end = at_end | this
        pin = np.where(trial_end, LOWER_END, 0.0)
        trial = _solve(posterior, objective, found["z"], noise | trial_end, pin, nothing)
        if _sum_of_squares(trial) <= _sum_of_squares(found) * (1 + 1e-7) + 1e-14:
            at_end, found = trial_end, trial
    return found, at_end


def _pinned_elsewhere(posterior: Posterior, objective: Objective, start: np.ndarray) -> list[Solution]:
    """Solutions with one parameter of the elastic side, or of friction beside it, pinned away from the minimum."""
    parameters, noise = posterior.model.space.free, _noise(posterior)
    roles = ["friction", "elastic"] if any(p.role == "elastic" for p in parameters) else []
    nothing, trials = np.zeros(len(noise)), []
    for i, z in product([i for i, p in enumerate(parameters) if p.role in roles], PINS):
        this = np.arange(len(noise)) == i
        trials.append(_solve(posterior, objective, start, noise | this, np.where(this, z, 0.0), nothing))
    return trials


def _solve(
    posterior: Posterior,
    objective: Objective,
    start: np.ndarray,
    pinned: np.ndarray,
    pin: np.ndarray,
    weight: np.ndarray,
) -> Solution:
    return jax.tree.map(np.asarray, objective(start, pinned, pin, weight, posterior.data))


def _sum_of_squares(found: Solution) -> float:
    return float(sum(np.sum(r**2) for r in found["residuals"].values()))


def _noise(posterior: Posterior) -> np.ndarray:
    """Which free parameters are noise scales, held at their prior median in least squares."""
    return np.array([p.role == "noise" for p in posterior.model.space.free], dtype=bool)


def _may_end(parameters: tuple[Parameter, ...]) -> np.ndarray:
    """Which parameters have a lower end that an estimate can run to."""
    ending = (LogNormal, HalfNormal, TruncatedNormal, Uniform)
    return np.array([isinstance(p.prior, ending) for p in parameters], dtype=bool)


def _summarized(
    posterior: Posterior, found: Solution, noise: np.ndarray, at_end: np.ndarray, trials: Sequence[Solution]
) -> LeastSquares:
    space = posterior.model.space
    active = np.flatnonzero(~noise & ~at_end)
    u, s, vt = np.linalg.svd(found["jacobian"][:, active], full_matrices=True)
    informed = np.zeros(len(active), dtype=bool)
    informed[: len(s)] = s > _SINGULAR * max(s.max(initial=0.0), 1e-30)
    s, u = s[informed[: len(s)]], u[:, : len(active)][:, informed[: u.shape[1]]]
    scale, residual_sd = scatter_about(posterior.model.terms, found["residuals"], np.sum(u**2, axis=1))
    root = vt[informed].T / s
    error = np.sqrt(np.sum((root @ (u.T * scale)) ** 2, axis=1))
    rivals = fitting_as_well(found, trials, scale, len(s))
    undetermined = np.sum(vt[~informed] ** 2, axis=0) > 1e-6
    lost = undetermined | (np.abs(found["z"][active]) > _FAR) | (np.sqrt(np.sum(root**2, axis=1)) > _FAR)
    estimates: dict[str, Estimate] = {}
    for i, p in enumerate(space.free):
        value = float(found["values"][i] * p.shown_scale)
        if noise[i]:
            continue
        if at_end[i]:
            remark = f"no finite minimum: runs to its lower end, {value:.3g}"
            estimates[p.name] = Estimate(np.nan, np.nan, False, remark)
        elif lost[np.searchsorted(active, i)]:
            estimates[p.name] = Estimate(np.nan, np.nan, False, UNDETERMINED)
        else:
            sd = abs(found["slope"][i] * error[np.searchsorted(active, i)]) * p.shown_scale
            estimates[p.name] = _estimate(value, float(sd), [float(r["values"][i]) * p.shown_scale for r in rivals])
    for p in space.fixed:
        estimates[p.name] = Estimate((p.fixed or 0.0) * p.shown_scale, np.nan, True, "fixed")
    condition = (float(s[0] / s[-1]) if informed.all() else float("inf")) if len(active) else 1.0
    message = "" if found["succeeded"] else "the solver stopped before it met its tolerance"
    total = _sum_of_squares(found)
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
        condition,
        total,
        found["z"],
        bool(found["succeeded"]),
        message,
        agreement,
    )


def _estimate(value: float, sd: float, rivals: Sequence[float]) -> Estimate:
    """An estimate, unless solutions that fit about as well lie far outside its standard error."""
    ends = contested(value, sd, rivals)
    if ends is None:
        return Estimate(value, sd, True)
    return Estimate(np.nan, np.nan, False, f"values from {ends[0]:.3g} to {ends[1]:.3g} fit about as well")


def _by_term(posterior: Posterior, found: Solution) -> dict[str, np.ndarray]:
    """The Jacobian's rows of each table."""
    names = [term.name for term in posterior.model.terms]
    ends = np.cumsum([len(found["residuals"][name]) for name in names])
    return dict(zip(names, np.split(found["jacobian"], ends[:-1]), strict=True))
