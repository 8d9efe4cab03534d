"""From files to tables: one function a kind of table, with every check that needs no description."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.columns import Column, ColumnSource, Quantity, find_columns, require
from bowdenfit.files.csv_table import Cell, read_csv
from bowdenfit.kinds.rows import (
    LARGEST_ANGLE,
    Route,
    provenance_of,
    read_angle,
    read_own_angles,
    read_route,
    read_strokes,
    rounded,
    shared_columns,
)
from bowdenfit.kinds.tables import AngleTable, EfficiencyTable, ForceTable, OwnAngles, Provenance
from bowdenfit.types import Labels, Vector
from bowdenfit.units import INTERNAL_UNITS, speed_dimension

_UNUSED = ("time", "position")  # columns that a force table may have and that nothing reads


def read_angles(
    path: Path,
    route: Route,
    contacts: Sequence[str],
    detection_limit: float | None = None,
    sources: Mapping[str, ColumnSource] | None = None,
) -> AngleTable:
    """Read a table of wrap angles; a blank cell or `<10` is an angle too small to detect.

    Args:
        path: CSV file.
        route: The route variable.
        contacts: Columns of the curved contacts.
        detection_limit: Limit for blank cells [rad].
        sources: Columns named by the user.

    Raises:
        DatasetError: See `read_csv` and `find_columns`; or a cell is not an angle between 0 and 2000 degrees.
    """
    table = read_csv(path)
    found = find_columns(table, (route.quantity(), *(Quantity(c, "angle") for c in contacts)), sources)
    route_column = require(table, found, route.variable, f"{route.variable}_{route.unit}")
    columns = [require(table, found, name, f"{name}_deg") for name in contacts]
    cells = [[_angle_or_limit(cell, c, detection_limit) for cell in c.cells] for c in columns]
    pairs = np.array(cells, dtype=float).reshape(len(columns), len(table.rows), 2)
    return AngleTable(
        rounded(route_column.numbers()), tuple(contacts), pairs[..., 0].T, pairs[..., 1].T, provenance_of(table)
    )


def _angle_or_limit(cell: Cell, column: Column, detection_limit: float | None) -> tuple[float, float]:
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


def read_efficiencies(
    path: Path, route: Route | None, contacts: Sequence[str], sources: Mapping[str, ColumnSource] | None = None
) -> EfficiencyTable:
    """Read a table of transmission efficiencies, 0 to 1 or in percent where the heading or the cell says so.

    Args:
        path: CSV file.
        route: The route variable, if the cable has one.
        contacts: Columns in which rows may carry their own wrap angle.
        sources: Columns named by the user.

    Raises:
        DatasetError: See `read_csv` and `find_columns`; or an efficiency is not between 0 and 1.
    """
    table = read_csv(path)
    names = (Quantity("efficiency", "ratio"), Quantity("efficiency_sd", "ratio"))
    found = find_columns(table, (*names, *shared_columns(route, contacts)), sources)
    column = require(table, found, "efficiency", "efficiency (0 to 1) or efficiency_percent")
    spread = found.get("efficiency_sd")
    efficiency = [_efficiency(cell, column) for cell in column.cells]
    pairs = zip(spread.cells, column.cells, strict=True) if spread else ()
    sd = [0.0 if cell.blank else _efficiency_sd(cell, spread, beside, column) for cell, beside in pairs if spread]
    return EfficiencyTable(
        read_route(table, found, route),
        np.array(efficiency),
        np.array(sd) if spread else np.zeros(len(table.rows)),
        read_own_angles(table, found, contacts),
        provenance_of(table),
    )


def _ratio(cell: Cell, column: Column) -> float:
    """A number, or a percentage where the heading or the cell says so."""
    percentage = cell.percentage()
    return column.value(cell) if percentage is None else percentage


def _in_percent(cell: Cell, column: Column) -> bool:
    return column.factor != 1 or cell.percentage() is not None


def _efficiency(cell: Cell, column: Column) -> float:
    value = _ratio(cell, column)
    if value <= 0:
        raise cell.refuse(f"an efficiency of {cell.shown} is not possible; it is output force over input force.")
    if value > 1:
        usual = (
            "the usual cause is that input and output force were swapped"
            if _in_percent(cell, column)
            else "if it is in percent, name the column efficiency_percent"
        )
        raise cell.refuse(f"an efficiency of {cell.shown} is above 1; {usual}.")
    return value


def _efficiency_sd(cell: Cell, column: Column, efficiency: Cell, efficiency_column: Column) -> float:
    value = _ratio(cell, column)
    if not 0 < value <= 1:
        raise cell.refuse(
            f"a standard deviation of {cell.shown} is not possible for an efficiency; write one up to 1 (100 %)."
        )
    if _in_percent(efficiency, efficiency_column) and not _in_percent(cell, column):
        raise cell.refuse(
            f"{cell.shown} does not say whether it is in percent as the efficiency beside it is; name the column "
            "efficiency_sd_percent, or write 1 % for 0.01."
        )
    return value


def read_forces(
    paths: Sequence[Path],
    route: Route | None,
    contacts: Sequence[str],
    sources: Mapping[str, ColumnSource] | None = None,
) -> tuple[ForceTable, tuple[str, ...]]:
    """Read force tables, one or several files, into one table.

    A run is one mounting of the cable. It is what the `run` column says, file by file; without one, all rows of a file
    at one route value and one set of own angles are taken for one run, which is remarked on. Without a `stroke` column
    all rows are taken as pulling, likewise.

    Args:
        paths: CSV files.
        route: The route variable, if the cable has one.
        contacts: Columns in which rows may carry their own wrap angle.
        sources: Columns named by the user.

    Returns:
        The table, and remarks on what had to be assumed.

    Raises:
        DatasetError: See `read_csv` and `find_columns`; or a force is not positive, or a stroke is unknown.
    """
    parts = [_read_force_file(path, route, contacts, sources) for path in paths]
    names: list[str] = []
    runs = []
    for path, (part, _) in zip(paths, parts, strict=True):
        runs.append(part.run + len(names))
        names += [f"{path.stem}:{name}" if len(paths) > 1 else name for name in part.run_names]
    tables = [part for part, _ in parts]
    own = OwnAngles(
        tuple(contacts),
        np.concatenate([t.own.angle for t in tables]),
        np.concatenate([t.own.sd for t in tables]),
    )
    merged = ForceTable(
        np.concatenate([t.route for t in tables]),
        np.concatenate([t.input_force for t in tables]),
        np.concatenate([t.output_force for t in tables]),
        np.concatenate(runs),
        tuple(names),
        np.concatenate([t.stroke for t in tables]),
        own,
        Provenance(
            tuple(path.name for path in paths),
            np.concatenate([np.full(len(t.run), i) for i, t in enumerate(tables)]),
            np.concatenate([t.origin.row for t in tables]),
        ),
        np.concatenate([t.velocity for t in tables]),
        _one_velocity_unit(tables),
    )
    return merged, tuple(dict.fromkeys(remark for _, remarks in parts for remark in remarks))


def _one_velocity_unit(tables: Sequence[ForceTable]) -> str:
    units = {t.velocity_unit: t.origin.files[0] for t in tables if t.velocity_unit}
    if len(units) > 1:
        raise DatasetError(
            f"{' and '.join(units.values())} give velocities of different kinds, of the rope and of the motor; give both in "
            "mm/s or both in r/min."
        )
    return next(iter(units), "")


def _read_force_file(
    path: Path, route: Route | None, contacts: Sequence[str], sources: Mapping[str, ColumnSource] | None
) -> tuple[ForceTable, list[str]]:
    table = read_csv(path)
    forces = (Quantity("input_force", "force"), Quantity("output_force", "force"))
    others = (Quantity("run", "text"), Quantity("stroke", "text"), Quantity("velocity", "speed"))
    found = find_columns(table, (*forces, *others, *shared_columns(route, contacts)), sources, _UNUSED)
    columns = [require(table, found, q.name, f"{q.name}_N") for q in forces]
    input_force, output_force = (np.array([_force(cell, c) for cell in c.cells]) for c in columns)
    own = read_own_angles(table, found, contacts)
    route_values = read_route(table, found, route)
    remarks = []
    if "stroke" not in found:
        remarks.append(f"{table.file} has no stroke column: every row is taken as pulling (rope sliding to the motor).")
    if "run" not in found:
        remarks.append(
            f"{table.file} has no run column: all rows at one {route.variable if route else 'wrap angle'} are taken "
            "as one run (one mounting of the cable)."
        )
    run, run_names = _runs(found.get("run"), route_values, own)
    strokes, origin = read_strokes(found, len(table.rows)), provenance_of(table)
    if held := int(np.sum(strokes == 0)):
        remarks.append(
            f"{table.file}: {held} readings are held. A held reading says only that friction is at least as large as it takes "
            "to hold it; a coefficient that rests on such readings alone has a lower bound, and above it nothing but its prior."
        )
    velocity, unit = _velocities(found.get("velocity"), len(table.rows))
    parts = (route_values, input_force, output_force, run, run_names, strokes, own, origin, velocity, unit)
    return ForceTable(*parts), remarks


def _velocities(column: Column | None, n_rows: int) -> tuple[Vector, str]:
    """Velocities, NaN where blank or without a column, and their internal unit."""
    if column is None:
        return np.full(n_rows, np.nan), ""
    values = np.array([np.nan if cell.blank else column.value(cell) for cell in column.cells])
    return values, INTERNAL_UNITS[speed_dimension(column.unit or "")]


def _runs(column: Column | None, route: Vector, own: OwnAngles) -> tuple[Labels, tuple[str, ...]]:
    if column is not None:
        keys = [cell.text.strip() or "(no run)" for cell in column.cells]
    else:
        rows = np.column_stack([route, own.angle])
        keys = [", ".join(f"{value:g}" for value in row if np.isfinite(value)) or "all" for row in rows]
    names = tuple(dict.fromkeys(keys))
    return np.array([names.index(key) for key in keys]), names


def _force(cell: Cell, column: Column) -> float:
    value = column.value(cell)
    if value <= 0:
        raise cell.refuse(
            f"{cell.shown} is not positive; the usual cause is the sign convention of the load cell or a "
            "reading before tension was on: write tension as positive and leave slack readings out."
        )
    return value
