"""Preload window: preloads without slack, and without more friction than may be felt."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.inference.interval import Interval
from bowdenfit.words import percent, significant

TAUT = 0.95  # probability with which the recommended preload keeps both sides taut; a choice, as an upper 90 % limit


@dataclass(frozen=True, repr=False)
class PreloadWindow(Display):
    """Preloads that keep a cable taut over a range of bends without more friction than may be felt.

    Args:
        bends: Lowest and highest wrap angle that the cable is bent to [deg].
        reference_angle: Wrap angle at which preloads are meant [deg]; NaN where preload is the same at all.
        input_force: Largest input force against which both sides must stay taut [N].
        friction_limit: Limit of what may be felt in free motion; infinite without one.
        friction_unit: Unit of what is felt.
        lowest: Lowest preload that keeps both sides taut [N].
        highest: Highest preload that is felt as no more than the limit [N]; None without one.
        best: Preload that keeps both sides taut with probability `TAUT`, and is felt least of those [N].
        felt: Free-motion friction at the best preload, at the bend where it is most.
        possible: Probability that some preload satisfies both; 1 without a limit.
    """

    bends: tuple[float, float]
    reference_angle: float
    input_force: float
    friction_limit: float
    friction_unit: str
    lowest: Interval
    highest: Interval | None
    best: float
    felt: Interval
    possible: float

    @property
    def advice(self) -> str:
        """Which preload to set."""
        low, high = (f"{angle:.4g}" for angle in self.bends)
        return (
            f"Set the preload to {significant(self.best)} N{self._at}: of the preloads that keep the cable taut from {low} to "
            f"{high} deg it adds the least friction."
        )

    @property
    def _at(self) -> str:
        """The reference angle in words; empty where preload is the same at all."""
        return "" if np.isnan(self.reference_angle) else f" at {self.reference_angle:.4g} deg"

    def sentences(self) -> list[str]:
        """Return which preload to set, and why."""
        return [self.advice, self.sentence()]

    def _table(self) -> Rows:
        known = {"lowest": self.lowest, "highest": self.highest, "felt": self.felt}
        rows = [{"preload": name} | vars(interval) for name, interval in known.items() if interval is not None]
        return rows, {"lowest": "N", "highest": "N", "felt": self.friction_unit}

    def sentence(self) -> str:
        """Return the answer in words."""
        low, high = (f"{angle:.4g}" for angle in self.bends)
        at = self._at
        under = f" under up to {self.input_force:g} N" if self.input_force > 0 else ""
        best, unit = significant(self.best), self.friction_unit
        lowest, least, most = map(significant, (self.lowest.median, self.lowest.q05, self.lowest.q95))
        felt, low_felt, high_felt = map(significant, (self.felt.median, self.felt.q05, self.felt.q95))
        parts = [
            f"Over bends from {low} to {high} deg{under} the cable stays taut if its preload is at least {lowest} N{at} "
            f"(90 % interval {least} to {most} N). The least friction without slack, with {percent(TAUT, 0)} probability, is "
            f"felt at {best} N: then free motion takes {felt} {unit} ({low_felt} to {high_felt}) at the bend where it takes "
            "most."
        ]
        if self.highest is not None:
            parts.append(
                f"To be felt as no more than {significant(self.friction_limit)} {unit}, preload must not exceed "
                f"{significant(self.highest.median)} N{at} ({significant(self.highest.q05)} to "
                f"{significant(self.highest.q95)} N)."
            )
            if self.possible < TAUT:
                parts.append(
                    f"That leaves a preload that does both with a probability of only {percent(self.possible, 0)}."
                )
        return " ".join(parts)
