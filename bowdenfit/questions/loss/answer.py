"""Which contact takes how much of what a cable loses: where to work on it."""

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
from bowdenfit.questions.recorded.rate import usual_length
from bowdenfit.results.record import OPTIMAL_LENGTH, Record, cached_per_fit, parameter_values
from bowdenfit.words import counted, listed, percent

_LONGEST_NAME = 40  # characters of a contact's name in a sentence
_FEW = 3  # contacts after the first that a sentence names


@dataclass(frozen=True)
class ContactShare:
    """One contact.

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
class Loss:
    """Shares of the contacts, the largest first.

    Args:
        place: Where on the route, in words; empty without a route.
        contacts: Each contact's share.
    """

    place: str
    contacts: tuple[ContactShare, ...]

    JSON: ClassVar = (("at", "place"), "contacts", ("in_words", "sentence"))

    def sentence(self) -> str:
        """'72 % of the loss sits at the bracket edge (90 % interval 62 to 79 %), 15 % at the squeezed sheath, ...'"""
        first, *others = self.contacts
        low, high = (percent(of, 0) for of in (first.share.q05, first.share.q95))
        rest = [f"{percent(c.share.median, 0)} at {c.name!r}" for c in others[:_FEW]]
        if len(others) > _FEW:
            rest.append(f"the rest at {counted(len(others) - _FEW, 'other')}")
        where = f"{self.place[0].upper()}{self.place[1:]}, " if self.place else ""
        return (
            f"{where}{percent(first.share.median, 0)} of the loss sits at {first.name!r} "
            f"(90 % interval {low.removesuffix(' %')} to {high}), {listed(rest)}."
        )


@cached_per_fit
def loss_by_contact(fit: Record) -> Loss | None:
    r"""Share of each contact in the friction exponent, at the best length if there is one; None without draws or contacts.

    .. math:: \frac{\mu_k \theta_k}{\sum_j \mu_j \theta_j}

    The exponents of contacts in series add up (on-body paper, equation 7), so this is their share of the logarithm of the loss.
    Contacts whose angle was measured in each run count at their nominal angle.

    Args:
        fit: The fit.
    """
    laws, route = fit.model.cable.laws, fit.dataset.description.route
    if fit.sampled is None or len(laws) < 2:
        return None
    at, place = usual_length(fit)
    if route is not None and (lengths := fit.posterior.optimum.get(OPTIMAL_LENGTH)) is not None:
        best = Interval.of(lengths)
        at, place = best.median, f"at {best.median:z.{best.digits}f} {route.unit}"
    shares = _shares(fit, at)
    largest = np.argmax(shares, axis=1)
    contacts = [
        ContactShare(law.contact, Interval.of(shares[:, k]), float(np.mean(largest == k))) for k, law in enumerate(laws)
    ]
    return Loss(place, tuple(sorted(contacts, key=lambda c: -c.share.median)))


def _shares(fit: Record, at: float) -> np.ndarray:
    """Share of each contact (columns) in each draw (rows) at a value of the route variable."""
    cable = fit.model.cable

    def exponents(values: dict[str, Array], route: Float[Array, " one"]) -> Array:
        angles = cable.wrap_angles(values, route)
        return jnp.stack([law.exponent(values, angles[:, k])[0] for k, law in enumerate(cable.laws)])

    with jax.enable_x64(True):
        found = np.asarray(for_each_value(exponents, parameter_values(fit), np.array([at])))
    total = np.sum(found, axis=1, keepdims=True)
    return np.where(total > 0, found / np.where(total > 0, total, 1.0), 1 / len(cable.laws))
