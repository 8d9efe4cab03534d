"""What `bowdenfit check FILE` says of a file alone: what it is, its columns or channels, and the command that fits it."""

import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeAlias, cast

import numpy as np

from bowdenfit.dataset import Dataset, is_lone_file, single_file_dataset
from bowdenfit.errors import BowdenfitError, DatasetError
from bowdenfit.files import read_channels
from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.files.clocks import is_clock
from bowdenfit.files.formats import TEXT, WORKBOOKS
from bowdenfit.files.headings import Quantity, find_candidates, heading_of, parse_sources
from bowdenfit.files.isolation import limits_times
from bowdenfit.kinds import KINDS, iterate_tables
from bowdenfit.kinds.file_kind import columns_of_kind
from bowdenfit.kinds.fit_command import FitCommand, make_commands
from bowdenfit.kinds.lone_file import LoneFile, understand, understand_sheets
from bowdenfit.kinds.recordings.kind import describe_preparations
from bowdenfit.questions.check.data_set_words import (
    check_data_set,
    describe_first_and_last_rows,
    describe_row_account,
    describe_unusable_readings,
)
from bowdenfit.reading import Reading
from bowdenfit.recordings.named_channels import parse_channels
from bowdenfit.recordings.preparation.checks import explain_backward_clock
from bowdenfit.recordings.recording import Recordings
from bowdenfit.words import WIDTH, counted, filled, listed, narrow_table, shown

CommandWriter: TypeAlias = Callable[[FitCommand], str]
_CHOICES = ("noise", "friction", "geometry", "undetected", "errors")  # options that the command repeats
ANY_ANGLE = (180.0, "deg")  # any will do to look at a file; the command proposes the same
_LEFT = ("column", "unit", "read as")  # columns aligned to the left
_MAX_NAMED = 8  # channels whose first and last sample are named
_LONG = 50  # rows from which a table beside a clock is meant as a recording; with fewer its clock may say when each was read
_MOST_NEIGHBORS = 40  # files of a folder that are looked at; a judgement
_MAX_LISTED = 100  # channels that are listed
_MAX_LENGTH = 60  # characters of a name or unit
_CHANNEL_HEADS = ("channel", "unit", "samples", "rate", "length", "lowest", "highest", "clock")


def is_single_file(path: Path) -> bool:
    """Return whether a path is a file that no description names."""
    return (path.is_file() and path.suffix.lower() != ".toml") or is_lone_file(path)


def describe_single_file(path: Path, reading: Reading, write: CommandWriter | None = None) -> tuple[str, bool]:
    """Describe a file alone and the command that fits it; and return whether it can be fitted as it stands.

    Args:
        path: The file.
        reading: Keywords of `bowdenfit.read`; which column of a table or channel of a recording is what among them.
        write: Writes a command that fits it; `wrap_command` if omitted.

    Raises:
        BowdenfitError: The file cannot be read, or not with these keywords.
    """
    with limits_times(reading.get("reading_limit") or 1):
        sheets, reasons = ({}, {}) if reading.get("sheet") else understand_sheets(path)
        if sheets or reasons:
            return _describe_workbook(path, sheets, reasons, reading)
        return _describe_sheet(path, reading, write or wrap_command)


def _describe_workbook(
    path: Path, sheets: Mapping[str, LoneFile], reasons: Mapping[str, str], reading: Reading
) -> tuple[str, bool]:
    """Describe the sheets of a workbook, and the one that can be fitted, or the command for all of them.

    Args:
        path: The workbook.
        sheets: The sheets that hold numbers, by title.
        reasons: Why each other sheet cannot be used.
        reading: Keywords of `bowdenfit.read`.
    """
    benches = {title: file for title, file in sheets.items() if file.is_bench}
    rows = [(shown(title), _describe_content(file), "yes" if file.is_bench else "no") for title, file in sheets.items()]
    rows += [(shown(title), "no readings", "no") for title in reasons]
    heads = ["sheet", "holds", "can be fitted alone"]
    lines = [f"{path.name}: a workbook of {counted(len(rows), 'sheet')}.", "", narrow_table(heads, rows, left=heads)]
    lines += ["", *(filled(f"Sheet {shown(title)}: {reason}") for title, reason in reasons.items())] if reasons else []
    if len(benches) > 1 or any(file.is_angles for file in sheets.values()):
        lines += ["", "To fit its sheets together:", _describe_init([path])]
    if len(benches) > 1:
        lines += ["", "To fit one of them:", *(wrap_command(make_commands(file)[0]) for file in benches.values())]
        return "\n".join(lines) + "\n", False
    chosen = cast(Reading, {**reading, "sheet": next(iter(benches))}) if benches else reading
    text, is_usable = _describe_sheet(path, chosen, wrap_command)
    return "\n".join([*lines, "", text]), is_usable


def _describe_content(file: LoneFile) -> str:
    """Return the contents of a sheet in a few words."""
    if file.recording is not None:
        return f"a recording of {counted(max(len(column.values) for column in file.columns), 'sample')}"
    rows = len(file.table.rows) if file.table else 0
    if file.is_angles:
        return f"wrap angles at {counted(rows, 'length')}"
    return counted(rows, "reading" if file.is_bench else "row")


def _describe_sheet(path: Path, reading: Reading, write: CommandWriter) -> tuple[str, bool]:
    """Describe a file, or one sheet of a workbook; see `describe_single_file`."""
    channels, columns = parse_channels(reading.get("channels", ())), parse_sources(reading.get("columns", ()), "--column")
    file = understand(path, channels, columns, reading.get("missing", ()), sheet=reading.get("sheet") or "")
    if file.recording is not None:
        return _describe_recording(file, file.recording, reading, write)
    assert file.table is not None
    if file.kind.other:
        backwards = _backward_clock(path)
        # `fit` asks which it is.
        return _describe_table(file, make_commands(file), None, backwards, not backwards, write), False
    if file.is_angles and not columns:
        return _describe_angle_table(file), True
    return _describe_readings(file, reading, write)


def _describe_readings(file: LoneFile, reading: Reading, write: CommandWriter) -> tuple[str, bool]:
    """Describe a table of readings; and return whether it can be fitted as it stands."""
    (command,) = make_commands(file)
    has_angles = file.has_own_angles(is_stated=False)
    strict = any(reading.values()) and not command.names_more
    names_angle = any(argument.startswith("wrap_angle=") for argument in command.arguments("--column"))
    options = {**reading, "wrap_angle": None if has_angles or names_angle else ANY_ANGLE}
    data, obstacle = _try_as_data_set(file.path, cast(Reading, options), strict)
    remaining = obstacle
    if obstacle and command.names_more:
        named = {**options, "columns": command.arguments("--column")}
        _, remaining = _try_as_data_set(file.path, cast(Reading, named), False)
        obstacle += f"\n{remaining}" if remaining not in obstacle else ""
    if obstacle and (backwards := _backward_clock(file.path)):
        obstacle, remaining = f"{obstacle}\n{backwards}", backwards
    command = command.with_options("--set", reading.get("settings", ()))
    for name in _CHOICES:
        command = command.with_options(f"--{name}", [value] if (value := reading.get(name)) else [])
    command = command.with_options("--missing", reading.get("missing", ()))
    return _describe_table(file, [command], data, obstacle, not remaining, write), not obstacle


def _find_neighbors(path: Path, angles: bool) -> list[Path]:
    """Return the tables next to a file that hold wrap angles by length, or else readings at several lengths."""
    neighbors = list[Path]()
    for other in sorted(path.parent.iterdir())[:_MOST_NEIGHBORS]:
        if other != path and other.is_file() and other.suffix.lower() in (*TEXT, *WORKBOOKS):
            with suppress(BowdenfitError):
                file = understand(other, is_whole=False)
                fits = file.is_angles if angles else bool(file.lengths)
                neighbors += [other] if fits else []
    return neighbors


def _describe_init(files: Sequence[Path]) -> str:
    """Return the command that writes a data set of several files, as it can be pasted."""
    return f"  bowdenfit init my-cable --from {' '.join(shlex.quote(str(file)) for file in files)}"


def _describe_lengths(file: LoneFile) -> list[str]:
    """Describe that wrap angles may differ between the lengths of a table, and the command that fits it then."""
    if not file.lengths:
        return []
    angles = _find_neighbors(file.path, angles=True)
    table = f"{angles[0].name} has them" if angles else "write those measured at each length into a table such as angles.csv"
    words = f"Its rows are at {file.lengths} lengths. If the wrap angle differs between them, {table}"
    first = angles[0] if angles else file.path.with_name("angles.csv")
    return [filled(f"{words}, and both are fitted together:"), _describe_init([first, file.path]), ""]


def _describe_angle_table(file: LoneFile) -> str:
    """Describe a table of wrap angles by length, and where it belongs."""
    assert file.table is not None
    place = (
        "It is fitted together with readings of forces or efficiencies, or recordings, at some of these lengths: name it in "
        f'cable.toml, [tables] angles = {{ file = "{file.path.name}" }}; bowdenfit init writes that file.'
    )
    title = f"{file.name}: a table of wrap angles at {counted(len(file.table.rows), 'length')}."
    lines = [title, "", _column_table(file, ()), "", *describe_row_account(file.table.lines), "", filled(place)]
    if readings := _find_neighbors(file.path, angles=False):
        lines += ["", "To write it for these files:", _describe_init([file.path, *readings])]
    return "\n".join(lines) + "\n"


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


def _describe_recording(
    file: LoneFile, recording: ChannelFile, reading: Reading, write: CommandWriter
) -> tuple[str, bool]:
    """Describe a recording alone; and return whether it can be fitted as it stands."""
    (command,) = make_commands(file)
    missing = reading.get("missing", ())
    wrap_angle = ANY_ANGLE if file.angle is None else (file.angle.angle, "rad")
    recordings, obstacle, notes = None, "", list[str]()
    try:
        data = single_file_dataset(
            file.path, wrap_angle, (), file.named, kind="recordings", missing=missing, sheet=file.sheet
        )
        recordings = data.measurements.table(Recordings)
        of_rows = [remark for account in data.accounts for remark in account.remarks]
        notes = [filled(f"Note: {remark}") for remark in data.measurements.remarks if remark not in of_rows]
    except DatasetError as error:
        obstacle = str(error)
    backwards = describe_backward_clock(recording) if obstacle and "backwards" not in obstacle else ""
    obstacle = "\n".join(filter(None, [obstacle, backwards]))
    usable = not obstacle or (not file.named and bool(command.arguments("--channel")) and not backwards)
    description = KINDS["recordings"].describe_single_file(recordings) if recordings is not None else "a recording"
    source = f"({recording.kind}, {counted(len(recording.channels), 'channel')})"
    lines = [filled(f"{file.name}: {description}, because {file.kind.why} {source}."), ""]
    lines += [*describe_channels(recording), *describe_recorded(recordings, obstacle)]
    lines += [*(note for note in notes if note not in lines), ""]
    lines += describe_commands([command.with_options("--missing", missing)], usable, write)
    lines += ["Several recordings of one cable go into a cable.toml (bowdenfit init)."]
    return "\n".join(lines) + "\n", not obstacle


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


def _describe_table(
    file: LoneFile,
    commands: Sequence[FitCommand],
    data: Dataset | None,
    obstacle: str,
    usable: bool,
    write: CommandWriter,
) -> str:
    """Describe a table and how to fit it.

    Args:
        file: The table.
        commands: Commands that fit it; two where it could be either of two kinds.
        data: The data set that it makes; None if it makes none yet.
        obstacle: Reason why it cannot be fitted, in a sentence.
        usable: Whether the command can fit it as it stands.
        write: Writes a command.
    """
    assert file.table is not None
    title = f"{file.name}: {_kind_in_words(len(file.table.rows), data)}, because {file.kind.why}."
    if file.kind.other:
        title = f"{file.name}: a table of readings or a recording; {file.kind.why}."
    lines = [filled(title), "", _column_table(file, columns_of_kind(file.kind.kind))]
    if data is not None:
        lines += ["", *describe_first_and_last_rows(data)]
    account = data.accounts[0] if data is not None else file.table.lines
    lines += ["", *describe_row_account(account)]
    if data is not None:
        lines += [filled(f"Note: {remark}") for remark in data.measurements.remarks if remark not in account.remarks]
        lines += [filled(f"Warning: {sentence}") for sentence in describe_unusable_readings(data)]
    else:
        lines += [filled(f"Note: {remark}") for remark in file.table.remarks]
    if obstacle:
        lines += ["", *map(filled, f"As it stands it cannot be fitted: {obstacle}".splitlines())]
    return "\n".join([*lines, "", *_describe_lengths(file), *describe_commands(commands, usable, write)]) + "\n"


def describe_commands(
    commands: Sequence[FitCommand], usable: bool = True, write: CommandWriter | None = None
) -> list[str]:
    """Describe the command, on a line of its own so that it can be pasted, and what it takes for granted.

    Args:
        commands: Commands that fit a file; two where it could be either of two kinds.
        usable: Whether it can be fitted as it stands.
        write: Writes a command; `wrap_command` if omitted.
    """
    lines, when = list[str](), "" if usable else " once that is corrected"
    for what, command in zip(("a table", "a recording") if len(commands) > 1 else ("",), commands, strict=True):
        if command.missing:
            ends = listed([f"the {name}" for name in command.missing])
            lines += [filled(f"No column is left that could be {ends}; add it to the file.")]
            continue
        lines += [f"To fit it{f' as {what}' if what else ''}{when}:", (write or wrap_command)(command)]
        granted = listed([f"that {assumption}" for assumption in command.provided])
        lines += [filled(f"This assumes {granted}; change what is wrong.")] if granted else []
    return lines


def wrap_command(command: FitCommand) -> str:
    """Wrap a command that can be pasted into lines that fit into a terminal, where its options let it."""
    first, *options = command.parts
    lines = [f"  {first}"]
    for option in options:
        if len(lines[-1]) + len(option) + 3 > WIDTH:
            lines[-1] += " \\"
            lines.append(f"    {option}")
        else:
            lines[-1] += f" {option}"
    return "\n".join(lines)


def _kind_in_words(rows: int, data: Dataset | None) -> str:
    """Return what a table is called: by its kind, or by its number of rows."""
    for kind, table in iterate_tables(data.measurements) if data else ():
        return kind.describe_single_file(table)
    return f"a table of {counted(rows, 'row')}"


def _column_table(file: LoneFile, wanted: tuple[Quantity, ...]) -> str:
    """Return the columns: unit, what they are read as, and range; of very many the first, and all that are read."""
    read_as = dict(file.stated_headings)
    for quantity, columns in find_candidates(file.headings, wanted, tuple(read_as.values())).items():
        for candidate in columns:
            read_as[file.headings[candidate.position][0]] = quantity if len(columns) == 1 else f"{quantity}?"
    rows = []
    for column in file.columns:
        spread = [f"{column.low:.5g}", f"{column.high:.5g}"] if column.numbers else ["", ""]
        unit = heading_of(column.name, column.below).unit or "-"
        rows.append([column.name, unit, read_as.get(column.name, "-"), *spread])
    listed_rows = [row for i, row in enumerate(rows) if i < _MAX_LISTED or row[0] in read_as]
    listing = narrow_table(["column", "unit", "read as", "lowest", "highest"], listed_rows, left=_LEFT)
    more = len(rows) - len(listed_rows)
    return f"{listing}\n... and {more} more columns." if more else listing


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
