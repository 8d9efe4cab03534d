"""Looking at a file without a description: what it is, how it is understood, and the command that fits it."""

import shlex
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import cast

from bowdenfit.dataset import Dataset, single_file_dataset
from bowdenfit.errors import BowdenfitError, DatasetError
from bowdenfit.files import read_channels
from bowdenfit.files.channels import ChannelFile
from bowdenfit.files.clocks import is_clock
from bowdenfit.files.headings import parse_sources
from bowdenfit.files.tables import read_table
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.file_kind import FileKind, guess_file_kind
from bowdenfit.kinds.fit_command import (
    FitCommand,
    HeadedColumn,
    has_own_angles,
    make_both_commands,
    make_recording_command,
    make_table_command,
)
from bowdenfit.questions.check.channels_words import describe_recording_file
from bowdenfit.questions.check.file_words import describe_table_file
from bowdenfit.reading import Reading
from bowdenfit.recordings.named_channels import parse_channels
from bowdenfit.recordings.recording import Recordings

_CHOICES = ("noise", "friction", "geometry", "undetected")
_ANY_ANGLE = (180.0, "deg")  # what the command says as well


def describe_single_file(path: Path, reading: Reading, check: Callable[..., Dataset]) -> tuple[str, bool]:
    """What a file alone is, and the command that fits it; and whether that can, or the file is to be mended first.

    Args:
        path: The file.
        reading: Keywords of `bowdenfit.read`; which column of a table or channel of a recording is what among them.
        check: Reads a data set with such keywords and refuses a model that cannot be.

    Raises:
        BowdenfitError: The file cannot be read, or not with these keywords.
    """
    channels, named = reading.get("channels", ()), parse_sources(reading.get("columns", ()), "--column")
    file = guess_file_kind(path, bool(channels), tuple(named))
    if KINDS[file.kind].takes_channels and not file.other:
        return _describe_recording(path, file, channels)
    raw = read_table(path)
    headings = {source.name: quantity.rpartition(".")[2] for quantity, source in named.items()}
    if file.other:
        return describe_table_file(raw, file, make_both_commands(path, raw, file), None, "", headings), True
    command = make_table_command(path, raw, file.kind, named)
    has_angles = has_own_angles(path, file.kind, tuple(named), stated=False)
    strict = any(reading.values()) and not command.names_more
    angle = None if has_angles or "wrap_angle=" in command.text else _ANY_ANGLE
    data, obstacle = _try_as_data_set(path, cast(Reading, {**reading, "wrap_angle": angle}), check, strict)
    remaining = obstacle
    if obstacle and command.names_more:
        words = shlex.split(command.text)
        columns = tuple(word for option, word in pairwise(words) if option == "--column")
        _, remaining = _try_as_data_set(
            path, cast(Reading, {**reading, "wrap_angle": angle, "columns": columns}), check, False
        )
        obstacle += f"\n{remaining}" if remaining not in obstacle else ""
    return describe_table_file(
        raw, file, [_with_settings(command, reading)], data, obstacle, headings, not remaining
    ), not obstacle


def _try_as_data_set(
    path: Path, reading: Reading, check: Callable[..., Dataset], strict: bool
) -> tuple[Dataset | None, str]:
    """The data set that a table makes at any wrap angle, or why it makes none as it stands.

    Raises:
        BowdenfitError: It makes none, and the user has asked for something that the command would not mend.
    """
    try:
        return check(path, **reading), ""
    except BowdenfitError as error:
        if strict:
            raise
        return None, str(error)


def _with_settings(command: FitCommand, reading: Reading) -> FitCommand:
    """The command with what the user has set besides columns."""
    stated = [f"--set {shlex.quote(setting)}" for setting in reading.get("settings", ())]
    stated += [f"--{name} {value}" for name in _CHOICES if (value := reading.get(name))]
    return replace(command, text=" ".join([command.text, *stated]))


def _describe_recording(path: Path, kind: FileKind, channels: Sequence[str]) -> tuple[str, bool]:
    file, recordings, obstacle = channels_of(path, channels)
    command = _recording_command(path, file, channels)
    usable = not obstacle or (not channels and "--channel" in command.text)
    return describe_recording_file(file, kind.why, command, recordings, obstacle, usable), not obstacle


def _recording_command(path: Path, file: ChannelFile, channels: Sequence[str]) -> FitCommand:
    signals = [each for each in file.channels if not is_clock(each)]
    headed = [
        HeadedColumn(each.name, each.unit, float(each.values[each.values == each.values].mean())) for each in signals
    ]
    return make_recording_command(path, headed, any(each.time is not None for each in signals), parse_channels(channels))


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
