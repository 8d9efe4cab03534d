"""Stretch, preload and loops in words: what was fitted, and what the fit answers."""

from bowdenfit.inference.interval import Interval
from bowdenfit.questions.bends.answer import Elastic
from bowdenfit.questions.bends.overview import ElasticOverview, elastic_overview
from bowdenfit.results.record import Record
from bowdenfit.words import filled, significant, table

Cells = tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]
HEADING = "Stretch and preload, median (90 % interval)"


def bends_text(found: Elastic) -> str:
    """The answers, or what is missing for them.

    Args:
        found: The answers of a fit.
    """
    return elastic_text(found.fit) or filled(
        "Nothing measured on this cable tells of stretch or preload, or the fit has no draws; name a table of stretch, of "
        "preload or of the loop in cable.toml."
    )


def elastic_text(fit: Record) -> str:
    """The answers about stretch, preload and the loop, with their intervals."""
    found = elastic_overview(fit)
    if found is None:
        return ""
    tables = [table(heads, rows) for heads, rows in elastic_tables(found)]
    return "\n".join([*([HEADING] if tables else []), *tables, *(filled(s) for s in found.sentences)])


def elastic_tables(found: ElasticOverview) -> list[Cells]:
    """Heads and rows of the answers at wrap angles; none where the cable has none."""
    tables = [_answers(found, columns) for columns in _COLUMNS] if found.bends else []
    return [one for one in tables if one is not None]


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


def _answers(found: ElasticOverview, columns: tuple[tuple[str, str, int], ...]) -> Cells | None:
    """Some of the answers, a row for each wrap angle; None where the cable has none of them."""
    there = [column for column in columns if column[0] in found.bends[0]]
    if not there:
        return None
    under = f", {found.input_force:g} N" if any(key in _UNDER_LOAD for key, _, _ in there) else ""
    heads = (f"at (deg){under}", *(head.format(unit=found.friction_unit) for _, head, _ in there))
    rows = tuple(
        (f"{bend['wrap_angle']:g}", *(_interval(bend[key], digits) for key, _, digits in there)) for bend in found.bends
    )
    return heads, rows


_UNDER_LOAD = {"efficiency", "position_error", "stiffness"}


def _interval(known: Interval, digits: int) -> str:
    return f"{significant(known.median, digits)} ({significant(known.q05, digits)} to {significant(known.q95, digits)})"
