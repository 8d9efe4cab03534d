"""Looking at a file without a description: what it is, how it is understood, and the command that fits it."""

from collections.abc import Sequence
from pathlib import Path

from bowdenfit.dataset import Dataset, single_file_dataset
from bowdenfit.errors import BowdenfitError, DatasetError
from bowdenfit.files import read_channels
from bowdenfit.files.channels import ChannelFile
from bowdenfit.files.clocks import is_clock
from bowdenfit.files.naming import parse_sources
from bowdenfit.files.tables import read_table
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.fit_commands import (
    FitCommand,
    either,
    has_own_angles,
    recording_command,
    table_command,
)
from bowdenfit.kinds.single_file import FileKind, file_kind
from bowdenfit.kinds.unnamed_ends import HeadedColumn
from bowdenfit.questions.check.channels_words import channels_text
from bowdenfit.questions.check.file_words import table_text
from bowdenfit.recordings.forces import parse_channels
from bowdenfit.recordings.recording import Recordings
from bowdenfit.units import ColumnSource

_ANY_ANGLE = (180.0, "deg")  # what the command says as well


def lone_file_text(path: Path, channels: Sequence[str] = (), columns: Sequence[str] = ()) -> str:
    """What a file alone is, and the command that fits it.

    Args:
        path: The file.
        channels: Which channel of a recording is what, such as "input_force=ai0:lbf".
        columns: Which column of a table is what.

    Raises:
        DatasetError: The file cannot be read.
    """
    named = parse_sources(columns, "--column")
    found = file_kind(path, bool(channels), tuple(named))
    if KINDS[found.kind].takes_channels and not found.other:
        return _recording_text(path, found, channels)
    raw = read_table(path)
    headings = {source.name: quantity.rpartition(".")[2] for quantity, source in named.items()}
    if found.other:
        return table_text(raw, found, either(path, raw, found), None, "", headings)
    command = table_command(path, raw, found.kind, named)
    data, why_not = _as_data_set(path, found, named)
    return table_text(raw, found, [command], data, why_not, headings)


def _as_data_set(path: Path, found: FileKind, named: dict[str, ColumnSource]) -> tuple[Dataset | None, str]:
    """The data set that a table makes at any wrap angle, or why it makes none."""
    try:
        own = has_own_angles(path, found.kind, tuple(named), stated=False)
        return single_file_dataset(path, None if own else _ANY_ANGLE, (), {}, named, found.kind), ""
    except BowdenfitError as error:
        return None, str(error)


def _recording_text(path: Path, found: FileKind, channels: Sequence[str]) -> str:
    file, recordings, why_not = channels_of(path, channels)
    return channels_text(file, found.why, _command(path, file, channels), recordings, why_not)


def _command(path: Path, file: ChannelFile, channels: Sequence[str]) -> FitCommand:
    signals = [each for each in file.channels if not is_clock(each)]
    headed = [HeadedColumn(each.name, each.unit, float(each.values[each.values == each.values].mean())) for each in signals]
    return recording_command(path, headed, any(each.time is not None for each in signals), parse_channels(channels))


def channels_of(path: str | Path, channels: Sequence[str] = ()) -> tuple[ChannelFile, Recordings | None, str]:
    """The channels of a recording's file, and the recording that they make.

    Args:
        path: A file.
        channels: Which channel is what, such as "input_force=ai0:lbf".

    Returns:
        The channels; the recording, prepared and cut into strokes, None where it cannot be; and why not, in a sentence.

    Raises:
        DatasetError: The file cannot be read.
    """
    file = read_channels(Path(path))
    try:
        data = single_file_dataset(Path(path), _ANY_ANGLE, (), parse_channels(channels), kind="recordings")
    except DatasetError as error:
        return file, None, str(error)
    return file, data.measurements.table(Recordings), ""
