"""Clocks of files whose channels come in groups: structures, folders, groups."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

from bowdenfit.files.channels import Channel
from bowdenfit.files.clocks import is_clock, seconds_of, with_clocks


def with_column_clocks(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Give each channel without a time that of the nearest time channel of its group, else of the groups around it.

    Args:
        channels: Channels with their groups before their names, as "bench/F_in" or "rec.F_in".
    """
    return with_clocks(channels, groups_around)


def with_only_clock(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Give the channels that have no time yet that of the only time channel of the file, wherever it stands."""
    clocks = [c for c in channels if is_clock(replace(c, name=c.name.removeprefix(_group(c.name))))]
    if len(clocks) != 1:
        return tuple(channels)
    (clock,), seconds = clocks, seconds_of(clocks[0])
    return tuple(
        channel
        if channel is clock or channel.time is not None or len(channel.values) != len(seconds)
        else replace(channel, time=seconds, clock=clock.name)
        for channel in channels
    )


def groups_around(name: str) -> Iterator[str]:
    """The group of a channel and those around it, to the file as a whole: "rec.run.", "rec." and "" of "rec.run.F"."""
    while name:
        name = _group(name)
        yield name
        name = name[:-1]


def _group(name: str) -> str:
    """The groups before the name."""
    return name.removesuffix(re.split(r"[/.](?=[^/.]+$)", name)[-1])
