"""How a fit, or a plan, comes to know what its measurements determine: from draws, or from the information at one point."""

from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

import jax
import numpy as np

from bowdenfit.inference.draws import DrawFunction, for_each_draw, value_function
from bowdenfit.inference.identifiability import PRIOR_DOMINATED, Combination, CovarianceAnalysis, analyze_covariance
from bowdenfit.inference.least_squares import UNDETERMINED, MaximumPosterior
from bowdenfit.inference.profiles import Profile
from bowdenfit.inference.scalar_priors import value_at
from bowdenfit.models import Model
from bowdenfit.questions.identify.answer import GROUPS, Identifiability, describe_precision
from bowdenfit.results.record import Record, cached_per_fit, values_program
from bowdenfit.words import listed, significant

BASIS_DRAWS = "what the fit found"
_STEP = 1e-4  # step of z, which determines a slope to a part in 10^8


_ROLES = {"friction", "friction_model", "sensor", "angle", "elastic"}
_CONFOUNDED = 0.9  # correlation beyond which two parameters are said to be confounded; a judgement
_WELL_KNOWN = 0.1  # relative standard deviation below which a positive quantity is known well; a judgement
_WORTH_SAYING = 0.5  # largest sd of a combination over that of its first parameter that is worth a sentence; a judgement
@cached_per_fit
def assess_identifiability(fit: Record) -> Identifiability:
    """Return what a fit determines, from its draws.

    Args:
        fit: A fit with a posterior.

    Raises:
        UsageError: There is no posterior.
    """
    posterior = fit.draws()
    values = np.column_stack([posterior.values[p.name].ravel() for p in fit.model.space.free])
    spread = np.cov(values, rowvar=False).reshape(values.shape[1], values.shape[1])
    with jax.enable_x64(True):
        _, prior_sd = _linearize(fit.model, values_program(fit), np.median(posterior.flat_z, axis=0))
    groups = _analyze_groups(fit.model, np.mean(values, axis=0), spread, prior_sd)
    return Identifiability(
        fit.name, BASIS_DRAWS, True, groups, units=fit.posterior.units, meanings=_parameter_meanings(fit.model)
    )


def identifiability_at_maximum(
    model: Model, start: MaximumPosterior, basis: str, measured: bool, profiles: tuple[Profile, ...] = ()
) -> Identifiability:
    """Return what measurements determine before sampling, from the Fisher information at one point.

    Args:
        model: The model.
        start: Maximum of the posterior, with the inverse of the information there.
        basis: Where that is, in words.
        measured: Whether readings entered.
        profiles: Profiles of the friction coefficients.
    """
    covariance = _adjust_for_student(model, np.asarray(start.covariance))
    with jax.enable_x64(True):
        value, slope = _linearize(model, _compile_values(model), np.asarray(start.z))
    groups = _analyze_groups(model, value, covariance * np.outer(slope, slope), slope)
    units = {p.name: p.unit for p in model.space.free}
    return Identifiability(model.description.name, basis, measured, groups, profiles, units, _parameter_meanings(model))


def _parameter_meanings(model: Model) -> dict[str, str]:
    """Return what each parameter is, in words."""
    return {p.name: p.meaning for p in model.space.free}


def _adjust_for_student(model: Model, covariance: np.ndarray) -> np.ndarray:
    """Return the covariance with the information of Student-t readings: nu / (nu + 3) of that of residuals near zero."""
    description = model.description
    if description.noise != "student":
        return covariance
    freedom, unit = description.student_degrees_of_freedom, np.eye(len(covariance))
    return np.linalg.inv(freedom / (freedom + 3) * (np.linalg.inv(covariance) - unit) + unit)


def _compile_values(model: Model) -> DrawFunction:
    """Compile the map from z to named values."""
    return for_each_draw(value_function(model), model.space.size, run_once=True)


def _linearize(model: Model, values_of: DrawFunction, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the free parameters at z and their slopes, which are standard deviations of the priors there; in shown units."""
    values = values_of(z + _STEP * np.array([[0.0], [-1.0], [1.0]]))
    value, below, above = np.column_stack([values[p.name] for p in model.space.free])
    slope = (above - below) / (2 * _STEP)
    return value, np.maximum(np.abs(slope), 1e-12 * np.maximum(np.abs(value), 1.0))


def _analyze_groups(
    model: Model, value: np.ndarray, covariance: np.ndarray, prior_sd: np.ndarray
) -> dict[str, CovarianceAnalysis]:
    """Analyze the covariance of every group, in shown units."""
    analyses = {}
    for group, roles in GROUPS.items():
        which = np.array([i for i, p in enumerate(model.space.free) if p.role in roles], dtype=int)
        if len(which):
            names = [model.space.free[i].name for i in which]
            analyses[group] = analyze_covariance(names, value[which], covariance[np.ix_(which, which)], prior_sd[which])
    return analyses


@dataclass(frozen=True)
class Unidentified:
    """Friction coefficients that rest on their default priors.

    Args:
        names: Their names; empty where the measurements determine all.
        combination: What the measurements determine of them; None if nothing.
        in_part: Whether the prior and the measurements count about equally.
    """

    names: tuple[str, ...]
    combination: Combination | None = None
    in_part: bool = False


@cached_per_fit
def find_unidentified(fit: Record) -> Unidentified:
    """Find the friction coefficients that the measurements do not determine.

    Only coefficients with the weak default prior count: who states a coefficient as measured, or gives it a prior, knows
    that it rests on that. The same holds for what the data sheet of a load cell says.
    """
    names = [p.name for p in fit.model.space.free if p.role == "friction" and not _has_stated_prior(fit, p.name)]
    if fit.sampled is None:
        return Unidentified(tuple(n for n in names if _is_undetermined(fit, n) or _may_be_zero_or_usual(fit, n)))
    friction = assess_identifiability(fit).groups.get("friction")
    if friction is None:
        return Unidentified(())
    share = {p.name: p.share for p in friction.parameters}
    unidentified = [
        n
        for n in names
        if share[n] > PRIOR_DOMINATED
        or _is_as_wide_as_prior(fit, n)
        or (_is_undetermined(fit, n) and n in friction.unidentified)
    ]
    if not unidentified and not friction.identified and not friction.determined:
        return Unidentified(tuple(names), in_part=True)
    combination = next((c for c in friction.determined if set(c.weights) & set(unidentified)), None)
    return Unidentified(tuple(unidentified), combination)


def describe_unidentified(fit: Record) -> str:
    """Name the friction coefficients that the measurements do not determine; empty where they determine all."""
    unidentified = find_unidentified(fit)
    if not unidentified.names:
        return ""
    return (
        f"{_separation_sentence(unidentified)} Efficiencies where you measured still hold, the coefficients do not: measure "
        "where the wrap angles change in other proportions, or state a coefficient that was measured separately under "
        "[friction.NAME]."
    )


def describe_coefficients_to_leave(fit: Record) -> str:
    """Name the coefficients that must not be used by themselves, of a fit whose design answer holds; empty if all may be."""
    unidentified = find_unidentified(fit)
    return f"{_separation_sentence(unidentified)} Do not use {_pronoun(unidentified)}." if unidentified.names else ""


def _is_as_wide_as_prior(fit: Record, name: str) -> bool:
    """Return whether a coefficient's draws are as wide as its prior in the sampler's coordinates."""
    return float(np.var(fit.draws().z[..., fit.model.space.index[name]])) > PRIOR_DOMINATED


def _is_undetermined(fit: Record, name: str) -> bool:
    """Return whether least squares without priors leaves a coefficient open altogether."""
    estimates = fit.least_squares.estimates
    stated = (p for p in fit.model.space.free if p.role == "sensor" and not p.scaled_by)
    if any(estimates[p.name].remark == UNDETERMINED for p in stated):
        return False
    return estimates[name].remark == UNDETERMINED


def _may_be_zero_or_usual(fit: Record, name: str) -> bool:
    """Return whether least squares runs to no friction at all and does not exclude what its prior thinks usual either.

    A contact that hardly rubs is one of which more is excluded; that contradictory readings do so is as likely.
    """
    estimate, parameter = fit.least_squares.estimates[name], fit.model.space.free[fit.model.space.index[name]]
    if not estimate.at_bound:
        return False
    return not estimate.upper < value_at(parameter.prior, 0.0) * parameter.shown_scale


def _separation_sentence(unidentified: Unidentified) -> str:
    """Sentence on what the measurements do not determine, what they determine instead, and on what the rest hangs."""
    them, several = listed(unidentified.names), len(unidentified.names) > 1
    if unidentified.combination is not None:
        determined = f"{unidentified.combination.words}, {describe_precision(unidentified.combination)}"
        sentence = f"The measurements do not separate {them}: what they determine is {determined}"
    else:
        sentence = f"The measurements do not determine {them}"
    remark = "rest on their priors" if several else "rests on its prior"
    how_much = " in good part" if unidentified.in_part else ""
    return f"{sentence}; {them} by {'themselves' if several else 'itself'} {remark}{how_much}."


def _pronoun(unidentified: Unidentified) -> str:
    """Words for the coefficients alone."""
    return "them by themselves" if len(unidentified.names) > 1 else "it by itself"


def _has_stated_prior(fit: Record, name: str) -> bool:
    """Return whether the description says something of a coefficient beyond naming it."""
    return name in fit.dataset.description.friction


@dataclass(frozen=True)
class ConfoundedPair:
    """Two parameters of which only a combination is known.

    Args:
        first, second: Their names.
        factor: The combination is first + factor x second, in shown units.
        mean, sd: Mean and standard deviation of the combination.
        first_sd, second_sd: Standard deviations of the two parameters alone.
        correlation: Correlation of their draws.
    """

    first: str
    second: str
    factor: float
    mean: float
    sd: float
    first_sd: float
    second_sd: float
    correlation: float

    JSON: ClassVar = (..., "combination")

    @property
    def combination(self) -> str:
        """The combination in symbols."""
        sign = "+" if self.factor >= 0 else "-"
        return f"{self.first} {sign} {significant(abs(self.factor))} {self.second}"

    def sentence(self) -> str:
        """Return the pair and its combination in a sentence."""
        digits = int(np.clip(1 - np.floor(np.log10(max(self.sd, 1e-12))), 0, 8))
        return (
            f"The measurements barely separate {self.first} from {self.second} (correlation {self.correlation:+.2f}); "
            f"what they do determine is {self.combination} = {self.mean:z.{digits}f} ± {self.sd:z.{digits}f}, while "
            f"{self.first} alone is known to ± {significant(self.first_sd, 2)}."
        )


def confounded_pairs(fit: Record) -> list[ConfoundedPair]:
    """Return pairs of parameters whose draws lie along a line, the closest first; empty without draws."""
    if fit.sampled is None:
        return []
    names = [
        p.name for p in fit.model.space.free if p.role in _ROLES and not (p.role == "elastic" and _is_well_known(fit, p.name))
    ]
    pairs = [_analyze_pair(fit, a, b) for a, b in combinations(names, 2)]
    confounded = [pair for pair in pairs if abs(pair.correlation) > _CONFOUNDED and pair.sd < _WORTH_SAYING * pair.first_sd]
    return sorted(confounded, key=lambda pair: -abs(pair.correlation))


def _is_well_known(fit: Record, name: str) -> bool:
    """Return whether a parameter is known well by itself, so that its correlations do not matter."""
    draws = fit.posterior.values[name]
    return bool(np.std(draws) < _WELL_KNOWN * np.abs(np.median(draws)))


def _analyze_pair(fit: Record, first: str, second: str) -> ConfoundedPair:
    """Return the correlation of two parameters, and the combination of them that is known best."""
    a, b = fit.posterior.values[first].ravel(), fit.posterior.values[second].ravel()
    covariance = np.cov(a, b)
    factor = -covariance[0, 1] / covariance[1, 1] if covariance[1, 1] > 0 else 0.0
    spread = np.sqrt(covariance[0, 0] * covariance[1, 1])
    correlation = float(covariance[0, 1] / spread) if spread > 0 else 0.0
    combination = a + factor * b
    a_sd, b_sd = (float(np.std(x)) for x in (a, b))
    return ConfoundedPair(
        first, second, float(factor), float(combination.mean()), float(combination.std()), a_sd, b_sd, correlation
    )
