"""The times of channels by single values that a file holds next to them: its sampling rate, and when each channel starts."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import Channel, strip_index
from bowdenfit.files.clocks import EPOCH_UNITS, YEARS, groups_around, is_clock, is_date, parse_dates

_RATE_NAMES = {
    "fs", "f_s", "rate", "samplingrate", "samplerate", "samplefrequency", "samplingfrequency", "sampfreq", "fsample",
    "fsampling", "acquisitionrate", "samplespersecond",
}  # fmt: skip
_INTERVAL_NAMES = {
    "dt", "deltat", "ts", "tsample", "sampletime", "sampletimes", "samplinginterval", "sampleinterval", "samplingtime",
    "timestep", "samplingperiod", "sampleperiod",
}  # fmt: skip
_START_NAMES = {
    "t0", "tstart", "tfirst", "toffset", "starttime", "startdate", "timestart", "timeoffset", "timezero", "wfstartoffset",
    "wfstarttime",
}  # fmt: skip

Settings = Mapping[str, Mapping[str, Any]]
"""Single values by name, such as the attributes of a data set, for each data set and group: "bench" or "rec.run"."""


def assign_interval_times(channels: Iterable[Channel], settings: Settings) -> tuple[tuple[Channel, ...], tuple[str, ...]]:
    """Give channels without a clock the times that follow from their sampling rate and start, and say so.

    Args:
        channels: The channels of a file.
        settings: Where rates [1/s], intervals [s] and starts ([s], or dates) may be.

    Returns:
        All channels in their order, and a remark on each setting that was used.
    """
    result, used, starts = [], dict[str, float](), list[float]()
    for channel in channels:
        setting = _nearest(channel.name, settings) if channel.time is None and not is_clock(channel) else None
        if setting:
            interval, name = setting
            used[name] = interval
            first, start = _first_times(channel.name, settings)
            starts.append(first)
            channel = replace(channel, time=first + np.arange(len(channel.values)) * interval, clock=name, start=start)
        result.append(channel)
    apart = max(starts, default=0.0) - min(starts, default=0.0)
    late = (f"By the start that each states, channels start up to {apart:.3g} s apart; each is read at its own times.",)
    return tuple(result), (late if apart else ()) + tuple(
        f"Without a time channel the time was counted from the first sample by {name} ({1 / interval:.6g} samples a "
        "second)."
        for name, interval in used.items()
    )


def _nearest(name: str, settings: Settings) -> tuple[float, str] | None:
    """Return seconds between samples, by the first setting of a channel itself, its group or those around it, and its name."""
    intervals = (_interval(*setting) for owner in _owners(name) for setting in settings.get(owner, {}).items())
    return next((interval for interval in intervals if interval), None)


def _owners(name: str) -> tuple[str, ...]:
    """Return whose settings are those of a channel: itself, its group and those around it."""
    return (strip_index(name), *(group[:-1] for group in groups_around(name)))


def _first_times(name: str, settings: Settings) -> tuple[float, float | None]:
    """Return the time of a channel's first sample [s], and the `Channel.start` of it, by the first settings that state them."""
    starts = [
        _start(value)
        for owner in _owners(name)
        for setting, value in settings.get(owner, {}).items()
        if {_normalize(setting), _normalize(setting.rpartition(".")[2])} & _START_NAMES
    ]
    dates = [start for start in starts if start is not None and start > YEARS]
    first = next((start for start in starts if start is not None and start <= YEARS), 0.0)
    return first, dates[0] if dates else None


def _start(value: Any) -> float | None:
    """Return a number of seconds, or the Unix time of a date in a text [s]; None for anything else."""
    array = np.asarray(value)
    item = array.reshape(-1)[0] if array.size == 1 else None
    if item is not None and array.dtype.kind in "fiu":
        seconds = float(item)
        scale = next((factor for bound, factor in EPOCH_UNITS if abs(seconds) > bound), 1.0)
        return seconds * scale if math.isfinite(seconds) else None
    text = item.decode("utf-8", "replace") if isinstance(item, bytes) else str(item or "")
    try:
        return parse_dates([text], "start")[1] if is_date(text.strip()) else None
    except DatasetError:
        return None


def _interval(name: str, value: Any) -> tuple[float, str] | None:
    """Return seconds between samples by one setting, and its name; None if it says nothing of them."""
    number, words = _positive(value), {_normalize(name), _normalize(name.rpartition(".")[2])}
    if number is not None and words & _RATE_NAMES:
        return 1 / number, name
    return (number, name) if number is not None and words & _INTERVAL_NAMES else None


def _normalize(name: str) -> str:
    """Return the name in lower case without what separates words and without a unit behind it."""
    letters = name.lower().replace("_", "").replace(" ", "").replace("-", "").replace(".", "")
    return letters.removesuffix("hz") or letters


def _positive(value: Any) -> float | None:
    """Return the value as a number if it is one, single, finite and above 0."""
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "fiu":
        return None
    number = float(array.reshape(-1)[0])
    return number if np.isfinite(number) and number > 0 else None
