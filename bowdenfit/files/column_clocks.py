"""Clocks of files whose channels come in groups: structures, folders, groups."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

from bowdenfit.files.channels import Channel
from bowdenfit.files.clocks import is_clock, with_clocks


def with_column_clocks(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Give each channel without a time that of the nearest time channel of its group, else of the groups around it.

    Args:
        channels: Channels with their groups before their names, as "bench/F_in" or "rec.F_in".
    """
    members: dict[str, list[int]] = {}
    for place, channel in enumerate(channels):
        members.setdefault(_group(channel.name), []).append(place)
    result = list(channels)
    for group, places in members.items():
        for around in groups_around(group + "channel"):
            lenders = [channels[place] for place in members.get(around, []) if around != group]
            clocked = _clocked([*lenders, *(result[place] for place in places)])[len(lenders) :]
            for place, channel in zip(places, clocked, strict=True):
                result[place] = channel
    return tuple(result)


def with_lone_clock(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Give the channels that have no time yet that of the only time channel of the file, wherever it stands."""
    clocks = [channel for channel in channels if is_clock(replace(channel, name=_leaf(channel.name)))]
    return tuple(_clocked(list(channels))) if len(clocks) == 1 else tuple(channels)


def groups_around(name: str) -> Iterator[str]:
    """The group of a channel and those around it, to the file as a whole: "rec.run.", "rec." and "" of "rec.run.F"."""
    while name:
        name = _group(name)
        yield name
        name = name[:-1]


def _clocked(channels: list[Channel]) -> list[Channel]:
    """The channels with their clocks, found by names without groups."""
    bare = [replace(channel, name=_leaf(channel.name)) for channel in channels]
    full = {short.name: channel.name for short, channel in zip(bare, channels, strict=True)}
    return [
        channel if before.time is not None else replace(channel, time=after.time, clock=full.get(after.clock, ""))
        for channel, before, after in zip(channels, bare, with_clocks(bare), strict=True)
    ]


def _leaf(name: str) -> str:
    """The name without its groups."""
    return re.split(r"[/.](?=[^/.]+$)", name)[-1]


def _group(name: str) -> str:
    """The groups before the name."""
    return name.removesuffix(_leaf(name))
