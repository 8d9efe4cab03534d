"""Tables of forces in words and in rows: what was read, what is plausible, and how a file says it."""

from collections import Counter

import numpy as np
from pydantic import Field, model_validator

from bowdenfit.description import Description, Finite
from bowdenfit.errors import nearest
from bowdenfit.kinds.design import Design, Stroke, radians, signs
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.pages import STROKE_NAMES, Page, fixed, route_cells, route_heading
from bowdenfit.kinds.plausibility import SCATTER, beyond, parts
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.words import counted, listed, percent, significant

_SEEN_LOSS = 0.01  # mean log ratio above which an error of the gains is said as a share of the coefficients


def count(table: ForceTable) -> str:
    """How many readings, in how many runs."""
    return f"{counted(len(table.run), 'force reading')} in {counted(len(table.run_names), 'run')}"


def describe(table: ForceTable, description: Description) -> list[str]:
    """How many readings of each stroke, and how large."""
    files = table.origin.files[0] if len(table.origin.files) == 1 else f"{len(table.origin.files)} files"
    counts = ", ".join(
        f"{(table.stroke == stroke).sum()} {name}"
        for stroke, name in ((1, "pulling"), (-1, "returning"), (0, "held"))
        if (table.stroke == stroke).any()
    )
    low, high = (significant(end, 4) for end in (table.input_force.min(), table.input_force.max()))
    loads = f"{low} to {high} N" if low != high else f"{high} N"
    weights = ", of hung weights without noise" if description.sensors.noise_ratio == 0 else ""
    return [f"{files}: {count(table)} ({counts}), input {loads}{weights}"]


def warnings(table: ForceTable, description: Description, measurements: Measurements) -> list[str]:
    """What the readings cannot tell from friction: gains of the load cells, and the mounting of a group that has one."""
    del measurements
    return _unlike_gains(table, description) + _mounted_once(table, description)


def _unlike_gains(table: ForceTable, description: Description) -> list[str]:
    """Of one stroke alone, where nothing is said of the gains; both strokes tell them from friction."""
    strokes = np.unique(table.stroke[table.stroke != 0])
    if len(strokes) != 1 or description.sensors.gain_sd is not None:
        return []
    slides = (table.stroke != 0) & (table.input_force > 0) & (table.output_force > 0)
    loss = abs(float(np.mean(np.log(table.input_force[slides] / table.output_force[slides])))) if slides.any() else 0.0
    wrong = f", coefficients are wrong by {percent(0.01 / loss, 0)}" if loss > _SEEN_LOSS else ", that counts as friction"
    read = "pulls" if strokes[0] > 0 else "returns"
    return [
        f"only {read} were read, in which load cells that differ in gain look like friction: where they differ by 1 %{wrong}, "
        "and no interval says so. State input_gain_error_sd and output_gain_error_sd under [sensors] (0 where one cell read "
        "both ends), or read the other stroke too."
    ]


def _mounted_once(table: ForceTable, description: Description) -> list[str]:
    """Groups of which there is one mounting, which its coefficient cannot be told from."""
    if not description.by_group:
        return []
    mounted = Counter(name for name, _ in set(zip(table.group, table.run.tolist(), strict=True)))
    once = [name for name in dict.fromkeys(table.group) if mounted[name] == 1]
    if not once:
        return []
    return [
        f"{listed(once)}: measured in one mounting of the cable{' each' if len(once) > 1 else ''}, so what that mounting did "
        "cannot be told from what the group does, and intervals rest on the scatter of other mountings, or on its prior; mount "
        "the cable anew a few times in each group."
    ]


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
    measured = np.isfinite(table.own.angle).any(axis=0)
    angles = np.rad2deg(table.own.angle[:, measured])
    inputs, outputs = fixed(table.input_force, 3), fixed(table.output_force, 3)
    rows = [
        [
            *route_cells(table.route[i], description),
            *("" if np.isnan(angle) else f"{angle:.6g}" for angle in angles[i]),
            table.run_names[table.run[i]],
            STROKE_NAMES[int(table.stroke[i])],
            inputs[i],
            outputs[i],
        ]
        for i in range(len(table.run))
    ]
    names = [f"{name}_deg" for name, there in zip(table.own.names, measured, strict=True) if there]
    return [*route_heading(description), *names, "run", "stroke", "input_force_N", "output_force_N"], rows


class ForceDesign(Design):
    """[design]: route value of each run, and the input forces [N] of every stroke of a run.

    Args:
        runs: Route values; any number for each run of a cable without a route.
        input_forces: Input forces [N].
        strokes: Strokes, in order.
        own_angles: Wrap angle of each run [deg], by column of a contact without a curve.
    """

    runs: tuple[Finite, ...] = ()
    input_forces: tuple[Finite, ...] = ()
    strokes: tuple[Stroke, ...] = ("pull", "return")
    own_angles: dict[str, tuple[Finite, ...]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _every_run_has_forces_and_angles(self) -> "ForceDesign":
        if self.runs and not self.input_forces:
            raise ValueError("runs need input_forces, such as [20, 40, 60] (in N)")
        for column, angles in self.own_angles.items():
            if len(angles) != len(self.runs):
                raise ValueError(
                    f"own_angles.{column} has {len(angles)} angles for {len(self.runs)} runs; write one each"
                )
        return self

    def contradiction(self, description: Description) -> str:
        """Wrap angles of a column that no contact has."""
        known = description.angle_columns
        unknown = next((name for name in self.own_angles if name not in known), None)
        return f"own_angles.{unknown}: no contact has that column{nearest(unknown, known or ['none'])}" if unknown else ""


def empty(design: ForceDesign, description: Description, file: str) -> ForceTable:
    """A table of a design's shape with unremarkable readings."""
    n_runs, n_forces, names = len(design.runs), len(design.input_forces), description.angle_columns
    run = np.repeat(np.arange(n_runs), len(design.strokes) * n_forces)
    stroke = np.tile(np.repeat(signs(design.strokes), n_forces), n_runs)
    force = np.tile(design.input_forces, n_runs * len(design.strokes))
    own = OwnAngles.none(names, len(run))
    for name in set(design.own_angles).intersection(names):
        own.angle[:, names.index(name)] = radians(design.own_angles[name])[run]
    route = np.asarray(design.runs, dtype=float)[run]
    labels = tuple(str(i + 1) for i in range(n_runs))
    origin, velocity = RowOrigin.below_heading(file, len(run)), np.full(len(run), np.nan)
    return ForceTable(route, force, 0.8 * force, run, labels, stroke.astype(int), own, origin, velocity)
