"""Candidates for the next reading of a cable: which there are, whether they make sense, and as users write them."""

import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bowdenfit.cable.sensors import RUN_SCATTER
from bowdenfit.errors import DatasetError, UsageError, suggest_name
from bowdenfit.kinds import find_readings, iterate_tables
from bowdenfit.kinds.candidate import STROKE_WORDS, Candidate, CandidateKind, Situation
from bowdenfit.kinds.tables import Measurements
from bowdenfit.kinds.term import Term
from bowdenfit.kinds.terms import candidate_kinds, find_term_kind
from bowdenfit.models import Model
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor, dimension_of, route_conversion_factor
from bowdenfit.words import listed, significant

_STROKES = {"pull": 1, "return": -1}
_NUMBER = re.compile(r"\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*(.*?)\s*")


def build_situation(model: Model, measurements: Measurements) -> Situation:
    """Return what is known of a cable before the next measurement."""
    return Situation(model.cable, measurements, frozenset(p.name for p in model.space.parameters))


def list_candidates(fit: Record) -> tuple[Candidate, ...]:
    """Return everything the tables of the description can hold, at the lengths and wrap angles that suggest themselves.

    Raises:
        UsageError: There is nothing that could be simulated.
    """
    candidates = _suitable_candidates(fit)
    if not candidates:
        names = [kind.name for kind, _ in iterate_tables(fit.dataset.measurements)]
        raise UsageError(
            f"the next reading of this fit's tables ({listed(names)}) cannot be simulated yet; {_suggest_alternative(fit)}."
        )
    return candidates


def _suggest_alternative(fit: Record) -> str:
    """Say what to ask where the tables offer nothing: readings of other kinds that this fit can simulate, or another verb."""
    can = [
        example_name(fit, kind)
        for kind in candidate_kinds().values()
        if not why_unsuitable(fit, _example_candidate(fit, kind))
    ]
    if can:
        return f"name others with --candidate, such as {' or '.join(can)}"
    return "bowdenfit identify says what is known least, and measuring at other bends helps most coefficients"


def example_name(fit: Record, kind: CandidateKind) -> str:
    """Return the name of an example of a kind, such as "efficiency@470" or "stretch@90deg,20N"."""
    return format_candidate(_example_candidate(fit, kind))


def _example_candidate(fit: Record, kind: CandidateKind) -> Candidate:
    return kind.example(build_situation(fit.model, fit.dataset.measurements))


def has_candidates(fit: Record) -> bool:
    """Whether the tables of the description hold anything whose next reading can be simulated."""
    return bool(_suitable_candidates(fit))


def rests_on_one_mounting(fit: Record) -> bool:
    """Whether how far mountings differ is to be found and all readings of friction come from one mounting."""
    is_free = any(p.name == RUN_SCATTER for p in fit.model.space.free)
    runs = [len(term.labels) if find_readings(term.name).are_runs else 2 for term in fit.model.terms if _shows_scatter(term)]
    return is_free and sum(runs) == 1


def _shows_scatter(term: Term) -> bool:
    return find_term_kind(term.name).shows_mounting_scatter


def _suitable_candidates(fit: Record) -> tuple[Candidate, ...]:
    situation = build_situation(fit.model, fit.dataset.measurements)
    return tuple(
        c for kind in candidate_kinds().values() for c in kind.candidates(situation) if not why_unsuitable(fit, c)
    )


def why_unsuitable(fit: Record, candidate: Candidate) -> str:
    """Return why a candidate makes no sense for this cable; empty where it does."""
    situation, kind = build_situation(fit.model, fit.dataset.measurements), candidate_kinds()[candidate.kind]
    route = fit.dataset.description.route
    reason = kind.why_unknown(situation)
    if reason or route is None or not (kind.along_route and situation.cable.curves and np.isfinite(candidate.route)):
        return reason
    low, high = route.range
    stands_in = (
        situation.angles is not None and not kind.measures_curves and candidate.route in situation.angles.route.tolist()
    )
    if low <= candidate.route <= high or stands_in:
        return ""
    cause = (
        "an angle there says nothing about the curves"
        if kind.measures_curves
        else "no angles were measured there that could stand in"
    )
    return (
        f"{candidate.route:g} {route.unit} lies outside the range of the curves, {low:g} to {high:g} {route.unit}, and {cause}"
        f"; name a {route_variable(fit)} inside."
    )


def route_variable(fit: Record) -> str:
    """Return what the route varies, in words."""
    route = fit.dataset.description.route
    return route.variable.replace("_", " ") if route else "length"


def describe_candidate(fit: Record, candidate: Candidate) -> str:
    """Return a candidate in words, such as "the wrap angles at 450 mm"."""
    route = fit.dataset.description.route
    what = candidate_kinds()[candidate.kind].describe_measurement(fit.model.cable)
    if route is not None and np.isfinite(candidate.route):
        what += f" at {candidate.route:g} {route.unit}"
    if candidate.angles:
        angles = " and ".join(f"{angle:.4g}" for angle in np.rad2deg(candidate.angles))
        what += f" at {angles} deg"
    what += f" under {significant(candidate.load)} N" if np.isfinite(candidate.load) else ""
    return what + (f" while {STROKE_WORDS[candidate.stroke]}" if candidate.stroke else "")


def format_candidate(candidate: Candidate) -> str:
    """Return a candidate as `parse_candidates` reads it."""
    parts = [f"{candidate.route:.12g}"] if np.isfinite(candidate.route) else []
    parts += [f"{angle:.6g}deg" for angle in np.rad2deg(candidate.angles)]
    parts += [f"{candidate.load:.6g}N"] if np.isfinite(candidate.load) else []
    parts += [{1: "pull", -1: "return"}[candidate.stroke]] if candidate.stroke else []
    return candidate.kind + ("@" + ",".join(parts) if parts else "")


def parse_candidates(fit: Record, texts: Iterable[str]) -> tuple[Candidate, ...]:
    """Read candidates as users write them, such as "angle@450" or "stretch@90deg,50N".

    Raises:
        UsageError: One is not understood, or makes no sense for this cable.
    """
    return tuple(dict.fromkeys(_parse_candidate(fit, text) for text in texts))


def _parse_candidate(fit: Record, text: str) -> Candidate:
    name, _, where = text.partition("@")
    kind = candidate_kinds().get(name)
    if kind is None:
        suggestion = suggest_name(name, list(candidate_kinds()))
        raise UsageError(f"--candidate {text!r} is of no kind that can be measured{suggestion}")
    candidate = Candidate(name)
    for part in filter(None, (part.strip() for part in where.split(","))):
        candidate = _add_part(fit, kind, candidate, text, part)
    _check_complete(fit, kind, candidate, text)
    reason = why_unsuitable(fit, candidate)
    if reason:
        raise UsageError(f"--candidate {text!r}: {reason}")
    return candidate


def _add_part(fit: Record, kind: CandidateKind, candidate: Candidate, text: str, part: str) -> Candidate:
    """Return the candidate with one more number of its place."""
    match = _NUMBER.fullmatch(part)
    route = fit.dataset.description.route
    has_designs = bool(kind.designs(build_situation(fit.model, fit.dataset.measurements)))
    if part in _STROKES and has_designs:
        return replace(candidate, stroke=_STROKES[part])
    try:
        value, unit = float(match[1]) if match else float("nan"), match[2] if match else ""
        if np.isnan(value):
            strokes = f", nor a stroke, {' or '.join(_STROKES)}" if has_designs else ""
            raise ValueError(f"{part!r} is not a number with its unit{strokes}")
        along = route is not None and kind.along_route and np.isnan(candidate.route)
        kind_of_unit = dimension_of(unit) if unit else ""
        if along and route is not None and (not unit or kind_of_unit == dimension_of(route.unit)):
            return replace(candidate, route=value * (route_conversion_factor(unit, route.unit) if unit else 1.0))
        if kind_of_unit == "force" and (kind.loaded or has_designs):
            return replace(candidate, load=value * conversion_factor(unit, "force"))
        if kind_of_unit == "angle" and kind.angles != "none":
            return replace(candidate, angles=(*candidate.angles, value * conversion_factor(unit, "angle")))
    except (ValueError, DatasetError) as error:
        raise UsageError(f"--candidate {text!r}: {error}.") from None
    units = f", with units where it is not a {route_variable(fit)}" if route is not None and kind.along_route else ""
    raise UsageError(
        f"--candidate {text!r}: {part!r} says nothing about {kind.phrase}; write it as {example_name(fit, kind)}{units}."
    )


def _check_complete(fit: Record, kind: CandidateKind, candidate: Candidate, text: str) -> None:
    """Refuse a candidate that lacks a number that its kind needs."""
    columns = build_situation(fit.model, fit.dataset.measurements).columns_without_curve
    if kind.along_route and fit.dataset.description.route is not None:
        missing = "" if np.isfinite(candidate.route) else f"the {route_variable(fit)}"
    else:
        n = {"none": 0, "columns": len(columns), "total": 1}[kind.angles]
        wanted = "a wrap angle" if n == 1 else f"the wrap angles in the columns {', '.join(columns)}"
        missing = "" if len(candidate.angles) == n else wanted
        if missing and n == 0:
            raise UsageError(
                f"--candidate {text!r}: this cable's wrap angles are constant, so there is no place to name; write "
                f"{kind.name} alone."
            )
    if not missing and (kind.loaded or not np.isnan(candidate.load)) and not candidate.load > 0:
        missing = "a load greater than zero"
    if not missing and any(not angle >= 0 for angle in candidate.angles):
        missing = "wrap angles without a sign"
    if missing:
        raise UsageError(f"--candidate {text!r} needs {missing}; write it as, for example, {example_name(fit, kind)}.")
