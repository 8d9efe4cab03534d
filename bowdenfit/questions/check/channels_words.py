"""What `bowdenfit check FILE` says of a file alone: its channels, and how to fit it."""

import numpy as np

from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.fit_command import FitCommand
from bowdenfit.kinds.recordings.kind import describe_preparations
from bowdenfit.questions.check.file_words import describe_commands
from bowdenfit.questions.check.row_words import describe_row_account
from bowdenfit.recordings.recording import Recordings
from bowdenfit.words import filled, narrow_table

_MAX_NAMED = 8  # channels whose first and last sample are said
_MAX_LISTED = 100  # channels that are listed
_MAX_LENGTH = 60  # characters of a name or unit
_HEADS = ("channel", "unit", "samples", "rate", "length", "lowest", "highest", "clock")


def describe_recording_file(
    file: ChannelFile,
    reason: str,
    command: FitCommand,
    recordings: Recordings | None = None,
    obstacle: str = "",
    usable: bool = True,
) -> str:
    """The channels of a file, one a line, and what the file is as a recording.

    Args:
        file: What was read.
        reason: Why it is taken for a recording, as a clause.
        command: What fits it.
        recordings: The file as a recording, where its channels say which is which.
        obstacle: What keeps it from being one, in a sentence.
        usable: Whether the command can fit it as it stands.
    """
    description = KINDS["recordings"].describe_single_file(recordings) if recordings is not None else "a recording"
    n = len(file.channels)
    title = f"{file.path.name}: {description}, because {reason} ({file.kind}, {n} channel{'s' if n != 1 else ''})."
    rows = [_channel_row(channel) for channel in file.channels[:_MAX_LISTED]]
    keep = [i for i, _ in enumerate(_HEADS) if i in (0, 1, 2, 5, 6) or any(row[i] for row in rows)]
    listing = narrow_table(
        [_HEADS[i] for i in keep], [[row[i] for i in keep] for row in rows], left=("channel", "unit", "clock")
    )
    more = [f"... and {n - _MAX_LISTED} more channels."] if n > _MAX_LISTED else []
    account = describe_row_account(file.account) if file.account else []
    notes = [filled(f"Note: {remark}") for remark in file.remarks]
    lines = [filled(title), "", listing, *more, "", *_first_and_last_samples(file), *account, *notes]
    if recordings is not None:
        lines += ["", *describe_preparations(recordings)]
        lines += [
            filled(f"Note: {remark}") for r in recordings.items for remark in (*r.account.remarks, *r.strokes.remarks)
        ]
    elif obstacle:
        lines += ["", *map(filled, f"As a recording it cannot be used yet: {obstacle}".splitlines())]
    several = "Several recordings of one cable go into a cable.toml (bowdenfit init)."
    return "\n".join([*lines, "", *describe_commands([command], usable), several]) + "\n"


def _first_and_last_samples(file: ChannelFile) -> list[str]:
    """The first and the last sample of every channel."""
    lines = []
    for which, i in (("First", 0), ("Last", -1)):
        values = [f"{_shorten(channel.name)} {channel.values[i]:.5g}" for channel in file.channels[:_MAX_NAMED]]
        more = [f"{len(file.channels) - _MAX_NAMED} more"] if len(file.channels) > _MAX_NAMED else []
        lines.append(filled(f"{which} sample{'s' if more else ''}: {', '.join([*values, *more])}."))
    return lines


def _channel_row(channel: Channel) -> tuple[str, ...]:
    finite = channel.values[np.isfinite(channel.values)]
    missing = len(channel.values) - len(finite)
    samples = f"{len(channel.values)}" + (f" ({missing} missing)" if missing else "")
    low, high = (f"{finite.min():.5g}", f"{finite.max():.5g}") if len(finite) else ("", "")
    rate = f"{channel.rate:.4g} Hz" if np.isfinite(channel.rate) else ""
    length = ""
    if channel.time is not None and len(channel.time) > 1:
        length = f"{np.nanmax(channel.time) - np.nanmin(channel.time):.4g} s"
    return (
        _shorten(channel.name),
        _shorten(channel.unit) or "?",
        samples,
        rate,
        length,
        low,
        high,
        _shorten(channel.clock),
    )


def _shorten(text: str) -> str:
    """A text without the middle, where it is long."""
    return text if len(text) <= _MAX_LENGTH else f"{text[: _MAX_LENGTH // 2]}...{text[-_MAX_LENGTH // 2 + 3 :]}"
