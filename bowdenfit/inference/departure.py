"""A way in which readings depart from the model, and when that is worth saying."""

from dataclasses import dataclass, field

FALSE_ALARM = 0.003  # chance that a healthy fit is said not to describe its readings
NOTICEABLE_SIZE = 0.02  # of what is read, below which a departure is not worth a verdict
NOTICEABLE_SHIFT = 0.5  # of the way from a coefficient to an end of its 90 % interval, by less than which a drift may move it


@dataclass(frozen=True)
class Departure:
    """One way in which the readings of a table depart from the model.

    Args:
        table: Name of the readings.
        group: Contact or the like that they belong to; empty where all are of one kind.
        against: Axis label of what they depend on.
        inside: Whether readings inside runs do; else whole runs, or single readings.
        chance: Probability of as much by chance, times the number of departures that were asked about.
        size: Root mean square of the departure, over that of what is read [1].
        low, high: Where the lowest third and the highest third of the readings were taken, on average; of a zero that drifts,
            what it was at the start and at the end of a run, against its middle [N].
        at_low, at_high: How much more than the model says is read there, over what is read [1].
        moved: Of a zero that drifts, whose size says little: how far it moves the coefficient of friction that it moves most,
            over half of its 90 % interval; 0 where chance does as much. None of all others.
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
        """Whether chance does not make it, and it matters."""
        matters = self.size > NOTICEABLE_SIZE if self.moved is None else self.moved > NOTICEABLE_SHIFT
        return self.p_value < FALSE_ALARM and matters


@dataclass(frozen=True)
class FarReading:
    """A reading that lies farther from the fit than chance puts one of all.

    Args:
        table: Name of the readings.
        label: Which one.
        chance: Probability of one as far out among all readings of a healthy fit.
        sds: How far, in standard deviations of the others.
    """

    table: str
    label: str
    p_value: float = field(metadata={"key": "chance"})
    sds: float
