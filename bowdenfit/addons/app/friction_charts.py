"""Charts of forces and efficiencies as they were measured."""

from collections.abc import Sequence

import numpy as np

from bowdenfit.addons.app.measured_rows import UnusedRow
from bowdenfit.addons.app.points import (
    EFFICIENCY,
    INPUT,
    OUTPUT,
    Drawers,
    Points,
    by_stroke,
    forces_of,
    make_chart,
    row_keys,
    row_place,
    row_places,
    unused_points,
)
from bowdenfit.dataset import Dataset
from bowdenfit.kinds.efficiencies.kind import EfficiencyTable
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.pages.section import Chart


def _draw_forces(table: ForceTable, dataset: Dataset, unused: Sequence[UnusedRow]) -> list[Chart]:
    """Return output against input force, and their ratio where the rope was bent."""
    description = dataset.description
    label, places = row_places(table, description)
    ratio = 100 * np.where(table.stroke < 0, table.input_force / table.output_force, table.output_force / table.input_force)

    def efficiency(row: UnusedRow) -> tuple[float, float]:
        low, high = sorted(forces_of(row))
        return row_place(row, description), 100 * low / high if high else np.nan

    shown = by_stroke(table.input_force, table.output_force, table.stroke, table.origin)
    ratios = by_stroke(places, ratio, table.stroke, table.origin)
    charts = [
        make_chart("Output against input force", INPUT, OUTPUT, [*shown, *unused_points(unused, forces_of)]),
        make_chart(f"Ratio of the forces against {label.split(' (')[0].lower()}", label, "Force transmitted (%)",
               [*ratios, *unused_points(unused, efficiency)]),
    ]  # fmt: skip
    return charts if np.ptp(table.input_force) > 0 else charts[::-1]


def _draw_efficiencies(table: EfficiencyTable, dataset: Dataset, unused: Sequence[UnusedRow]) -> list[Chart]:
    """Return efficiencies along the route, or against the wrap angle."""
    label, places = row_places(table, dataset.description)
    points = [Points("Efficiency", "blue", "points", places, 100 * table.efficiency, tuple(row_keys(table.origin)))]

    def place(row: UnusedRow) -> tuple[float, float]:
        return row_place(row, dataset.description), 100 * row.values.get("efficiency", np.nan)

    return [make_chart("Efficiencies", label, EFFICIENCY, [*points, *unused_points(unused, place)])]


DRAWERS: Drawers = {ForceTable: ("Forces", _draw_forces), EfficiencyTable: ("Efficiencies", _draw_efficiencies)}
