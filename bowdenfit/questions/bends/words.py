"""Stretch, preload and loops in words: what was fitted, and what the fit answers."""

from bowdenfit.inference.interval import Interval
from bowdenfit.questions.bends.overview import ElasticOverview, elastic_overview
from bowdenfit.results.record import Record
from bowdenfit.words import filled, table


def elastic_text(fit: Record) -> str:
    """The answers about stretch, preload and the loop, with their intervals."""
    found = elastic_overview(fit)
    if found is None:
        return ""
    tables = [_answers(found, columns) for columns in _COLUMNS] if found.bends else []
    blocks = [*([_HEADING] if tables else []), *(t for t in tables if t), *(filled(s) for s in found.sentences)]
    return "\n".join(blocks)


_HEADING = "Stretch and preload, median (90 % interval)"
_COLUMNS = (
    (
        ("preload", "preload (N)", 3),
        ("friction", "felt in free motion ({unit})", 3),
        ("slack_load", "return side slack from (N)", 3),
    ),
    (
        ("efficiency", "efficiency (%)", 3),
        ("position_error", "position error (mm)", 3),
        ("lost_motion", "lost motion (mm)", 2),
        ("stiffness", "stiffness (N/mm)", 3),
    ),
)


def _answers(found: ElasticOverview, columns: tuple[tuple[str, str, int], ...]) -> str:
    """Some of the answers, a row for each wrap angle; empty where the cable has none of them."""
    there = [column for column in columns if column[0] in found.bends[0]]
    if not there:
        return ""
    under = f", {found.input_force:g} N" if any(key in _UNDER_LOAD for key, _, _ in there) else ""
    heads = [f"at (deg){under}", *(head.format(unit=found.friction_unit) for _, head, _ in there)]
    rows = [
        [f"{bend['wrap_angle']:g}", *(_interval(bend[key], digits) for key, _, digits in there)] for bend in found.bends
    ]
    return table(heads, rows)


_UNDER_LOAD = {"efficiency", "position_error", "stiffness"}


def _interval(known: Interval, digits: int) -> str:
    return f"{known.median:.{digits}g} ({known.q05:.{digits}g} to {known.q95:.{digits}g})"
