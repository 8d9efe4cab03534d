"""What came of a fleet: every inspection by itself; cables are compared and pooled elsewhere."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.inference.interval import Interval


@dataclass(frozen=True)
class FailedInspection:
    """An inspection that could not be fitted.

    Args:
        inspection: Which.
        why: In a sentence.
    """

    inspection: str
    why: str


@dataclass(frozen=True)
class FittedInspection:
    """An inspection that was fitted by itself.

    Args:
        inspection: Which.
        cable: Its cable.
        cycles: That the cable had made; NaN where nobody says.
        temperature: [°C]; NaN where nobody says.
        lubricated: Whether it was; None where nobody says.
        shape: Number of the model that it was fitted with, from 1.
        engine: What drew: "laplace" (weighted draws), "ensembles" or "nuts".
        pareto_k: Of the importance weights.
        n_effective: Effective number of the draws, of the worst parameter.
        reasons: Why the draws should not be trusted; empty if they may.
        quantities: Medians and intervals, by name in shown units.
    """

    inspection: str
    cable: str
    cycles: float
    temperature: float
    lubricated: bool | None
    shape: int
    engine: str
    pareto_k: float
    n_effective: float
    reasons: tuple[str, ...]
    quantities: dict[str, Interval]


@dataclass(frozen=True, repr=False)
class Fleet(Display):
    """What came of a fleet.

    Args:
        name: Of the fleet.
        fitted: Inspections that were fitted, in the order of cables and cycles.
        broken: Those that could not be.
        units: Of the quantities.
        shapes: For each model what is fitted with it, in words.
        seed: Seed of everything random.
        versions: Of what computed.
    """

    name: str
    fitted: tuple[FittedInspection, ...]
    broken: tuple[FailedInspection, ...]
    units: dict[str, str]
    shapes: tuple[str, ...]
    seed: int
    versions: dict[str, str] = field(default_factory=dict)

    JSON: ClassVar = ("is_trusted", ...)

    @property
    def cables(self) -> tuple[str, ...]:
        """Names of all cables that were fitted."""
        return tuple(dict.fromkeys(inspection.cable for inspection in self.fitted))

    @property
    def untrusted(self) -> tuple[FittedInspection, ...]:
        """Inspections whose draws should not be trusted."""
        return tuple(inspection for inspection in self.fitted if inspection.reasons)

    @property
    def is_trusted(self) -> bool:
        """Whether every inspection was fitted, and every fit may be trusted."""
        return not (self.broken or self.untrusted)

    @property
    def engines(self) -> dict[str, int]:
        """How many inspections each engine drew for."""
        names = [inspection.engine for inspection in self.fitted]
        return {name: names.count(name) for name in dict.fromkeys(sorted(names))}

    def summarize_quantity(self, quantity: str) -> tuple[float, float, float, float]:
        """Of a quantity over the fleet: 5 %, 50 % and 95 % of the medians, and the median of single standard deviations."""
        intervals = [interval.quantities[quantity] for interval in self.fitted if quantity in interval.quantities]
        low, middle, high = np.quantile([interval.median for interval in intervals], (0.05, 0.5, 0.95))
        return float(low), float(middle), float(high), float(np.median([interval.sd for interval in intervals]))

    def _table(self) -> Rows:
        """A row for each inspection and quantity."""
        rows = [
            {
                "quantity": name,
                "inspection": inspection.inspection,
                "cable": inspection.cable,
                "cycles": inspection.cycles,
                "temperature_degC": inspection.temperature,
                "lubricated": inspection.lubricated,
                "trusted": not inspection.reasons,
                **vars(interval),
            }
            for inspection in self.fitted
            for name, interval in inspection.quantities.items()
        ]
        return rows, dict(self.units)
