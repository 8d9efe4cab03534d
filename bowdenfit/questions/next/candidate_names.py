"""Candidates as users write them, such as angle@450 or stretch@90deg,50N."""

import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bowdenfit.errors import DatasetError, UsageError, suggest_name
from bowdenfit.kinds.candidate import Candidate, CandidateKind
from bowdenfit.kinds.terms import candidate_kinds
from bowdenfit.questions.next.candidates import build_situation, example_name, route_variable, why_unsuitable
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor, dimension_of, route_conversion_factor

_STROKES = {"pull": 1, "return": -1}
_NUMBER = re.compile(r"\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*(.*?)\s*")


def parse_candidates(fit: Record, texts: Iterable[str]) -> tuple[Candidate, ...]:
    """Candidates as users write them, such as "angle@450" or "stretch@90deg,50N".

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
    """The candidate with one more number of its place."""
    match = _NUMBER.fullmatch(part)
    route = fit.dataset.description.route
    has_designs = bool(kind.designs(build_situation(fit.model, fit.dataset.measurements)))
    if part in _STROKES and has_designs:
        return replace(candidate, stroke=_STROKES[part])
    try:
        value, unit = float(match[1]) if match else float("nan"), match[2] if match else ""
        if np.isnan(value):
            strokes = f", nor a stroke, {' or '.join(_STROKES)}" if has_designs else ""
            raise ValueError(f"{part!r} is no number with its unit{strokes}")
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
    units = f", with units where it is no {route_variable(fit)}" if route is not None and kind.along_route else ""
    raise UsageError(
        f"--candidate {text!r}: {part!r} says nothing of {kind.phrase}; write it as {example_name(fit, kind)}{units}."
    )


def _check_complete(fit: Record, kind: CandidateKind, candidate: Candidate, text: str) -> None:
    """Every number that the kind needs must be there."""
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
