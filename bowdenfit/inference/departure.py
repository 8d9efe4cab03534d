"""Departures of readings from the model, and when they are large enough to be reported."""

from dataclasses import dataclass, field

# probability that a fit of a correct model is reported not to describe its readings; `tests/inference/test_lack_of_fit.py`
FALSE_ALARM = 0.003
NOTICEABLE_SIZE = 0.02  # relative size of the departure below which it is not reported
# shift of a coefficient by a drifting zero, over half of its 90 % interval, above which the drift is reported
NOTICEABLE_SHIFT = 0.5


@dataclass(frozen=True)
class Departure:
    """One way in which the readings of a table depart from the model.

    Args:
        table: Name of the readings.
        group: Contact or other group of the readings; empty where there are no groups.
        against: Axis label of the quantity that they depend on.
        inside: Whether these are readings inside runs; otherwise whole runs, or single readings.
        p_value: Bonferroni-adjusted p-value: that of this departure times the number of departures that were tested.
        size: Root mean square of the departure, relative to that of the readings [1].
        low, high: Mean position of the lowest third and of the highest third of the readings; for a drifting zero, its value at
            the start and at the end of a run, relative to its middle [N].
        at_low, at_high: By how much readings there exceed the model, relative to the readings [1].
        moved: For a drifting zero, whose size says little: the largest shift of a friction coefficient, over half of its 90 %
            interval; 0 where the drift is not significant. None for all others.
    """

    table: str
    group: str
    against: str
    inside: bool
    p_value: float = field(metadata={"key": "chance"})
    size: float
    low: float
    high: float
    at_low: float
    at_high: float
    moved: float | None = None

    @property
    def is_noticeable(self) -> bool:
        """Whether the departure is significant and large enough to matter."""
        matters = self.size > NOTICEABLE_SIZE if self.moved is None else self.moved > NOTICEABLE_SHIFT
        return self.p_value < FALSE_ALARM and matters


@dataclass(frozen=True)
class FarReading:
    """An outlier: a reading farther from the fit than expected of any reading.

    Args:
        table: Name of the readings.
        label: Label of the reading.
        p_value: Probability that any reading of a correct model lies as far out.
        sds: Distance from the fit in standard deviations of the other readings.
    """

    table: str
    label: str
    p_value: float = field(metadata={"key": "chance"})
    sds: float
