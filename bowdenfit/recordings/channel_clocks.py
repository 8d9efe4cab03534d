"""The clock of a channel: the time of each of its samples, and the unit that a clock without one may count in."""

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.files.clocks import YEARS
from bowdenfit.files.headings import option_naming
from bowdenfit.recordings.named_channels import RATE, converted
from bowdenfit.units import ColumnSource
from bowdenfit.words import shown

FEW_SAMPLES = 50  # below which a recording may well have been written down by hand
SLOWEST = 2.0  # s between samples, from which a clock without a unit is likelier to count milliseconds
_SHORTEST = 0.5  # s, in which no motor pulls a cable back and forth; a judgement
_CLOCK_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_CLOCK_WORDS = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}


def sample_times(file: ChannelFile, channel: Channel, time: Channel | None, source: ColumnSource | None) -> np.ndarray:
    """Return the time of each sample of a channel [s]."""
    hertz = _rate(file, source)
    if hertz is not None:
        return np.arange(len(channel.values)) / hertz
    if source is None and channel.time is not None:
        _refuse_clock_without_unit(file, channel)
        return channel.time
    if time is not None:
        return converted(file, time, "time", source, "time")
    rising = [other.name for other in file.channels if len(other.values) > 1 and np.all(np.diff(other.values) > 0)]
    by_name = f"name the channel of the time, {option_naming('time', rising[0], 's', '--channel')}, or " if rising else ""
    raise DatasetError(
        f"{file.path.name}: the channel {shown(channel.name)} has no clock; {by_name}state the sampling rate, such as "
        "--channel time=1000Hz."
    )


def _rate(file: ChannelFile, source: ColumnSource | None) -> float | None:
    """Return the sampling rate that the user gives in the place of a clock [1/s]."""
    rate = RATE.fullmatch(source.name.strip()) if source is not None else None
    if rate is None:
        return None
    hertz = float(rate["rate"]) * (1000.0 if rate["unit"].lower() == "khz" else 1.0)
    if not 0 < hertz < np.inf:
        raise DatasetError(
            f"{file.path.name}: a sampling rate of {rate[0]} is not possible; it must be above 0, such as time=1000Hz."
        )
    return hertz


def check_same_length(file: ChannelFile, channel: Channel, values: np.ndarray, time: np.ndarray) -> None:
    """Refuse a channel whose clock has another number of samples."""
    if len(values) != len(time):
        raise DatasetError(
            f"{file.path.name}: the channel {shown(channel.name)} has {len(values)} samples, but its clock has "
            f"{len(time)}; name the clock that belongs to it, or state the rate: --channel time=1000Hz."
        )


def _read_clock_without_unit(file: ChannelFile, channel: Channel) -> tuple[Channel, float, float] | None:
    """Return the clock of a channel that says no unit, with its step and its length if these are seconds [s].

    None for any other clock, for one that holds dates, and for few samples.
    """
    clock = next((c for c in file.channels if c.name == channel.clock), None)
    if clock is None or clock.unit or channel.time is None or len(channel.time) < FEW_SAMPLES:
        return None
    if np.nanmin(np.abs(clock.values)) >= YEARS:
        return None
    return clock, float(np.nanmedian(np.diff(clock.values))), float(np.nanmax(clock.values) - np.nanmin(clock.values))


def likely_clock_unit(step: float) -> str:
    """Return the unit that a clock without one is likely to count in, by its typical step."""
    return next((unit for unit, factor in _CLOCK_UNITS.items() if step * factor < SLOWEST), "ns")


def clock_in_doubt(file: ChannelFile, channel: Channel) -> Channel | None:
    """Return the clock of a channel where it says no unit and would have the samples seconds apart; None for any other."""
    clock = _read_clock_without_unit(file, channel)
    return clock[0] if clock is not None and clock[1] >= SLOWEST else None


def _refuse_clock_without_unit(file: ChannelFile, channel: Channel) -> None:
    """Refuse a clock that says no unit and is unlikely to be in seconds.

    Raises:
        DatasetError: By it samples would be seconds apart, or all strokes last less than a second.
    """
    if (read := _read_clock_without_unit(file, channel)) is None:
        return
    clock, step, length = read
    if step >= SLOWEST:
        units = [likely_clock_unit(step), "s"]
        last = (
            f"{length / 3600:.2g} hours at one sample each {step:g} s, in {_CLOCK_WORDS[units[0]]} "
            f"{length * _CLOCK_UNITS[units[0]]:.4g} s"
        )
    elif 0 < length < _SHORTEST:
        units = ["day", "min", "s"]
        last = (
            f"{length:.3g} s, in minutes {60 * length:.4g} s, and in days, as spreadsheets count them, {86400 * length:.4g} s"
        )
    else:
        return
    *options, option = (option_naming("time", clock.name, unit, "--channel") for unit in units)
    raise DatasetError(
        f"{file.path.name}: the clock {shown(clock.name)} does not state its unit; in seconds the recording would last {last}. "
        f"Say which it is: {', '.join(options)}, or {option}."
    )
