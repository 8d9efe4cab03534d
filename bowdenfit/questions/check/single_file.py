"""What `bowdenfit check FILE` says of a file alone: what it is, its columns or channels, and the command that fits it."""

import re
import shlex
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import cast

import numpy as np

from bowdenfit.dataset import Dataset, is_lone_file, single_file_dataset
from bowdenfit.errors import BowdenfitError, DatasetError
from bowdenfit.files import read_channels
from bowdenfit.files.apart import limits_times
from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.files.clocks import is_clock
from bowdenfit.files.headings import Quantity, find_candidates, heading_of, parse_sources
from bowdenfit.files.missing_codes import MissingCodes
from bowdenfit.files.tables import RawTable, read_table
from bowdenfit.kinds import KINDS, iterate_tables
from bowdenfit.kinds.file_kind import FileKind, columns_of_kind, guess_file_kind, is_angle_table
from bowdenfit.kinds.fit_command import (
    FitCommand,
    HeadedColumn,
    has_own_angles,
    list_number_columns,
    make_both_commands,
    make_recording_command,
    make_table_command,
)
from bowdenfit.kinds.recordings.kind import describe_preparations
from bowdenfit.questions.check.data_set_words import (
    check_data_set,
    describe_first_and_last_rows,
    describe_row_account,
    describe_unusable_readings,
)
from bowdenfit.reading import Reading
from bowdenfit.recordings.angle_channels import AngleChannel, find_angle_channels
from bowdenfit.recordings.forces import clock_in_doubt
from bowdenfit.recordings.named_channels import WANTED, find_channel, parse_channels
from bowdenfit.recordings.preparation.checks import explain_backward_clock
from bowdenfit.recordings.recording import Recordings
from bowdenfit.words import WIDTH, counted, filled, listed, narrow_table, shown

_CHOICES = ("noise", "friction", "geometry", "undetected")  # options that the command repeats
ANY_ANGLE = (180.0, "deg")  # any will do to look at a file; the command proposes the same
_LEFT = ("column", "unit", "read as")  # columns aligned to the left
_MAX_NAMED = 8  # channels whose first and last sample are named
_LONG = 50  # rows from which a table beside a clock is meant as a recording; with fewer its clock may say when each was read
_MAX_LISTED = 100  # channels that are listed
_MAX_LENGTH = 60  # characters of a name or unit
_CHANNEL_HEADS = ("channel", "unit", "samples", "rate", "length", "lowest", "highest", "clock")


def is_single_file(path: Path) -> bool:
    """Return whether a path is a file that no description names."""
    return (path.is_file() and path.suffix.lower() != ".toml") or is_lone_file(path)


def describe_single_file(path: Path, reading: Reading) -> tuple[str, bool]:
    """Describe a file alone and the command that fits it; and return whether it can be fitted as it stands.

    Args:
        path: The file.
        reading: Keywords of `bowdenfit.read`; which column of a table or channel of a recording is what among them.

    Raises:
        BowdenfitError: The file cannot be read, or not with these keywords.
    """
    with limits_times(reading.get("reading_limit") or 1):
        return _describe_file(path, reading)


def _describe_file(path: Path, reading: Reading) -> tuple[str, bool]:
    """Describe a file that is read within the usual limits."""
    channels, named = reading.get("channels", ()), parse_sources(reading.get("columns", ()), "--column")
    file = guess_file_kind(path, bool(channels), tuple(named))
    if KINDS[file.kind].takes_channels and not file.other:
        return _describe_recording(path, file, channels, reading.get("missing", ()))
    raw = MissingCodes(tuple(reading.get("missing", ()))).mark(read_table(path))
    headings = {source.name: quantity.rpartition(".")[2] for quantity, source in named.items()}
    if file.other:
        backwards = _backward_clock(path)
        text = describe_table_file(raw, file, make_both_commands(path, raw, file), None, backwards, headings, not backwards)
        return text, False  # `fit` asks which of the two it is
    if is_angle_table(raw) and not named:
        return _describe_angle_table(raw), True
    command = make_table_command(path, raw, file.kind, named)
    has_angles = has_own_angles(path, file.kind, tuple(named), stated=False)
    strict = any(reading.values()) and not command.names_more
    angle = None if has_angles or "wrap_angle=" in command.text else ANY_ANGLE
    data, obstacle = _try_as_data_set(path, cast(Reading, {**reading, "wrap_angle": angle}), strict)
    remaining = obstacle
    if obstacle and command.names_more:
        words = shlex.split(command.text)
        columns = tuple(word for option, word in pairwise(words) if option == "--column")
        _, remaining = _try_as_data_set(
            path, cast(Reading, {**reading, "wrap_angle": angle, "columns": columns}), False
        )
        obstacle += f"\n{remaining}" if remaining not in obstacle else ""
    if obstacle and (backwards := _backward_clock(path)):
        obstacle, remaining = f"{obstacle}\n{backwards}", backwards
    return describe_table_file(
        raw, file, [_with_settings(command, reading)], data, obstacle, headings, not remaining
    ), not obstacle


def _describe_angle_table(raw: RawTable) -> str:
    """Describe a table of wrap angles by length, and where it belongs."""
    place = (
        "It is fitted together with readings of forces or efficiencies, or recordings, at some of these lengths: name it in "
        f'cable.toml, [tables] angles = {{ file = "{raw.file}" }}; bowdenfit init writes that file.'
    )
    lines = [f"{raw.file}: a table of wrap angles at {counted(len(raw.rows), 'length')}.", "", _column_table(raw, (), {})]
    return "\n".join([*lines, "", *describe_row_account(raw.lines), "", filled(place)]) + "\n"


def _try_as_data_set(path: Path, reading: Reading, strict: bool) -> tuple[Dataset | None, str]:
    """Return the data set that a table makes at any wrap angle, or why it makes none as it stands.

    Raises:
        BowdenfitError: It makes none, and the user has asked for something that the command would not mend.
    """
    try:
        return check_data_set(path, reading), ""
    except BowdenfitError as error:
        if strict:
            raise
        return None, str(error)


def _with_settings(command: FitCommand, reading: Reading) -> FitCommand:
    """Return the command with what the user has set besides columns."""
    stated = [f"--set {shlex.quote(setting)}" for setting in reading.get("settings", ())]
    stated += [f"--{name} {value}" for name in _CHOICES if (value := reading.get(name))]
    return with_missing(replace(command, text=" ".join([command.text, *stated])), reading.get("missing", ()))


def with_missing(command: FitCommand, codes: Sequence[str]) -> FitCommand:
    """Return the command with the missing-value codes."""
    return replace(command, text=" ".join([command.text, *(f"--missing {shlex.quote(code)}" for code in codes)]))


def _describe_recording(path: Path, kind: FileKind, channels: Sequence[str], missing: Sequence[str]) -> tuple[str, bool]:
    """Describe a recording alone; and return whether it can be fitted as it stands."""
    file, notes = MissingCodes(tuple(missing)).blank_samples(read_channels(path))
    file = replace(file, remarks=(*file.remarks, *notes))
    angle = _measured_angle(file, channels)
    recordings, obstacle = _read_recording(file, channels, angle, missing)
    backwards = describe_backward_clock(file) if obstacle and "backwards" not in obstacle else ""
    obstacle = "\n".join(filter(None, [obstacle, backwards]))
    command = with_missing(_recording_command(path, file, channels, angle), missing)
    usable = not obstacle or (not channels and "--channel" in command.text and not backwards)
    return describe_recording_file(file, kind.why, command, recordings, obstacle, usable), not obstacle


def describe_backward_clock(file: ChannelFile) -> str:
    """Return the sentence that a clock of a file runs backwards; empty where none does."""
    for channel in file.channels:
        time = channel.values if is_clock(channel) else channel.time
        if time is not None and (backwards := explain_backward_clock(channel.name, time)):
            return f"{file.path.name}: {backwards}"
    return ""


def _backward_clock(path: Path) -> str:
    """Return that the clock of a table that may be a recording runs backwards; empty where it does not, or has few rows."""
    try:
        file = read_channels(path)
    except DatasetError:
        return ""
    long = any(len(channel.values) > _LONG for channel in file.channels)
    return describe_backward_clock(file) if long else ""


def _measured_angle(file: ChannelFile, channels: Sequence[str]) -> AngleChannel | None:
    """Return the channel that says at which wrap angle a recording was made, with the force at the input looked for by name."""
    sources = parse_channels(channels)
    with suppress(DatasetError):
        force = find_channel(file, WANTED[0], sources)
        return next(iter(find_angle_channels(file, sources, np.zeros(0) if force is None else force.values)), None)
    return None


def _recording_command(path: Path, file: ChannelFile, channels: Sequence[str], angle: AngleChannel | None) -> FitCommand:
    """Return the command that fits a recording."""
    signals = [channel for channel in file.channels if not is_clock(channel) and not (angle and channel.name == angle.name)]
    headed = [
        HeadedColumn(signal.name, signal.unit, float(signal.values[signal.values == signal.values].mean()))
        for signal in signals
    ]
    has_clock = any(signal.time is not None for signal in signals)
    in_doubt = [clock.name for signal in signals if (clock := clock_in_doubt(file, signal)) is not None]
    stated = (angle.option, f"the channel {shown(angle.name)}") if angle else None
    return make_recording_command(
        path, headed, has_clock, parse_channels(channels), doubtful_clock="".join(in_doubt[:1]), angle=stated
    )


def _read_recording(
    file: ChannelFile, channels: Sequence[str] = (), angle: AngleChannel | None = None, missing: Sequence[str] = ()
) -> tuple[Recordings | None, str]:
    """Read the recording that the channels of a file make, prepared and cut into strokes.

    Args:
        file: The channels.
        channels: Which channel is what, such as "input_force=ai0:lbf".
        angle: The channel that says at which wrap angle it was made.
        missing: Missing-value codes.

    Returns:
        The recording, None where they make none; and why not, in a sentence.
    """
    stated = ANY_ANGLE if angle is None else (angle.angle, "rad")
    try:
        data = single_file_dataset(file.path, stated, (), parse_channels(channels), kind="recordings", missing=missing)
    except DatasetError as error:
        return None, str(error)
    return data.measurements.table(Recordings), ""


def describe_table_file(
    raw: RawTable,
    file: FileKind,
    commands: Sequence[FitCommand],
    data: Dataset | None,
    obstacle: str,
    named: Mapping[str, str],
    usable: bool = True,
) -> str:
    """Describe a table and how to fit it.

    Args:
        raw: The file as read.
        file: Its detected kind.
        commands: Commands that fit it; two where it could be either of two kinds.
        data: The data set that it makes; None if it makes none yet.
        obstacle: Reason why it cannot be fitted, in a sentence.
        named: Quantities whose columns the user has named, by heading.
        usable: Whether the command can fit it as it stands.
    """
    title = f"{raw.file}: {_kind_in_words(raw, data)}, because {file.why}."
    if file.other:
        title = f"{raw.file}: a table of readings or a recording; {file.why}."
    lines = [filled(title), "", _column_table(raw, columns_of_kind(file.kind), named)]
    if data is not None:
        lines += ["", *describe_first_and_last_rows(data)]
    account = data.accounts[0] if data is not None else raw.lines
    lines += ["", *describe_row_account(account)]
    if data is not None:
        lines += [filled(f"Note: {remark}") for remark in data.measurements.remarks if remark not in account.remarks]
        lines += [filled(f"Warning: {sentence}") for sentence in describe_unusable_readings(data)]
    if obstacle:
        lines += ["", *map(filled, f"As it stands it cannot be fitted: {obstacle}".splitlines())]
    return "\n".join([*lines, "", *describe_commands(commands, usable)]) + "\n"


def describe_commands(commands: Sequence[FitCommand], usable: bool = True) -> list[str]:
    """Describe the command, on a line of its own so that it can be pasted, and what it takes for granted.

    Args:
        commands: Commands that fit a file; two where it could be either of two kinds.
        usable: Whether it can be fitted as it stands.
    """
    lines, when = list[str](), "" if usable else " once that is corrected"
    for what, command in zip(("a table", "a recording") if len(commands) > 1 else ("",), commands, strict=True):
        lines += [f"To fit it{f' as {what}' if what else ''}{when}:", wrap_command(command.text)]
        granted = listed([f"that {assumption}" for assumption in command.provided])
        lines += [filled(f"This assumes {granted}; change what is wrong.")] if granted else []
    return lines


def wrap_command(command: str) -> str:
    """Wrap a command that can be pasted into lines that fit into a terminal, where its options let it."""
    lines = ["  "]
    for i, part in enumerate(re.split(r" (?=--)", command)):
        if i and len(lines[-1]) + len(part) + 3 > WIDTH:
            lines[-1] += " \\"
            lines.append(f"    {part}")
        else:
            lines[-1] += f" {part}" if i else part
    return "\n".join(lines)


def _kind_in_words(raw: RawTable, data: Dataset | None) -> str:
    """Return what a table is called: by its kind, or by its number of rows."""
    for kind, table in iterate_tables(data.measurements) if data else ():
        return kind.describe_single_file(table)
    return f"a table of {counted(len(raw.rows), 'row')}"


def _column_table(raw: RawTable, wanted: tuple[Quantity, ...], named: Mapping[str, str]) -> str:
    """Return the columns: unit, what they are read as, and range; of very many the first, and all that are read."""
    can_be = find_candidates(list(zip(raw.header, raw.units, strict=True)), wanted, tuple(named.values()))
    read_as = dict(named)
    for quantity, columns in can_be.items():
        for candidate in columns:
            read_as[raw.header[candidate.position]] = quantity if len(columns) == 1 else f"{quantity}?"
    numbers = {candidate.name: candidate for candidate in list_number_columns(raw)}
    rows = []
    for heading, below in zip(raw.header, raw.units, strict=True):
        if heading:
            column = numbers.get(heading)
            spread = [f"{column.low:.5g}", f"{column.high:.5g}"] if column else ["", ""]
            rows.append([heading, heading_of(heading, below).unit or "-", read_as.get(heading, "-"), *spread])
    listed_rows = [row for i, row in enumerate(rows) if i < _MAX_LISTED or row[0] in read_as]
    listing = narrow_table(["column", "unit", "read as", "lowest", "highest"], listed_rows, left=_LEFT)
    more = len(rows) - len(listed_rows)
    return f"{listing}\n... and {more} more columns." if more else listing


def describe_recording_file(
    file: ChannelFile,
    reason: str,
    command: FitCommand,
    recordings: Recordings | None = None,
    obstacle: str = "",
    usable: bool = True,
) -> str:
    """Describe the channels of a file, one a line, and the recording that they make.

    Args:
        file: Channels of the file.
        reason: Why it is taken for a recording, as a clause.
        command: The command that fits it.
        recordings: The file as a recording, where its channels say which is which.
        obstacle: Reason why it is not one, in a sentence.
        usable: Whether the command can fit it as it stands.
    """
    description = KINDS["recordings"].describe_single_file(recordings) if recordings is not None else "a recording"
    title = f"{file.path.name}: {description}, because {reason} ({file.kind}, {counted(len(file.channels), 'channel')})."
    lines = [filled(title), "", *describe_channels(file), *describe_recorded(recordings, obstacle)]
    several = "Several recordings of one cable go into a cable.toml (bowdenfit init)."
    return "\n".join([*lines, "", *describe_commands([command], usable), several]) + "\n"


def describe_recorded(recordings: Recordings | None, obstacle: str) -> list[str]:
    """Describe the preparation of a recording, or what keeps a file from being one."""
    if recordings is None:
        return ["", *map(filled, f"As a recording it cannot be used yet: {obstacle}".splitlines())] if obstacle else []
    remarks = [remark for r in recordings.items for remark in (*r.account.remarks, *r.strokes.remarks)]
    return ["", *describe_preparations(recordings), *(filled(f"Note: {remark}") for remark in remarks)]


def describe_channels(file: ChannelFile) -> list[str]:
    """Describe the channels of a file, one a line, its first and last sample, and how its rows were used."""
    n = len(file.channels)
    rows = [_channel_row(channel) for channel in file.channels[:_MAX_LISTED]]
    keep = [i for i, _ in enumerate(_CHANNEL_HEADS) if i in (0, 1, 2, 5, 6) or any(row[i] for row in rows)]
    listing = narrow_table(
        [_CHANNEL_HEADS[i] for i in keep], [[row[i] for i in keep] for row in rows], left=("channel", "unit", "clock")
    )
    more = [f"... and {n - _MAX_LISTED} more channels."] if n > _MAX_LISTED else []
    account = describe_row_account(file.account) if file.account else []
    notes = [filled(f"Note: {remark}") for remark in file.remarks]
    return [listing, *more, "", *_first_and_last_samples(file), *account, *notes]


def _first_and_last_samples(file: ChannelFile) -> list[str]:
    """Describe the first and the last sample of every channel."""
    lines = []
    for which, i in (("First", 0), ("Last", -1)):
        values = [f"{_shorten_name(channel.name)} {channel.values[i]:.5g}" for channel in file.channels[:_MAX_NAMED]]
        more = [f"{len(file.channels) - _MAX_NAMED} more"] if len(file.channels) > _MAX_NAMED else []
        lines.append(filled(f"{which} sample{'s' if more else ''}: {', '.join([*values, *more])}."))
    return lines


def _channel_row(channel: Channel) -> tuple[str, ...]:
    """Return the cells of a channel in the listing, see `_CHANNEL_HEADS`."""
    finite = channel.values[np.isfinite(channel.values)]
    missing = len(channel.values) - len(finite)
    samples = f"{len(channel.values)}" + (f" ({missing} missing)" if missing else "")
    low, high = (f"{finite.min():.5g}", f"{finite.max():.5g}") if len(finite) else ("", "")
    rate = f"{channel.rate:.4g} Hz" if np.isfinite(channel.rate) else ""
    length = ""
    if channel.time is not None and len(channel.time) > 1:
        length = f"{np.nanmax(channel.time) - np.nanmin(channel.time):.4g} s"
    return (
        _shorten_name(channel.name),
        _shorten_name(channel.unit) or "?",
        samples,
        rate,
        length,
        low,
        high,
        _shorten_name(channel.clock),
    )


def _shorten_name(text: str) -> str:
    """Return a name without its middle, where it is long."""
    return text if len(text) <= _MAX_LENGTH else f"{text[: _MAX_LENGTH // 2]}...{text[-_MAX_LENGTH // 2 + 3 :]}"
