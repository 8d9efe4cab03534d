"""The coefficients in the report: value, interval and what each is."""

from bowdenfit.pages.section import Section, Table, prose
from bowdenfit.questions.groups.words import groups_text
from bowdenfit.questions.summary.answer import quantities
from bowdenfit.questions.summary.parameter_words import parameters_text
from bowdenfit.results.record import Record

_HEADS = ("coefficient", "value", "90 % interval", "unit", "what it is")


def section(fit: Record) -> Section | None:
    """Coefficients of friction and of the rope; None where every one is stated."""
    rows = tuple((q.name, q.value, q.interval, q.unit, q.what) for q in quantities(fit))
    folded = [("Every parameter, with what was assumed beforehand", parameters_text(fit)), ("Groups", groups_text(fit))]
    return prose("Coefficients", (), [Table(_HEADS, rows, left=(0, 3, 4))], folded=folded) if rows else None
