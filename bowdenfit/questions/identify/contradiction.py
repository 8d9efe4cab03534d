"""Which tables of a fit contradict the others, in words."""

from typing import Any

from bowdenfit.inference.disagreement import NOTICEABLE_SDS, Disagreement
from bowdenfit.kinds import readings_called
from bowdenfit.results.record import Record
from bowdenfit.results.serialization import values_by_key
from bowdenfit.words import decimals

_AS_MUCH = 0.8  # of the largest conflict: beyond that either table may be the odd one out


def agreement_page(fit: Record) -> list[dict[str, Any]]:
    """How well each table agrees with everything else, the odd one out first."""
    found = sorted(fit.least_squares.disagreements, key=lambda d: -d.conflict)
    return [values_by_key(d) | {"unit": _unit(fit, d)} for d in found]


def contradiction(fit: Record) -> str:
    """The table that is the odd one out, in a sentence; empty where all agree."""
    worst = max(fit.least_squares.disagreements, key=lambda d: d.conflict, default=None)
    if worst is None or worst.sds < NOTICEABLE_SDS:
        return ""
    unit, digits = _unit(fit, worst), decimals(worst.others_sd)
    name, *others = (
        readings_called(d.table).table
        for d in (worst, *(d for d in fit.least_squares.disagreements if d is not worst))
        if d.conflict > _AS_MUCH * worst.conflict
    )
    or_else = f" (or {' or '.join(f'that of {other}' for other in others)})" if others else ""
    together = f"{worst.together:z.{digits}f}{unit}"
    return (
        f"The table of {name}{or_else} disagrees with everything else by {worst.sds:.1f} standard deviations: "
        f"without it {worst.parameter} would be {worst.others:z.{digits}f} ± {worst.others_sd:z.{digits}f}{unit}, with it the "
        f"fit is at {together}. Look at the units and wrap angles of that table and at how it was measured: the numbers below "
        "are a compromise between readings that cannot all be right."
    )


def _unit(fit: Record, found: Disagreement) -> str:
    """Unit of the parameter, with a blank before it."""
    unit = next(p.unit for p in fit.model.space.free if p.name == found.parameter)
    return "" if unit == "1" else f" {unit}"
