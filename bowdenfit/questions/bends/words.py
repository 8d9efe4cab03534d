"""Stretch, preload and loops in words: what was fitted, and what the fit answers."""

from typing import Any

from bowdenfit.questions.bends.page import elastic_page
from bowdenfit.results.record import Record
from bowdenfit.words import filled, table


def elastic_text(fit: Record) -> str:
    """The answers about stretch, preload and the loop, with their intervals."""
    page = elastic_page(fit)
    if not page:
        return ""
    tables = [_answers(page, columns) for columns in _COLUMNS] if page["bends"] else []
    blocks = [*([_HEADING] if tables else []), *(t for t in tables if t), *(filled(s) for s in page["sentences"])]
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


def _answers(page: dict[str, Any], columns: tuple[tuple[str, str, int], ...]) -> str:
    """Some of the answers, a row for each wrap angle; empty where the cable has none of them."""
    there = [column for column in columns if column[0] in page["bends"][0]]
    if not there:
        return ""
    under = f", {page['input_force']:g} N" if any(key in _UNDER_LOAD for key, _, _ in there) else ""
    heads = [f"at (deg){under}", *(head.format(unit=page["friction_unit"]) for _, head, _ in there)]
    rows = [
        [f"{bend['wrap_angle']:g}", *(_interval(bend[key], digits) for key, _, digits in there)]
        for bend in page["bends"]
    ]
    return table(heads, rows)


_UNDER_LOAD = {"efficiency", "position_error", "stiffness"}


def _interval(row: dict[str, float], digits: int) -> str:
    return f"{row['median']:.{digits}g} ({row['q05']:.{digits}g} to {row['q95']:.{digits}g})"
