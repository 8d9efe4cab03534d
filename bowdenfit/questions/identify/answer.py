"""What the measurements of a cable determine, before any force is measured and after a fit, in words."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.identifiability import NOTHING, Combination, Knowledge, Known, knowledge
from bowdenfit.inference.least_squares import UNDETERMINED, MaximumPosterior
from bowdenfit.inference.profiles import Profile
from bowdenfit.model import Model
from bowdenfit.results.record import Record, once
from bowdenfit.words import decimals, listed

# Parameters that friction is made of, and those of the rope's elasticity: each group is judged by itself.
CURVES = "wrap angle curves"
GROUPS: Mapping[str, tuple[str, ...]] = {
    "friction": ("friction", "friction_model", "sensor", "angle"),
    "elastic": ("elastic",),
    CURVES: ("curve",),
}
_REMEDY = (
    "Coefficients rub at the same time, so only their weighted sum is seen; they come apart where the wrap angles change in "
    "different proportions: measure at lengths (or routes) where one contact turns much more than the others, or measure one "
    "coefficient separately and state it under [friction.NAME] as measured."
)


@dataclass(frozen=True)
class Identifiability:
    """What is known of the parameters of a cable, by group.

    Args:
        name: Name of the cable.
        basis: Where it was judged, in words.
        measured: Whether readings entered, or only the plan of what to measure.
        groups: Knowledge by group of `GROUPS`, as far as there are such parameters.
        profiles: How the sum of squares of the readings rises with each friction coefficient, the others fitted again.
    """

    name: str
    basis: str
    measured: bool
    groups: dict[str, Knowledge]
    profiles: tuple[Profile, ...] = ()

    JSON: ClassVar = ("name", "basis", "sentences", "groups", ("profiles", "rises"))

    def sentences(self) -> list[str]:
        """What is known, in words: friction first, and a remedy where something is not."""
        friction, elastic = (self.groups.get(group) for group in ("friction", "elastic"))
        said = [say_what_is_determined(friction, self.measured)] if friction else []
        if elastic is not None:
            said.append(say_what_is_determined(elastic, self.measured, "Of stretch and preload they determine"))
        if friction is not None and (friction.undetermined or friction.determined):
            said.append(_REMEDY)
        return said

    @property
    def rises(self) -> dict[str, Any]:
        """Profiles by the name of their coefficient."""
        return {p.name: {"value": p.values, "rise": p.rise} for p in self.profiles}


@once
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
        _, prior_sd = _linear(fit.model, np.median(drawn.flat_z, axis=0))
    groups = _groups(fit.model, np.mean(values, axis=0), spread, prior_sd)
    return Identifiability(fit.name, "the draws of the posterior", True, groups)


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
        value, slope = _linear(model, start.z)
    groups = _groups(model, value, covariance * np.outer(slope, slope), slope)
    return Identifiability(model.description.name, basis, measured, groups, profiles)


def _with_tails(model: Model, covariance: np.ndarray) -> np.ndarray:
    """The covariance, with the information of Student-t readings: nu / (nu + 3) of what residuals near zero suggest."""
    description = model.description
    if description.noise != "student":
        return covariance
    freedom, unit = description.student_degrees_of_freedom, np.eye(len(covariance))
    return np.linalg.inv(freedom / (freedom + 3) * (np.linalg.inv(covariance) - unit) + unit)


def _linear(model: Model, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values of the free parameters at z and their change with it, which is the prior's sd there; in shown units."""
    one = jax.ShapeDtypeStruct((len(z),), jnp.float64)
    value, slope = compile_program(lambda at: jax.jvp(model.space.vector, (at,), (jnp.ones_like(at),)), one, run_once=True)(z)
    scale = np.array([p.shown_scale for p in model.space.free])
    value, slope = np.asarray(value) * scale, np.abs(np.asarray(slope)) * scale
    return value, np.maximum(slope, 1e-12 * np.maximum(np.abs(value), 1.0))


def _groups(model: Model, value: np.ndarray, covariance: np.ndarray, prior_sd: np.ndarray) -> dict[str, Knowledge]:
    """Knowledge of every group, in shown units."""
    found = {}
    for group, roles in GROUPS.items():
        which = np.array([i for i, p in enumerate(model.space.free) if p.role in roles], dtype=int)
        if len(which):
            names = [model.space.free[i].name for i in which]
            found[group] = knowledge(names, value[which], covariance[np.ix_(which, which)], prior_sd[which])
    return found


def say_what_is_determined(found: Knowledge, measured: bool, opening: str = "") -> str:
    """What some parameters are known to, in one sentence.

    Args:
        found: What is known.
        measured: Whether readings entered.
        opening: How the sentence begins.
    """
    opening = opening or ("These measurements determine" if measured else "Measurements by this plan would determine")
    parts = [f"{p.name} {_to(p)}" for p in found.by_themselves]
    parts += [f"{c.words} {_to(c)}" for c in found.determined]
    said = f"{opening} {listed(parts)}" if parts else f"{opening} no coefficient by itself"
    resting, half = found.resting, found.partly
    if half:
        verb = "owes" if len(half) == 1 else "owe"
        said += f"; {listed([p.name for p in half])} {verb} about as much to the prior as to them"
    if resting:
        verb = "rests on its prior" if len(resting) == 1 else "rest on their priors"
        said += f"; {listed(resting)} {verb}"
    if found.sharpest is not None and not found.determined:
        said += f"; sharpest of all is {found.sharpest.words}, {_to(found.sharpest)}"
    return said + "."


def _to(known: Known | Combination) -> str:
    """How well a quantity is known: in percent where it is clear of zero, else in its unit."""
    if abs(known.value) > 2 * known.sd:
        return f"to {100 * known.sd / abs(known.value):.2g} %"
    return f"to +- {known.sd:.{decimals(known.sd)}f}"


def say_what_is_not_determined(fit: Record) -> str:
    """Which friction coefficients the measurements do not tell, in a sentence; empty where they tell all.

    Only coefficients with the weak default prior count: who states a coefficient as measured, or gives it a prior, knows
    that it rests on that. The same holds for what the data sheet of a load cell says.
    """
    names = [p.name for p in fit.model.space.free if p.role == "friction" and not _stated(fit, p.name)]
    if fit.posterior is None:
        return _in_words([name for name in names if _undetermined(fit, name)], None)
    friction = identifiability(fit).groups.get("friction")
    if friction is None:
        return ""
    share = {p.name: p.share for p in friction.parameters}
    lost = [n for n in names if share[n] > NOTHING or (_undetermined(fit, n) and n in friction.tangled)]
    known = next((c for c in friction.determined if set(c.weights) & set(lost)), None)
    return _in_words(lost, known)


def _undetermined(fit: Record, name: str) -> bool:
    """Whether least squares without priors leaves a coefficient open altogether."""
    estimates = fit.least_squares.estimates
    if any(estimates[p.name].remark == UNDETERMINED for p in fit.model.space.free if p.role == "sensor"):
        return False
    return estimates[name].remark == UNDETERMINED


def _in_words(lost: list[str], known: Combination | None) -> str:
    if not lost:
        return ""
    them = listed(lost)
    if known is not None:
        said = f"The measurements do not tell {them} apart: what they determine is {known.words}, {_to(known)}"
    else:
        said = f"The measurements do not determine {them}"
    rest = "rest on their priors" if len(lost) > 1 else "rests on its prior"
    return (
        f"{said}; {them} by {'themselves' if len(lost) > 1 else 'itself'} {rest}. Efficiencies where you measured still hold, "
        "the coefficients do not: measure where the wrap angles change in other proportions, or state a coefficient that was "
        "measured separately under [friction.NAME]."
    )


def _stated(fit: Record, name: str) -> bool:
    """Whether the description says something of a coefficient beyond naming it."""
    return name in fit.dataset.description.friction
