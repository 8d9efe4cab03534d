"""TDMS files of National Instruments (LabVIEW, FlexLogger, DAQExpress)."""

import logging
from collections.abc import Iterator, Mapping
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
from bowdenfit.files.clocks import assign_group_clocks, assign_only_clock
from bowdenfit.files.headings import unit_in_name

_UNITS = ("unit_string", "NI_UnitDescription", "Unit", "unit")
_WAVEFORM = "wf_increment"


def read(path: Path) -> ChannelFile:
    """Read the numeric channels of a TDMS file, one at a time.

    The time of a channel is that of its waveform (`wf_start_offset` and `wf_increment`), else the time channel of its
    group. Of a file that was cut off the whole samples are kept.

    Raises:
        DatasetError: The file is damaged, too large or without numeric channels, or npTDMS is not installed.
    """
    nptdms = load_library("nptdms", "TDMS")
    # By its stream, without its name: by name npTDMS would believe an index beside it, which may be of an older file.
    with refuse_damage(path), _quiet(), path.open("rb") as stream, nptdms.TdmsFile.open(stream) as file:
        stored = [channel for group in file.groups() for channel in group.channels()]
        left_out = UnreadNames()
        chosen = [channel for channel in stored if _is_recording(channel, left_out)]
        refuse_too_large(path, sum(2 * len(channel) for channel in chosen))
        lengths = _whole_lengths(chosen, file.file_status)
        channels = [_channel(channel, lengths[channel.path]) for channel in chosen if lengths[channel.path]]
        incomplete = file.file_status.incomplete_final_segment
    for channel in chosen:
        if not lengths[channel.path]:
            left_out.add(_name(channel), "they are empty")
    if incomplete and not channels:
        raise truncation_error(path, "it ends before the first whole sample")
    longest = max((len(channel.values) for channel in channels), default=0)
    remarks = [describe_truncation(path, f"the {longest} whole samples before the end")] if incomplete else []
    return make_channel_file(path, "TDMS", assign_only_clock(assign_group_clocks(channels)), left_out, remarks)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the library's own warnings off the terminal; what they say becomes a remark."""
    manager = load_library("nptdms.log", "TDMS").log_manager
    level = manager.log_level
    manager.set_level(logging.CRITICAL)
    try:
        yield
    finally:
        manager.set_level(level)


def _name(channel: Any) -> str:
    """Return the group and channel, as "bench/F_in"."""
    return f"{channel.group_name}/{channel.name}"


def _is_recording(channel: Any, left_out: UnreadNames) -> bool:
    """Return whether this channel holds numbers; times of the day count as such."""
    if not (is_numeric(channel.dtype) or channel.dtype.kind == "M"):
        left_out.add(_name(channel), "they are text or complex numbers")
        return False
    return True


def _whole_lengths(channels: list[Any], status: Any) -> dict[str, int]:
    """Return how many samples to take of each channel.

    A file that ends in the middle of a chunk has more samples of its first channels than of its last; channels of one
    group that were meant to be equally long are cut to the shortest, so that they stay side by side.
    """
    missing = {channel.path: 0 for channel in channels}
    if status.incomplete_final_segment and status.channel_statuses:
        for path, segment in status.channel_statuses.items():
            missing[path] = segment.expected_length - segment.read_length
    meant = {channel.path: (channel.group_name, len(channel) + missing[channel.path]) for channel in channels}
    shortest: dict[tuple[str, int], int] = {}
    for channel in channels:
        key = meant[channel.path]
        shortest[key] = min(len(channel), shortest.get(key, len(channel)))
    return {path: shortest[key] for path, key in meant.items()}


def _channel(channel: Any, length: int) -> Channel:
    """Return one channel with the time of its waveform, if it has one."""
    raw = channel[:length]
    unit = _unit(channel.properties) or unit_in_name(channel.name)
    if raw.dtype.kind == "M":
        return Channel(_name(channel), "s", _seconds(raw), start=_unix_time(raw[0]))
    time = _waveform_times(channel.properties, length) if _has_waveform(channel.properties) else None
    start = channel.properties.get("wf_start_time") if time is not None else None
    clock = "" if time is None else _WAVEFORM
    return Channel(_name(channel), unit, to_floats(raw), time, clock, None if start is None else _unix_time(start))


def _has_waveform(properties: Mapping[str, Any]) -> bool:
    """Return whether the channel says how its samples follow each other in time."""
    return properties.get(_WAVEFORM, 0) > 0


def _waveform_times(properties: Mapping[str, Any], length: int) -> np.ndarray:
    """Return the time of each sample [s], from the start of the waveform; an offset of 0 may be left out."""
    return float(properties.get("wf_start_offset", 0.0)) + float(properties[_WAVEFORM]) * np.arange(length)


def _unit(properties: Mapping[str, Any]) -> str:
    """Return the unit of a channel, by the first property that has one."""
    return next((str(properties[name]).strip() for name in _UNITS if properties.get(name)), "")


def _unix_time(date: Any) -> float | None:
    """Return the Unix time of a date [s]; None where there is none, or the epoch of LabVIEW stands for none."""
    seconds = float((np.datetime64(date, "us") - np.datetime64(0, "s")) / np.timedelta64(1, "s"))
    return seconds if seconds > 0 else None


def _seconds(dates: np.ndarray) -> np.ndarray:
    """Return dates as seconds from the first."""
    return (dates - dates[0]) / np.timedelta64(1, "s")
