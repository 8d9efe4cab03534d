"""MDF measurement files of ASAM (Vector CANape, ETAS INCA, and many data loggers)."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.files.channels import (
    Channel,
    ChannelFile,
    UnreadNames,
    describe_truncation,
    is_numeric,
    load_library,
    make_channel_file,
    refuse_damage,
    refuse_too_large,
    to_floats,
    truncation_error,
)

_MASTERS = (2, 3)  # master and virtual master
_VIRTUAL = (3, 6)  # computed from the number of the record
_NOT_TIME = (2, 3, 4)  # masters that count angle, distance or records


def read(path: Path) -> ChannelFile:
    """Read the numeric channels of an MDF file, one at a time, each with the time of its group.

    Raises:
        DatasetError: The file is damaged, too large or without numeric channels, or asammdf is not installed.
    """
    asammdf = load_library("asammdf", "MDF4")
    left_out = UnreadNames()
    with refuse_damage(path), _open(asammdf, path) as file:
        places = _find_channels(file, left_out)
        refuse_too_large(path, sum(2 * _n_records(file, group) for group, _ in places))
        names = _names(file, places)
        read_one = [_channel(file, *place, names[place], left_out) for place in places]
        expected = max((_n_records(file, group) for group, _ in places), default=0)
        kind = f"MDF{str(file.version)[:1]}"
    channels = [channel for channel in read_one if channel is not None]
    longest = max((len(channel.values) for channel in channels), default=0)
    if places and expected and not longest and not left_out.names:
        raise truncation_error(path, "it ends before the first whole record")
    remarks = [describe_truncation(path, f"{longest} of its {expected} records")] if 0 < longest < expected else []
    return make_channel_file(path, kind, channels, left_out, remarks)


@contextmanager
def _open(asammdf: Any, path: Path) -> Iterator[Any]:
    """Yield the file, closed afterwards.

    A file that its logger never finalized has to be named: the library repairs a copy of it. Any other is handed over
    open, so that it is surely closed when the library fails.
    """
    with path.open("rb") as stream:
        source = path if stream.read(5) == b"UnFin" else stream
        stream.seek(0)
        file = asammdf.MDF(source, process_bus_logging=False)
        with file:
            yield file


def _find_channels(file: Any, left_out: UnreadNames) -> list[tuple[int, int]]:
    """Return the group and index of each channel that may be a recording."""
    return [
        (group, index)
        for group, content in enumerate(file.groups)
        for index, channel in enumerate(content.channels)
        if index != file.masters_db.get(group) and _may_be_recorded(file, group, channel, left_out)
    ]


def _may_be_recorded(file: Any, group: int, channel: Any, left_out: UnreadNames) -> bool:
    """Return whether a channel holds samples of its own."""
    kind = getattr(channel, "channel_type", 0)
    if kind in _MASTERS and group in file.masters_db:
        return False
    if kind in _VIRTUAL:
        left_out.add(channel.name, "they are virtual, computed from the number of the record")
        return False
    if _n_records(file, group) == 0:
        left_out.add(channel.name, "they are empty")
        return False
    return True


def _n_records(file: Any, group: int) -> int:
    """Return the number of samples of each channel of a group, as the file says."""
    return int(file.groups[group].channel_group.cycles_nr)


def _names(file: Any, places: list[tuple[int, int]]) -> dict[tuple[int, int], str]:
    """Return the name of each channel, with that of its group before it where several groups have such a channel."""
    plain = {(group, index): file.groups[group].channels[index].name for group, index in places}
    count = Counter(plain.values())
    return {
        place: name if count[name] == 1 else f"{_group_name(file, place[0])}/{name}" for place, name in plain.items()
    }


def _group_name(file: Any, group: int) -> str:
    """Return the name that the acquisition gave a group, else its number."""
    return str(getattr(file.groups[group].channel_group, "acq_name", "") or f"group {group + 1}")


def _channel(file: Any, group: int, index: int, name: str, left_out: UnreadNames) -> Channel | None:
    """Return one channel, or None if it is no column of numbers; samples that the logger called invalid are NaN."""
    # "Ignoring" the bits hands them over; otherwise the library drops these samples, and channels lose their alignment.
    signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
    samples = signal.samples
    if samples.dtype.names or samples.ndim != 1 or not is_numeric(samples.dtype):
        left_out.add(name, "they are text, structures or arrays")
        return None
    values = to_floats(samples)
    if signal.invalidation_bits is not None:
        values = np.where(np.asarray(signal.invalidation_bits, dtype=bool), np.nan, values)
    clock = _clock(file, group)
    if not clock:
        return Channel(name, (signal.unit or "").strip(), values)
    start = file.header.start_time.timestamp()
    return Channel(name, (signal.unit or "").strip(), values, to_floats(signal.timestamps), clock, start if start > 0 else None)


def _clock(file: Any, group: int) -> str:
    """Return the name of the master channel of a group, if it counts time."""
    index = file.masters_db.get(group)
    if index is None:
        return ""
    master = file.groups[group].channels[index]
    return "" if getattr(master, "sync_type", 1) in _NOT_TIME else str(master.name)
