"""Forces read at both ends of a cable: how they are checked and described."""

from collections import Counter
from dataclasses import replace

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import override

from bowdenfit.description import Description, Finite
from bowdenfit.errors import suggest_name
from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.bench_error import BenchError, BenchLoads, order_of, powers, smooth_readings
from bowdenfit.kinds.forces.impossible_forces import check_following, check_gains
from bowdenfit.kinds.forces.misread_angles import describe_misread_angles
from bowdenfit.kinds.forces.mountings import ForceSettings
from bowdenfit.kinds.forces.stated_noise import describe_scatter, log_ratio_variance
from bowdenfit.kinds.forces.table import ForceTable, count_loads, read_forces
from bowdenfit.kinds.kind import Design, FrictionTableKind, PlannedKind, Readings, efficiency_readings
from bowdenfit.kinds.measured_columns import MeasuredColumn, pair_forces
from bowdenfit.kinds.motor_readings import check_gear, convert_to_motor_readings
from bowdenfit.kinds.plausibility import (
    SCATTER,
    CoarseReadings,
    ComparedReadings,
    compare_without_runs,
    describe_copies,
    explain_impossible_loss,
    find_coarse_readings,
    route_or_wrap_angle,
    split_by_group,
)
from bowdenfit.kinds.rows import (
    STROKE_NAMES,
    FileRows,
    OwnAngles,
    RowOrigin,
    Stroke,
    convert_to_radians,
    format_fixed,
    number_names,
    route_cells,
    route_heading,
    stroke_signs,
)
from bowdenfit.kinds.table_files import RUN, STROKE, InitQuestions, Source, TableFromFiles, WantedColumn, YesNoQuestion
from bowdenfit.kinds.tables import Measurements
from bowdenfit.types import Vector
from bowdenfit.words import counted, listed, percent, significant

_SEEN_LOSS = 0.01  # mean log ratio that a gain error of 1 % equals; below it a share of the coefficients says nothing


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


class ForceKind(FrictionTableKind[ForceTable], PlannedKind[ForceTable]):
    """Pairs of forces at both ends, in runs: one run is one mounting of the cable."""

    name = "forces"
    table = ForceTable
    settings = ForceSettings
    readings = (
        efficiency_readings("run_efficiency", "forces", "force runs", "run {}", are_runs=True),
        Readings("held_ratio", "held forces", "held forces", "{}", "Input over output force"),
    )
    methods_sentence = "All readings of one mounting of the cable shared its error, which was integrated out."
    init_questions = InitQuestions(
        "forces at both ends of the cable, one pair of readings a row",
        (
            WantedColumn(
                Quantity("input_force", "force"),
                "the force at the motor",
                (Quantity("input_torque", "torque"), Quantity("input_current", "current")),
            ),
            WantedColumn(
                Quantity("output_force", "force"), "the force at the load", (Quantity("output_torque", "torque"),)
            ),
            RUN,
            STROKE,
        ),
        (YesNoQuestion("run", "Was the cable remounted for every row of {}?", "run", "each row"),),
        has_own_angles=True,
        several=True,
    )
    design = ForceDesign

    @override
    def read(self, source: Source) -> TableFromFiles[ForceTable]:
        return read_forces(source)

    @override
    def describe(self, table: ForceTable, description: Description) -> list[str]:
        """Return how many readings of each stroke there are, and how large."""
        files = table.origin.files[0] if len(table.origin.files) == 1 else f"{len(table.origin.files)} files"
        counts = ", ".join(
            f"{(table.stroke == stroke).sum()} {name}"
            for stroke, name in ((1, "pulling"), (-1, "returning"), (0, "held"))
            if (table.stroke == stroke).any()
        )
        low, high = (significant(end, 4) for end in (table.input_force.min(), table.input_force.max()))
        loads = f"{low} to {high} N" if low != high else f"{high} N"
        weights = ", of hung weights without noise" if description.sensors.noise_ratio == 0 else ""
        return [f"{files}: {self.count_readings(table)} ({counts}), input {loads}{weights}"]

    @override
    def describe_single_file(self, table: ForceTable) -> str:
        """Return how many readings it has, and at how many loads, counted at the end where they fall together."""
        n = len(table.input_force)
        counts = [count for count in map(count_loads, (table.input_force, table.output_force)) if count]
        at = f" at {min(counts)} load{'s' if min(counts) > 1 else ''}" if counts else ""
        return f"a table of {n} reading{'s' if n > 1 else ''}{at}"

    @override
    def count_readings(self, table: ForceTable) -> str:
        return f"{counted(len(table.run), 'force reading')} in {counted(len(table.run_names), 'run')}"

    @override
    def forces(self, table: ForceTable) -> Vector:
        return np.concatenate([table.input_force, table.output_force])

    @override
    def speeds(self, table: ForceTable) -> Vector:
        return np.abs(table.velocity)

    @override
    def typical_speeds(self, table: ForceTable) -> list[float]:
        """Return the lowest and the highest speed."""
        finite = np.abs(table.velocity[np.isfinite(table.velocity)])
        return [float(finite.min()), float(finite.max())] if len(finite) else []

    @override
    def velocity_unit(self, table: ForceTable) -> str:
        return table.velocity_unit

    @override
    def groups(self, table: ForceTable) -> tuple[str, ...]:
        return table.group

    @override
    def check(self, table: ForceTable, description: Description, measurements: Measurements) -> None:
        """Refuse rows without wrap angles, a gear that they do not show, an output that does not follow, and gains of force."""
        super().check(table, description, measurements)
        check_gear(description, table, table.stroke, table.input_force, listed(table.origin.files))
        check_following(table)
        check_gains(table, description)

    @override
    def warnings(self, table: ForceTable, description: Description, measurements: Measurements) -> list[str]:
        """Warn of what cannot be separated from friction: gains of the load cells, and the only mounting of a group."""
        of_groups = _warn_of_single_mountings(table, description)
        return _warn_of_gains(table, description) + of_groups + _warn_of_stated_noise(table)

    @override
    def copied_readings(self, table: ForceTable) -> list[str]:
        """Compare runs whatever their length, since a copied run is often given another one.

        Runs of one reading are compared by how their losses scatter along the bend, as one table.
        """
        forces = np.column_stack([table.input_force, table.output_force])
        stroke, curve = table.stroke[:, None].astype(float), 3 * table.run + table.stroke
        different = np.unique(np.column_stack([curve, forces]), axis=0)
        if len(different) == len(np.unique(curve)) and np.all(forces > 0):
            settings, loss = np.column_stack([stroke, forces]), np.log(table.input_force / table.output_force)
            return describe_copies(compare_without_runs(table.origin, settings, loss, route_or_wrap_angle(table), table.stroke))
        names = tuple(f"run {name}" for name in table.run_names)
        return describe_copies(
            ComparedReadings(
                listed(table.origin.files), table.run, names, stroke, forces, table.input_force, curve, table.origin
            )
        )

    @override
    def misread_angles(self, table: ForceTable, description: Description) -> str:
        return describe_misread_angles(table, description)

    @override
    def coarse_readings(self, table: ForceTable) -> CoarseReadings | None:
        """Check the output force, where its standard deviation is not stated; the input force may be set."""
        if table.sd is not None:
            return None
        stroke = table.stroke.astype(float)
        settings = np.column_stack([table.route, table.own.angle, stroke, table.input_force])
        return find_coarse_readings(listed(table.origin.files), settings, table.output_force, "N")

    @override
    def measured_columns(self, table: ForceTable) -> list[MeasuredColumn]:
        return pair_forces(table.input_force, table.output_force, 3 * table.run + table.stroke)

    @override
    def with_bench_error(self, table: ForceTable, error: BenchError) -> ForceTable:
        """Return the table with the error in its forces and wrap angles."""
        forces, order = (table.input_force, table.output_force), order_of(table.run, len(table.run_names))
        rope, log_ratio = error.where_angles_grow(table.own.sd), _smooth_log_ratio(table)
        input_force, output_force = rope.apply_to_rope(forces, log_ratio, table.stroke, order, BenchLoads.of(*forces))
        return replace(table, input_force=input_force, output_force=output_force, own=error.apply_to_rows(table.own))

    @override
    def why_implausible(self, measured: ForceTable, simulated: ForceTable) -> str:
        """Check runs, and that readings of one run and stroke scatter no more than errors of forces may."""
        if np.any(simulated.input_force <= 0) or np.any(simulated.output_force <= 0):
            return "a force is not positive"
        slides = simulated.stroke != 0
        if not slides.any():
            return ""
        ratio = (simulated.stroke * np.log(simulated.input_force / simulated.output_force))[slides]
        strokes = split_by_group(2 * simulated.run[slides] + (simulated.stroke[slides] > 0), ratio)
        if any(np.std(part) > SCATTER for part in strokes):
            return "forces scatter by more than a tenth"
        of_runs = np.array([part.mean() for part in split_by_group(simulated.run[slides], ratio)])
        return explain_impossible_loss(of_runs, "the efficiency of a run")

    @override
    def file_rows(self, table: ForceTable, description: Description) -> FileRows:
        measured = np.isfinite(table.own.angle).any(axis=0)
        angles = np.rad2deg(table.own.angle[:, measured])
        heading, readings = convert_to_motor_readings(table.input_force, description)
        inputs, outputs = format_fixed(readings, 3), format_fixed(table.output_force, 3)
        sds = [] if table.sd is None else [format_fixed(column, 3) for column in table.sd.T if np.all(column > 0)]
        rows = [
            [
                *route_cells(table.route[i], description),
                *("" if np.isnan(angle) else f"{angle:.6g}" for angle in angles[i]),
                table.run_names[table.run[i]],
                STROKE_NAMES.get(int(table.stroke[i]), "hold"),
                inputs[i],
                outputs[i],
                *(column[i] for column in sds),
            ]
            for i in range(len(table.run))
        ]
        names = [f"{name}_deg" for name, there in zip(table.own.names, measured, strict=True) if there]
        of_sds = [f"{end}_force_sd_N" for end in ("input", "output")][2 - len(sds) :]
        return [*route_heading(description), *names, "run", "stroke", heading, "output_force_N", *of_sds], rows

    @override
    def design_contradiction(self, design: ForceDesign, description: Description) -> str:
        """Return that wrap angles are of a column that no contact has."""
        known_names = description.angle_columns
        unknown = next((name for name in design.own_angles if name not in known_names), None)
        return (
            f"own_angles.{unknown}: no contact has that column{suggest_name(unknown, known_names or ['none'])}"
            if unknown
            else ""
        )

    @override
    def empty_table(self, design: ForceDesign, description: Description, file: str) -> ForceTable:
        n_runs, n_forces, names = len(design.runs), len(design.input_forces), description.angle_columns
        run = np.repeat(np.arange(n_runs), len(design.strokes) * n_forces)
        stroke = np.tile(np.repeat(stroke_signs(design.strokes), n_forces), n_runs)
        force = np.tile(design.input_forces, n_runs * len(design.strokes))
        own_angles = OwnAngles.none(names, len(run))
        for name in set(design.own_angles).intersection(names):
            own_angles.angle[:, names.index(name)] = convert_to_radians(design.own_angles[name])[run]
        route = np.asarray(design.runs, dtype=float)[run]
        labels = tuple(str(i + 1) for i in range(n_runs))
        origin, velocity = RowOrigin.below_heading(file, len(run)), np.full(len(run), np.nan)
        return ForceTable(route, force, 0.8 * force, run, labels, stroke.astype(int), own_angles, origin, velocity)


def _warn_of_gains(table: ForceTable, description: Description) -> list[str]:
    """Warn where one stroke was read and nothing is said of the gains; both strokes tell them from friction."""
    strokes = np.unique(table.stroke[table.stroke != 0])
    if len(strokes) != 1 or description.gain_sd is not None:
        return []
    slides = (table.stroke != 0) & (table.input_force > 0) & (table.output_force > 0)
    loss = abs(float(np.mean(np.log(table.input_force[slides] / table.output_force[slides])))) if slides.any() else 0.0
    wrong = (
        f", coefficients are wrong by {percent(0.01 / loss, 0)}" if loss > _SEEN_LOSS else ", that counts as friction"
    )
    read = "pulls" if strokes[0] > 0 else "returns"
    return [
        f"only {read} were read, in which load cells that differ in gain look like friction: where they differ by 1 %{wrong}, "
        "and no interval says so. State input_gain_error_sd and output_gain_error_sd under [sensors] (0 where one cell read "
        "both ends), or read the other stroke too."
    ]


def _warn_of_stated_noise(table: ForceTable) -> list[str]:
    """Warn where readings of one run scatter otherwise than their standard deviations say."""
    slides = table.stroke != 0
    if table.sd is None or not slides.any():
        return []
    force_in, force_out = table.input_force[slides], table.output_force[slides]
    settings = np.column_stack([table.run, table.stroke, np.nan_to_num(table.route), np.nan_to_num(table.own.angle)])[slides]
    group = np.unique(settings, axis=0, return_inverse=True)[1].ravel()
    variance = log_ratio_variance(table.sd[slides], force_in, force_out)
    ratio = table.stroke[slides] * np.log(force_in / force_out)
    return describe_scatter(listed(table.origin.files), ratio, variance, force_in + force_out, group)


def _warn_of_single_mountings(table: ForceTable, description: Description) -> list[str]:
    """Warn of groups with one mounting, whose effect cannot be told from that of the group."""
    if not description.by_group:
        return []
    mounted = Counter(name for name, _ in set(zip(table.group, table.run.tolist(), strict=True)))
    once = [name for name in dict.fromkeys(table.group) if mounted[name] == 1]
    if not once:
        return []
    return [
        f"{listed(once)}: measured in one mounting of the cable{' each' if len(once) > 1 else ''}, so the effect of that "
        "mounting cannot be separated from that of the group, and intervals rest on the scatter of other mountings, or on its "
        "prior; remount the cable a few times in each group."
    ]


def _smooth_log_ratio(table: ForceTable) -> Vector:
    """Return the log ratio of input to output force that rows like each one have [1]; 0 for held rows.

    By least squares over all rows of a stroke and group: linear in wrap angles and log load, and cubic in the route variable.
    """
    slides = (table.stroke != 0) & (table.input_force > 0) & (table.output_force > 0)
    ratio = np.zeros(len(slides))
    ratio[slides] = np.log(table.input_force[slides] / table.output_force[slides])
    load = np.log(np.where(slides, table.input_force, 1.0))
    columns = np.column_stack([powers(table.route, 4), np.nan_to_num(table.own.angle), load])
    group = number_names(table.group)[0] if table.group else np.zeros(len(slides), dtype=int)
    weight = table.input_force[slides]  # noise of a log ratio is that of the cells over their force
    ratio[slides] = smooth_readings(ratio[slides], columns[slides], (3 * group + table.stroke)[slides], weight)
    return ratio
