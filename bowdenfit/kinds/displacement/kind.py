"""Force at the motor against its displacement: how it is checked and described."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from typing_extensions import override

from bowdenfit.description import Description, Finite
from bowdenfit.description.file import Stated
from bowdenfit.description.values import Frozen
from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.bench_error import PARABOLA, BenchError, powers, smooth_readings
from bowdenfit.kinds.displacement.reader import find_early_rows, read_displacement
from bowdenfit.kinds.displacement.table import DisplacementSettings, DisplacementTable, follow_motor
from bowdenfit.kinds.kind import Design, FrictionTableKind, PlannedKind, Readings, RopeKind
from bowdenfit.kinds.measured_columns import MeasuredColumn
from bowdenfit.kinds.plausibility import ComparedReadings, describe_copies, is_within_factor
from bowdenfit.kinds.rows import (
    FileRows,
    OwnAngles,
    RowOrigin,
    convert_to_radians,
    describe_range,
    format_fixed,
    route_cells,
    route_heading,
)
from bowdenfit.kinds.table_files import RUN, STROKE, InitQuestions, Source, TableFromFiles, WantedColumn
from bowdenfit.kinds.tables import Measurements
from bowdenfit.types import Vector
from bowdenfit.words import listed

_SPRING, _ROPE = "end_spring", "rope_stiffness"
_FEW_SHARE = 0.2  # displacements that pull and return share, over all, from which a loop closes; a judgement
_NEGATIVE = -0.05  # least simulated force over the largest, as the reader allows of noise about 0


class _DisplacementRows(Frozen):
    """[design.displacement]: displacements of a stroke [mm], how often up and down, and the wrap angle of each run [deg]."""

    displacements: tuple[Finite, ...] = ()
    cycles: Annotated[int, Field(ge=1, le=100)] = 2
    wrap_angles: tuple[Finite, ...] = ()


class DisplacementDesign(Design):
    """[design]: how the motor moves."""

    displacement: _DisplacementRows = _DisplacementRows()


class DisplacementKind(
    FrictionTableKind[DisplacementTable], RopeKind[DisplacementTable], PlannedKind[DisplacementTable]
):
    """One load cell and one position, with a spring or a stop at the far end."""

    name = "displacement"
    needs_load_cell = True
    table = DisplacementTable
    settings = DisplacementSettings
    readings = (
        Readings(
            "motor_force", "displacement", "force at the motor", "force at the motor in {}", "Force at the motor (N)"
        ),
    )
    methods_sentence = (
        "The force at the motor followed its displacement as the tension of a rubbing rope does, through every turn of the "
        "motor."
    )
    init_questions = InitQuestions(
        "one force, at the motor, and the displacement of the motor",
        (
            WantedColumn(Quantity("force", "force"), "the force at the motor", (Quantity("input_force", "force"),)),
            WantedColumn(
                Quantity("displacement", "length"), "the displacement of the motor", (Quantity("position", "length"),)
            ),
            RUN,
            STROKE,
        ),
        has_own_angles=True,
    )
    design = DisplacementDesign

    @override
    def read(self, source: Source) -> TableFromFiles[DisplacementTable]:
        return read_displacement(source)

    @override
    def describe(self, table: DisplacementTable, description: Description) -> list[str]:
        """Return the readings of each stroke, what is at the far end, and where the loop closes."""
        pulling = int(table.pulls.sum())
        low, high = table.shared
        place = f"from {low:.4g} to {high:.4g} mm" if high > low else "at no common displacement"
        unused = int(np.sum(~table.used))
        left = f"; {unused} of {len(table.used)} rows are not used" if unused else ""
        count, returning = self.count_readings(table), int(table.used.sum()) - pulling
        return [
            f"{table.origin.files[0]}: {count} ({pulling} pulling, {returning} returning), "
            f"{describe_range(table.force, 'N')} over {describe_range(table.displacement, 'mm')}, "
            f"pull and return {place}; far end: {_far_end(description)}{left}"
        ]

    @override
    def describe_single_file(self, table: DisplacementTable) -> str:
        return f"a table of {len(table.force)} forces against displacement"

    @override
    def count_readings(self, table: DisplacementTable) -> str:
        """Return how many readings are used, in how many runs."""
        runs = len(table.run_names)
        return f"{int(table.used.sum())} forces against displacement in {runs} run{'s' if runs > 1 else ''}"

    @override
    def forces(self, table: DisplacementTable) -> Vector:
        return table.force[table.used]

    @override
    def bends(self, table: DisplacementTable) -> Vector:
        return np.nansum(table.own.angle, axis=1)

    @override
    def contradiction(self, settings: DisplacementSettings | None, description: Description) -> str:
        """Return that there is a loop, a friction model whose equations these are not, or a stop that is a spring."""
        if settings is None:
            return ""
        if description.cable.kind == "loop":
            return "the table displacement is of a single rope, and a loop has two; leave it out, or describe one rope alone"
        if description.friction_model != "capstan":
            return 'the equations of the table displacement hold for friction_model = "capstan" only; leave it out'
        if settings.stop is not None and settings.end != "stop":
            return 'tables.displacement says where a stop is, but not end = "stop"; write that as well, or leave the stop out'
        return ""

    @override
    def quantities(self, settings: Any, description: Description) -> list[Stated]:
        return [("tables, displacement, stop", settings.stop, "length")]

    @override
    def warnings(self, table: DisplacementTable, description: Description, measurements: Measurements) -> list[str]:
        return list(_warnings(table, description))

    @override
    def measured_columns(self, table: DisplacementTable) -> list[MeasuredColumn]:
        return [MeasuredColumn("force", "N", table.force)]

    @override
    def copied_readings(self, table: DisplacementTable) -> list[str]:
        files, names = listed(table.origin.files), tuple(f"run {name}" for name in table.run_names)
        moved, force = table.displacement[:, None], table.force[:, None]
        return describe_copies(
            ComparedReadings(files, table.run, names, moved, force, table.displacement, table.run, table.origin)
        )

    @override
    def with_bench_error(self, table: DisplacementTable, error: BenchError) -> DisplacementTable:
        """Return the table with the error in its forces, which rise as the motor pulls, and in its wrap angles."""
        strokes = 2 * table.run + (table.motion.stroke > 0)
        smooth = smooth_readings(table.force, powers(table.displacement, PARABOLA), strokes)
        force = table.force + error.apply_to_force(smooth, table.motion.stroke) - smooth
        return replace(table, force=force, own=error.apply_to_rows(table.own))

    @override
    def why_implausible(self, measured: DisplacementTable, simulated: DisplacementTable) -> str:
        """Return that forces differ much in size from the measured ones, or that one is negative."""
        if np.any(simulated.force < _NEGATIVE * max(simulated.force.max(), 0.0)):
            return "a force is negative"
        close = is_within_factor(np.ptp(measured.force), np.ptp(simulated.force))
        return "" if close else "the force is far from the measured one"

    @override
    def file_rows(self, table: DisplacementTable, description: Description) -> FileRows:
        names = table.own.names
        displacements, forces = format_fixed(table.displacement, 4), format_fixed(table.force, 4)
        rows = [
            [
                *route_cells(table.route[i], description),
                *("" if np.isnan(angle) else f"{angle:.6g}" for angle in np.rad2deg(table.own.angle[i])),
                table.run_names[table.run[i]],
                *(["pull" if table.motion.stroke[i] > 0 else "return"] if table.sliding else []),
                displacements[i],
                forces[i],
            ]
            for i in range(len(table.run))
        ]
        heads = [
            *route_heading(description),
            *(f"{name}_deg" for name in names),
            "run",
            *(["stroke"] if table.sliding else []),
        ]
        return [*heads, "displacement_mm", "force_N"], rows

    @override
    def empty_table(self, design: DisplacementDesign, description: Description, file: str) -> DisplacementTable:
        """Return a table in the order in which the motor moves up and down."""
        moved, angles = design.displacement, convert_to_radians(design.displacement.wrap_angles)
        up = np.array(sorted(set(moved.displacements)), dtype=float)
        path = np.append(np.tile(np.concatenate([up, up[-2:0:-1]]), moved.cycles), up[:1])
        runs, names = max(len(angles), 1), description.angle_columns
        x, run = np.tile(path, runs), np.repeat(np.arange(runs), len(path))
        own_angles = OwnAngles.none(names, len(x))
        column = next((c.wrap_angle.column for c in description.contact if c.wrap_angle.column), None)
        if column is not None and len(angles):
            own_angles.angle[:, names.index(column)] = angles[run]
        labels = tuple(f"{angle:.4g} deg" for angle in np.rad2deg(angles)) or ("all",)
        every, nowhere = np.ones(len(x), dtype=bool), np.full(len(x), np.nan)
        origin = RowOrigin.below_heading(file, len(x))
        table = DisplacementTable(nowhere, 1.0 + x, x, follow_motor(x, run), run, labels, every, own_angles, origin, False)
        return replace(table, used=~find_early_rows(table))


def _far_end(description: Description) -> str:
    """Return what is at the far end, and how much is known of it."""
    settings = description.table(DisplacementSettings)
    if settings is not None and settings.end == "stop":
        return "a stop"
    return f"a spring whose stiffness is {'stated' if _SPRING in description.prior else 'fitted'}"


def _warnings(table: DisplacementTable, description: Description) -> Iterator[str]:
    file, settings = table.origin.files[0], description.table(DisplacementSettings)
    springy = settings is None or settings.end == "spring"
    rope_known = _ROPE in description.prior or "stretch" in description.tables.stated
    free = [
        name
        for name, known in ((_SPRING, not springy or _SPRING in description.prior), (_ROPE, rope_known))
        if not known
    ]
    low, high = table.shared
    closes = high - low > _FEW_SHARE * np.ptp(table.displacement)
    if free and not closes:
        yield (
            f"in {file} pull and return do not meet over the same displacements, so the loop does not close, and "
            f"{' and '.join(free)} {'are' if len(free) > 1 else 'is'} free: friction cannot be separated from the stiffness. "
            "Record the return too, or state what is known of spring and rope under [prior.NAME]."
        )
    elif table.sliding and len(free) == 2:
        yield (
            f"{file} has readings of the sliding rope alone, and neither {_SPRING} nor {_ROPE} is stated: the width of the "
            "loop determines the friction exponent only to a factor of two, between a rope that does not give and an end that "
            "does not. Read through the turns of the motor too, or state one of them under [prior.NAME]."
        )
    if not np.any(table.used):
        yield f"no row of {file} can be used."
    if not (np.nansum(table.own.angle, axis=1) > 0).any() and not any(
        c.wrap_angle.constant is not None or c.wrap_angle.curve for c in description.contact
    ):
        yield f"every row of {file} is at a wrap angle of 0, so it has no information on friction; read at larger ones too."
