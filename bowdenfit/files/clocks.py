"""The time of each channel of a recording: from a column that is a clock, or from a stated sampling rate.

Sheets have clocks beside their channels (`assign_clocks`); files with groups have them in the same group or around it
(`assign_group_clocks`). A sampling rate may be a single number in the file (`files/clock_settings.py`), or a line over the data
(`assign_rate_times`).
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import Channel, load_library
from bowdenfit.files.pieces import last_set, never_falls
from bowdenfit.types import Vector
from bowdenfit.units import conversion_factor
from bowdenfit.words import shown

_TIME_WORDS = {
    *("time", "timestamp", "stamp", "datetime", "elapsed"),
    *("zeit", "uhrzeit", "zeitstempel", "temps", "tiempo", "tempo"),
}
_UNITS_AS_NAMES = {
    "ms": "ms millis milliseconds millisekunden",
    "us": "us µs μs micros microseconds",
    "s": "sec secs seconds sekunden",
}
_UNIT_OF_NAME = {name: unit for unit, names in _UNITS_AS_NAMES.items() for name in names.split()}
_LABVIEW = "x_value"
_SECOND_SPELLINGS = {"sek", "sek.", "sec.", "seg", "secs"}
_RATIO = re.compile(r"[A-Za-z]_?\d?/[A-Za-z]_?\d?")  # of two symbols, such as T/t
_TENSION = re.compile(r"T_?\d")  # a clock only where it rises
EPOCH_UNITS = (
    (1e17, 1e-9),
    (1e14, 1e-6),
    (1e11, 1e-3),
)  # no recording lasts 3000 years: these are dates in ns, us, ms
YEARS = 1e8  # [s], three years: no recording lasts so long, so such numbers are dates
_HALF_DAY, _DAY = 43200.0, 86400.0
_COUNTED_FROM_ZERO = 60.0  # [s]; judged: nobody starts a bench in the first minute after midnight
_DATE = re.compile(r"\d{4}[-/]\d\d?[-/]\d\d?(?:[ T].*)?|\d\d?[./-]\d\d?[./-]\d{4}(?: .*)?")
_HALF = r"(?P<half>[AaPp])\.?\s?[Mm]\.?"  # AM or PM
_TIME_OF_DAY = re.compile(rf"\d{{1,3}}:\d\d(?::\d\d(?:[.,]\d+)?)?(?:\s*{_HALF})?")
_AM_OR_PM = re.compile(rf"(?<=\d)\s*{_HALF}$")

_STATED_RATE = re.compile(
    r"(?P<what>(?:sampl\w*|scan\w*|acquisition|acq\.?|data|logging)[\s_-]*(?:rate|freq\w*|interval|period|time|step)|rate|"
    r"f_?s|abtast\w*|delta_x|d_?t)\b[^\d+\-]{0,20}?(?P<value>\d+(?:[.,]\d+)?(?:e[+-]?\d+)?)\s*"
    r"(?P<unit>[kM]?Hz|[kM]?S/s|s/s|sps|[mµun]?s\b|sec\w*)?",
    re.IGNORECASE,
)
_VICON = ("devices", "trajectories", "model outputs")  # blocks of Vicon Nexus, with the rate [Hz] alone in the next line
_PERIOD_WORDS = ("interval", "period", "time", "step", "delta_x", "dt", "d_t")
_PERIOD_UNITS = ("s", "ms", "us", "µs", "ns")
_RATE_FACTORS = {"khz": 1e3, "mhz": 1e6, "ks/s": 1e3, "ms/s": 1e6, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}


def assign_clocks(
    channels: Sequence[Channel], groups: Callable[[str], Iterable[str]] = lambda _: ("",)
) -> tuple[Channel, ...]:
    """Return the channels, each with the time that its clock gives.

    The clock of a channel is the nearest clock to its left that has as many samples, so that sheets with a pair of
    columns for each run work; without one to the left, the nearest to the right. Clocks stay channels of their own, and
    a channel that has its time already keeps it. Numbers that can only be dates (Unix time in s, ms, us or ns) count
    from their first.

    Args:
        channels: Channels in the order of the file.
        groups: From the name of a channel to what stands before it in names of its group and of those around it, in which
            it looks for a clock one after the other.
    """
    own = [next(iter(groups(channel.name)), "") for channel in channels]
    clocks = [i for i, c in enumerate(channels) if is_clock(replace(c, name=c.name.removeprefix(own[i])))]
    seconds = {i: dated_seconds(channels[i]) for i in clocks}

    def timed(position: int, channel: Channel) -> Channel:
        if channel.time is not None or position in clocks:
            return channel
        alike = [i for i in clocks if len(channels[i].values) == len(channel.values)]
        fitting = next((near for group in groups(channel.name) if (near := [i for i in alike if own[i] == group])), [])
        nearest = max((i for i in fitting if i < position), default=fitting[0] if fitting else None)
        if nearest is None:
            return channel
        time, start = seconds[nearest]
        return replace(channel, time=time, clock=channels[nearest].name, start=start)

    return tuple(timed(i, channel) for i, channel in enumerate(channels))


def assign_group_clocks(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Give each channel without a time that of the nearest time channel of its group, else of the groups around it.

    Args:
        channels: Channels with their groups before their names, as "bench/F_in" or "rec.F_in".
    """
    return assign_clocks(channels, groups_around)


def assign_only_clock(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Give the channels that have no time yet that of the only time channel of the file, wherever it stands."""
    clocks = [c for c in channels if is_clock(replace(c, name=c.name.removeprefix(_group(c.name))))]
    if len(clocks) != 1:
        return tuple(channels)
    (clock,), (seconds, start) = clocks, dated_seconds(clocks[0])
    return tuple(
        channel
        if channel is clock or channel.time is not None or len(channel.values) != len(seconds)
        else replace(channel, time=seconds, clock=clock.name, start=start)
        for channel in channels
    )


def groups_around(name: str) -> Iterator[str]:
    """Yield the group of a channel and those around it, to the file as a whole: "rec.run.", "rec." and "" of "rec.run.F"."""
    while name:
        name = _group(name)
        yield name
        name = name[:-1]


def _group(name: str) -> str:
    """Return the groups before the name."""
    return name.removesuffix(re.split(r"[/.](?=[^/.]+$)", name)[-1])


def is_clock(channel: Channel) -> bool:
    """Return whether a channel is a time, by its name or by its unit.

    A name says so if its first or last word does, unless the unit is that of something else. A channel that only has
    a unit of time must also never run backwards.
    """
    factor = _time_factor(channel.unit)
    forward = len(channel.values) > 1 and never_falls(channel.values[: _filled_length(channel.values)])
    if names_time(channel.name) and (forward or not _TENSION.fullmatch(channel.name)):
        return not channel.unit or factor is not None
    return factor is not None and forward


def unit_of_time(heading: str) -> str:
    """Return the unit of time that a heading is itself, such as "millis" of an Arduino; empty for any other."""
    return _UNIT_OF_NAME.get(heading.strip().lower(), "")


def names_time(heading: str) -> bool:
    """Return whether a heading means time: "Time (s)", "t", "Zeit_ms", "45 time", "X_Value" of LabVIEW."""
    if _RATIO.fullmatch(heading.strip()):
        return False
    plain = heading.rpartition("/")[2].strip().lower()
    words = [word for word in re.split(r"[\W\d_]+", plain) if word]
    if not {*words[:1], *words[-2:]} & {*_TIME_WORDS, "t"}:  # before a last word is looked up among all units
        return plain == _LABVIEW or bool(unit_of_time(plain))
    named = words[:-1] if len(words) > 1 and _time_factor(words[-1]) is not None else words
    ends = {*named[:1], *named[-1:]}
    return bool(ends & _TIME_WORDS) or named == ["t"] or plain == _LABVIEW


def dated_seconds(clock: Channel) -> tuple[Vector, float | None]:
    """Return the times that a clock shows, from its first where they can only be dates [s]; and its `Channel.start`."""
    finite = np.isfinite(clock.values)
    lowest, highest = (float(end(clock.values, where=finite, initial=0.0)) for end in (np.min, np.max))
    largest = max(-lowest, highest)
    factor = _time_factor(clock.unit)
    if factor is None:
        factor = next((factor for bound, factor in EPOCH_UNITS if largest > bound), 1.0)
    if largest * factor > YEARS:
        return _subtract_first(clock.values) * factor, float(clock.values[finite][0]) * factor
    return clock.values if factor == 1 else clock.values * factor, clock.start


def _time_factor(unit: str) -> float | None:
    """Return the factor from a unit to seconds; None if it is no unit of time."""
    try:
        return conversion_factor("s" if unit.lower() in _SECOND_SPELLINGS else unit, "time") if unit else None
    except DatasetError:
        return None


def trim_tails(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Return the channels without the blank cells below them, where runs of different length stand side by side.

    All channels of one clock keep one length: that of the longest of them.
    """
    clocks = [is_clock(channel) for channel in channels]
    starts = [clock and not before for clock, before in zip(clocks, [True, *clocks], strict=False)]
    blocks = np.cumsum(starts) if sum(clocks) > 1 else np.zeros(len(channels), dtype=int)
    retained: list[Channel] = []
    for _, group in groupby(zip(blocks.tolist(), channels, strict=True), key=lambda pair: pair[0]):
        block = [channel for _, channel in group]
        length = max(_filled_length(channel.values) for channel in block)
        retained += [replace(channel, values=channel.values[:length]) for channel in block]
    return tuple(retained)


def _filled_length(values: Vector) -> int:
    """Return the number of samples up to the last that is none of the blank ones."""
    return last_set(~np.isnan(values), len(values)) + 1


def is_date(text: str) -> bool:
    """Return whether a cell is a date with or without time, or a time of day."""
    return bool(_DATE.fullmatch(text) or _TIME_OF_DAY.fullmatch(text))


def parse_dates(texts: Iterable[str], source: str) -> tuple[Vector, float | None]:
    """Return seconds from the first of some dates, and the `Channel.start` of it; a time of day may pass midnight.

    Args:
        texts: Dates such as "2021-02-04 14:52:00.120", "04.02.2021 14:52:00,120", "14:52:00.120" or "2:52:00.120 PM"; blank
            is missing.
        source: File and column, for the error.

    Raises:
        DatasetError: A text is no date.
    """
    pandas = load_library("pandas", "CSV")
    plain = [_AM_OR_PM.sub(r" \g<half>M", text.strip()).replace(",", ".") for text in texts]
    written = pandas.Series(plain, dtype=object)
    written = written.where(written != "", None)
    first = str(next((text for text in written if text), ""))
    try:
        if _TIME_OF_DAY.fullmatch(first):
            times = _unwrap_midnight(_times_of_day(written))
            return _subtract_first(times), _start_of_day_times(times)
        form = "ISO8601" if re.match(r"\d{4}-\d\d-\d\d", first) and first[-1:] not in {*"Mm"} else "mixed"
        dates = pandas.to_datetime(written, format=form, dayfirst="." in first[:3], utc=True)
    except ValueError as error:
        raise DatasetError(
            f"{source}: a cell is not a date or time like the others ({error}); correct it, or write the time in seconds."
        ) from None
    origin = dates.dropna().iloc[0]
    return _subtract_first((dates - origin).dt.total_seconds().to_numpy(dtype=float)), origin.timestamp()


def _times_of_day(texts: Iterable[str | None]) -> Vector:
    """Return seconds of "14:52:00.120", "2:52:00.120 PM" or "52:00"; two numbers are hours and minutes.

    Raises:
        ValueError: A text is neither, or only some have AM or PM.
    """
    written = [text or "nan:nan" for text in texts]
    parts = [text.rstrip("APMapm ").split(":") for text in written]
    seconds = np.array([sum(float(part) * 60.0 ** (2 - i) for i, part in enumerate(row)) for row in parts], dtype=float)
    halves = [text[-2:].upper() if text[-1:] in {*"Mm"} else "" for text in written]
    if not any(halves):
        return seconds
    for text, half, second in zip(written, halves, seconds.tolist(), strict=True):
        if not half and math.isfinite(second):
            raise ValueError(f"{text} lacks the AM or PM that others have")
        if second >= 13 * 3600:
            raise ValueError(f"{text} is no time of a 12-hour clock")
    # 12 AM is midnight, and 12 PM noon.
    return seconds % _HALF_DAY + _HALF_DAY * (np.array(halves) == "PM")


def _unwrap_midnight(seconds: Vector) -> Vector:
    """Return times of day that go on rising past midnight: a fall by more than half a day is a new day."""
    steps = np.diff(seconds, prepend=seconds[:1])
    return seconds + _DAY * np.cumsum(steps < -_HALF_DAY)


def _start_of_day_times(seconds: Vector) -> float | None:
    """Return when times of day start [s]; None where they count from 0, as the time since a start does."""
    finite = seconds[np.isfinite(seconds)]
    return float(finite[0]) if len(finite) and finite[0] >= _COUNTED_FROM_ZERO else None


def _subtract_first(seconds: Vector) -> Vector:
    """Return seconds from the first that is known."""
    finite = seconds[np.isfinite(seconds)]
    return seconds - finite[0] if len(finite) else seconds


def stated_rate(lines: Sequence[str]) -> tuple[float, str] | None:
    """Return the sampling rate [Hz] that the lines over the data state, and the line; None if none does."""
    plain_lines = [" ".join(line.replace('"', " ").strip(" #%;,\t\r\n").split()) for line in lines]
    for above, plain in zip(["", *plain_lines], plain_lines, strict=False):
        if above.lower() in _VICON and plain.isdecimal() and int(plain):
            return float(plain), f"{above} {plain}"
        match = _STATED_RATE.search(plain)
        if match is None:
            continue
        value = float(match["value"].replace(",", ".")) * _RATE_FACTORS.get((match["unit"] or "").lower(), 1.0)
        period = match["what"].lower().endswith(_PERIOD_WORDS) or (match["unit"] or "").lower() in _PERIOD_UNITS
        if value > 0 and math.isfinite(value):
            return (1 / value if period else value), plain[:80]
    return None


def assign_rate_times(channels: Sequence[Channel], lines: Sequence[str]) -> tuple[tuple[Channel, ...], list[str]]:
    """Give channels without any clock the times by a sampling rate stated over the data, and say so in a remark."""
    if any(channel.time is not None or names_time(channel.name) for channel in channels):
        return tuple(channels), []
    stated = stated_rate(lines)
    if stated is None:
        return tuple(channels), []
    rate, line = stated
    timed = tuple(replace(c, time=np.arange(len(c.values)) / rate, clock=line) for c in channels)
    return timed, [f"There is no column of time; it comes from the line {shown(line)}: {rate:g} samples a second."]
