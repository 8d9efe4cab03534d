"""Read the recordings of a data set: prepare them, identify their strokes, and locate each on the route."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from bowdenfit.description import Description, Preparation, QuantityValue, RecordingFile, TableSettings
from bowdenfit.description.measurements import ExcludedSpan
from bowdenfit.errors import BowdenfitError, DatasetError, DescriptionError, Faults, suggest_name
from bowdenfit.files import read_channels
from bowdenfit.files.cells import AS_DECIMALS
from bowdenfit.files.missing_codes import MissingCodes
from bowdenfit.files.row_account import RowAccount
from bowdenfit.inputs import refuse_special
from bowdenfit.kinds.recordings.locations import locate_by_channels, location_names, parse_file_name
from bowdenfit.kinds.rows import OwnAngles, RowConditions, unify_labels
from bowdenfit.kinds.table_files import Source, TableFromFiles
from bowdenfit.recordings.angle_channels import refuse_other_angle
from bowdenfit.recordings.forces import separate_joined_clocks, to_recording
from bowdenfit.recordings.named_channels import INSTEAD_OF_FORCES, OUTPUT_CLOCK, WANTED, rows_where
from bowdenfit.recordings.preparation import (
    NO_DELAY_OF_LOOPS,
    Inspected,
    average_recording,
    inspect_parts,
    inspect_recording,
)
from bowdenfit.recordings.preparation.delay import COMMON_ERROR, RANGE
from bowdenfit.recordings.preparation.excluded import leave_out_spans
from bowdenfit.recordings.recording import Account, Blocks, RawRecording, Recording, Recordings
from bowdenfit.recordings.strokes import cable_of, find_strokes
from bowdenfit.recordings.two_loggers import ClockShift, align_clocks, check_determined
from bowdenfit.types import Vector
from bowdenfit.units import INTERNAL_UNITS, ChannelSource, ColumnSource, speed_dimension

_MOST_SPANS = 1000  # that are left out; a judgement


class RecordingsTable(TableSettings):
    """Recordings that share their channels' names and their preparation.

    `pattern` reads what a file was recorded at from its name, such as "{at}mm_{velocity:r/min}rpm".
    """

    files: str | tuple[str, ...] | None = None
    sheet: str | None = None
    pattern: str | None = None
    channels: dict[str, ChannelSource] = Field(default_factory=dict)
    likelihood: Literal["runs", "whole"] = "runs"
    prepare: Preparation = Preparation()
    exclude: Annotated[tuple[ExcludedSpan, ...], Field(max_length=_MOST_SPANS)] = ()

    def list_excluded(self) -> list[tuple[tuple[str, str], int, str]]:
        """Return the stretches that are left out, such as "470mm.csv, 3 to 4.5 s (the rope jumped)", and whole recordings."""
        excluded = []
        for part in self.exclude:
            file = part.file or (self.files if isinstance(self.files, str) else "the recording")
            place = f", {part.start:g} to {part.end:g} s" if part.span else ""
            words = ("stretch", "stretches") if part.span else ("recording", "recordings")
            excluded.append((words, 1, f"{file}{place} ({part.reason})"))
        return excluded

    @property
    def fits_offsets(self) -> bool:
        """Whether the load cells are tared by the fit."""
        return self.prepare.tare == "fitted"


def angles_of_recordings(recordings: Recordings) -> RowConditions:
    """Return route values and own wrap angles, one row a recording."""
    shape = (len(recordings.items), len(recordings.columns))
    angle, sd = (np.array([getattr(r, n) for r in recordings.items]).reshape(shape) for n in ("own_angle", "own_sd"))
    return RowConditions(np.array([r.route for r in recordings.items]), OwnAngles(recordings.columns, angle, sd))


def read_recordings(source: Source) -> TableFromFiles[Recordings]:
    """Read all recordings of a description.

    Args:
        source: Where they are; channels named on the command line come before those of the description.

    Raises:
        DatasetError, DescriptionError: The fault, in a sentence.
    """
    description = source.description
    files_of_all = [*(source.folder / entry.file for entry in description.recording), *source.files]
    unused = _find_unused(source, files_of_all)
    entries = _list_entries(source, unused)
    _check_names(entries)
    faults = Faults()
    read = faults.read_all(lambda entry: _read_entry(source, *entry, files_of_all), entries, None)
    faults.refuse()
    files = [file for file in read if file is not None]
    units = {f.velocity_unit: f.raw.file for f in files if f.velocity_unit}
    if len(units) > 1:
        raise DatasetError(
            f"{' and '.join(units.values())} give velocities of different kinds, of the rope and of the motor; give both in "
            "mm/s or both in r/min."
        )
    parts, prepared, delay_sd = _prepare_files(files)
    items = tuple(
        _make_recording(description, part, *averaged)
        for part, averaged in zip(parts, _keep_first_loop_remark(prepared), strict=True)
    )
    unit, loop = next(iter(units), ""), description.cable.kind == "loop"
    recordings = Recordings(description.angle_columns, items, unit, delay_sd, loop)
    _check_locations(recordings, description)
    remarks = [remark for file in files for remark in file.remarks]
    remarks += [remark for r in items for remark in (*r.account.remarks, *r.strokes.remarks)]
    accounts = dict.fromkeys(account for f in files for account in f.accounts)  # a file may hold several recordings
    paths = {entry.file: path for path, entry in entries}
    paths |= {entry.output_file: source.folder / entry.output_file for _, entry in entries if entry.output_file}
    paths |= {source.name_of(path): path for path in unused if path.exists()}
    return TableFromFiles(recordings, paths, tuple(remarks), tuple(accounts))


def _find_unused(source: Source, files: Sequence[Path]) -> list[Path]:
    """Return the files of which the user leaves out all.

    Raises:
        DatasetError: They are all files.
        DescriptionError: See `Source.find_excluded`.
    """
    with source.name_keys():
        unused = [path for path in files if any(part.span is None for part in source.find_excluded(path, files))]
    if unused and len(unused) == len(files):
        raise DatasetError(
            "exclude leaves out every recording; leave one in, or delete the recordings under [tables] in cable.toml.",
            key_path=("tables", "recordings", "exclude"),
        )
    return unused


@dataclass(frozen=True)
class _File:
    """A recording's file as read, with its entry and settings."""

    raw: RawRecording
    entry: RecordingFile
    settings: Preparation
    delay_sd: float
    velocity_unit: str
    accounts: tuple[RowAccount, ...] = ()
    remarks: tuple[str, ...] = ()
    shift: ClockShift | None = None

def _prepare_files(files: Sequence[_File]) -> tuple[list[_File], list[tuple[Blocks, Account]], float]:
    """Prepare every recording, or the parts of a long one, with one delay; return them and the standard error of that [s].

    The two channels run through the same electronics in every recording, so that what each of them says of the delay is
    put together; an error of it shifts the friction of all of them alike, in proportion to how fast the force changes.

    Two loggers are started anew for each recording, which keeps its own delay. The largest standard error then stands for all:
    errors that do not average out are the wider interval.
    """
    pairs = [pair for file in files for pair in _inspect_parts(file)]
    delays = [i.delay for f, i in pairs if not f.shift and i.settings.delay == "estimated" and i.delay.sd > 0]
    values, sds_of_delays = np.array([d.value for d in delays]), np.array([d.sd for d in delays])
    pooled = _pool_delays(values, sds_of_delays) if delays and np.ptp(values) < 2 * RANGE else None
    sds = [pooled[1]] if pooled else [f.delay_sd for f in files if not f.shift]
    prepared = list[tuple[Blocks, Account]]()
    for file, inspection in pairs:
        if file.shift is None:
            prepared.append(average_recording(inspection, pooled if inspection.settings.delay == "estimated" else None))
            continue
        check_determined(file.raw, file.shift, inspection.delay)
        blocks, account = average_recording(inspection)
        sd = file.delay_sd or account.delay_sd
        sds.append(sd if sd > 0 else 0.0)
        prepared.append((blocks, _state_shift(file, account, sd or np.nan)))
    return [file for file, _ in pairs], prepared, max(sds, default=0.0)


def _inspect_parts(file: _File) -> list[tuple[_File, Inspected]]:
    """Return a recording, or parts of a long one, all of one run; those with stated phases or two clocks stay whole."""
    if file.entry.strokes or file.shift:
        return [(file, inspect_recording(file.raw, file.settings))]
    parts = inspect_parts(file.raw, file.settings)
    if len(parts) == 1:
        return [(file, parts[0])]
    entry = file.entry.model_copy(update={"run": file.entry.run or file.raw.name})
    return [(replace(file, raw=part.raw, entry=entry), part) for part in parts]


def _state_shift(file: _File, account: Account, sd: float) -> Account:
    """Return the account of two loggers' recording, with the shift between their clocks."""
    assert file.shift is not None  # the caller asked
    remark = file.shift.describe(file.raw, account.delay, sd)
    return replace(account, remarks=(remark, *account.remarks), clock_shift=file.shift.value - account.delay)


def _keep_first_loop_remark(prepared: Sequence[tuple[Blocks, Account]]) -> list[tuple[Blocks, Account]]:
    """Keep the remark that delays of loops are not estimated in the first account only."""
    is_stated = False
    retained = []
    for blocks, account in prepared:
        remarks = tuple(r for r in account.remarks if r != NO_DELAY_OF_LOOPS or not is_stated)
        is_stated = is_stated or NO_DELAY_OF_LOOPS in account.remarks
        retained.append((blocks, replace(account, remarks=remarks)))
    return retained


def _pool_delays(delays: Vector, sds: Vector) -> tuple[float, float]:
    """Return the weighted mean of estimated delays and its standard error [s].

    What chance did to each estimate averages out, and is at least as large as the estimates differ. What all of them have
    in common, COMMON_ERROR, does not average out.
    """
    weights = sds**-2 / np.sum(sds**-2)
    mean = float(weights @ delays)
    chance = float(weights**2 @ (sds**2 - COMMON_ERROR**2))
    apart = float(weights @ (delays - mean) ** 2) / max(len(delays) - 1, 1)
    return mean, float(np.hypot(np.sqrt(max(chance, apart)), COMMON_ERROR))


def _list_entries(source: Source, unused: Sequence[Path]) -> list[tuple[Path, RecordingFile]]:
    """List every file that is used with its entry; a file named in a [[recording]] is not read twice."""
    description = source.description
    entries = [(source.folder / entry.file, entry) for entry in description.recording]
    joined = [source.folder / entry.output_file for _, entry in entries if entry.output_file]
    stated = [*(path for path, _ in entries), *joined]
    for path in stated:
        refuse_special(path)  # before links are followed, which may lead round in a circle
    named = {path.resolve() for path in stated}
    for path in source.files:
        refuse_special(path)
        if path.resolve() not in named and path not in unused:
            entry = parse_file_name(description, source.settings.pattern, path, source.name_of(path))
            entries.append((path, entry.model_copy(update={"sheet": source.settings.sheet})))
    entries = [(path, entry) for path, entry in entries if path not in unused]
    labels, files = [entry.run or "" for _, entry in entries], [path.name for path, _ in entries]
    runs_of_files = zip(entries, unify_labels(labels, files, "runs of recordings"), strict=True)
    entries = [(path, entry.model_copy(update={"run": run or None})) for (path, entry), run in runs_of_files]
    runs = Counter(entry.run for _, entry in entries if not entry.name)
    return [(path, _name_within_run(path, entry) if runs[entry.run] > 1 else entry) for path, entry in entries]


def _name_within_run(path: Path, entry: RecordingFile) -> RecordingFile:
    """Name one of several recordings of a run that have no names of their own."""
    if entry.name or not entry.run:
        return entry
    return entry.model_copy(update={"name": f"{entry.run}, {path.stem}"})


def _check_names(entries: list[tuple[Path, RecordingFile]]) -> None:
    names = [_recording_name(path, entry) for path, entry in entries]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise DescriptionError(
            f"two recordings are both called {twice!r}; give one of them another name in its [[recording]]."
        )


def _recording_name(path: Path, entry: RecordingFile) -> str:
    return entry.name or entry.run or (f"{path.stem}, {entry.sheet}" if entry.sheet else path.stem)


def _read_entry(source: Source, path: Path, entry: RecordingFile, files_of_all: Sequence[Path]) -> _File:
    """Read a recording; errors name the keys of its [[recording]], or those that all recordings share."""
    try:
        return _read_file(source, path, entry, files_of_all)
    except BowdenfitError as error:
        described = enumerate(source.description.recording)
        numbers = [i for i, part in described if (part.file, part.where) == (entry.file, entry.where)]
        if not path.exists():
            error.key_path = ("file" if numbers else "files",)
        key, *names = error.key_path or ("",)
        is_own = numbers and key != "exclude" and (key != "channels" or names[0] in entry.channels)
        error.put_below(*(("recording", numbers[0]) if is_own else ("tables", "recordings")))
        raise


def _read_file(source: Source, path: Path, entry: RecordingFile, files_of_all: Sequence[Path]) -> _File:
    description = source.description
    table = description.table(RecordingsTable)
    assert table is not None  # the caller asked
    page = entry.prepare or table.prepare
    sources = (
        _check_channel_names(table.channels, description)
        | _check_channel_names(entry.channels, description)
        | dict(source.channels)
    )
    paths = [path, *([source.folder / entry.output_file] if entry.output_file else [])]
    titles = [entry.sheet or "", ""]
    blanked = [MissingCodes(table.missing).blank_samples(read_channels(*pair)) for pair in zip(paths, titles, strict=False)]
    files, remarks = [file for file, _ in blanked], tuple(remark for _, words in blanked for remark in words)
    remarks += tuple(remark for file in files for remark in file.remarks if AS_DECIMALS in remark)
    rows, *output_rows = (rows_where(file, entry.where) for file in files)
    raw, unit = to_recording(
        rows,
        _recording_name(path, entry),
        sources,
        description.pulleys,
        is_loop=description.cable.kind == "loop",
        output_file=output_rows[0] if output_rows else None,
    )
    raw, joined = separate_joined_clocks(raw)
    remarks += joined
    sensors = description.sensors
    if (sensors.input_ratio, sensors.output_ratio) != (1.0, 1.0):
        forces = raw.input_force * sensors.input_ratio, raw.output_force * sensors.output_ratio
        raw = replace(raw, input_force=forces[0], output_force=forces[1])
    entry = locate_by_channels(description, rows, entry, sources)
    refuse_other_angle(rows, sources, raw.input_force, _only_stated_angle(description, entry))
    shift = None
    if output_rows:
        raw, shift, page = align_clocks(raw, entry.clock_shift, page)
    raw = leave_out_spans(raw, [part.span for part in source.find_excluded(path, files_of_all)])
    stated = [value for value in (entry.clock_shift, page.delay) if isinstance(value, QuantityValue)]
    stated_sd = max((value.sd_to("time") or 0.0 for value in stated), default=0.0)
    if entry.velocity is not None and not unit:
        unit = INTERNAL_UNITS[speed_dimension(entry.velocity.unit)]
    accounts = tuple(file.account for file in files if file.account is not None)
    return _File(raw, entry, page, stated_sd, unit, accounts, remarks, shift)


def _only_stated_angle(description: Description, entry: RecordingFile) -> float | None:
    """Return the wrap angle stated for a recording of a cable with one contact [rad]; None of any other."""
    source = description.contact[0].wrap_angle
    stated = source.constant or entry.wrap_angles.get(source.column or "")
    return None if len(description.contact) > 1 or stated is None else stated.to("angle")


def _make_recording(description: Description, file: _File, blocks: Blocks, account: Account) -> Recording:
    raw, entry = file.raw, file.entry
    cable = replace(cable_of(description), channels=raw.channels)
    strokes = find_strokes(blocks, raw.file, raw.name, entry.strokes, cable)
    if entry.velocity is not None and not len(raw.velocity):
        speed = entry.velocity.to(speed_dimension(entry.velocity.unit))
        blocks = replace(blocks, velocity=np.full(len(blocks.time), speed))
    angle, sd = _stated_angles(description, entry)
    route = float("nan") if entry.at is None else entry.at
    return Recording(raw.name, raw.file, entry.run or raw.name, route, angle, sd, blocks, strokes, account)


def _check_channel_names(channels: Mapping[str, ColumnSource], description: Description) -> dict[str, ColumnSource]:
    """Return the channels of the description; refuse those of quantities that a recording does not have."""
    known = [*(quantity.name for quantity in (*WANTED, *INSTEAD_OF_FORCES)), OUTPUT_CLOCK, *location_names(description)]
    for name in channels:
        if name not in known:
            raise DescriptionError(
                f"cable.toml, channels of recordings: no quantity is called {name!r}{suggest_name(name, known)}",
                key_path=("channels", name),
            )
    return dict(channels)


def _stated_angles(description: Description, entry: RecordingFile) -> tuple[np.ndarray, np.ndarray]:
    """Return wrap angles stated for a recording, and their standard deviations [rad]."""
    columns = description.angle_columns
    for name in entry.wrap_angles:
        if name not in columns:
            in_contact = f"; give its contact wrap_angle = {{ column = {name!r} }} in the place of a constant angle."
            remedy = suggest_name(name, columns) if columns else in_contact
            raise DescriptionError(
                f"cable.toml, recording {entry.file!r}, wrap_angles: {name!r} is not a column of a contact's wrap angle"
                f"{remedy}"
            )
    stated = [entry.wrap_angles.get(name) for name in columns]
    angles = [float("nan") if q is None else q.to("angle") for q in stated]
    sds = [float("nan") if q is None or q.sd is None else q.sd_to("angle") for q in stated]
    return np.array(angles, dtype=float), np.array(sds, dtype=float)


def _check_locations(recordings: Recordings, description: Description) -> None:
    """Refuse a recording that cannot be given a wrap angle in every contact."""
    route = description.route
    for recording in recordings.items:
        for contact in description.contact:
            column = contact.wrap_angle.column
            if column is None or np.isfinite(recording.own_angle[recordings.columns.index(column)]):
                continue
            if not contact.wrap_angle.curve:
                raise DatasetError(
                    f"the recording {recording.name!r} has no wrap angle for the contact {contact.name!r}; add it to its "
                    f'[[recording]]: wrap_angles = {{ {column} = {{ value = 90, unit = "deg" }} }}.'
                )
            if np.isnan(recording.route):
                at = f"at = 470   # {route.variable}, in {route.unit}" if route else "at = 470"
                raise DatasetError(
                    f"the recording {recording.name!r} does not say at which {route.variable if route else 'length'} it was "
                    f'made; add that to its [[recording]] ({at}), or read it from the file names: pattern = "{{at}}mm*".'
                )
