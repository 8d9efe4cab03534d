"""Arrays that NumPy saved: .npz archives of several, and single ones in .npy."""

import math
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

from bowdenfit.files.channels import (
    Channel,
    ChannelFile,
    UnreadNames,
    is_numeric,
    make_channel_file,
    name_columns,
    refuse_damage,
    refuse_too_large,
    to_floats,
)
from bowdenfit.files.clock_settings import assign_interval_times
from bowdenfit.files.clocks import assign_group_clocks, assign_only_clock
from bowdenfit.files.headings import unit_in_name

_MOST_COLUMNS = 64  # judged: a wider array is an image or a spectrum, no set of channels


def read(path: Path) -> ChannelFile:
    """Read every numeric vector, the columns of narrow arrays as "data[:,0]", and the fields of records as "data.F_in".

    Single numbers are settings, such as a sampling rate `fs`. Objects and text are left out and never unpickled.

    Raises:
        DatasetError: The file is damaged, too large or without numeric vectors.
    """
    left_out, channels, settings = UnreadNames(), list[Channel](), dict[str, float]()
    with refuse_damage(path):
        refuse_too_large(path, 2 * _n_numbers(path))
        for name, values in _arrays(path, left_out):
            if values.size == 1 and is_numeric(values.dtype):
                settings[name] = float(values.reshape(-1)[0])
            else:
                channels += _channels(name, values, left_out)
    clocked, remarks = assign_interval_times(assign_group_clocks(channels), {"": settings})
    return make_channel_file(path, "NumPy", assign_only_clock(clocked), left_out, remarks)


def _n_numbers(path: Path) -> int:
    """Return how many numbers a file holds when unpacked, by what its list of members says."""
    if not zipfile.is_zipfile(path):
        return path.stat().st_size // 8
    with zipfile.ZipFile(path) as archive:
        return sum(member.file_size for member in archive.infolist()) // 8


def _arrays(path: Path, left_out: UnreadNames) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the arrays of a file with their names, but for objects."""
    if not zipfile.is_zipfile(path):
        yield path.stem, np.load(path, allow_pickle=False)
        return
    with zipfile.ZipFile(path) as archive:
        for member in archive.infolist():
            name = member.filename.removesuffix(".npy")
            with archive.open(member) as file:
                version = npy.read_magic(file)
                shape, _, dtype = npy.read_array_header_1_0(file) if version == (1, 0) else npy.read_array_header_2_0(file)
            if dtype.hasobject or math.prod(shape) == 0:
                left_out.add(name, "they are objects or empty")
                continue
            with archive.open(member) as file:
                yield name, npy.read_array(file, allow_pickle=False)


def _channels(name: str, values: np.ndarray, left_out: UnreadNames) -> Iterator[Channel]:
    """Yield the channels of an array; the longer side of a table is the time."""
    if values.dtype.names and values.ndim == 1:
        for field in values.dtype.names:
            yield from _channels(f"{name}.{field}", values[field], left_out)
    elif not is_numeric(values.dtype):
        left_out.add(name, "they are text, complex numbers or objects")
    elif values.ndim > 2 or (values.ndim == 2 and min(values.shape) > _MOST_COLUMNS):
        left_out.add(name, f"they have more than two dimensions or {_MOST_COLUMNS} columns")
    else:
        for column_name, column in name_columns(name, values):
            yield Channel(column_name, unit_in_name(name), to_floats(column))
