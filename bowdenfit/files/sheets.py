"""From the columns of a sheet, whatever program wrote it, to channels."""

import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bowdenfit.files.channels import Channel, with_unique_names
from bowdenfit.files.clocks import names_time, with_clocks, without_tails
from bowdenfit.files.layout import Layout, is_index
from bowdenfit.types import Vector
from bowdenfit.words import shown

_RATE = re.compile(
    r"(?P<what>(?:sampl\w*|scan\w*|acquisition|acq\.?|data|logging)[\s_-]*(?:rate|freq\w*|interval|period|time|step)|rate|"
    r"f_?s|abtast\w*|delta_x|d_?t)\b[^\d+\-]{0,20}?(?P<value>\d+(?:[.,]\d+)?(?:e[+-]?\d+)?)\s*"
    r"(?P<unit>[kM]?Hz|[kM]?S/s|s/s|sps|[mµun]?s\b|sec\w*)?",
    re.IGNORECASE,
)
_PERIODS = ("interval", "period", "time", "step", "delta_x", "dt", "d_t")
_SECONDS = ("s", "ms", "us", "µs", "ns")
_FACTORS = {"khz": 1e3, "mhz": 1e6, "ks/s": 1e3, "ms/s": 1e6, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}


def channels_of(layout: Layout, columns: Sequence[Vector | None]) -> tuple[tuple[Channel, ...], list[str]]:
    """The channels of a sheet with their clocks, and remarks on the columns left out.

    Args:
        layout: Its headings.
        columns: The numbers of each column; None for one of text.
    """
    kept: list[Channel] = []
    remarks: list[str] = []
    nameless = [not heading.name for heading in layout.headings]
    for i, (heading, values) in enumerate(zip(layout.headings, columns, strict=True)):
        place = f"Column {i + 1}" if nameless[i] else f"The column {shown(heading.name)}"
        if values is None:
            remarks.append(f"{place} holds text and was left out.")
        elif not np.isfinite(values).any():
            remarks += [] if nameless[i] else [f"{place} holds no numbers and was left out."]
        elif nameless[i] and layout.named and is_index(values):
            remarks.append(f"{place} has no heading, only counts the rows and was left out.")
        else:
            kept.append(Channel(layout.name(i), heading.unit, values))
    if not layout.named:
        remarks.append("There is no row of headings; the columns are called column1, column2, ... from the left.")
    named = with_unique_names(kept)
    return with_clocks(without_tails(named)) if named else (), remarks


def stated_rate(lines: Sequence[str]) -> tuple[float, str] | None:
    """Sampling rate [Hz] that the lines over the data state, and the line; None if none does."""
    for line in lines:
        plain = " ".join(line.replace('"', " ").strip(" #%;,\t\r\n").split())
        match = _RATE.search(plain)
        if match is None:
            continue
        value = float(match["value"].replace(",", ".")) * _FACTORS.get((match["unit"] or "").lower(), 1.0)
        period = match["what"].lower().endswith(_PERIODS) or (match["unit"] or "").lower() in _SECONDS
        if value > 0 and math.isfinite(value):
            return (1 / value if period else value), plain[:80]
    return None


def with_rate(channels: Sequence[Channel], lines: Sequence[str]) -> tuple[tuple[Channel, ...], list[str]]:
    """Channels without any clock get one from the sampling rate stated over the data, and a remark says so."""
    if any(channel.time is not None or names_time(channel.name) for channel in channels):
        return tuple(channels), []
    stated = stated_rate(lines)
    if stated is None:
        return tuple(channels), []
    rate, line = stated
    timed = tuple(replace(c, time=np.arange(len(c.values)) / rate, clock=line) for c in channels)
    return timed, [f"There is no column of time; it comes from the line {shown(line)}: {rate:g} samples a second."]
