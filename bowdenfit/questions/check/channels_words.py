"""What `bowdenfit check FILE` says of a file alone: its channels, and how to fit it."""

import numpy as np

from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.kinds.recordings.words import recordings_text
from bowdenfit.recordings.recording import Recordings
from bowdenfit.words import filled, table

_HEADS = ("channel", "unit", "samples", "rate", "length", "lowest", "highest", "clock")


def channels_text(file: ChannelFile, recordings: Recordings | None = None, why_not: str = "") -> str:
    """The channels of a file, one a line, and what the file is as a recording.

    Args:
        file: What was read.
        recordings: The file as a recording, where its channels say which is which.
        why_not: What keeps it from being one, in a sentence.
    """
    title = f"{file.path.name}: {file.kind}, {len(file.channels)} channel{'s' if len(file.channels) != 1 else ''}"
    rows = [_row(channel) for channel in file.channels]
    keep = [i for i, _ in enumerate(_HEADS) if i in (0, 1, 2, 5, 6) or any(row[i] for row in rows)]
    listing = table(
        [_HEADS[i] for i in keep], [[row[i] for i in keep] for row in rows], left=("channel", "unit", "clock")
    )
    notes = [filled(f"Note: {remark}") for remark in file.remarks]
    how = filled(
        "To fit it as a recording of one cable with one contact: bowdenfit fit "
        f"{file.path.name} --wrap-angle 180deg --channel input_force=NAME:N --channel output_force=NAME:N. Names that say it "
        "themselves, such as input_force_N, need no --channel; several recordings go into a cable.toml (bowdenfit init)."
    )
    lines = [title, "", listing, *(["", *notes] if notes else [])]
    if recordings is not None:
        lines += ["", *recordings_text(recordings)]
        lines += [
            filled(f"Note: {remark}") for r in recordings.each for remark in (*r.account.remarks, *r.strokes.remarks)
        ]
    elif why_not:
        lines += ["", filled(f"As a recording it cannot be used yet: {why_not}")]
    return "\n".join([*lines, "", how]) + "\n"


def _row(channel: Channel) -> tuple[str, ...]:
    finite = channel.values[np.isfinite(channel.values)]
    missing = len(channel.values) - len(finite)
    samples = f"{len(channel.values)}" + (f" ({missing} missing)" if missing else "")
    low, high = (f"{finite.min():.5g}", f"{finite.max():.5g}") if len(finite) else ("", "")
    rate = f"{channel.rate:.4g} Hz" if np.isfinite(channel.rate) else ""
    length = ""
    if channel.time is not None and len(channel.time) > 1:
        length = f"{np.nanmax(channel.time) - np.nanmin(channel.time):.4g} s"
    return channel.name, channel.unit or "?", samples, rate, length, low, high, channel.clock
