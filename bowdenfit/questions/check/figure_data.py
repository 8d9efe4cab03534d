"""What the figures of a fit's checks and of its priors show, as plain arrays; loads no JAX, and must not."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CheckedTable:
    """Readings of one table against their predictions from all the others.

    Args:
        name: What they are, in words.
        z_score: Deviations in standard deviations of the predictions; NaN of readings that are only a bound.
        numbers: Where the readings were taken, by axis label: the first two that vary.
        group: Contact or the like of each reading; empty where all are of one kind.
        back: Whether each was taken on the way back, or while unloading.
        decisive: Whether the fit leans on it.
        outlier: Whether it is an outlier.
        labels: Each in words.
        at: Places in the predictions at which their distribution was looked at; empty of few readings.
        off, low, high: Share of readings up to there less what it should be, and the band of that.
        probability: Probability that it stays in the band.
    """

    name: str
    z_score: np.ndarray
    numbers: dict[str, np.ndarray]
    group: tuple[str, ...]
    back: np.ndarray
    decisive: np.ndarray
    outlier: np.ndarray
    labels: tuple[str, ...]
    at: np.ndarray
    off: np.ndarray
    low: np.ndarray
    high: np.ndarray
    probability: float


@dataclass(frozen=True)
class PriorTable:
    """Readings of one table beside what the priors alone hold possible.

    Args:
        name: What they are, in words.
        label: Axis label of the readings.
        numbers: Where they were taken, the first that varies.
        place: Its axis label.
        group: Contact or the like of each reading.
        labels: Each reading in words.
        reading: As measured; NaN of readings that are only a bound.
        quantiles: 0.5 %, 5 %, 50 %, 95 % and 99.5 % quantiles (first axis) of readings by the priors.
        outside: Whether each reading lies outside the widest of these intervals.
    """

    name: str
    label: str
    numbers: np.ndarray
    place: str
    group: tuple[str, ...]
    labels: tuple[str, ...]
    reading: np.ndarray
    quantiles: np.ndarray
    outside: np.ndarray


@dataclass(frozen=True)
class PriorPredictive:
    """What the priors alone hold possible.

    Args:
        name: Name of the cable.
        tables: By table.
        route_label: Axis label of the route; empty without one.
        route: Route values of the curve.
        efficiency: Quantiles (first axis, as in `PriorTable`) of the efficiency there; empty without a route.
    """

    name: str
    tables: tuple[PriorTable, ...]
    route_label: str = ""
    route: np.ndarray | None = None
    efficiency: np.ndarray | None = None
