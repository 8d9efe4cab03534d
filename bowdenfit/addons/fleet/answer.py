"""Results of a fleet, one fit per inspection, and the summary that `bowdenfit fleet` prints."""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from bowdenfit.display import Block, Display, ResultTable, Rows, blocks_of, separate
from bowdenfit.inference.interval import Interval
from bowdenfit.words import counted, decimals, give_or_take, listed

_NAMED = 12  # broken or untrusted inspections that are named; a judgement
_ENGINES = {"laplace": "importance sampling", "ensembles": "full sampling", "nuts": "NUTS"}
_HEADS = ("quantity", "unit", "middle", "from", "to", "± of one fit")


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
        engine: Engine that drew: "laplace" (weighted draws), "ensembles" or "nuts".
        pareto_k: Pareto k of the importance weights.
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
    """Fits of all inspections of a fleet.

    Args:
        name: Name of the fleet.
        fitted: Inspections that were fitted, in the order of cables and cycles.
        broken: Those that could not be.
        units: Units of the quantities.
        shapes: For each model what is fitted with it, in words.
        seed: Random seed.
        versions: Versions of what computed.
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
        """Say whether every inspection was fitted, and every fit may be trusted."""
        return not (self.broken or self.untrusted)

    @property
    def engines(self) -> dict[str, int]:
        """How many inspections each engine drew for."""
        names = [inspection.engine for inspection in self.fitted]
        return {name: names.count(name) for name in dict.fromkeys(sorted(names))}

    def summarize_quantity(self, quantity: str) -> tuple[float, float, float, float]:
        """Return 5 %, 50 % and 95 % of the medians of a quantity over the fleet, and the median of its standard deviations."""
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


@blocks_of.register
def _(fleet: Fleet) -> list[Block]:
    """Return a fleet for people: whether all went well, the range of each quantity, and what is broken."""
    return separate(
        [status_sentence(fleet)],
        [*_list_inspections("broken", [(b.inspection, b.why) for b in fleet.broken]), *_list_untrusted(fleet)],
        [ResultTable(_HEADS, _quantity_rows(fleet))] if fleet.fitted else [],
        [_explain_columns(fleet)] if fleet.fitted else [],
        _method_sentences(fleet),
    )


def status_sentence(fleet: Fleet) -> str:
    """Say whether every inspection was fitted and may be trusted."""
    total = len(fleet.fitted) + len(fleet.broken)
    what = f"{counted(total, 'inspection')} of {counted(len(fleet.cables), 'cable')}"
    if fleet.is_trusted:
        return f"{fleet.name}: {what}, every one fitted, and every fit may be trusted."
    wrong = [f"{len(fleet.broken)} could not be fitted"] if fleet.broken else []
    wrong += [f"{len(fleet.untrusted)} must not be trusted"] if fleet.untrusted else []
    return f"{fleet.name}: of {what} {listed(wrong)}; the others are not affected."


def _list_inspections(what: str, named: list[tuple[str, str]]) -> list[str]:
    """List inspections with what is wrong, and how many more."""
    lines = [f"- {label}: {' '.join(why.split())}" for label, why in named[:_NAMED]]
    more = len(named) - _NAMED
    return [*lines, f"- and {more} more {what} ones, in fleet.json."] if more > 0 else lines


def _list_untrusted(fleet: Fleet) -> list[str]:
    return _list_inspections(
        "untrusted",
        [(inspection.inspection, f"not to be trusted: {inspection.reasons[0]}.") for inspection in fleet.untrusted],
    )


def _quantity_rows(fleet: Fleet) -> list[tuple[str, ...]]:
    """Return a row for every quantity, under `_HEADS`."""
    rows = []
    for name, unit in fleet.units.items():
        low, middle, high, sd = fleet.summarize_quantity(name)
        digits = decimals(max(high - low, sd, abs(middle) * 1e-6))
        shown = [f"{value:z.{digits}f}" for value in (middle, low, high)]
        rows.append((name, "" if unit == "1" else unit, *shown, f"{sd:z.{digits}f}"))
    return rows


def _explain_columns(fleet: Fleet) -> str:
    first = next(iter(fleet.units))
    _, middle, _, sd = fleet.summarize_quantity(first)
    return (
        f"Middle, from and to: median, 5 % and 95 % quantiles over all inspections, each fitted by itself. A single {first} is "
        f"known to about {give_or_take(middle, sd)}, and the ranges include that uncertainty."
    )


def _method_sentences(fleet: Fleet) -> list[str]:
    """Describe models, engines, and what is known of the inspections."""
    lines = []
    if len(fleet.shapes) > 1:
        models = listed(list(fleet.shapes))
        lines.append(f"The descriptions or designs differ, so {len(fleet.shapes)} models were fitted: {models}.")
    engines = listed([f"{_ENGINES.get(name, name)} ({n})" for name, n in fleet.engines.items()])
    lines.append(f"Fitted by {engines}; seed {fleet.seed}." if fleet.fitted else f"Seed {fleet.seed}.")
    unknown = sum(math.isnan(inspection.cycles) for inspection in fleet.fitted)
    if unknown:
        state = "states no number of cycles, so it says" if unknown == 1 else "state no number of cycles, so they say"
        lines.append(f"{counted(unknown, 'inspection')} {state} nothing about wear.")
    if len(fleet.cables) == 1:
        lines.append("It is one cable only, so there is no population to compare it with.")
    return lines
