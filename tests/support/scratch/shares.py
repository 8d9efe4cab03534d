"""A question: which contact takes what share of the loss? With its figure."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from bowdenfit.arguments import FIT, RESULTS
from bowdenfit.inference.interval import Interval
from bowdenfit.verb import Reply, Verb


@dataclass(frozen=True)
class Share:
    """Share of one contact in the friction exponent."""

    contact: str
    share: Interval


def shares(fit: Annotated[Any, RESULTS, FIT]) -> tuple[Share, ...]:
    """Shares of all contacts with a constant wrap angle."""
    contacts = fit.dataset.description.contact
    parts = [fit.draws().values[c.friction] * c.wrap_angle.constant.to("angle") for c in contacts]
    whole = np.sum(parts, axis=0)
    return tuple(Share(c.name, Interval.of(part / whole)) for c, part in zip(contacts, parts, strict=True))


def words(answer, _):
    """A line a contact."""
    lines = [f"{item.contact}: {item.share.median:.0%} of the loss" for item in answer]
    return Reply("\n".join(lines) + "\n", lambda: {item.contact: item.share.median for item in answer})


VERB = Verb(shares, words, "Say which contact takes what share of the loss.")


HEADING = "Who takes what"


def data(fit):
    """What the figure shows."""
    return shares(fit) if fit.sampled is not None else None


def caption(answer):
    """What is drawn."""
    return f"Share of the loss of {len(answer)} contacts."


def draw(answer, width=None):
    """A bar a contact."""
    from bowdenfit.plots.layout import panels

    figure, (axes,) = panels([1.5], 1, 0.1, (0, 0), width or 4.6)
    axes.bar([item.contact for item in answer], [item.share.median for item in answer])
    axes.set_ylabel("Share of the loss")
    return figure
