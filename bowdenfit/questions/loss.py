"""Loss by contact: which contact takes how much of what a cable loses, in words and as a section of the report."""

import textwrap
from dataclasses import dataclass
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.inference.draws import for_each_value
from bowdenfit.inference.interval import Interval
from bowdenfit.pages.section import Chart, PageSection, PageTable, Picture, Series, SeriesGroup, prose_section
from bowdenfit.plots.style import MEDIAN, WIDE_INTERVAL
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.questions.recorded.friction_effects import choose_recorded_length
from bowdenfit.results.record import OPTIMAL_LENGTH, Record, cached_per_fit, parameter_values
from bowdenfit.words import counted, listed, percent, table

_LONGEST_NAME = 40  # characters of a contact's name in a sentence; a judgement
_FEW = 3  # contacts after the first that a sentence names; a judgement
LOSS_TITLE = "Where the force is lost"
HEADS = ("contact", "share", "90 % interval", "probability of the largest")


@dataclass(frozen=True)
class ContactShare:
    """Share of one contact in the loss.

    Args:
        contact: Its name.
        share: Its part of the friction exponent [1].
        probability_largest: Probability that no other contact takes more.
    """

    contact: str
    share: Interval
    probability_largest: float

    @property
    def name(self) -> str:
        """The contact as a sentence names it."""
        return textwrap.shorten(self.contact, _LONGEST_NAME, placeholder="...")


@dataclass(frozen=True)
class LossByContact:
    """Shares of the contacts, the largest first.

    Args:
        position: Where on the route, in words; empty without a route.
        contacts: Each contact's share.
    """

    position: str
    contacts: tuple[ContactShare, ...]

    JSON: ClassVar = (("at", "position"), "contacts", ("in_words", "sentence"))

    def sentence(self) -> str:
        """Return the shares in words: "72 % of the loss occurs at the bracket edge (90 % interval 62 to 79 %), 15 % at ..."."""
        largest, *others = self.contacts
        low, high = (percent(end, 0) for end in (largest.share.q05, largest.share.q95))
        remaining = [f"{percent(c.share.median, 0)} at {c.name!r}" for c in others[:_FEW]]
        if len(others) > _FEW:
            remaining.append(f"the rest at {counted(len(others) - _FEW, 'other')}")
        place = f"{self.position[0].upper()}{self.position[1:]}, " if self.position else ""
        return (
            f"{place}{percent(largest.share.median, 0)} of the loss occurs at {largest.name!r} "
            f"(90 % interval {low.removesuffix(' %')} to {high}), {listed(remaining)}."
        )


@cached_per_fit
def loss_by_contact(fit: Record) -> LossByContact | None:
    r"""Return the share of each contact in the friction exponent, at the best length if any; None without draws or contacts.

    .. math:: \frac{\mu_k \theta_k}{\sum_j \mu_j \theta_j}

    The exponents of contacts in series add up (on-body paper, equation 7), so this is their share of the logarithm of the loss.
    Contacts whose angle was measured in each run count at their nominal angle.

    Args:
        fit: The fit.
    """
    laws, route = fit.model.cable.laws, fit.dataset.description.route
    if fit.sampled is None or len(laws) < 2:
        return None
    fit = with_bench_errors(fit)
    route_value, position = choose_recorded_length(fit)
    if route is not None and (lengths := fit.posterior.optimum.get(OPTIMAL_LENGTH)) is not None:
        best = Interval.of(lengths)
        route_value, position = best.median, f"at {best.median:z.{best.digits}f} {route.unit}"
    shares = _compute_shares(fit, route_value)
    largest = np.argmax(shares, axis=1)
    contacts = [
        ContactShare(law.contact, Interval.of(shares[:, k]), float(np.mean(largest == k))) for k, law in enumerate(laws)
    ]
    return LossByContact(position, tuple(sorted(contacts, key=lambda c: -c.share.median)))


def _compute_shares(fit: Record, at: float) -> np.ndarray:
    """Return the share of each contact (columns) in each draw (rows) at a value of the route variable."""
    cable = fit.model.cable

    def exponents(values: dict[str, Array], route: Float[Array, " one"]) -> Array:
        angles = cable.wrap_angles(values, route)
        both = [law.exponent(values, angles[:, k]) + law.exponent_along(values, route) for k, law in enumerate(cable.laws)]
        return jnp.stack(both)[:, 0]

    with jax.enable_x64(True):
        exponents_by_contact = np.asarray(for_each_value(exponents, parameter_values(fit), np.array([at])))
    total = np.sum(exponents_by_contact, axis=1, keepdims=True)
    return np.where(total > 0, exponents_by_contact / np.where(total > 0, total, 1.0), 1 / len(cable.laws))


def loss_text(fit: Record) -> str:
    """Return a table of the contacts' shares; empty for one contact, or without draws."""
    loss = loss_by_contact(fit)
    return f"{loss_heading(loss)}\n{table(HEADS, loss_rows(loss))}" if loss is not None else ""


def loss_heading(loss: LossByContact) -> str:
    """Return the heading of the table, with the place on the route."""
    return LOSS_TITLE + (f", {loss.position}" if loss.position else "")


def loss_rows(loss: LossByContact) -> list[tuple[str, ...]]:
    """Return a row for each contact, under `HEADS`."""
    rows = list[tuple[str, ...]]()
    for contact in loss.contacts:
        interval = f"{percent(contact.share.q05)} to {percent(contact.share.q95)}"
        rows.append((contact.name, percent(contact.share.median), interval, percent(contact.probability_largest, 0)))
    return rows


def loss_section(fit: Record) -> PageSection | None:
    """Return the share of each contact as a section; None for one contact, or without draws."""
    loss = loss_by_contact(fit)
    if loss is None:
        return None
    table_of_shares = PageTable(HEADS, tuple(loss_rows(loss)), loss_heading(loss))
    place = f", {loss.position}" if loss.position else ""
    caption = f"Share of each contact in the loss{place}: median, and the interval that holds it with 90 % probability."
    picture = Picture("loss", LOSS_TITLE, caption, (make_loss_chart(loss),), caption, alone=True)
    return prose_section(LOSS_TITLE, (), [table_of_shares], pictures=(picture,))


def make_loss_chart(loss: LossByContact) -> Chart:
    """Return the chart of the share of each contact [%], with its interval."""
    names, shares = tuple(contact.name for contact in loss.contacts), [contact.share for contact in loss.contacts]
    low, median, high = (100 * np.array([getattr(share, name) for share in shares]) for name in ("q05", "median", "q95"))
    series = (
        Series(WIDE_INTERVAL, "from", "blue", low),
        Series(WIDE_INTERVAL, "to", "blue", high),
        Series(MEDIAN, "points", "blue", median),
    )
    places = SeriesGroup(np.arange(1.0, len(names) + 1), series)
    return Chart("Loss", "Contact", "Share of the loss (%)", (places,), place_names=names)
