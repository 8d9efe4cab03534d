"""Force lost to drag: drag is a hidden tension that the load cells do not show, not the lost force itself."""

from dataclasses import dataclass
from typing import ClassVar

import jax
import numpy as np

from bowdenfit.cable.friction import DRAG
from bowdenfit.inference.draws import output_force_at
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.recorded.rate import usual_length
from bowdenfit.results.record import OPTIMAL_LENGTH, Record, cached_per_fit
from bowdenfit.words import decimals


@dataclass(frozen=True)
class LostForce:
    """Hidden tension, and the force that it costs while pulling.

    Args:
        place: Where on the route, in words; empty without a route.
        hidden_tension: D [N].
        lost: D (1 - exp(-Lambda)), by which the output is below that of the capstan equation at any load; with a load
            exponent, at no load [N].
        at_any_load: Whether it is the same at any load.
    """

    place: str
    hidden_tension: Interval
    lost: Interval
    at_any_load: bool

    JSON: ClassVar = (
        ("at", "place"), ("hidden_tension_N", "hidden_tension"), ("lost_force_N", "lost"), "at_any_load",
        ("in_words", "sentence"),
    )  # fmt: skip

    def sentence(self) -> str:
        """Return both numbers in a sentence."""
        where = f" {self.place}" if self.place else ""
        load = "at any load" if self.at_any_load else "even at the smallest load"
        return (
            f"Drag: while pulling{where}, {_interval_words(self.lost)} of the force is lost {load}, as if "
            f"{_interval_words(self.hidden_tension)} of tension did not show at the cells."
        )

    def explanation(self) -> str:
        """Return the sentence with the formula that relates both numbers."""
        return (
            f"{self.sentence()} The parameter drag is that hidden tension D; it costs D (1 - exp(-Lambda)), Lambda being the "
            "sum of friction coefficient times wrap angle."
        )

    def short(self) -> str:
        """Both medians, for a figure."""
        lost, hidden = (f"{of.median:z.{decimals(of.sd)}f} N" for of in (self.lost, self.hidden_tension))
        return (
            f"{lost} lost at any load,\nby {hidden} of hidden tension"
            if self.at_any_load
            else f"{hidden} of hidden tension"
        )


@cached_per_fit
def lost_force(fit: Record) -> LostForce | None:
    """Hidden tension and the force that it costs, at the best length where the fit has one; None without drag or draws.

    From F_out = (F_in + D) exp(-Lambda) - D: the output is F_in exp(-Lambda) less D (1 - exp(-Lambda)), which is minus the
    output at no input.
    """
    friction = fit.model.cable.friction
    if fit.sampled is None or DRAG not in friction.options:
        return None
    at, place = usual_length(fit)
    route, best = fit.dataset.description.route, fit.posterior.optimum.get(OPTIMAL_LENGTH)
    if route is not None and best is not None:
        at = float(np.median(best))
        place = f"at {at:.4g} {route.unit}"
    z = fit.posterior.flat_z
    with jax.enable_x64(True):
        lost = -output_force_at(fit.model, z, np.array([at]), 0.0, 1, (np.zeros(len(z)),))[0][:, 0]
    fixed = {p.name: np.full(len(z), p.fixed) for p in fit.model.space.fixed if p.fixed is not None}
    tension = (fit.posterior.values | fixed)[DRAG]
    return LostForce(place, Interval.of(tension), Interval.of(lost), "load-dependent" not in friction.options)


def _interval_words(known: Interval) -> str:
    digits = decimals(known.sd)
    return f"{known.median:z.{digits}f} N (90 % interval {known.q05:z.{digits}f} to {known.q95:z.{digits}f} N)"
