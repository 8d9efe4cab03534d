"""Force recordings, sampled while a motor pulls, stops, reverses and returns: how they are checked and described."""

from dataclasses import replace
from typing import Any

import numpy as np
from typing_extensions import override

from bowdenfit.description import Description, Preparation, QuantityValue
from bowdenfit.description.file import Stated
from bowdenfit.errors import DatasetError
from bowdenfit.files.headings import Quantity
from bowdenfit.kinds.bench_error import BenchError, BenchLoads, order_of
from bowdenfit.kinds.kind import FrictionKind, Readings, efficiency_readings
from bowdenfit.kinds.motor_readings import check_gear
from bowdenfit.kinds.plausibility import FACTOR, NO_NOISE, SCATTER, explain_impossible_loss
from bowdenfit.kinds.recordings.reader import RecordingsTable, angles_of_recordings, read_recordings
from bowdenfit.kinds.rows import RowConditions
from bowdenfit.kinds.table_files import InitQuestions, Source, TableFromFiles, WantedColumn
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.recordings.bench_faults import BenchFault, describe_bench_fault, find_bench_fault
from bowdenfit.recordings.preparation.hysteresis import last_contact
from bowdenfit.recordings.recording import PULL, RETURN, SWITCH, Recording, Recordings
from bowdenfit.recordings.rope_strokes import describe_off_center
from bowdenfit.types import Vector
from bowdenfit.units import speed_dimension
from bowdenfit.words import counted, filled, listed, narrow_table

_PHASES = (("pulling", PULL), ("returning", RETURN), ("switching", SWITCH))
_SAMPLES = ("recording", "samples", "used", "left out", "block")
_HEADS = (*_SAMPLES, "pulling", "switching", "returning", "sliding", "exponent")
_LOOP_HEADS = (*_SAMPLES, "forward", "between", "back", "moving", "loss", "exponent")
_NOTE = (
    "Samples are averaged over blocks; pulling, switching and returning count blocks of each phase, sliding those that "
    "lie safely inside a pulling or returning phase. The exponent is that of the recording by itself: half the width of "
    "its hysteresis loop, as a log ratio."
)
_LOOP_NOTE = (
    "Samples are averaged over blocks; forward, between and back count blocks in which the loop moves forward, stands while "
    "the input force crosses the friction band, and moves back, moving those that lie safely inside a motion. The loss is "
    "the force that is lost while both sides are taut, 2 x preload x exponent, and the exponent is that of one side, both by "
    "the recording itself; a dash where it does not determine them."
)


_FEWEST_BLOCKS = 10  # blocks of each stroke of a plausible recording; a judgement
_UNDER_LOAD = 0.2  # share of a loop's largest force above which it counts as loaded; a judgement


def list_preparations(recordings: Recordings) -> list[dict[str, Any]]:
    """Return a dictionary for each recording: its samples, its preparation and its phases, in s, N and Hz."""
    return [_preparation(recording) for recording in recordings.items]


def _preparation(recording: Recording) -> dict[str, Any]:
    account, strokes = recording.account, recording.strokes
    phases = {word: int(np.sum(strokes.stroke == sign)) for word, sign in _PHASES}
    return {
        "name": recording.name,
        "file": recording.file,
        "run": recording.run,
        "at": recording.route,
        "samples": account.samples,
        "counts": dict(account.counts),
        "rate": account.rate,
        "bandwidth": account.bandwidth,
        "block": account.block,
        "tare": list(account.tare),
        "delay": account.delay,
        "delay_sd": account.delay_sd,
        **({} if account.clock_shift is None else {"clock_shift": account.clock_shift}),
        "noise": list(account.noise),
        "blocks": phases | {"sliding": int(strokes.used_sliding.sum())},
        "phases_by_hand": strokes.by_hand,
        "correlation_time": strokes.correlation * max(account.block, 1 / account.rate),
        "exponent": strokes.exponent,
        "center": strokes.center,
    }


def describe_preparations(recordings: Recordings) -> list[str]:
    """Describe the preparation of the recordings, line by line."""
    pages = list_preparations(recordings)
    losses = [(_format_or_dash(r.strokes.drag, ".3g", " N"),) if recordings.loop else () for r in recordings.items]
    rows = [_format_row(page, loss) for page, loss in zip(pages, losses, strict=True)]
    lines = narrow_table(_LOOP_HEADS if recordings.loop else _HEADS, rows, left=("left out",)).splitlines()
    notes = [
        _LOOP_NOTE if recordings.loop else _NOTE,
        *_describe_delay(pages),
        *_describe_tare(pages),
        *_describe_manual_phases(pages),
    ]
    return [*lines, *(line for note in notes for line in filled(note).splitlines())]


def _format_row(page: dict[str, Any], loss: tuple[str, ...]) -> tuple[str, ...]:
    counts, blocks = page["counts"], page["blocks"]
    left_out = [f"{n} {kind}" for kind, n in counts.items() if kind != "used" and n]
    block = f"{1000 * page['block']:.4g} ms" if page["block"] > 0 else "none"
    return (
        page["name"],
        str(page["samples"]),
        str(counts["used"]),
        ", ".join(left_out) or "none",
        block,
        *(str(blocks[name]) for name in ("pulling", "switching", "returning", "sliding")),
        *loss,
        _format_or_dash(page["exponent"], ".3f"),
    )


def _format_or_dash(value: float, digits: str, unit: str = "") -> str:
    """Format a number; a dash where it is not known."""
    return f"{value:{digits}}{unit}" if np.isfinite(value) else "-"


def _describe_delay(pages: list[dict[str, Any]]) -> list[str]:
    """Describe the delay, once where all recordings share it."""
    texts = {}
    for page in pages:
        if "clock_shift" in page:  # a remark says it, with the shift between the loggers
            continue
        delay, sd = 1000 * page["delay"], 1000 * (page["delay_sd"] if page["delay_sd"] is not None else np.nan)
        if np.isfinite(sd):
            texts[f"{delay:.1f} ms ± {sd:.1f} ms (from the reversals of all recordings)"] = page["name"]
        elif delay:
            texts[f"{delay:.1f} ms (as stated)"] = page["name"]
    return [f"The output channel was shifted back by a delay of {text}." for text in texts]


def _describe_tare(pages: list[dict[str, Any]]) -> list[str]:
    tared = [p for p in pages if any(p["tare"])]
    if not tared:
        return []
    parts = [f"{p['name']} {p['tare'][0]:+.2f} and {p['tare'][1]:+.2f} N" for p in tared]
    return [f"Tare taken off the input and output force: {listed(parts)}."]


def _describe_manual_phases(pages: list[dict[str, Any]]) -> list[str]:
    names = [p["name"] for p in pages if p["phases_by_hand"]]
    return [f"Phases set by hand in cable.toml: {listed(names)}."] if names else []


class RecordingKind(FrictionKind[Recordings]):
    """Two load cells, sampled: the tables are `Recordings`."""

    name = "recordings"
    table = Recordings
    settings = RecordingsTable
    readings = (
        efficiency_readings("recorded_efficiency", "recordings", "recordings", "recording {}", are_runs=True),
        Readings("recorded_loss", "recordings", "recordings", "recording {}", "Force lost (N)"),
    )
    heading = "Recordings"
    methods_sentence = (
        "Recordings were averaged over blocks, phases of sliding were identified by a play operator, and all readings of one "
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
        return describe_preparations(table)

    @override
    def describe_single_file(self, table: Recordings) -> str:
        """Return the length of the recording in words."""
        length = sum(float(np.ptp(r.blocks.time)) for r in table.items if len(r.blocks.time))
        return f"a recording of {length:.3g} s"

    @override
    def count_readings(self, table: Recordings) -> str:
        """Return how many samples of how many recordings there are, in how many runs."""
        blocks = sum(int(r.strokes.used_sliding.sum()) for r in table.items)
        samples, runs = sum(r.account.samples for r in table.items), len(table.runs)
        of = f"{counted(len(table.items), 'recording')} in {counted(runs, 'run')}"
        return f"{counted(samples, 'sample')} of {of} ({counted(blocks, 'sliding block')})"

    @override
    def conditions(self, table: Recordings) -> RowConditions:
        return angles_of_recordings(table)

    @override
    def forces(self, table: Recordings) -> Vector:
        """Return the forces at both ends; those of a loop under load, because its force passes through zero [N]."""
        read = [force for r in table.items for force in (r.blocks.input_force, r.blocks.output_force)]
        return np.concatenate([f[f > _UNDER_LOAD * f.max()] for f in read] if table.loop else read)

    @override
    def speeds(self, table: Recordings) -> Vector:
        return np.concatenate([np.abs(r.blocks.velocity[r.strokes.used_sliding]) for r in table.items])

    @override
    def typical_speeds(self, table: Recordings) -> list[float]:
        """Return the median speed of each recording."""
        used = [np.abs(r.blocks.velocity[r.strokes.used_sliding]) for r in table.items]
        return [float(np.nanmedian(speeds)) for speeds in used if np.isfinite(speeds).any()]

    @override
    def velocity_unit(self, table: Recordings) -> str:
        return table.velocity_unit

    @override
    def contradiction(self, settings: RecordingsTable | None, description: Description) -> str:
        """Return that there is a table without any recordings, or a preparation that cannot be."""
        if settings is not None and not (description.recording or settings.files):
            return (
                'the table recordings names no file: write files = "recordings/*.csv", or a [[recording]] with its file'
            )
        if settings is not None and settings.likelihood == "whole" and description.motor is not None:
            return (
                'likelihood = "whole" follows the force at the input through every turn, in which the gear of a [motor] has '
                'friction of its own; write likelihood = "runs"'
            )
        pages = [settings.prepare] if settings is not None else []
        pages += [entry.prepare for entry in description.recording if entry.prepare is not None]
        return next((reason for page in pages if (reason := _why_impossible(page))), "")

    @override
    def quantities(self, settings: RecordingsTable, description: Description) -> list[Stated]:
        """Return the quantities in the table of recordings and in each [[recording]]."""
        pages = [("tables, recordings, prepare", settings.prepare)]
        quantities: list[Stated] = []
        for entry in description.recording:
            place = f"recording {entry.file!r}"
            quantities += [
                (f"{place}, wrap_angles, {name}", angle, "angle") for name, angle in entry.wrap_angles.items()
            ]
            if entry.velocity is not None:
                quantities.append((f"{place}, velocity", entry.velocity, speed_dimension(entry.velocity.unit)))
            if isinstance(entry.clock_shift, QuantityValue):
                quantities.append((f"{place}, clock_shift", entry.clock_shift, "time"))
            if entry.prepare is not None:
                pages.append((f"{place}, prepare", entry.prepare))
        for place, page in pages:
            for name, value in (("delay", page.delay), ("block", page.block)):
                if isinstance(value, QuantityValue):
                    quantities.append((f"{place}, {name}", value, "time"))
            if page.limits is not None:
                lowest = QuantityValue(value=page.limits.low, unit=page.limits.unit)
                quantities.append((f"{place}, limits", lowest, "force"))
        return quantities

    @override
    def check(self, table: Recordings, description: Description, measurements: Measurements) -> None:
        """Refuse a recording outside the range of the curves whose wrap angles were measured nowhere, and a hidden gear.

        Raises:
            DatasetError: Says which.
        """
        route, angles = description.route, measurements.table(AngleTable)
        sliding = [(r.strokes.stroke, r.blocks.input_force, r.strokes.used_sliding) for r in table.items]
        strokes, loads = (np.concatenate([part[i][part[2]] for part in sliding]) for i in (0, 1))
        check_gear(description, angles_of_recordings(table), strokes, loads, listed([r.file for r in table.items]))
        if route is None or angles is None:
            return
        curved = [table.columns.index(c.wrap_angle.column) for c in description.curved if c.wrap_angle.column]
        for recording in table.items:
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
        """Look for recordings of noisy cells with the same forces; their files may have other names and clocks."""
        first_with: dict[bytes, str] = {}
        copied = []
        for recording in table.items:
            forces = np.concatenate([recording.blocks.input_force, recording.blocks.output_force])
            name = first_with.setdefault(forces.tobytes(), recording.name)
            if name != recording.name and min(recording.account.noise) > NO_NOISE * np.abs(forces).max():
                copied.append(
                    f"the recording {recording.name} holds the same forces as the recording {name}, to the last digit"
                )
        return copied

    @override
    def bench_faults(self, table: Recordings, description: Description) -> list[str]:
        """Return a sentence on each kind of fault, of the recording that shows it most clearly.

        A loop that is off center by more than cells disagree is one, unless errors of the gains or offsets are fitted. Behind
        a gear, whose friction is its own, the input does not tell its faults by itself.
        """
        if table.loop or description.motor is not None:
            return []
        options = {option.strip() for option in description.friction_model.split("+")}
        expects_drag = description.fits_offsets or bool(options & {"drag", "load-dependent"})
        expects_creep = bool(options & {"dahl", "lugre"})
        clearest: dict[str, tuple[BenchFault, str]] = {}
        for recording in table.items:
            fault = find_bench_fault(recording, expects_drag=expects_drag, expects_creep=expects_creep)
            if fault and (fault.kind not in clearest or fault.significance > clearest[fault.kind][0].significance):
                clearest[fault.kind] = fault, recording.file
        sentences = [describe_bench_fault(*clear) for clear in clearest.values()]
        if description.fits_offsets or description.gain_sd:
            return sentences
        farthest = max(table.items, key=lambda recording: abs(recording.strokes.center))
        off_center = describe_off_center(farthest.name, farthest.strokes.center)
        return [*sentences, off_center] if off_center else sentences

    @override
    def with_bench_error(self, table: Recordings, error: BenchError) -> Recordings:
        """Return the recordings with the error in their forces and wrap angles; their strokes stay."""
        ends = ("input_force", "output_force")
        loads = BenchLoads.of(*(np.concatenate([getattr(r.blocks, end) for r in table.items]) for end in ends))
        items, order = [], order_of(np.array([table.runs.index(recording.run) for recording in table.items]), len(table.runs))
        for recording, late in zip(table.items, order, strict=True):
            blocks, strokes = recording.blocks, recording.strokes
            forces = blocks.input_force, blocks.output_force
            if table.loop:
                input_force, output_force = error.apply_to_loop(forces, strokes.contact, strokes.contact, loads)
            else:
                log_ratio = strokes.center + last_contact(strokes.contact) * strokes.exponent
                rope = error.where_angles_grow(recording.own_sd)
                input_force, output_force = rope.apply_to_rope(forces, log_ratio, strokes.contact, late, loads)
            angle = np.where(np.isnan(recording.own_sd), error.apply_to_angles(recording.own_angle), recording.own_angle)
            read = replace(blocks, input_force=input_force, output_force=output_force, finer=None)
            items.append(replace(recording, own_angle=angle, blocks=read))
        return replace(table, items=tuple(items))

    @override
    def why_implausible(self, measured: Recordings, simulated: Recordings) -> str:
        """Return that recordings hardly slide, are nothing but noise, or have an efficiency that no bench reads."""
        for one, other in zip(measured.items, simulated.items, strict=True):
            for stroke in (PULL, RETURN):
                before, after = (
                    int(np.sum(r.strokes.used_sliding & (r.strokes.stroke == stroke))) for r in (one, other)
                )
                if after < min(before, _FEWEST_BLOCKS):
                    return "a recording barely slides"
            if other.strokes.noise > max(FACTOR * one.strokes.noise, SCATTER if not measured.loop else 0.0):
                return "a recording is nothing but noise"
        exponents = np.array([r.strokes.exponent for r in simulated.items])
        return explain_impossible_loss(exponents[np.isfinite(exponents)], "the efficiency of a recording")


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
            f"prepare, block: {block.value:g} {block.unit} is not a possible length of a block; write a positive "
            'one, or block = "none" to average nothing'
        )
    return ""
