"""Where a cable loses its force, in the report."""

from bowdenfit.pages.section import Section, Table, prose
from bowdenfit.questions.loss.answer import loss_by_contact
from bowdenfit.questions.loss.words import HEADS, heading, loss_rows
from bowdenfit.results.record import Record


def section(fit: Record) -> Section | None:
    """The share of each contact; None for one contact, or without draws."""
    found = loss_by_contact(fit)
    if found is None:
        return None
    return prose("Where the force is lost", (), [Table(HEADS, tuple(loss_rows(found)), heading(found))])
