"""`Interval`: a quantity with its uncertainty, as plain data."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.words import decimals

NORMAL_90 = 1.645  # standard deviations of a normal distribution from the middle to either end of its 90 % interval


@dataclass(frozen=True, repr=False)
class Interval(Display):
    """A quantity with its uncertainty: moments, and the 5 %, 50 % and 95 % quantiles of its draws."""

    mean: float
    sd: float
    median: float
    q05: float
    q95: float

    @classmethod
    def of(cls, draws: np.ndarray) -> "Interval":
        """Summarize draws of any shape."""
        q05, median, q95 = (float(q) for q in np.quantile(draws, (0.05, 0.5, 0.95)))
        return cls(float(np.mean(draws)), float(np.std(draws)), median, q05, q95)

    @property
    def digits(self) -> int:
        """Decimals to which it is printed."""
        return decimals(self.q95 - self.q05, self.median)

    def __str__(self) -> str:
        return f"{self.median:z.{self.digits}f} (90 % interval {self.range_text(self.digits)})"

    def sentences(self) -> list[str]:
        """Return the median with the interval."""
        return [str(self)]

    def range_text(self, digits: int) -> str:
        """Return its ends to so many decimals, such as '0.166 to 0.186'."""
        return f"{self.q05:z.{digits}f} to {self.q95:z.{digits}f}"

    def _table(self) -> Rows:
        return [vars(self)], {}

    def times(self, factor: float) -> "Interval":
        """Return the interval multiplied by a factor, as in another unit."""
        return Interval(*(factor * value for value in vars(self).values()))
