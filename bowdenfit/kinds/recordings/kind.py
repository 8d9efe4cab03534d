"""Force recordings, sampled while a motor pulls, stops, reverses and returns: how they are checked and described."""

import numpy as np
from typing_extensions import override

from bowdenfit.description import Description, Preparation, QuantityValue
from bowdenfit.description.file import Stated
from bowdenfit.errors import DatasetError
from bowdenfit.files.matching import Quantity
from bowdenfit.kinds.angles.table import AngleTable
from bowdenfit.kinds.copies import NO_NOISE
from bowdenfit.kinds.init_questions import InitQuestions, WantedColumn
from bowdenfit.kinds.kind import FrictionKind, Readings, Source, TableFromFiles, efficiencies
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.plausibility import FACTOR, SCATTER, beyond
from bowdenfit.kinds.recordings.table import RecordingsTable, read_recordings, recorded_angles
from bowdenfit.kinds.recordings.words import recordings_text
from bowdenfit.kinds.rows import RowConditions
from bowdenfit.recordings.recording import PULL, RETURN, Recordings
from bowdenfit.types import Vector
from bowdenfit.units import speed_dimension
from bowdenfit.words import counted

_FEWEST_BLOCKS = 10  # of each stroke of a plausible recording
_UNDER_LOAD = 0.2  # of the largest force of a loop, above which it counts as loaded


class RecordingKind(FrictionKind[Recordings]):
    """Two load cells, sampled: the tables are `Recordings`."""

    name = "recordings"
    table = Recordings
    settings = RecordingsTable
    readings = (
        efficiencies("recorded_efficiency", "recordings", "recordings", "recording {}", are_runs=True),
        Readings("recorded_loss", "recordings", "recordings", "recording {}", "Force lost (N)"),
    )
    heading = "Recordings"
    methods_sentence = (
        "Recordings were averaged over blocks, phases of sliding were told by a play operator, and all readings of one "
        "mounting shared its error."
    )
    takes_channels = True
    init_questions = InitQuestions(
        "a recording of two load cells, sampled while the motor moves",
        (
            WantedColumn(Quantity("input_force", "force"), "the force at the motor"),
            WantedColumn(Quantity("output_force", "force"), "the force at the load"),
        ),
        several=True,
        is_guessed=False,
    )

    @override
    def read(self, source: Source) -> TableFromFiles[Recordings]:
        return read_recordings(source)

    @override
    def describe(self, table: Recordings, description: Description) -> list[str]:
        return recordings_text(table)

    @override
    def describe_single_file(self, table: Recordings) -> str:
        """Return how long it is."""
        length = sum(float(np.ptp(r.blocks.time)) for r in table.each if len(r.blocks.time))
        return f"a recording of {length:.3g} s"

    @override
    def count_readings(self, table: Recordings) -> str:
        """Return how many samples of how many recordings there are, in how many runs."""
        blocks = sum(int(r.strokes.used_sliding.sum()) for r in table.each)
        samples, runs = sum(r.account.samples for r in table.each), len(table.runs)
        of = f"{counted(len(table.each), 'recording')} in {counted(runs, 'run')}"
        return f"{counted(samples, 'sample')} of {of} ({counted(blocks, 'sliding block')})"

    @override
    def conditions(self, table: Recordings) -> RowConditions:
        return recorded_angles(table)

    @override
    def forces(self, table: Recordings) -> Vector:
        """Return the forces at both ends; those of a loop under load, because its force passes through zero [N]."""
        read = [force for r in table.each for force in (r.blocks.input_force, r.blocks.output_force)]
        return np.concatenate([f[f > _UNDER_LOAD * f.max()] for f in read] if table.loop else read)

    @override
    def speeds(self, table: Recordings) -> Vector:
        return np.concatenate([np.abs(r.blocks.velocity[r.strokes.used_sliding]) for r in table.each])

    @override
    def typical_speeds(self, table: Recordings) -> list[float]:
        """Return the median speed of each recording."""
        used = [np.abs(r.blocks.velocity[r.strokes.used_sliding]) for r in table.each]
        return [float(np.nanmedian(speeds)) for speeds in used if np.isfinite(speeds).any()]

    @override
    def velocity_unit(self, table: Recordings) -> str:
        return table.velocity_unit

    @override
    def contradiction(self, settings: RecordingsTable | None, description: Description) -> str:
        """Return that there are recordings without a table, a table without any, or a preparation that cannot be."""
        if settings is None and description.recording:
            return "[[recording]] needs recordings = {} under [tables], where what they share can be said"
        if settings is not None and not (description.recording or settings.files):
            return 'the table recordings names no file: write files = "recordings/*.csv", or a [[recording]] with its file'
        pages = [settings.prepare] if settings is not None else []
        pages += [entry.prepare for entry in description.recording if entry.prepare is not None]
        return next((why for page in pages if (why := _why_impossible(page))), "")

    @override
    def quantities(self, settings: RecordingsTable, description: Description) -> list[Stated]:
        """Return the quantities in the table of recordings and in each [[recording]]."""
        pages = [("tables, recordings, prepare", settings.prepare)]
        quantities: list[Stated] = []
        for entry in description.recording:
            where = f"recording {entry.file!r}"
            quantities += [(f"{where}, wrap_angles, {name}", angle, "angle") for name, angle in entry.wrap_angles.items()]
            if entry.velocity is not None:
                quantities.append((f"{where}, velocity", entry.velocity, speed_dimension(entry.velocity.unit)))
            if entry.prepare is not None:
                pages.append((f"{where}, prepare", entry.prepare))
        for where, page in pages:
            for name, value in (("delay", page.delay), ("block", page.block)):
                if isinstance(value, QuantityValue):
                    quantities.append((f"{where}, {name}", value, "time"))
            if page.limits is not None:
                lowest = QuantityValue(value=page.limits.low, unit=page.limits.unit)
                quantities.append((f"{where}, limits", lowest, "force"))
        return quantities

    @override
    def check(self, table: Recordings, description: Description, measurements: Measurements) -> None:
        """Refuse a recording outside the range of the curves whose wrap angles were measured nowhere.

        Raises:
            DatasetError: Says which.
        """
        route, angles = description.route, measurements.table(AngleTable)
        if route is None or angles is None:
            return
        curved = [table.columns.index(c.wrap_angle.column) for c in description.curved if c.wrap_angle.column]
        for recording in table.each:
            outside = not route.range[0] <= recording.route <= route.range[1]
            if outside and not np.isfinite(recording.own_angle[curved]).all() and recording.route not in angles.route:
                raise DatasetError(
                    f"the recording {recording.name!r} was made at {recording.route:g} {route.unit}, outside the range "
                    f"{route.range[0]:g} to {route.range[1]:g} {route.unit} where the angle curves hold, and the angle table "
                    "has no row there; measure the wrap angles there, and add them to the table or as wrap_angles to its "
                    "[[recording]]."
                )

    @override
    def copied_readings(self, table: Recordings) -> list[str]:
        """Look for recordings of noisy cells whose forces are all the same; files may have other names and clocks."""
        first_with: dict[bytes, str] = {}
        copied = []
        for recording in table.each:
            forces = np.concatenate([recording.blocks.input_force, recording.blocks.output_force])
            name = first_with.setdefault(forces.tobytes(), recording.name)
            if name != recording.name and min(recording.account.noise) > NO_NOISE * np.abs(forces).max():
                copied.append(
                    f"the recording {recording.name} holds the same forces as the recording {name}, to the last digit"
                )
        return copied

    @override
    def why_implausible(self, measured: Recordings, simulated: Recordings) -> str:
        """Return that recordings hardly slide, are nothing but noise, or of an efficiency that no bench reads."""
        for one, other in zip(measured.each, simulated.each, strict=True):
            for stroke in (PULL, RETURN):
                before, after = (
                    int(np.sum(r.strokes.used_sliding & (r.strokes.stroke == stroke))) for r in (one, other)
                )
                if after < min(before, _FEWEST_BLOCKS):
                    return "a recording hardly slides"
            if other.strokes.noise > max(FACTOR * one.strokes.noise, SCATTER if not measured.loop else 0.0):
                return "a recording is nothing but noise"
        exponents = np.array([r.strokes.exponent for r in simulated.each])
        return beyond(exponents[np.isfinite(exponents)], "the efficiency of a recording")


def _why_impossible(page: Preparation) -> str:
    """Return why a preparation cannot be; empty if it can."""
    limits, block = page.limits, page.block
    if limits is not None and not limits.low < limits.high:
        return (
            f"prepare, limits: low = {limits.low:g} must be below high = {limits.high:g}; they are the lowest and "
            "the highest force that the load cells can show"
        )
    if isinstance(block, QuantityValue) and block.value <= 0:
        return (
            f"prepare, block: {block.value:g} {block.unit} is no length of a block; write a positive "
            'one, or block = "none" to average nothing'
        )
    return ""
