"""Shares of the contacts as the whole summary shows them."""

from bowdenfit.questions.loss.answer import loss_by_contact
from bowdenfit.results.record import Record
from bowdenfit.words import percent, table


def loss_text(fit: Record) -> str:
    """A table of the contacts' shares; empty for one contact, or without draws."""
    if (found := loss_by_contact(fit)) is None:
        return ""
    rows = []
    for one in found.contacts:
        interval = f"{percent(one.share.q05)} to {percent(one.share.q95)}"
        rows.append((one.name, percent(one.share.median), interval, percent(one.probability_largest, 0)))
    where = f", {found.place}" if found.place else ""
    heads = ("contact", "share", "90 % interval", "probability of the largest")
    return f"Where the force is lost{where}\n" + table(heads, rows)
