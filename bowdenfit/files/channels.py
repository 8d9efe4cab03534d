"""The channels of one file as the acquisition wrote them: named columns of numbers, before anybody says what they mean."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bowdenfit.files.pieces import sample
from bowdenfit.files.row_account import RowAccount
from bowdenfit.types import Vector


@dataclass(frozen=True)
class Channel:
    """One column of numbers.

    Args:
        name: Its name, unique in the file; a sheet, group, topic or message before it where the file has several, such
            as "Sheet1/ai0".
        unit: Its unit as the file says; empty where it says nothing.
        values: Samples, NaN where a sample is missing; in the unit of the file.
        time: Time of each sample [s], where the file has a clock for this channel; else None.
        clock: Name of the channel or setting that the time comes from; empty without one.
    """

    name: str
    unit: str
    values: Vector
    time: Vector | None = None
    clock: str = ""

    @property
    def rate(self) -> float:
        """Samples a second, by the median step of the clock; NaN without one."""
        if self.time is None or len(self.time) < 2:
            return float("nan")
        step = float(np.median(np.diff(sample(self.time))))
        return 1 / step if step > 0 else float("nan")


@dataclass(frozen=True)
class ChannelFile:
    """All channels of one file.

    Args:
        path: The file.
        kind: What it is, for people: "CSV", "MATLAB", "TDMS", "MDF4", "ROS bag", "Parquet", "HDF5", "Excel workbook".
        channels: Its numeric channels, in the order of the file.
        remarks: What was left out or assumed, in sentences.
        account: Where its rows went; None where it has none.
    """

    path: Path
    kind: str
    channels: tuple[Channel, ...]
    remarks: tuple[str, ...] = ()
    account: RowAccount | None = None


def with_unique_names(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Channels with numbers behind names that stand there twice: "45", "45 (2)", "45 (3)"."""
    taken = {channel.name for channel in channels}
    seen: set[str] = set()
    named = []
    for channel in channels:
        name, count = channel.name, 1
        while name in seen or (count > 1 and name in taken):
            count += 1
            name = f"{channel.name} ({count})"
        seen.add(name)
        named.append(replace(channel, name=name))
    return tuple(named)
