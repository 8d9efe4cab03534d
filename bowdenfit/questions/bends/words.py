"""Answers about stretch, preload and loops in words."""

from bowdenfit.inference.interval import Interval
from bowdenfit.questions.bends.answer import ElasticAnswers
from bowdenfit.questions.bends.overview import ElasticOverview, elastic_overview
from bowdenfit.results.record import Record
from bowdenfit.words import filled, significant, table

Cells = tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]
HEADING = "Stretch and preload, median (90 % interval)"


def bends_text(answers: ElasticAnswers) -> str:
    """The answers, or what is missing for them.

    Args:
        answers: The answers of a fit.
    """
    return describe_elastic(answers.fit) or filled(
        "Nothing measured on this cable determines its stretch or preload, or the fit has no draws; name a table of "
        "stretch, of preload or of the loop in cable.toml."
    )


def describe_elastic(fit: Record) -> str:
    """The answers about stretch, preload and the loop, with their intervals."""
    overview = elastic_overview(fit)
    if overview is None:
        return ""
    tables = [table(heads, rows) for heads, rows in elastic_tables(overview)]
    return "\n".join([*([HEADING] if tables else []), *tables, *(filled(s) for s in overview.sentences)])


def elastic_tables(overview: ElasticOverview) -> list[Cells]:
    """Heads and rows of the answers at wrap angles; none where the cable has none."""
    tables = [_answer_table(overview, columns) for columns in _COLUMNS] if overview.bends else []
    return [table for table in tables if table is not None]


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


def _answer_table(overview: ElasticOverview, columns: tuple[tuple[str, str, int], ...]) -> Cells | None:
    """Some of the answers, a row for each wrap angle; None where the cable has none of them."""
    known = [column for column in columns if column[0] in overview.bends[0]]
    if not known:
        return None
    under = f", {overview.input_force:g} N" if any(key in _UNDER_LOAD for key, _, _ in known) else ""
    heads = (f"at (deg){under}", *(head.format(unit=overview.friction_unit) for _, head, _ in known))
    rows = tuple(
        (f"{bend['wrap_angle']:g}", *(_interval_words(bend[key], digits) for key, _, digits in known))
        for bend in overview.bends
    )
    return heads, rows


_UNDER_LOAD = {"efficiency", "position_error", "stiffness"}


def _interval_words(known: Interval, digits: int) -> str:
    return f"{significant(known.median, digits)} ({significant(known.q05, digits)} to {significant(known.q95, digits)})"
