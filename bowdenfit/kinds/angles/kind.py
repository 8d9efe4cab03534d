"""Wrap angles of curved contacts along the route: how they are read, checked and described."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from typing_extensions import override

from bowdenfit.cable.registry import CURVES
from bowdenfit.description import Description, Finite
from bowdenfit.description.file import Stated
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column, Quantity, require_column
from bowdenfit.kinds.bench_error import BenchError
from bowdenfit.kinds.kind import Design, PlannedKind, Readings
from bowdenfit.kinds.measured_columns import MeasuredColumn
from bowdenfit.kinds.plausibility import compare_without_runs, describe_copies
from bowdenfit.kinds.rows import (
    LARGEST_ANGLE,
    FileRows,
    RowOrigin,
    origin_of_rows,
    read_angle,
    round_lengths,
    route_column,
    route_heading,
)
from bowdenfit.kinds.table_files import InitQuestions, Source, TableFromFiles
from bowdenfit.kinds.tables import AngleSettings, AngleTable, Measurements

_FEWEST = 3  # detected angles of each curve in a plausible table: the most coefficients that a curve has
_NUMBERS = {2: "two", 3: "three"}
_UNDETECTED = {"censored": "known to be less", "zero": "taken as 0", "dropped": "left out"}


class AngleDesign(Design):
    """[design]: route values at which wrap angles are read."""

    angles: tuple[Finite, ...] = ()


class AngleKind(PlannedKind[AngleTable]):
    """Wrap angles at several lengths of the cable, which curves are fitted to."""

    name = "angles"
    table = AngleTable
    settings = AngleSettings
    readings = (Readings("wrap_angle", "angles", "wrap angles", "{}", "Wrap angle (deg)", "deg"),)
    methods_sentence = "Wrap angles along the route followed curves, which were fitted with everything else."
    init_questions = InitQuestions("wrap angles at several lengths of the cable", by_length=True)
    design = AngleDesign

    @override
    def read(self, source: Source) -> TableFromFiles[AngleTable]:
        """Read a table of wrap angles; a blank cell or `<10` is an angle too small to detect.

        Raises:
            DatasetError: See `read_table` and `find_columns`; or a cell is not an angle between 0 and 2000 degrees.
        """
        path, route, stated = source.file, source.description.route, source.settings.detection_limit
        assert route is not None  # a description has angles only with a route
        contacts = [c.wrap_angle.column for c in source.description.curved if c.wrap_angle.column]
        detection_limit = stated.to("angle") if stated else None
        wanted = (route_column(route), *(Quantity(c, "angle") for c in contacts))
        table, columns = source.read_table(path, wanted)
        lengths = require_column(table, columns, route.variable, f"{route.variable}_{route.unit}", ("route", "variable"))
        keys = source.description.angle_column_keys
        angle_columns = [require_column(table, columns, name, f"{name}_deg", keys[name]) for name in contacts]
        cells = [c.read_cells(partial(_angle_or_limit, c, detection_limit), (np.nan, np.nan)) for c in angle_columns]
        pairs = np.array(cells, dtype=float).reshape(len(angle_columns), len(table.rows), 2)
        route_values, angle, limit = round_lengths(lengths.numbers()), pairs[..., 0].T, pairs[..., 1].T
        made = AngleTable(route_values, tuple(contacts), angle, limit, origin_of_rows(table))
        return TableFromFiles(made, {path.name: path}, accounts=(table.account,))

    @override
    def describe(self, table: AngleTable, description: Description) -> list[str]:
        """Return what was detected in each column, and what lies outside the range of the curves."""
        settings = description.table(AngleSettings)
        how = _UNDETECTED[settings.undetected if settings else "censored"]
        lines = []
        for name in table.names:
            angle, limit = table.column(name)
            detected = np.rad2deg(angle[np.isfinite(angle)])
            below = (
                f", {np.isnan(angle).sum()} below {np.rad2deg(np.nanmax(limit)):g} deg ({how})"
                if np.isnan(angle).any()
                else ""
            )
            spread = f", {detected.min():.4g} to {detected.max():.4g} deg" if len(detected) else ""
            lines.append(f"{table.origin.files[0]}: {name}, {len(detected)} detected{spread}{below}")
        if description.route:
            outside = (table.route < description.route.range[0]) | (table.route > description.route.range[1])
            if outside.any():
                rows, are = ("1 row lies", "is") if outside.sum() == 1 else (f"{outside.sum()} rows lie", "are")
                lines.append(f"{rows} outside the range of the curves, and {are} used for what was measured there.")
        return lines

    @override
    def contradiction(self, settings: AngleSettings | None, description: Description) -> str:
        """Return that there are curves without angles, or angles without curves."""
        curved = description.curved
        if settings is None and curved:
            return (
                f"no table has the column {curved[0].wrap_angle.column!r} of the contact {curved[0].name!r}: "
                'name one under [tables], angles = { file = "angles.csv" }'
            )
        if settings is not None and not curved:
            return "[tables] has angles, but no contact has a curve that they could determine"
        return ""

    @override
    def quantities(self, settings: Any, description: Description) -> list[Stated]:
        return [("tables, angles, detection_limit", settings.detection_limit, "angle")]

    @override
    def warnings(self, table: AngleTable, description: Description, measurements: Measurements) -> list[str]:
        """Return which curves too few angles determine."""
        assert description.route is not None  # an angle table is read only with one
        low, high = description.route.range
        inside, warnings = (table.route >= low) & (table.route <= high), []
        for contact in description.curved:
            n = int(np.isfinite(table.column(contact.wrap_angle.column or "")[0][inside]).sum())
            coefficients = CURVES[contact.wrap_angle.curve or ""].coefficients
            if n < coefficients:
                warnings.append(
                    f"the curve of {contact.name!r} has {_NUMBERS.get(coefficients, coefficients)} coefficients "
                    f"and {n} detected angles in the range; its shape will rest on the priors."
                )
        return warnings

    @override
    def copied_readings(self, table: AngleTable) -> list[str]:
        return describe_copies(compare_without_runs(table.origin, table.route, table.angle, table.route))

    @override
    def measured_columns(self, table: AngleTable) -> list[MeasuredColumn]:
        return [
            MeasuredColumn(name, "deg", np.rad2deg(angle), table.route)
            for name, angle in zip(table.names, table.angle.T, strict=True)
        ]

    @override
    def with_bench_error(self, table: AngleTable, error: BenchError) -> AngleTable:
        """Return the table with the error in its angles."""
        return replace(table, angle=error.apply_to_angles(table.angle))

    @override
    def why_implausible(self, measured: AngleTable, simulated: AngleTable) -> str:
        """Return that an angle is beyond the readable, or that fewer are detected than a curve has coefficients."""
        if np.nanmax(simulated.angle, initial=0.0) > LARGEST_ANGLE:
            return "an angle is above 2000 deg"
        detected, enough = (np.isfinite(table.angle).sum(axis=0) for table in (simulated, measured))
        return "too few angles are detected" if np.any(detected < np.minimum(enough, _FEWEST)) else ""

    @override
    def file_rows(self, table: AngleTable, description: Description) -> FileRows:
        shown, limits = np.rad2deg(table.angle), np.rad2deg(table.limit)
        cells = [
            [f"<{limits[i, k]:g}" if np.isnan(angle) else f"{angle:.1f}" for k, angle in enumerate(row)]
            for i, row in enumerate(shown)
        ]
        rows = [[f"{length:g}", *row] for length, row in zip(table.route, cells, strict=True)]
        return [*(route_heading(description) or [""]), *(f"{name}_deg" for name in table.names)], rows

    @override
    def empty_table(self, design: AngleDesign, description: Description, file: str) -> AngleTable:
        columns = tuple(c.wrap_angle.column or "" for c in description.curved)
        shape = (len(design.angles), len(columns))
        angle, limit = np.full(shape, np.deg2rad(30)), np.full(shape, np.nan)
        return AngleTable(np.array(design.angles), columns, angle, limit, RowOrigin.below_heading(file, shape[0]))


def _angle_or_limit(column: Column, detection_limit: float | None, cell: Cell) -> tuple[float, float]:
    """Return a wrap angle and NaN, or NaN and the detection limit [rad]."""
    written = cell.limit()
    if written is None and not cell.blank:
        return read_angle(cell, column), np.nan
    limit = written * column.factor if written is not None else detection_limit
    if limit is None:
        raise cell.refuse(
            "the cell is blank, which means too small to detect, but no detection limit is known; write <10 (the "
            'limit) in the cell, or set detection_limit = { value = 10, unit = "deg" } for the table in cable.toml.'
        )
    if not 0 < limit <= LARGEST_ANGLE:
        raise cell.refuse(f"{cell.shown} is not a possible detection limit; write one between 0 and 2000 deg.")
    return np.nan, limit
