"""Which readings could be taken next of a cable, whether they make sense, and what they are called."""

import numpy as np

from bowdenfit.errors import UsageError
from bowdenfit.kinds import each_table
from bowdenfit.kinds.candidate import STROKE_WORDS, Candidate, CandidateKind, Situation
from bowdenfit.kinds.tables import Measurements
from bowdenfit.kinds.terms import candidate_kinds
from bowdenfit.model import Model
from bowdenfit.results.record import Record
from bowdenfit.words import listed, significant


def build_situation(model: Model, measurements: Measurements) -> Situation:
    """What is known of a cable before the next measurement."""
    return Situation(model.cable, measurements, frozenset(p.name for p in model.space.parameters))


def list_candidates(fit: Record) -> tuple[Candidate, ...]:
    """Everything the tables of the description can hold, at the lengths and wrap angles that suggest themselves.

    Raises:
        UsageError: There is nothing that could be simulated.
    """
    candidates = _suitable_candidates(fit)
    if not candidates:
        names = [kind.name for kind, _ in each_table(fit.dataset.measurements)]
        raise UsageError(
            f"the next reading of this fit's tables ({listed(names)}) cannot be simulated yet; {_suggest_alternative(fit)}."
        )
    return candidates


def _suggest_alternative(fit: Record) -> str:
    """What to ask where the tables offer nothing: readings of other kinds that this fit can simulate, or another verb."""
    can = [
        example_name(fit, kind)
        for kind in candidate_kinds().values()
        if not why_unsuitable(fit, _example_candidate(fit, kind))
    ]
    if can:
        return f"name others with --candidate, such as {' or '.join(can)}"
    return "bowdenfit identify says what is known least, and measuring at other bends tells more of most coefficients"


def example_name(fit: Record, kind: CandidateKind) -> str:
    """How readings of a kind are named of this cable, such as "efficiency@470" or "stretch@90deg,20N"."""
    return format_candidate(_example_candidate(fit, kind))


def _example_candidate(fit: Record, kind: CandidateKind) -> Candidate:
    return kind.example(build_situation(fit.model, fit.dataset.measurements))


def has_candidates(fit: Record) -> bool:
    """Whether the tables of the description hold anything whose next reading can be simulated."""
    return bool(_suitable_candidates(fit))


def _suitable_candidates(fit: Record) -> tuple[Candidate, ...]:
    situation = build_situation(fit.model, fit.dataset.measurements)
    return tuple(
        c for kind in candidate_kinds().values() for c in kind.candidates(situation) if not why_unsuitable(fit, c)
    )


def why_unsuitable(fit: Record, candidate: Candidate) -> str:
    """Why a candidate makes no sense for this cable; empty where it does."""
    situation, kind = build_situation(fit.model, fit.dataset.measurements), candidate_kinds()[candidate.kind]
    route = fit.dataset.description.route
    reason = kind.why_unknown(situation)
    if reason or route is None or not (kind.along_route and situation.cable.curves and np.isfinite(candidate.route)):
        return reason
    low, high = route.range
    stands_in = (
        situation.angles is not None and not kind.tells_curves and candidate.route in situation.angles.route.tolist()
    )
    if low <= candidate.route <= high or stands_in:
        return ""
    why = (
        "an angle there tells nothing of the curves"
        if kind.tells_curves
        else "no angles were measured there that could stand in"
    )
    return (
        f"{candidate.route:g} {route.unit} lies outside the range of the curves, {low:g} to {high:g} {route.unit}, and {why}; "
        f"name a {route_variable(fit)} inside."
    )


def route_variable(fit: Record) -> str:
    """What the route varies, in words."""
    route = fit.dataset.description.route
    return route.variable.replace("_", " ") if route else "length"


def describe_candidate(fit: Record, candidate: Candidate) -> str:
    """A candidate in words, such as "the wrap angles at 450 mm"."""
    route = fit.dataset.description.route
    what = candidate_kinds()[candidate.kind].measured(fit.model.cable)
    if route is not None and np.isfinite(candidate.route):
        what += f" at {candidate.route:g} {route.unit}"
    if candidate.angles:
        angles = " and ".join(f"{angle:.4g}" for angle in np.rad2deg(candidate.angles))
        what += f" at {angles} deg"
    what += f" under {significant(candidate.load)} N" if np.isfinite(candidate.load) else ""
    return what + (f" while {STROKE_WORDS[candidate.stroke]}" if candidate.stroke else "")


def format_candidate(candidate: Candidate) -> str:
    """A candidate as `parse_candidates` reads it."""
    parts = [f"{candidate.route:.12g}"] if np.isfinite(candidate.route) else []
    parts += [f"{angle:.6g}deg" for angle in np.rad2deg(candidate.angles)]
    parts += [f"{candidate.load:.6g}N"] if np.isfinite(candidate.load) else []
    parts += [{1: "pull", -1: "return"}[candidate.stroke]] if candidate.stroke else []
    return candidate.kind + ("@" + ",".join(parts) if parts else "")
