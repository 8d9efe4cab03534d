"""Which columns of a recording are clocks, and the time that each channel takes from them."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import Channel
from bowdenfit.files.libraries import load
from bowdenfit.files.pieces import last_set, rises
from bowdenfit.types import Vector
from bowdenfit.units import conversion_factor

_TIME_WORDS = {"time", "timestamp", "datetime", "elapsed", "zeit", "uhrzeit", "zeitstempel", "temps", "tiempo", "tempo"}
_LABVIEW = "x_value"
_SECONDS = {"sek", "sek.", "sec.", "seg", "secs"}
_RATIO = re.compile(r"[A-Za-z]_?\d?/[A-Za-z]_?\d?")  # of two symbols, such as T/t
_TENSION = re.compile(r"T_?\d")  # a clock only where it rises
_EPOCH_UNITS = (
    (1e17, 1e-9),
    (1e14, 1e-6),
    (1e11, 1e-3),
)  # no recording lasts 3000 years: these are dates in ns, us, ms
_YEARS = 1e8  # [s], three years
_HALF_DAY, _DAY = 43200.0, 86400.0
_DATE = re.compile(r"\d{4}[-/]\d\d?[-/]\d\d?(?:[ T].*)?|\d\d?[./-]\d\d?[./-]\d{4}(?: .*)?")
_TIME_OF_DAY = re.compile(r"\d{1,3}:\d\d(?::\d\d(?:[.,]\d+)?)?")


def with_clocks(
    channels: Sequence[Channel], groups: Callable[[str], Iterable[str]] = lambda _: ("",)
) -> tuple[Channel, ...]:
    """The channels, each with the time that its clock gives.

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
    seconds = {i: seconds_of(channels[i]) for i in clocks}

    def timed(position: int, channel: Channel) -> Channel:
        if channel.time is not None or position in clocks:
            return channel
        alike = [i for i in clocks if len(channels[i].values) == len(channel.values)]
        fitting = next((near for group in groups(channel.name) if (near := [i for i in alike if own[i] == group])), [])
        nearest = max((i for i in fitting if i < position), default=fitting[0] if fitting else None)
        if nearest is None:
            return channel
        return replace(channel, time=seconds[nearest], clock=channels[nearest].name)

    return tuple(timed(i, channel) for i, channel in enumerate(channels))


def is_clock(channel: Channel) -> bool:
    """Whether a channel is a time, by its name or by its unit.

    A name says so if its first or last word does, unless the unit is that of something else. A channel that only has
    a unit of time must also never run backwards.
    """
    factor = _time_factor(channel.unit)
    forward = len(channel.values) > 1 and rises(channel.values)
    if names_time(channel.name) and (forward or not _TENSION.fullmatch(channel.name)):
        return not channel.unit or factor is not None
    return factor is not None and forward


def names_time(heading: str) -> bool:
    """Whether a heading means time: "Time (s)", "t", "Zeit_ms", "45 time", "X_Value" of LabVIEW."""
    if _RATIO.fullmatch(heading.strip()):
        return False
    plain = heading.rpartition("/")[2].strip().lower()
    words = [word for word in re.split(r"[\W\d_]+", plain) if word]
    if not {*words[:1], *words[-2:]} & {*_TIME_WORDS, "t"}:  # before a last word is looked up among all units
        return plain == _LABVIEW
    named = words[:-1] if len(words) > 1 and _time_factor(words[-1]) is not None else words
    ends = {*named[:1], *named[-1:]}
    return bool(ends & _TIME_WORDS) or named == ["t"] or plain == _LABVIEW


def without_tails(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """The channels without the blank cells below them, where runs of different length stand side by side.

    All channels of one clock keep one length: that of the longest of them.
    """
    clocks = [is_clock(channel) for channel in channels]
    starts = [clock and not before for clock, before in zip(clocks, [True, *clocks], strict=False)]
    blocks = np.cumsum(starts) if sum(clocks) > 1 else np.zeros(len(channels), dtype=int)
    kept: list[Channel] = []
    for _, group in groupby(zip(blocks.tolist(), channels, strict=True), key=lambda pair: pair[0]):
        block = [channel for _, channel in group]
        length = max(_filled(channel.values) for channel in block)
        kept += [replace(channel, values=channel.values[:length]) for channel in block]
    return tuple(kept)


def is_date(text: str) -> bool:
    """Whether a cell is a date with or without time, or a time of day."""
    return bool(_DATE.fullmatch(text) or _TIME_OF_DAY.fullmatch(text))


def seconds_of_dates(texts: Iterable[str], source: str) -> Vector:
    """Seconds from the first of some dates; a time of day may pass midnight.

    Args:
        texts: Dates such as "2021-02-04 14:52:00.120", "04.02.2021 14:52:00,120" or "14:52:00.120"; blank is missing.
        source: File and column, for the error.

    Raises:
        DatasetError: A text is no date.
    """
    pandas = load("pandas", "CSV")
    written = pandas.Series([text.strip().replace(",", ".") for text in texts], dtype=object)
    written = written.where(written != "", None)
    first = str(next((text for text in written if text), ""))
    try:
        if _TIME_OF_DAY.fullmatch(first):
            return _from_first(_past_midnight(_times_of_day(written)))
        form = "ISO8601" if re.match(r"\d{4}-\d\d-\d\d", first) else "mixed"
        dates = pandas.to_datetime(written, format=form, dayfirst="." in first[:3], utc=True)
    except ValueError as error:
        raise DatasetError(
            f"{source}: a cell is no date or time like the others ({error}); correct it, or write the time in seconds."
        ) from None
    return _from_first((dates - dates.dropna().iloc[0]).dt.total_seconds().to_numpy(dtype=float))


def _times_of_day(texts: Iterable[str | None]) -> Vector:
    """Seconds of "14:52:00.120" or "52:00"; two numbers are hours and minutes.

    Raises:
        ValueError: A text is neither.
    """
    parts = [(text or "nan:nan").split(":") for text in texts]
    return np.array([sum(float(part) * 60.0 ** (2 - i) for i, part in enumerate(row)) for row in parts], dtype=float)


def _past_midnight(seconds: Vector) -> Vector:
    steps = np.diff(seconds, prepend=seconds[:1])
    return seconds + _DAY * np.cumsum(steps < -_HALF_DAY)


def _from_first(seconds: Vector) -> Vector:
    finite = seconds[np.isfinite(seconds)]
    return seconds - finite[0] if len(finite) else seconds


def _filled(values: Vector) -> int:
    """Number of samples up to the last that is none of the blank ones."""
    return last_set(~np.isnan(values), len(values)) + 1


def _time_factor(unit: str) -> float | None:
    """Factor from a unit to seconds; None if it is no unit of time."""
    try:
        return conversion_factor("s" if unit.lower() in _SECONDS else unit, "time") if unit else None
    except DatasetError:
        return None


def seconds_of(clock: Channel) -> Vector:
    """The times that a clock shows, from its first where they can only be dates [s]."""
    finite = np.isfinite(clock.values)
    lowest, highest = (float(end(clock.values, where=finite, initial=0.0)) for end in (np.min, np.max))
    largest = max(-lowest, highest)
    factor = _time_factor(clock.unit)
    if factor is None:
        factor = next((factor for bound, factor in _EPOCH_UNITS if largest > bound), 1.0)
    if largest * factor > _YEARS:
        return _from_first(clock.values) * factor
    return clock.values if factor == 1 else clock.values * factor
