"""Sampling rates that stand beside the samples as single numbers, and the clocks they make."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bowdenfit.files.channels import Channel
from bowdenfit.files.clocks import is_clock

_RATES = {
    "fs", "f_s", "rate", "samplingrate", "samplerate", "samplefrequency", "samplingfrequency", "sampfreq", "fsample",
    "fsampling", "acquisitionrate", "samplespersecond",
}  # fmt: skip
_INTERVALS = {
    "dt", "deltat", "ts", "tsample", "sampletime", "sampletimes", "samplinginterval", "sampleinterval", "samplingtime",
    "timestep", "samplingperiod", "sampleperiod",
}  # fmt: skip
_Interval = tuple[float, str]


def interval_from(settings: Mapping[str, Any]) -> tuple[float, str] | None:
    """Seconds between samples by the first setting that says so, and the name of that setting.

    Args:
        settings: Single values by name, such as the attributes of a data set: rates [1/s] and intervals [s].
    """
    for name, value in settings.items():
        number = _positive(value)
        if number is not None and _plain(name) in _RATES:
            return 1 / number, name
        if number is not None and _plain(name) in _INTERVALS:
            return number, name
    return None


def with_interval(
    channels: Iterable[Channel], interval_of: Callable[[str], _Interval | None]
) -> tuple[tuple[Channel, ...], tuple[str, ...]]:
    """Give channels without a clock the times that follow from their sampling rate, and say so.

    Args:
        channels: The channels of a file.
        interval_of: From the name of a channel to the time between its samples [s] and the setting that says so.

    Returns:
        All channels in their order, and a remark on each setting that was used.
    """
    result, used = [], dict[str, float]()
    for channel in channels:
        found = interval_of(channel.name) if channel.time is None and not is_clock(channel) else None
        if found:
            interval, name = found
            used[name] = interval
            channel = replace(channel, time=np.arange(len(channel.values)) * interval, clock=name)
        result.append(channel)
    return tuple(result), tuple(
        f"Without a time channel the time was counted from the first sample by {name} ({1 / interval:.6g} samples a "
        "second)."
        for name, interval in used.items()
    )


def _plain(name: str) -> str:
    """The name in lower case without what separates words and without a unit behind it."""
    letters = name.lower().replace("_", "").replace(" ", "").replace("-", "").replace(".", "")
    return letters.removesuffix("hz") or letters


def _positive(value: Any) -> float | None:
    """The value as a number if it is one, single, finite and above 0."""
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "fiu":
        return None
    number = float(array.reshape(-1)[0])
    return number if np.isfinite(number) and number > 0 else None
