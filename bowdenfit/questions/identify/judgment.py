"""How a fit, or a plan, comes to know what its measurements determine: from draws, or from the information at one point."""

import jax
import numpy as np

from bowdenfit.inference.draws import DrawFunction, for_each_draw, value_function
from bowdenfit.inference.identifiability import PRIOR_DOMINATED, Combination, CovarianceAnalysis, analyze_covariance
from bowdenfit.inference.least_squares import UNDETERMINED, MaximumPosterior
from bowdenfit.inference.profiles import Profile
from bowdenfit.inference.scalar_priors import value_at
from bowdenfit.model import Model
from bowdenfit.questions.identify.answer import GROUPS, Identifiability, how_well
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.words import listed

DRAWS = "what the fit found"
_STEP = 1e-4  # of z, from which a slope is told to a part in 10^8


@cached_per_fit
def identifiability(fit: Record) -> Identifiability:
    """What a fit knows, from its draws.

    Args:
        fit: A fit with a posterior.

    Raises:
        UsageError: There is no posterior.
    """
    drawn = fit.draws()
    values = np.column_stack([drawn.values[p.name].ravel() for p in fit.model.space.free])
    spread = np.cov(values, rowvar=False).reshape(values.shape[1], values.shape[1])
    with jax.enable_x64(True):
        _, prior_sd = _linear(fit.model, values_program(fit), np.median(drawn.flat_z, axis=0))
    groups = _groups(fit.model, np.mean(values, axis=0), spread, prior_sd)
    return Identifiability(fit.name, DRAWS, True, groups, units=fit.posterior.units, meanings=_meanings(fit.model))


def of_maximum(
    model: Model, start: MaximumPosterior, basis: str, measured: bool, profiles: tuple[Profile, ...] = ()
) -> Identifiability:
    """What measurements will tell, or tell before sampling: from the Fisher information at one point.

    Args:
        model: The model.
        start: Maximum of the posterior, with the inverse of the information there.
        basis: Where that is, in words.
        measured: Whether readings entered.
        profiles: Of the friction coefficients.
    """
    covariance = _with_tails(model, np.asarray(start.covariance))
    with jax.enable_x64(True):
        value, slope = _linear(model, _compile_values(model), np.asarray(start.z))
    groups = _groups(model, value, covariance * np.outer(slope, slope), slope)
    units = {p.name: p.unit for p in model.space.free}
    return Identifiability(model.description.name, basis, measured, groups, profiles, units, _meanings(model))


def _meanings(model: Model) -> dict[str, str]:
    """What each parameter is, in words."""
    return {p.name: p.meaning for p in model.space.free}


def _with_tails(model: Model, covariance: np.ndarray) -> np.ndarray:
    """The covariance, with the information of Student-t readings: nu / (nu + 3) of what residuals near zero suggest."""
    description = model.description
    if description.noise != "student":
        return covariance
    freedom, unit = description.student_degrees_of_freedom, np.eye(len(covariance))
    return np.linalg.inv(freedom / (freedom + 3) * (np.linalg.inv(covariance) - unit) + unit)


@cached_per_fit
def values_program(fit: Record) -> DrawFunction:
    """Named values of many z, in shown units; a fit that samples has one already."""
    return fit.programs.values if fit.programs else _compile_values(fit.model)


def _compile_values(model: Model) -> DrawFunction:
    return for_each_draw(value_function(model), model.space.size, run_once=True)


def _linear(model: Model, values_of: DrawFunction, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values of the free parameters at z and their change with it, which is the prior's sd there; in shown units."""
    found = values_of(z + _STEP * np.array([[0.0], [-1.0], [1.0]]))
    value, below, above = np.column_stack([found[p.name] for p in model.space.free])
    slope = (above - below) / (2 * _STEP)
    return value, np.maximum(np.abs(slope), 1e-12 * np.maximum(np.abs(value), 1.0))


def _groups(model: Model, value: np.ndarray, covariance: np.ndarray, prior_sd: np.ndarray) -> dict[str, CovarianceAnalysis]:
    """Knowledge of every group, in shown units."""
    found = {}
    for group, roles in GROUPS.items():
        which = np.array([i for i, p in enumerate(model.space.free) if p.role in roles], dtype=int)
        if len(which):
            names = [model.space.free[i].name for i in which]
            found[group] = analyze_covariance(names, value[which], covariance[np.ix_(which, which)], prior_sd[which])
    return found


def say_what_is_not_determined(fit: Record) -> str:
    """Which friction coefficients the measurements do not tell, in a sentence; empty where they tell all.

    Only coefficients with the weak default prior count: who states a coefficient as measured, or gives it a prior, knows
    that it rests on that. The same holds for what the data sheet of a load cell says.
    """
    names = [p.name for p in fit.model.space.free if p.role == "friction" and not _stated(fit, p.name)]
    if fit.sampled is None:
        return _in_words([name for name in names if _undetermined(fit, name) or _nothing_or_anything(fit, name)], None)
    friction = identifiability(fit).groups.get("friction")
    if friction is None:
        return ""
    share = {p.name: p.share for p in friction.parameters}
    lost = [
        n
        for n in names
        if share[n] > PRIOR_DOMINATED or _as_wide_as_prior(fit, n) or (_undetermined(fit, n) and n in friction.unidentified)
    ]
    if not lost and not friction.identified and not friction.determined:
        return _in_words(names, None, " in good part")
    known = next((c for c in friction.determined if set(c.weights) & set(lost)), None)
    return _in_words(lost, known)


def _as_wide_as_prior(fit: Record, name: str) -> bool:
    """Whether a coefficient's draws are as wide as its prior in the sampler's coordinates."""
    return float(np.var(fit.draws().z[..., fit.model.space.index[name]])) > PRIOR_DOMINATED


def _undetermined(fit: Record, name: str) -> bool:
    """Whether least squares without priors leaves a coefficient open altogether."""
    estimates = fit.least_squares.estimates
    stated = (p for p in fit.model.space.free if p.role == "sensor" and not p.scaled_by)
    if any(estimates[p.name].remark == UNDETERMINED for p in stated):
        return False
    return estimates[name].remark == UNDETERMINED


def _nothing_or_anything(fit: Record, name: str) -> bool:
    """Whether least squares runs to no friction at all and does not exclude what its prior thinks usual either.

    A contact that hardly rubs is one of which more is excluded; that contradictory readings do so is as likely.
    """
    estimate, parameter = fit.least_squares.estimates[name], fit.model.space.free[fit.model.space.index[name]]
    if not estimate.at_bound:
        return False
    return not estimate.upper < value_at(parameter.prior, 0.0) * parameter.shown_scale


def _in_words(lost: list[str], known: Combination | None, how_much: str = "") -> str:
    if not lost:
        return ""
    them = listed(lost)
    if known is not None:
        said = f"The measurements do not tell {them} apart: what they determine is {known.words}, {how_well(known)}"
    else:
        said = f"The measurements do not determine {them}"
    rest = "rest on their priors" if len(lost) > 1 else "rests on its prior"
    return (
        f"{said}; {them} by {'themselves' if len(lost) > 1 else 'itself'} {rest}{how_much}. Efficiencies where you measured "
        "still hold, the coefficients do not: measure where the wrap angles change in other proportions, or state a "
        "coefficient that was measured separately under [friction.NAME]."
    )


def _stated(fit: Record, name: str) -> bool:
    """Whether the description says something of a coefficient beyond naming it."""
    return name in fit.dataset.description.friction
