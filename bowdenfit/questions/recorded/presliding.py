"""How far a rope creeps after a turn of the motion until its friction is built up, and whether its delay is known well."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.cable.friction_options import PRESLIDING_STIFFNESS
from bowdenfit.cable.sensors import DELAY_ERROR
from bowdenfit.inference.interval import Interval
from bowdenfit.recordings.recording import Recordings
from bowdenfit.results.record import Record
from bowdenfit.words import percent

# Ratio of the ends of the 90 % interval of a positive quantity that is two standard deviations clear of 0, or more.
_CLEAR_OF_PLAY = 10.0
# Error of the estimated delay, over the length of a block, beyond which it cannot be corrected in proportion. With 0.03 to 0.19
# of a block all parameters of a simulated LuGre rope were within their 90 % intervals; with 0.34 and 0.53 the stiffness was 5
# and 6 % too high, three and five times as far as its interval reaches.
_LARGEST_DELAY_ERROR = 0.25


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


def describe_wrong_delay(fit: Record) -> str:
    """Say that the delay of a creeping rope was estimated too wrongly; empty of any other rope, and where it was not.

    The fit corrects an error of the delay in proportion to how fast the output changes, which holds for a part of a block.
    """
    recordings, error = fit.dataset.measurements.table(Recordings), _find_delay_error(fit)
    if recordings is None or error is None or not fit.model.is_slow:
        return ""
    block = 1000 * float(np.median([recording.account.block for recording in recordings.items]))
    if abs(error) <= _LARGEST_DELAY_ERROR * block:
        return ""
    estimated = 1000 * float(np.median([recording.account.delay for recording in recordings.items]))
    total = f"{estimated + error:.1f}"
    return (
        f"The output channel was shifted by {estimated:.0f} ms, as its reversals say, but the fit finds {total} ms, and so "
        f"large an error cannot be corrected within blocks of {block:.0f} ms; the usual cause is friction that rises toward "
        f"standstill. Fit again with --set 'tables.recordings.prepare.delay={{value={total},unit=\"ms\"}}' (in cable.toml "
        "delay under prepare)."
    )


def _find_delay_error(fit: Record) -> float | None:
    """Return the error of the estimated delay [ms]; None where it is no parameter, or not determined."""
    if fit.sampled is not None:
        draws = fit.posterior.values.get(DELAY_ERROR)
        return None if draws is None else float(np.median(draws))
    estimate = fit.least_squares.estimates.get(DELAY_ERROR)
    return estimate.value if estimate is not None and np.isfinite(estimate.value) else None
