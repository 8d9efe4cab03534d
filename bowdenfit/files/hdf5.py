"""Plain HDF5 files, as scripts in Python, Julia or C write them."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

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

MOST_COLUMNS = 64  # judged: a wider table is an image or a spectrum, no set of channels
_LONGEST = 400  # characters of a path
_UNITS = ("unit", "units", "Unit", "Units")


def read(path: Path) -> ChannelFile:
    """Read every numeric vector of an HDF5 file, and every column of its numeric tables, by path.

    The unit comes from the attribute `unit` or `units`, else from the name; the time from a time channel beside it, else from
    a sampling rate (`rate`, `fs`, `sampling_rate` ...) among the attributes of the data set or of the groups around it.

    Raises:
        DatasetError: The file is damaged, too large or without numeric channels.
    """
    left_out = UnreadNames()
    with refuse_damage(path), h5py.File(path, "r") as file:
        chosen = [dataset for dataset in _datasets(file, left_out, set()) if _is_recording(dataset, left_out)]
        refuse_too_large(path, sum(2 * dataset.size * max(1, len(dataset.dtype.names or ())) for dataset in chosen))
        channels = [channel for dataset in chosen for channel in _channels(dataset, left_out)]
        settings = {path: values for dataset in chosen for path, values in _settings(dataset).items()}
    clocked, remarks = assign_interval_times(assign_group_clocks(channels), settings)
    return make_channel_file(path, "HDF5", assign_only_clock(clocked), left_out, remarks)


def _datasets(group: Any, left_out: UnreadNames, seen: set[int]) -> Iterator[Any]:
    """Yield all data sets, in the order of the file, but for what lies elsewhere."""
    for path, member in iterate_members(group, left_out, seen):
        if isinstance(member, h5py.Group):
            yield from _datasets(member, left_out, seen)
        elif isinstance(member, h5py.Dataset):
            yield member
        else:
            left_out.add(path, "they are types of numbers, not numbers")


def iterate_members(group: Any, left_out: UnreadNames, seen: set[int]) -> Iterator[tuple[str, Any]]:
    """Yield path and content of what a group holds, in the order of the file, but for links and what lies in other files.

    Args:
        group: The group.
        left_out: Takes the paths of what is left alone.
        seen: Takes the groups, by their places in the file: one that holds itself is gone through once.
    """
    for key in group:
        path = f"{group.name.rstrip('/')}/{key}".lstrip("/")
        if not isinstance(group.get(key, getlink=True), h5py.HardLink):
            left_out.add(path, "they are links")
            continue
        member = group[key]
        if isinstance(member, h5py.Dataset) and (member.external or member.is_virtual):
            left_out.add(path, "their numbers are in other files (write them into this one)")
            continue
        if isinstance(member, h5py.Group):
            place = h5py.h5o.get_info(member.id).addr
            if place in seen or len(path) > _LONGEST:
                left_out.add(path, "they are second names of a group, or lie too deep")
                continue
            seen.add(place)
        yield path, member


def _is_recording(dataset: Any, left_out: UnreadNames) -> bool:
    """Return whether a data set is a vector or a narrow table of numbers."""
    name = dataset.name.lstrip("/")
    shape = dataset.shape or ()
    numeric = is_numeric(dataset.dtype) or (dataset.dtype.names is not None and len(shape) == 1)
    if not numeric:
        left_out.add(name, "they are text, complex numbers or objects")
    elif (dataset.size or 0) < 2:  # none of a data set without a place for any
        left_out.add(name, "they are single numbers or empty")
    elif len(shape) > 2 or (len(shape) == 2 and min(shape) > MOST_COLUMNS):
        left_out.add(name, f"they have more than two dimensions or {MOST_COLUMNS} columns")
    else:
        return True
    return False


def _channels(dataset: Any, left_out: UnreadNames) -> Iterator[Channel]:
    """Yield the columns of a data set; the longer side of a table is the time."""
    name, unit = dataset.name.lstrip("/"), _unit(dataset)
    values, named = dataset[()], unit or unit_in_name(name)
    if values.dtype.names:
        yield from _fields(name, unit, values, left_out)
    else:
        for column_name, column in name_columns(name, values):
            yield Channel(column_name, named, to_floats(column))


def _fields(name: str, unit: str, values: np.ndarray, left_out: UnreadNames) -> Iterator[Channel]:
    """Yield the numeric columns of a table whose rows are records."""
    for field in values.dtype.names or ():
        if values[field].ndim == 1 and is_numeric(values[field].dtype):
            yield Channel(f"{name}.{field}", unit or unit_in_name(field), to_floats(values[field]))
        else:
            left_out.add(f"{name}.{field}", "they are text, complex numbers or objects")


def _unit(dataset: Any) -> str:
    """Return the unit that the attributes name, else nothing."""
    value = next((dataset.attrs[name] for name in _UNITS if name in dataset.attrs), "")
    value = value.flat[0] if isinstance(value, np.ndarray) and value.size == 1 else value
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
    return text.strip() if isinstance(text, str) else ""


def _settings(holder: Any) -> dict[str, dict[str, Any]]:
    """Return the attributes of a data set and of the groups around it, by their paths."""
    own = {holder.name.strip("/"): {str(name): holder.attrs[name] for name in holder.attrs}}
    return own if holder.name == "/" else own | _settings(holder.parent)
