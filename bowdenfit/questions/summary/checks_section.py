"""Checks of a fit against its own readings, in the report."""

from bowdenfit.pages.section import Section, Table, prose
from bowdenfit.questions.check.answer import checks_of
from bowdenfit.questions.check.words import describe_checks
from bowdenfit.questions.summary.answer import checked_readings, readings_off
from bowdenfit.questions.summary.brief_words import READING_HEADS, none_is_off, reading_row
from bowdenfit.results.record import Record

_MOST = 400  # readings in a table that someone may look through


def section(fit: Record) -> Section | None:
    """Readings that are off; folded, all readings and what the checks say in full. None without draws."""
    off, every = readings_off(fit), checked_readings(fit)
    if not every:
        return None
    heads = ("reading", *READING_HEADS)
    far = Table(heads, tuple(map(reading_row, off)), f"Off: {len(off)} of {len(every)} readings")
    rest = Table(heads, tuple(map(reading_row, every[:_MOST])))
    whole = "All readings" if len(every) <= _MOST else f"The first {_MOST} of {len(every)} readings"
    folded: list[tuple[str, str | Table]] = [
        (f"{whole} beside what all the others say of each", rest),
        ("What the checks say, with their numbers", describe_checks(checks_of(fit))),
    ]
    return prose("Checks", [none_is_off(every) if not off else ""], [far], folded=folded)
