"""posterior.nc: arrays in the layout that ArviZ reads, written and read as HDF5; loads no model."""

import io
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from textwrap import shorten
from typing import Any, TypeAlias
from urllib.parse import unquote

import h5netcdf
import h5py
import numpy as np

from bowdenfit.errors import DatasetError, StoreError
from bowdenfit.files.isolation import Limits, call_isolated
from bowdenfit.outputs import replace_atomically
from bowdenfit.results.folder import kept_file
from bowdenfit.results.serialization import pack_single, unpack_single

Groups: TypeAlias = dict[str, dict[str, np.ndarray]]
Coordinates: TypeAlias = Mapping[str, tuple[str, ...]]
# Bytes and seconds of CPU that reading may take, some times what honest files take: they hold plain arrays.
_MEMORY, _MEMORY_PER_BYTE, _SECONDS, _SECONDS_PER_BYTE = 1 << 29, 8, 5.0, 5e-7
_PACKED = {"compression": "gzip", "shuffle": True}  # draws of walkers that stay where they are repeat
_FEW = 100  # numbers that are not packed, because the tables of what is packed take as much room; a judgement
_MOST_PACKED = 100  # times the size of a file that one of its arrays may have; a judgement
EXPECTED, DERIVED = "expected_", "derived"  # the group of what follows from parameters, and may be infinite


def write_groups(
    path: Path,
    groups: Groups,
    labels: Coordinates,
    attributes: Mapping[str, str],
    variable_attributes: Mapping[str, Mapping[str, str]],
) -> None:
    """Write posterior.nc whole.

    Args:
        path: The file.
        groups, labels, attributes, variable_attributes: See `make_netcdf`.
    """
    contents = make_netcdf(groups, labels, attributes, variable_attributes)  # HDF5 does not survive a disk that is full
    with replace_atomically(path) as temporary:
        temporary.write_bytes(contents.getbuffer())


def make_netcdf(
    groups: Groups,
    labels: Coordinates,
    attributes: Mapping[str, str],
    variable_attributes: Mapping[str, Mapping[str, str]],
) -> io.BytesIO:
    """Return the contents of posterior.nc, in memory.

    Args:
        groups: Arrays by group and name; draws have chains first, then the draws of each, then readings.
        labels: Labels of the readings, by table.
        attributes: Attributes of the file.
        variable_attributes: Unit, symbol and meaning by variable.
    """
    in_memory = io.BytesIO()
    with h5netcdf.File(in_memory, "w") as file:
        file.attrs.update(attributes)
        for name, variables in groups.items():
            group = file.create_group(name)
            for variable, values in variables.items():
                attached = variable_attributes.get(variable, {}) if name in ("posterior", "prior", DERIVED) else {}
                of_readings = labels.get(variable.removeprefix(EXPECTED))
                _write(group, _key(variable), np.asarray(values), of_readings, attached)
    in_memory.seek(0)
    return in_memory


def _write(
    group: Any, name: str, values: np.ndarray, labels: Sequence[str] | None, attributes: Mapping[str, str]
) -> None:
    """Write a variable with its dimensions in xarray's layout, without loading xarray, which takes a third of a second."""
    of_readings = [] if labels is None else [f"{name.removeprefix(EXPECTED)}_reading"]
    draw_axes = values.ndim - len(of_readings)
    dimensions = [*("chain", "draw")[:draw_axes], *(f"{name}_dim_{i}" for i in range(draw_axes - 2)), *of_readings]
    for dimension, length in zip(dimensions, values.shape, strict=True):
        if dimension not in group.dimensions:
            group.dimensions[dimension] = length
            if labels is not None and dimension in of_readings:
                group.create_variable(dimension, (dimension,), dtype=h5py.string_dtype(), data=np.array(labels, dtype=object))
            else:
                numbers = np.arange(length, dtype=np.int32)
                group.create_variable(dimension, (dimension,), data=numbers, **(_PACKED if length > _FEW else {}))
    flags = values.dtype == bool
    variable = group.create_variable(name, dimensions, data=_shorten(values), **(_PACKED if values.size > 1 else {}))
    variable.attrs.update({**attributes, **({"dtype": "bool"} if flags else {})})


def _shorten(values: np.ndarray) -> np.ndarray:
    """Return an array as it is written: flags as integers, and numbers of single precision in as many bytes as these take."""
    return values.astype("int8") if values.dtype == bool else pack_single(values)


def _key(name: str) -> str:
    """Return a name encoded for HDF5, where "/" would be a group, "." this group, and trailing spaces be lost."""
    encoded = name.replace("%", "%25").replace("/", "%2F")
    return encoded.replace(".", "%2E") if not encoded.strip(".") else encoded


def read_groups(path: Path) -> Groups:
    """Return the arrays of posterior.nc by group and name, in the order in which they were written.

    Read as the HDF5 that they are: the libraries that give them their labels take longer to load than the draws to read.
    """
    with h5py.File(kept_file(path.parent, path.name)) as file:
        groups = {name: own_member(file, name) for name in _members(file)}
        return {
            name: {unquote(key): _array(member) for key in _members(group) if not _is_label(member := own_member(group, key))}
            for name, group in groups.items()
            if isinstance(group, h5py.Group)
        }


def read_groups_isolated(path: Path) -> Groups:
    """Return what `read_groups` does, from a process with limits: over some damaged files HDF5 goes in circles for ever.

    Raises:
        StoreError: The file is damaged, or asks for more memory or time than fits its size.
    """
    groups: Groups = read_own_hdf5(path, "bowdenfit.results.netcdf:read_groups")
    return groups


def read_own_hdf5(path: Path, reader: str) -> Any:
    """Return what a function makes of an HDF5 file of a results folder, called in a process with limits.

    Args:
        path: The file.
        reader: Module and name of the function, of which whatever it raises is damage.

    Raises:
        StoreError: The file is damaged, or asks for more memory or time than fits its size.
    """
    kept_file(path.parent, path.name)
    size = path.stat().st_size
    limits = Limits(_MEMORY + _MEMORY_PER_BYTE * size, _SECONDS + _SECONDS_PER_BYTE * size)
    try:
        return call_isolated(path, "bowdenfit.results.netcdf:_read_or_refuse", reader, limits=limits)
    except DatasetError as error:
        reason, _, _ = str(error).partition(":")
        raise StoreError(f"{path} is damaged ({reason}); fit again, or restore the folder from a copy.") from None


def _read_or_refuse(path: Path, reader: str) -> Any:
    """Call a reader by its name; runs in the other process.

    Raises:
        DatasetError: Whatever the reader stumbles over.
    """
    module, _, name = reader.partition(":")
    try:
        return getattr(import_module(module), name)(path)
    except MemoryError:
        raise
    except Exception as error:
        raise DatasetError(shorten(str(error), 200)) from None


def own_member(group: h5py.Group, name: str) -> Any:
    """Return a member of a group that lies in this very file and is not larger than it.

    Args:
        group: Group of an open file.
        name: The name.

    Raises:
        ValueError: It lies elsewhere, or says that it is larger than the file.
        KeyError: Nothing has that name.
    """
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise ValueError(f"{name} lies in another file or place")
    member = group[name]
    if isinstance(member, h5py.Dataset):
        if member.external or member.is_virtual:
            raise ValueError(f"{name} lies in other files")
        if member.nbytes > _MOST_PACKED * group.file.id.get_filesize():
            raise ValueError(f"{name} says that it is far larger than its file")
    return member


def _members(group: h5py.Group) -> list[str]:
    """Return names in a group, in the order in which they were written."""
    names: list[bytes] = []
    group.id.links.iterate(names.append, idx_type=h5py.h5.INDEX_CRT_ORDER)
    return [name.decode() for name in names]


def _is_label(member: h5py.Dataset) -> bool:
    """Return whether a dataset labels a dimension of others."""
    return bool(h5py.h5ds.is_scale(member.id))


def _array(member: h5py.Dataset) -> np.ndarray:
    return unpack_single(np.asarray(member[()], dtype=bool if member.attrs.get("dtype") == "bool" else None))
