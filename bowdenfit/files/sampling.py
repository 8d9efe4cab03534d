"""Sampling rates that stand beside the samples as single numbers, and the clocks they make."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bowdenfit.files.channels import Channel
from bowdenfit.files.clocks import is_clock
from bowdenfit.files.column_clocks import groups_around

_RATES = {
    "fs", "f_s", "rate", "samplingrate", "samplerate", "samplefrequency", "samplingfrequency", "sampfreq", "fsample",
    "fsampling", "acquisitionrate", "samplespersecond",
}  # fmt: skip
_INTERVALS = {
    "dt", "deltat", "ts", "tsample", "sampletime", "sampletimes", "samplinginterval", "sampleinterval", "samplingtime",
    "timestep", "samplingperiod", "sampleperiod",
}  # fmt: skip
_INDEX = re.compile(r"[\[(][\d:,]+[\])]$")
Settings = Mapping[str, Mapping[str, Any]]
"""Single values by name, such as the attributes of a data set, for each data set and group: "bench" or "rec.run"."""


def with_interval(channels: Iterable[Channel], settings: Settings) -> tuple[tuple[Channel, ...], tuple[str, ...]]:
    """Give channels without a clock the times that follow from their sampling rate, and say so.

    Args:
        channels: The channels of a file.
        settings: Where rates [1/s] and intervals [s] may stand.

    Returns:
        All channels in their order, and a remark on each setting that was used.
    """
    result, used = [], dict[str, float]()
    for channel in channels:
        setting = _nearest(channel.name, settings) if channel.time is None and not is_clock(channel) else None
        if setting:
            interval, name = setting
            used[name] = interval
            channel = replace(channel, time=np.arange(len(channel.values)) * interval, clock=name)
        result.append(channel)
    return tuple(result), tuple(
        f"Without a time channel the time was counted from the first sample by {name} ({1 / interval:.6g} samples a "
        "second)."
        for name, interval in used.items()
    )


def _nearest(name: str, settings: Settings) -> tuple[float, str] | None:
    """Seconds between samples, by the first setting of a channel itself, its group or those around it, and its name."""
    owners = (_INDEX.sub("", name), *(group[:-1] for group in groups_around(name)))
    intervals = (_interval(*setting) for owner in owners for setting in settings.get(owner, {}).items())
    return next((interval for interval in intervals if interval), None)


def _interval(name: str, value: Any) -> tuple[float, str] | None:
    """Seconds between samples by one setting, and its name; None if it says nothing of them."""
    number, words = _positive(value), {_plain(name), _plain(name.rpartition(".")[2])}
    if number is not None and words & _RATES:
        return 1 / number, name
    return (number, name) if number is not None and words & _INTERVALS else None


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
