"""The channels of one file, and what all readers of recordings share.

A channel is a named column of numbers as the acquisition wrote it, before anybody says what it means. Readers load their
library with `load_library`, refuse damaged and huge files in a sentence, and end with `make_channel_file`, which says what was
left out.
"""

import importlib
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.pieces import subsample
from bowdenfit.files.row_account import RowAccount
from bowdenfit.types import Vector
from bowdenfit.words import quoted

_INDEX = re.compile(r"[\[(][\d:,]+[\])]$")  # of a column, behind the name of its array

LARGEST_BYTES = 2 * 1024**3
"""The most that the samples of one file may need in memory, as 64-bit numbers [bytes]."""

BYTES_PER_SAMPLE = 8


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
        start: Unix time at which `time` is 0, or a clock's `values` are [s]; since midnight where a clock has times of day;
            None where the file does not date the samples.
    """

    name: str
    unit: str
    values: Vector
    time: Vector | None = None
    clock: str = ""
    start: float | None = None

    @property
    def rate(self) -> float:
        """Samples a second, by the median step of the clock; NaN without one."""
        if self.time is None or len(self.time) < 2:
            return float("nan")
        step = float(np.median(np.diff(subsample(self.time))))
        return 1 / step if step > 0 else float("nan")


@dataclass(frozen=True)
class ChannelFile:
    """All channels of one file.

    Args:
        path: The file.
        kind: Format in words: "CSV", "MATLAB", "TDMS", "MDF4", "ROS bag", "Parquet", "HDF5", "Excel workbook".
        channels: Its numeric channels, in the order of the file.
        remarks: Omissions and assumptions, in sentences.
        account: Where its rows went; None where it has none.
    """

    path: Path
    kind: str
    channels: tuple[Channel, ...]
    remarks: tuple[str, ...] = ()
    account: RowAccount | None = None


def make_names_unique(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Return channels with numbers behind names that stand there twice: "45", "45 (2)", "45 (3)"."""
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


@dataclass(frozen=True)
class UnreadNames:
    """Names of what was not read, by reason.

    Args:
        names: The names under each reason; filled while reading.
    """

    names: dict[str, list[str]] = field(default_factory=dict)

    def add(self, name: str, why: str) -> None:
        """Note that `name` was left out; `why` completes the words "left out because"."""
        self.names.setdefault(why, []).append(name)

    def remarks(self) -> tuple[str, ...]:
        """Return one sentence for each reason."""
        return tuple(f"Left out because {reason}: {quoted(tuple(names))}." for reason, names in self.names.items())


def make_channel_file(
    path: Path, kind: str, channels: Sequence[Channel], left_out: UnreadNames, remarks: Sequence[str] = ()
) -> ChannelFile:
    """Return the channels of a file with unique names, and the remarks on it.

    Raises:
        DatasetError: There is no numeric channel at all.
    """
    sentences = (*remarks, *left_out.remarks())
    if not channels:
        raise DatasetError(
            f"{path.name} holds no recording that can be read: no channel with several numbers. "
            f"{' '.join((*sentences, ''))}Save the forces as plain vectors of numbers, or export the recording as CSV."
        )
    aligned, apart = align_starts(channels)
    if apart:
        sentences = (*sentences, f"{path.name}: its channels start up to {apart:.3g} s apart; each is read at its own times.")
    return ChannelFile(path, kind, make_names_unique(aligned), sentences)


def align_starts(channels: Sequence[Channel]) -> tuple[list[Channel], float]:
    """Channels whose times count from the same moment, where they overlap and say when they start; and how far starts differ.

    Channels that do not overlap, such as those of runs one after the other, keep their times.
    """
    dated = [channel for channel in channels if channel.time is not None and channel.start is not None and len(channel.time)]
    aligned, first, end, apart = {id(channel): channel for channel in channels}, 0.0, -np.inf, 0.0
    for channel in sorted(dated, key=lambda channel: channel.start or 0.0):
        assert channel.time is not None and channel.start is not None  # chosen above
        first = channel.start if channel.start > end else first
        end, late = max(end, channel.start + float(channel.time[-1])), channel.start - first
        if late > 0:
            aligned[id(channel)], apart = replace(channel, time=channel.time + late, start=first), max(apart, late)
    return list(aligned.values()), apart


def load_library(module: str, kind: str) -> ModuleType:
    """Return the library called `module`.

    Args:
        module: Name to import, such as "openpyxl" or "pyarrow.parquet".
        kind: Format that it reads, for the error: ".xlsx", "Parquet".

    Raises:
        DatasetError: It is not installed, or cannot be loaded.
    """
    library = module.partition(".")[0]
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError:
        raise DatasetError(
            f"reading {kind} files needs {library}, which is not installed; install it with pip install 'bowdenfit[lab]'."
        ) from None
    except ImportError as error:
        raise DatasetError(
            f"reading {kind} files needs {library}, which is installed but cannot be loaded ({error}); install it again with "
            "pip install --force-reinstall 'bowdenfit[lab]'."
        ) from error


@contextmanager
def refuse_damage(path: Path) -> Iterator[None]:
    """Turn whatever a library raises about a file into one sentence about that file.

    Raises:
        DatasetError: The library could not read the file.
    """
    try:
        yield
    except DatasetError:
        raise
    except MemoryError as error:
        raise DatasetError(
            f"{path.name} does not fit into the memory of this computer; save only the channels of the load cells, or "
            "cut the recording."
        ) from error
    # The libraries raise anything on damaged files: OSError, ValueError, KeyError, struct.error, zlib.error, their own.
    except Exception as error:
        raise truncation_error(path, f"{type(error).__name__}: {error}") from error


def truncation_error(path: Path, seen: str) -> DatasetError:
    """Return the refusal of a file that ends early or is damaged."""
    words = " ".join(seen.replace(f"{path.parent}/", "").split()).rstrip(".:")
    words = words if len(words) <= 160 else f"{words[:157]}..."
    return DatasetError(f"{path.name} is cut off or damaged ({words}); copy it again from the acquisition computer.")


def describe_truncation(path: Path, what: str) -> str:
    """Return the remark on a file that ends early, of which `what` could be read."""
    return (
        f"{path.name} is cut off: {what} were kept. Copy the file again from the acquisition computer if there should be "
        "more."
    )


def refuse_too_large(path: Path, n_samples: int, what: str = "") -> None:
    """Refuse a file before it fills the memory.

    Args:
        path: The file.
        n_samples: How many numbers it holds, times included.
        what: Name of the rows, for the error.

    Raises:
        DatasetError: They would need more than `LARGEST_BYTES`.
    """
    needed = n_samples * BYTES_PER_SAMPLE
    if needed > LARGEST_BYTES:
        raise DatasetError(
            f"{path.name} holds {needed / 1024**3:.3g} GiB of numbers{what}, more than the {LARGEST_BYTES / 1024**3:.3g} GiB "
            "that are read at once; save only the channels of the load cells, cut the recording, or decimate it."
        )


def refuse_larger(path: Path, most: int, remedy: str) -> None:
    """Refuse a file of more than so many bytes, whatever it holds.

    Raises:
        DatasetError: It has more.
    """
    size = path.stat().st_size
    if size > most:
        raise DatasetError(
            f"{path.name} has {size / 1024**3:.3g} GiB, more than the {most / 1024**3:.3g} GiB that can be read; {remedy}."
        )


def is_numeric(dtype: np.dtype[Any]) -> bool:
    """Return whether values of this type are real numbers, or true and false."""
    return dtype.kind in "fiub"


def name_columns(name: str, values: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield a vector, or the columns (or rows, if these are longer) of a matrix, with names such as "data[:,0]".

    Args:
        name: Name of the array.
        values: The array, of one or two dimensions.
    """
    if values.ndim == 1 or min(values.shape) == 1:
        yield name, values
        return
    tall = values.shape[0] >= values.shape[1]
    for number, column in enumerate(values.T if tall else values):
        yield f"{name}[:,{number}]" if tall else f"{name}[{number},:]", column


def strip_index(name: str) -> str:
    """Return the name of an array by that of one of its columns, such as "data" of "data[:,0]" or "data(:,1)"."""
    return _INDEX.sub("", name)


def to_floats(values: np.ndarray) -> Vector:
    """Return samples as 64-bit floats, one after the other in memory."""
    return np.ascontiguousarray(values, dtype=np.float64).reshape(-1)
