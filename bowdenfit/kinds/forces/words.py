"""Tables of forces in words and in rows: what was read, what is plausible, and how a file says it."""

import numpy as np

from bowdenfit.description import Description
from bowdenfit.kinds.design import Design
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.pages import STROKE_NAMES, Page, route_cells, route_heading
from bowdenfit.kinds.plausibility import SCATTER, beyond, parts
from bowdenfit.kinds.rows import OwnAngles, RowOrigin


def count(table: ForceTable) -> str:
    """How many readings, in how many runs."""
    return f"{len(table.run)} force readings in {len(table.run_names)} runs"


def describe(table: ForceTable, description: Description) -> list[str]:
    """How many readings of each stroke, and how large."""
    files = table.origin.files[0] if len(table.origin.files) == 1 else f"{len(table.origin.files)} files"
    counts = ", ".join(
        f"{(table.stroke == stroke).sum()} {name}"
        for stroke, name in ((1, "pulling"), (-1, "returning"), (0, "held"))
        if (table.stroke == stroke).any()
    )
    low, high = table.input_force.min(), table.input_force.max()
    weights = ", of hung weights without noise" if description.sensors.noise_ratio == 0 else ""
    return [f"{files}: {count(table)} ({counts}), input {low:.4g} to {high:.4g} N{weights}"]


def implausible(real: ForceTable, made: ForceTable) -> str:
    """By run; and readings of one run and stroke must not scatter more than errors of forces may."""
    del real
    if np.any(made.input_force <= 0) or np.any(made.output_force <= 0):
        return "a force is not positive"
    slides = made.stroke != 0
    if not slides.any():
        return ""
    ratio = (made.stroke * np.log(made.input_force / made.output_force))[slides]
    strokes = parts(2 * made.run[slides] + (made.stroke[slides] > 0), ratio)
    if any(np.std(part) > SCATTER for part in strokes):
        return "forces scatter by more than a tenth"
    return beyond(np.array([part.mean() for part in parts(made.run[slides], ratio)]), "the efficiency of a run")


def page(table: ForceTable, description: Description) -> Page:
    """Headings and rows of its file."""
    rows = [
        [
            *route_cells(table.route[i], description),
            table.run_names[table.run[i]],
            STROKE_NAMES[int(table.stroke[i])],
            f"{table.input_force[i]:.3f}",
            f"{table.output_force[i]:.3f}",
        ]
        for i in range(len(table.run))
    ]
    return [*route_heading(description), "run", "stroke", "input_force_N", "output_force_N"], rows


def empty(design: Design, description: Description, file: str) -> ForceTable:
    """A table of a design's shape with unremarkable readings."""
    per_run = len(design.strokes) * len(design.input_forces)
    run = np.repeat(np.arange(len(design.runs)), per_run)
    stroke = np.tile(np.repeat(design.strokes, len(design.input_forces)), len(design.runs))
    force = np.tile(design.input_forces, len(design.runs) * len(design.strokes))
    names = description.angle_columns
    own = OwnAngles.none(names, len(run))
    for k, name in enumerate(names):
        if design.own_angles and name in design.own_angles:
            own.angle[:, k] = np.asarray(design.own_angles[name])[run]
    route = np.asarray(design.runs, dtype=float)[run]
    labels = tuple(str(i + 1) for i in range(len(design.runs)))
    origin, velocity = RowOrigin.below_heading(file, len(run)), np.full(len(run), np.nan)
    return ForceTable(route, force, 0.8 * force, run, labels, stroke.astype(int), own, origin, velocity)
