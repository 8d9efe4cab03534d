"""Shares of the contacts as the whole summary shows them."""

from bowdenfit.questions.loss.answer import Loss, loss_by_contact
from bowdenfit.results.record import Record
from bowdenfit.words import percent, table

HEADS = ("contact", "share", "90 % interval", "probability of the largest")


def loss_text(fit: Record) -> str:
    """A table of the contacts' shares; empty for one contact, or without draws."""
    found = loss_by_contact(fit)
    return f"{heading(found)}\n{table(HEADS, loss_rows(found))}" if found is not None else ""


def heading(found: Loss) -> str:
    """What is said of which place."""
    return "Where the force is lost" + (f", {found.place}" if found.place else "")


def loss_rows(found: Loss) -> list[tuple[str, ...]]:
    """A row for each contact, under `HEADS`."""
    rows = list[tuple[str, ...]]()
    for one in found.contacts:
        interval = f"{percent(one.share.q05)} to {percent(one.share.q95)}"
        rows.append((one.name, percent(one.share.median), interval, percent(one.probability_largest, 0)))
    return rows
