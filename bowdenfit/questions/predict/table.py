"""Predictions for the rows of a table, each with its own length, wrap angles, force and stroke."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import jax
import numpy as np

from bowdenfit.description import ContactSettings
from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column, Quantity, find_columns
from bowdenfit.files.tables import RawTable, read_table
from bowdenfit.frames import is_frame, write_frame
from bowdenfit.kinds.rows import read_angle, route_column
from bowdenfit.kinds.strokes import read_stroke
from bowdenfit.questions.predict.lengths import summarize_draws, to_newtons
from bowdenfit.questions.predict.measured_range import clip_to_tension, find_measured_range
from bowdenfit.questions.predict.predictions import ROW
from bowdenfit.results.prediction_angles import choose_angles, predict_forces, split_lengths
from bowdenfit.results.record import Record
from bowdenfit.words import listed, quoted

_STROKES = {"pull": 1, "return": -1}
_NAMES = {sign: name for name, sign in _STROKES.items()}


@dataclass(frozen=True)
class StatedRows:
    """What is stated in the rows of a table.

    Args:
        row: Number of each row in its file.
        route: Route values; 0 without a route.
        angles: Wrap angles [rad] by number of the contact, NaN where it keeps its own.
        stroke: +1 pulling, -1 return.
        force: Force at the end that is known [N]; None where efficiencies are asked for.
        is_wanted: Whether that is the force that is wanted at the load side.
    """

    row: np.ndarray
    route: np.ndarray
    angles: Mapping[int, np.ndarray]
    stroke: np.ndarray
    force: np.ndarray | None
    is_wanted: bool


def predict_table(
    fit: Record,
    table: Any,
    input_force: tuple[float, str] | None = None,
    output_force: tuple[float, str] | None = None,
    stroke: str = "pull",
) -> list[dict[str, Any]]:
    """Predict efficiency, output force or input force for each row of a table.

    Args:
        fit: The fit.
        table: A file, or a data frame: columns for the route variable, for the wrap angle of any contact, for input_force or
            output_force, and for the stroke, with headings and units as in tables of measurements.
        input_force: Force and unit of all rows, where the table has no forces.
        output_force: The same, wanted at the load side.
        stroke: "pull" or "return", of all rows where the table has no strokes.

    Raises:
        DatasetError: The table cannot be read, lacks a length, or has a column that would not be used.
        UsageError: Forces are stated twice, or the cable has no such prediction.
    """
    if fit.dataset.description.route is None and fit.model.cable.is_loop:
        raise UsageError("--table: a loop without a route is predicted at wrap angles; name them as --wrap-angle 90deg.")
    if is_frame(table):
        with TemporaryDirectory() as folder:
            return predict_table(fit, write_frame(table, Path(folder)), input_force, output_force, stroke)
    rows = read_rows(fit, Path(table))
    if (input_force or output_force) is not None:
        if rows.force is not None:
            raise UsageError("forces are stated in the table and by --input-force or --output-force; leave one of them out.")
        option = "--output-force" if output_force else "--input-force"
        newtons = to_newtons(output_force or input_force or (0.0, "N"), option)
        force = np.full(len(rows.row), newtons)
        rows = StatedRows(rows.row, rows.route, rows.angles, rows.stroke, force, output_force is not None)
    if stroke != "pull":
        if (rows.stroke != _STROKES["pull"]).any():
            raise UsageError("strokes are stated in the table and by --stroke; leave one of them out.")
        rows = StatedRows(rows.row, rows.route, rows.angles, -rows.stroke, rows.force, rows.is_wanted)
    parts = np.cumsum([0, *(len(part) for part in split_lengths(rows.route))])
    return [row for a, b in pairwise(parts) for row in _predict_part(fit, rows, slice(a, b))]


def read_rows(fit: Record, path: Path) -> StatedRows:
    """Read what to predict.

    Raises:
        DatasetError: The table cannot be read, lacks a length, or has a column that would not be used.
    """
    description, table = fit.dataset.description, read_table(path)
    names = _angle_names(description.contact)
    route = [] if description.route is None else [route_column(description.route)]
    forces = [Quantity("input_force", "force"), Quantity("output_force", "force")]
    angles = [Quantity(name, "angle", optional=True) for name in names]
    wanted = (*route, *angles, *forces, Quantity("stroke", "text"))
    columns = find_columns(table, wanted)
    _refuse_unused(table, columns, wanted)
    at = _read_lengths(fit, table, columns)
    stated: dict[int, np.ndarray] = {}
    for name, contact in names.items():
        if name in columns:
            if contact in stated:
                raise DatasetError(f"{table.file} has two columns for the wrap angle of {description.contact[contact].name!r}.")
            column = columns[name]
            stated[contact] = np.array(column.read_cells(partial(_read_own_angle, column), np.nan))
    ends = [quantity.name for quantity in forces if quantity.name in columns]
    if len(ends) > 1:
        raise DatasetError(
            f"{table.file} has input_force and output_force; keep the one that is known, and the other is predicted."
        )
    force = np.array(columns[ends[0]].read_cells(partial(_read_force, columns[ends[0]]), np.nan)) if ends else None
    stroke = np.array(columns["stroke"].read_cells(_read_stroke, 1)) if "stroke" in columns else np.ones(len(at), dtype=int)
    table.faults.refuse()
    if not len(at):
        raise DatasetError(f"{path.name} has headings and no rows; write a row for each prediction.")
    return StatedRows(
        np.array([row[0].row for row in table.rows]), at, stated, stroke, force, "output_force" in ends
    )


def _angle_names(contacts: tuple[ContactSettings, ...] | list[ContactSettings]) -> dict[str, int]:
    """Return the headings that mean the wrap angle of a contact: that of its column, or else its name."""
    names: dict[str, int] = {}
    for number, contact in enumerate(contacts):
        word = "_".join(contact.name.lower().split())
        for name in (contact.wrap_angle.column or f"{word}_angle", word, *(["wrap_angle"] if len(contacts) == 1 else [])):
            names.setdefault(name, number)
    return names


def _refuse_unused(table: RawTable, columns: Mapping[str, Column], wanted: tuple[Quantity, ...]) -> None:
    """Refuse columns that would change nothing.

    Raises:
        DatasetError: There are some.
    """
    used = {column.heading for column in columns.values()}
    if unused := [heading for heading in table.header if heading and heading not in used]:
        known = [quantity.name for quantity in wanted]
        raise DatasetError(
            f"{table.file}: predict does not use {quoted(tuple(unused))}; it uses {listed(known)}, with the unit behind the "
            "name. Rename what is meant to be one of these, and delete the rest."
        )


def _read_lengths(fit: Record, table: RawTable, columns: Mapping[str, Column]) -> np.ndarray:
    route = fit.dataset.description.route
    if route is None:
        return np.zeros(len(table.rows))
    if route.variable not in columns:
        raise DatasetError(
            f"{table.file} has no column {route.variable}_{route.unit}; each row needs the "
            f"{route.variable.replace('_', ' ')} to predict at."
        )
    return np.array([float(f"{value:.12g}") for value in columns[route.variable].numbers()])


def _read_own_angle(column: Column, cell: Cell) -> float:
    return np.nan if cell.blank else read_angle(cell, column)


def _read_force(column: Column, cell: Cell) -> float:
    force = column.value(cell)
    if not force > 0:
        raise cell.refuse(f"{cell.shown} is not positive; write the tension as a positive force.")
    return force


def _read_stroke(cell: Cell) -> int:
    sign = read_stroke(cell, held="")
    if sign == 0:
        raise cell.refuse(f"{cell.shown} must be a stroke in which the rope slides; write pull (+1) or return (-1).")
    return sign


def _predict_part(fit: Record, stated: StatedRows, part: slice) -> list[dict[str, Any]]:
    """Return the predictions of some rows."""
    description, friction, limits = fit.dataset.description, fit.model.cable.friction, find_measured_range(fit)
    at, sign = stated.route[part], stated.stroke[part]
    angles = {contact: angle[part] for contact, angle in stated.angles.items()}
    own = choose_angles(fit.dataset, at, angles, fit.provenance.seed)
    force = np.full(len(at), friction.conditions.reference_force) if stated.force is None else stated.force[part]
    z = fit.draws().flat_z
    with jax.enable_x64(True):
        mountings = np.zeros(len(z)), fit.mounting()
        draws = predict_forces(fit.model, z, own, force, sign, mountings, inverse=stated.is_wanted)
    (mean, words), (mounted, _) = (
        clip_to_tension(forces, force, "held by friction alone" if stated.is_wanted else "slack") for forces in draws
    )
    known, name = ("output_force_N", "input_force_N") if stated.is_wanted else ("input_force_N", "output_force_N")
    scale = np.ones(len(at))
    if stated.force is None:
        name, scale = "efficiency", 1 / force
    rows = []
    for i, length in enumerate(at):
        row: dict[str, Any] = {ROW: int(stated.row[part][i])}
        if description.route is not None:
            row[f"{description.route.variable}_{description.route.unit}"] = float(length)
        row |= {f"{_slug(description.contact[k])}_deg": _degrees(angle[i]) for k, angle in angles.items()}
        row |= {"stroke": _NAMES[int(sign[i])]} | ({} if stated.force is None else {known: float(force[i])})
        row |= summarize_draws(name, scale[i] * mean[:, i], scale[i] * mounted[:, i])
        if stated.force is None and friction.depends_on_load:
            row["at_input_force_N"] = float(force[i])
        load = None if stated.force is None else row[name] if stated.is_wanted else float(force[i])
        notes = [words[i], own.outside[i], *limits.notes(None if description.route is None else float(length), load)]
        row["note"] = "; ".join(note for note in notes if note)
        rows.append(row)
    return rows


def _slug(contact: ContactSettings) -> str:
    return "_".join(contact.name.lower().split())


def _degrees(angle: float) -> float | None:
    return None if np.isnan(angle) else float(np.rad2deg(angle))
