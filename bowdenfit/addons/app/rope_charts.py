"""Charts of the stretch and the preload of a rope as they were measured."""

from collections.abc import Sequence

import numpy as np

from bowdenfit.addons.app.measured_rows import UnusedRow
from bowdenfit.addons.app.points import ANGLE, Drawers, Points, by_stroke, make_chart, row_keys, unused_points
from bowdenfit.dataset import Dataset
from bowdenfit.kinds.tables import PreloadTable, StretchTable
from bowdenfit.pages.section import Chart


def _draw_stretch(table: StretchTable, dataset: Dataset, unused: Sequence[UnusedRow]) -> list[Chart]:
    """Return the stretch against the load."""
    del dataset
    names = ((0, "Loading", "blue", "points"), (1, "Unloading", "vermillion", "points"))
    shown = by_stroke(table.load, table.stretch, table.unloading.astype(int), table.origin, names)
    left_out = unused_points(unused, lambda row: (row.values.get("load", np.nan), row.values.get("stretch", np.nan)))
    return [make_chart("Stretch against load", "Load (N)", "Stretch (mm)", [*shown, *left_out])]


def _draw_preload(table: PreloadTable, dataset: Dataset, unused: Sequence[UnusedRow]) -> list[Chart]:
    """Return the preload against the wrap angle."""
    del dataset
    points = Points("Preload", "blue", "points", np.rad2deg(table.wrap_angle), table.preload, tuple(row_keys(table.origin)))
    left_out = unused_points(unused, _place_of_preload)
    return [make_chart("Preload against wrap angle", ANGLE, "Preload (N)", [points, *left_out])]


def _place_of_preload(row: UnusedRow) -> tuple[float, float]:
    return float(np.rad2deg(row.values.get("wrap_angle", np.nan))), row.values.get("preload", np.nan)


DRAWERS: Drawers = {StretchTable: ("Stretch of the rope", _draw_stretch), PreloadTable: ("Preload", _draw_preload)}
