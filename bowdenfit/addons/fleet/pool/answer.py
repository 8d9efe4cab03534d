"""Results of pooling a fleet: its cables, the population, wear, life and the next inspections."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.inference.interval import Interval


@dataclass(frozen=True)
class ServiceLimit:
    """Efficiency until which a cable serves, and the wrap angles at which that holds.

    Args:
        efficiency: Below which it has failed.
        wrap_angles: At which [rad], by coefficient.
        cycles: Before which failing is asked for; None if it is not.
    """

    efficiency: float
    wrap_angles: dict[str, float]
    cycles: float | None


@dataclass(frozen=True)
class Life:
    """Cycles until the efficiency falls below the limit, dry and at the reference temperature.

    Args:
        median: Median of its cycles; infinite where it more likely lasts for ever.
        q05: One in twenty falls below before.
        fails: Probability of falling below before the cycles that were asked for; None where none were.
        lasts: Probability that it never does, because its friction does not grow.
        extrapolated: Whether the median, or the cycles asked for, lie beyond the longest that was inspected.
    """

    median: float
    q05: float
    fails: float | None
    lasts: float
    extrapolated: bool


@dataclass(frozen=True)
class PooledCable:
    """One cable, shrunk toward the population as far as its data allow, or an outlier by its own inspections alone.

    Args:
        cable: Name of the cable.
        inspections: Number of its inspections.
        last: Cycles at the last of them; NaN if unknown.
        coefficients: Coefficients when new, dry and at the reference temperature, by name.
        unpooled: The same from its own inspections alone, without the population; None where these do not identify them.
        wear: Growth of friction in the reference cycles as a share; None where wear is not identifiable.
        life: Its life; None unless a limit was given.
        p_value: Probability that some cable of such a fleet is as far from the others; Holm-adjusted.
        departure: How it differs from the other cables, in words; empty if it does not.
        pooled: Names of what is shrunk toward the population: everything of an ordinary cable; of an outlier at most "wear",
            and only where its own inspections do not identify it.
        n_effective: Effective number of its draws under the pooled posterior, at its worst inspection (importance sampling).
        n_from_readings: Number of its inspections of which the readings were refitted, because `n_effective` was too small.
    """

    cable: str
    inspections: int
    last: float
    coefficients: dict[str, Interval]
    unpooled: dict[str, Interval | None]
    wear: Interval | None
    life: Life | None
    p_value: float
    departure: str
    pooled: tuple[str, ...]
    n_effective: float
    n_from_readings: int

    JSON: ClassVar = (
        "cable", "inspections", "last", "coefficients", ("alone", "unpooled"), "wear", "life", "p_value",
        ("unlike", "departure"), "pooled", ("worth", "n_effective"), ("measured", "n_from_readings"),
    )  # fmt: skip


@dataclass(frozen=True)
class Effect:
    """Relative change of friction by wear or a covariate.

    Args:
        name: "wear" in the reference cycles, "lubrication", or "per_degree".
        share: The share; 0.1 where it grows by a tenth.
        probability: That it has the sign of its median.
    """

    name: str
    share: Interval
    probability: float


@dataclass(frozen=True)
class NextInspection:
    """A next inspection and how much it would reduce uncertainty.

    Args:
        cable: Of which cable.
        cycles: After how many.
        target: Quantity that the inspection narrows: "failing" (probability of failing before the cycles asked for) or "wear".
        before: Standard deviation of that now.
        after: Expected uncertainty after the inspection, averaged over possible readings.
        probability: Probability of failing now; None where that is not the target.
    """

    cable: str
    cycles: float
    target: str
    before: float
    after: float
    probability: float | None


@dataclass(frozen=True)
class Curves:
    """Curves over cycles, dry and at the reference temperature.

    Args:
        cycles: At which.
        new: Of a new cable 5 %, 50 % and 95 % of its efficiency, or of its friction over that when new; (3, cycles).
        cables: Median of that for each cable, (cable, cycles).
        new_fails: Probability that a new cable has fallen below the efficiency asked for; None where none is.
        fails: The same of each cable, (cable, cycles).
    """

    cycles: np.ndarray
    new: np.ndarray
    cables: np.ndarray
    new_fails: np.ndarray | None
    fails: np.ndarray | None


@dataclass(frozen=True)
class ExcludedFit:
    """An inspection that is not pooled.

    Args:
        inspection: Which.
        why: In a few words.
    """

    inspection: str
    why: str


@dataclass(frozen=True, repr=False)
class Pool(Display):
    """A hierarchical model of the cables of a fleet.

    Args:
        name: Name of the fleet.
        cables: In the order of the fleet.
        inspections: How many are pooled.
        left_out: Those that are not.
        coefficients: Of a new cable of this population, dry and at the reference temperature; its scatter is in it. Cables that
            are outliers are not in the population.
        typical: Values in the middle of the population, by name.
        spreads: Standard deviation of log coefficients between cables, by name, and of the wear under "wear".
        wear: In the reference cycles, of the middle of the population; None where it cannot be told.
        effects: Effects of what else was told.
        reference_cycles: Cycles that wear is stated for: the longest inspected.
        reference_temperature: Temperature that coefficients are stated for [°C].
        limit: Limit that ends the life of a cable; None if not asked for.
        new_cable: Life of a new cable of this population; None where there is none.
        mixtures: Coefficients of which cables do not look like one population, with the probability of that by chance.
        curves: Curves over cycles; None where wear cannot be told.
        next_inspections: The inspections that tell most, the best first.
        notes: What is not estimated and why, and what was taken for granted, a sentence each.
        reasons: Why the answer should not be trusted; empty if it may.
        seed: Random seed.
    """

    name: str
    cables: tuple[PooledCable, ...]
    inspections: int
    left_out: tuple[ExcludedFit, ...]
    coefficients: dict[str, Interval]
    typical: dict[str, Interval]
    spreads: dict[str, Interval]
    wear: Effect | None
    effects: tuple[Effect, ...]
    reference_cycles: float
    reference_temperature: float
    limit: ServiceLimit | None
    new_cable: Life | None
    mixtures: dict[str, float]
    curves: Curves | None
    next_inspections: tuple[NextInspection, ...]
    notes: tuple[str, ...]
    reasons: tuple[str, ...]
    seed: int

    JSON: ClassVar = (
        "is_trusted", "name", "cables", "inspections", "left_out", "coefficients", "typical", "spreads", "wear", "effects",
        "reference_cycles", "reference_temperature", ("asked", "limit"), ("new", "new_cable"), ("mixed", "mixtures"), "curves",
        ("next", "next_inspections"), "notes", "reasons", "seed",
    )  # fmt: skip

    @property
    def is_trusted(self) -> bool:
        """Whether the answer may be trusted."""
        return not self.reasons

    @property
    def outliers(self) -> tuple[PooledCable, ...]:
        """Outlying cables, the most extreme first."""
        return tuple(sorted((cable for cable in self.cables if cable.departure), key=lambda cable: cable.p_value))

    def cable(self, name: str) -> PooledCable:
        """Return one of the cables.

        Raises:
            KeyError: There is none of this name.
        """
        for pooled in self.cables:
            if pooled.cable == name:
                return pooled
        raise KeyError(f"there is no cable {name!r}; there are {', '.join(c.cable for c in self.cables)}.")

    def _table(self) -> Rows:
        """A row for each cable and quantity."""
        rows: list[dict[str, Any]] = []
        for cable in self.cables:
            intervals: dict[str, Interval] = dict(cable.coefficients) | ({"wear": cable.wear} if cable.wear else {})
            life = cable.life
            fails = {"life_cycles": life.median if life else None, "fails": life.fails if life else None}
            for name, interval in intervals.items():
                pooled = {"pooled": "yes" if name in cable.pooled else "no"}
                rows.append({"quantity": name, "cable": cable.cable, **vars(interval), **fails, **pooled})
        names = (*self.typical, *(("wear",) if self.wear else ()))
        return rows, dict.fromkeys(names, "1")
