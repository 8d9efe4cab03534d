"""Candidates as users write them, such as angle@450 or stretch@90deg,50N."""

import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bowdenfit.errors import DatasetError, UsageError, nearest
from bowdenfit.questions.next.possible_candidates import ALONG, columns_without_curve, route_words, why_not
from bowdenfit.questions.next.possible_readings import KINDS, Candidate
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor, dimension_of, route_conversion_factor

_LOADED = ("stretch", "loop")
_NUMBER = re.compile(r"\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
_EXAMPLES = {
    "angle": "angle@450",
    "force": "force@470",
    "efficiency": "efficiency@470",
    "stretch": "stretch@90deg,50N",
    "preload": "preload@90deg",
    "loop": "loop@90deg,30N",
}
_KIND_WORDS = {
    "angle": "an angle",
    "force": "a force run",
    "efficiency": "an efficiency",
    "stretch": "a stretch",
    "preload": "a preload",
    "loop": "a loop under load",
}


def parsed_candidates(fit: Record, texts: Iterable[str]) -> tuple[Candidate, ...]:
    """Candidates as users write them, such as "angle@450" or "stretch@90deg,50N".

    Raises:
        UsageError: One is not understood, or makes no sense for this cable.
    """
    return tuple(dict.fromkeys(_parsed(fit, text) for text in texts))


def _parsed(fit: Record, text: str) -> Candidate:
    kind, _, where = text.partition("@")
    if kind not in KINDS:
        raise UsageError(f"--candidate {text!r} is of no kind that can be measured{nearest(kind, KINDS)}")
    candidate = Candidate(kind)
    for part in filter(None, (part.strip() for part in where.split(","))):
        candidate = _with_part(fit, candidate, text, part)
    _check_complete(fit, candidate, text)
    reason = why_not(fit, candidate)
    if reason:
        raise UsageError(f"--candidate {text!r}: {reason}")
    return candidate


def _with_part(fit: Record, candidate: Candidate, text: str, part: str) -> Candidate:
    """The candidate with one more number of its place."""
    found = _NUMBER.fullmatch(part)
    route = fit.dataset.description.route
    try:
        value, unit = float(found[1]) if found else float("nan"), found[2] if found else ""
        if np.isnan(value):
            raise ValueError(f"{part!r} is no number with its unit")
        along = route is not None and candidate.kind in ALONG and np.isnan(candidate.route)
        kind_of_unit = dimension_of(unit) if unit else ""
        if along and route is not None and (not unit or kind_of_unit == dimension_of(route.unit)):
            return replace(candidate, route=value * (route_conversion_factor(unit, route.unit) if unit else 1.0))
        if kind_of_unit == "force" and candidate.kind in _LOADED:
            return replace(candidate, load=value * conversion_factor(unit, "force"))
        if kind_of_unit == "angle" and candidate.kind != "angle":
            return replace(candidate, angles=(*candidate.angles, value * conversion_factor(unit, "angle")))
    except (ValueError, DatasetError) as error:
        raise UsageError(f"--candidate {text!r}: {error}.") from None
    raise UsageError(
        f"--candidate {text!r}: {part!r} says nothing of {_KIND_WORDS[candidate.kind]}; write it as "
        f"{_EXAMPLES[candidate.kind]}, with units where it is no {route_words(fit)}."
    )


def _check_complete(fit: Record, candidate: Candidate, text: str) -> None:
    """Every number that the kind needs must be there."""
    along = candidate.kind in ALONG and fit.dataset.description.route is not None
    if along:
        missing = "" if np.isfinite(candidate.route) else f"the {route_words(fit)}"
    else:
        n = (
            1
            if candidate.kind in ("stretch", "preload")
            else len(columns_without_curve(fit)) * (candidate.kind != "angle")
        )
        wanted = "a wrap angle" if n == 1 else f"the wrap angles in the columns {', '.join(columns_without_curve(fit))}"
        missing = "" if len(candidate.angles) == n else wanted
        if missing and n == 0:
            raise UsageError(
                f"--candidate {text!r}: this cable's wrap angles are constant, so there is no place to name; write "
                f"{candidate.kind} alone."
            )
    if not missing and candidate.kind in _LOADED and not candidate.load > 0:
        missing = "a load greater than zero"
    if not missing and any(not angle >= 0 for angle in candidate.angles):
        missing = "wrap angles without a sign"
    if missing:
        example = _EXAMPLES[candidate.kind]
        raise UsageError(f"--candidate {text!r} needs {missing}; write it as, for example, {example}.")
