"""How far a rope creeps after a turn of the motion until its friction is built up, in a sentence."""

from dataclasses import dataclass

from bowdenfit.cable.friction_options import PRESLIDING_STIFFNESS
from bowdenfit.inference.interval import Interval
from bowdenfit.results.record import Record
from bowdenfit.words import percent

# Ratio of the ends of the 90 % interval of a positive quantity that is two standard deviations clear of 0, or more.
_CLEAR_OF_PLAY = 10.0


@dataclass(frozen=True)
class Presliding:
    """Presliding of a fitted rope.

    Args:
        creep: Relative change of the output force in which friction builds up by 63 % [1]; 0 is the play operator.
        force: Force at which that holds, where friction depends on the load [N]; NaN where it does not.
    """

    creep: Interval
    force: float

    @property
    def is_play(self) -> bool:
        """Whether the readings cannot tell friction from the play operator."""
        return self.creep.q95 > _CLEAR_OF_PLAY * self.creep.q05

    def sentence(self) -> str:
        """Say how far the rope creeps, or that the readings cannot tell."""
        at = f" at {self.force:g} N" if self.force > 0 else ""
        if self.is_play:
            return (
                "The readings cannot tell the presliding stiffness, nor friction from a play operator, which holds at once "
                f"after a turn: friction builds up by 63 % while the output force{at} changes by anything up to "
                f"{percent(self.creep.q95, 1)} (with 95 % probability)."
            )
        low, high = percent(self.creep.q05, 1).removesuffix("%").strip(), percent(self.creep.q95, 1)
        return (
            f"After a turn friction builds up by 63 % while the output force{at} changes by {percent(self.creep.median, 1)} "
            f"(90 % interval {low} to {high})."
        )


def estimate_presliding(fit: Record) -> Presliding | None:
    """Return how far the rope creeps after a turn; None of a fit without presliding stiffness, or without draws of it."""
    if fit.sampled is None or PRESLIDING_STIFFNESS not in fit.posterior.values:
        return None
    friction = fit.model.cable.friction
    force = friction.conditions.reference_force if friction.depends_on_load else float("nan")
    return Presliding(Interval.of(1 / fit.posterior.values[PRESLIDING_STIFFNESS]), force)
