"""MATLAB .mat files of all versions: vectors, narrow matrices and structures of them."""

import math
import warnings
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.io

from bowdenfit.files.channels import (
    BYTES_PER_SAMPLE,
    Channel,
    ChannelFile,
    UnreadNames,
    is_numeric,
    make_channel_file,
    refuse_damage,
    refuse_too_large,
    to_floats,
)
from bowdenfit.files.clock_settings import assign_interval_times
from bowdenfit.files.clocks import assign_group_clocks, assign_only_clock
from bowdenfit.files.hdf5 import iterate_members
from bowdenfit.files.headings import unit_in_name

MOST_COLUMNS = 64  # judged: a wider matrix is an image or a spectrum, no set of channels
_TEXT = "they are text"
_CELLS = "they are cells or arrays of structures (save them as vectors of numbers)"
_OBJECTS = (
    "they are objects such as tables, timetables or function handles, which only MATLAB can decode "
    "(save their columns as plain vectors, for example with table2struct(T, 'ToScalar', true))"
)
_NUMERIC = ("double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
_VALUES, _LABELS = ("values", "Data"), ("label", "Name")  # fields of signals by Simulink and by dSPACE
_LONGEST_LABEL = 200  # judged: characters
_MOST_ELEMENTS = 1000  # judged: of an array of structures, each of which is a channel
_COMPRESSED = 15  # type number of a compressed element


@dataclass(frozen=True)
class _Variables:
    """Variables of one file, sorted into channels, settings and what is neither.

    Args:
        channels: Vectors, and the columns of narrow matrices.
        settings: Single numbers by name, such as "fs" or "rec.fs", of the file ("") and of each structure ("rec").
        left_out: Variables that are neither.
    """

    channels: list[Channel] = field(default_factory=list)
    settings: dict[str, dict[str, float]] = field(default_factory=dict)
    left_out: UnreadNames = field(default_factory=UnreadNames)

    def add(self, name: str, values: np.ndarray) -> None:
        """Sort in one array of numbers, in the orientation that MATLAB shows."""
        if values.size == 1:
            self.settings.setdefault(name.rpartition(".")[0], {})[name] = float(values.reshape(-1)[0])
        elif values.size == 0:
            self.left_out.add(name, "they are empty")
        elif values.ndim > 2 or (values.ndim == 2 and min(values.shape) > MOST_COLUMNS):
            self.left_out.add(name, f"they have more than two dimensions or {MOST_COLUMNS} columns")
        else:
            columns = _columns(name, values)
            self.channels.extend(Channel(label, unit_in_name(label), to_floats(column)) for label, column in columns)


def read(path: Path) -> ChannelFile:
    """Read the numeric vectors of a .mat file, and those in its structures as "rec.F_in".

    The columns of a matrix get the names by which MATLAB takes them, "data(:,1)"; the longer side is the time. A
    vector without a time vector of its length gets its times from a sampling rate (`fs`, `rate`, `dt` ...).

    Raises:
        DatasetError: The file is damaged, too large or without numeric vectors.
    """
    with path.open("rb") as file:
        modern = file.read(520).endswith(b"\x89HDF\r\n\x1a\n")
    with refuse_damage(path):
        variables = _read_hdf5(path) if modern else _read_classic(path)
    clocked, remarks = assign_interval_times(assign_group_clocks(variables.channels), variables.settings)
    return make_channel_file(path, "MATLAB", assign_only_clock(clocked), variables.left_out, remarks)


def _name_field(owner: str, key: str, label: str) -> str:
    """Return the name of a field of a structure: that of its signal where a label states it, as in out.signals(1).values.

    The field Data of a structure X next to Y has the times of Y, as ControlDesk of dSPACE writes them.
    """
    group, _, axis = owner.rpartition(".")
    if key not in _VALUES or not (label or axis == "X"):
        return f"{owner}.{key}"
    name = "time" if axis == "X" else label.replace(".", "_")
    return f"{group}.{name}" if group else name


def _columns(name: str, values: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield a vector, or the columns (or rows, if these are longer) of a matrix, with their names."""
    if values.ndim == 1 or min(values.shape) == 1:
        yield name, values
        return
    tall = values.shape[0] >= values.shape[1]
    for number, column in enumerate(values.T if tall else values, start=1):
        yield f"{name}(:,{number})" if tall else f"{name}({number},:)", column


def _read_classic(path: Path) -> _Variables:
    """Read a file of MATLAB 4 to 7.2, by SciPy."""
    variables = _Variables()
    with warnings.catch_warnings():
        # Names that occur twice, and objects without a name: the numbers are read all the same.
        warnings.filterwarnings("ignore", category=scipy.io.matlab.MatReadWarning)
        listing = scipy.io.whosmat(path)
        wanted = [name for name, _, kind in listing if _is_wanted(name, kind, variables.left_out)]
        refuse_too_large(path, 2 * _n_numbers(path, listing))
        loaded = scipy.io.loadmat(path, variable_names=wanted, struct_as_record=False) if wanted else {}
    for name in wanted:
        _sort_in(name, loaded.pop(name), variables)
    return variables


def _is_wanted(name: str, kind: str, left_out: UnreadNames) -> bool:
    """Return whether a variable may hold recordings, by its class."""
    if name == "__function_workspace__":
        return False
    if kind in (*_NUMERIC, "struct"):
        return True
    left_out.add(name, {"char": _TEXT, "cell": _CELLS, "sparse": "they are sparse"}.get(kind, _OBJECTS))
    return False


def _sort_in(name: str, value: Any, variables: _Variables) -> None:
    """One variable or field as SciPy decodes it; structures field by field."""
    if not isinstance(value, np.ndarray) or type(value).__name__ in ("MatlabOpaque", "MatlabFunction", "MatlabObject"):
        variables.left_out.add(name, _OBJECTS)
    elif is_numeric(value.dtype):
        variables.add(name, value)
    elif value.dtype.kind in "US":
        variables.left_out.add(name, _TEXT)
    elif value.dtype.kind == "c":
        variables.left_out.add(name, "they are complex numbers")
    elif value.dtype.kind == "O" and value.size and all(hasattr(element, "_fieldnames") for element in value.flat):
        _sort_in_structures(name, value, variables)
    else:
        variables.left_out.add(name, _CELLS if value.dtype.kind == "O" else _OBJECTS)


def _sort_in_structures(name: str, value: np.ndarray, variables: _Variables) -> None:
    """Fields of a structure, or of each in an array of them."""
    for number, structure in enumerate(value.flat, start=1):
        owner = name if value.size == 1 else f"{name}({number})"
        texts = [np.asarray(getattr(structure, key)) for key in _LABELS if key in structure._fieldnames]
        label = next((str(text.flat[0]) for text in texts if text.dtype.kind == "U" and text.size), "")
        for key in structure._fieldnames:
            _sort_in(_name_field(owner, key, label), getattr(structure, key), variables)


def _n_numbers(path: Path, listing: list[tuple[str, tuple[int, ...], str]]) -> int:
    """Return how many numbers the variables hold: by their shapes, and structures by their size when unpacked."""
    plain = sum(math.prod(shape) for _, shape, kind in listing if kind in _NUMERIC)
    structures = sum(
        size // BYTES_PER_SAMPLE
        for (_, _, kind), size in zip(listing, _element_bytes(path), strict=False)
        if kind == "struct"
    )
    return plain + structures


def _element_bytes(path: Path) -> list[int]:
    """Return the size of each variable of a MATLAB 5 file when unpacked, by the headers alone; nothing for MATLAB 4."""
    with path.open("rb") as file:
        head = file.read(128)
        if not head.startswith(b"MATLAB 5"):
            return []
        order = "<" if head[126:128] == b"IM" else ">"
        sizes = []
        while len(tag := file.read(8)) == 8:
            kind, size = (int(number) for number in np.frombuffer(tag, dtype=f"{order}u4"))
            start = file.tell()
            sizes.append(_unpacked_size(file.read(64), order) if kind == _COMPRESSED else size)
            file.seek(start + size)
    return sizes


def _unpacked_size(start: bytes, order: str) -> int:
    """Return the size of a compressed element, which stands at its start."""
    tag = zlib.decompressobj().decompress(start, 8)
    return int(np.frombuffer(tag, dtype=f"{order}u4")[1]) if len(tag) == 8 else 0


def _read_hdf5(path: Path) -> _Variables:
    """Read a file of MATLAB 7.3, which is HDF5 with all arrays transposed."""
    variables = _Variables()
    with h5py.File(path, "r") as file:
        stored = list(_iterate_stored(file, variables.left_out, set()))
        refuse_too_large(path, 2 * sum(dataset.size for _, dataset in stored))
        for name, dataset in stored:
            variables.add(name, np.zeros(0) if "MATLAB_empty" in dataset.attrs else dataset[()].T)
    return variables


def _iterate_stored(group: Any, left_out: UnreadNames, seen: set[int], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the numeric variables of a group and of the structures in it, with their names."""
    for path, member in iterate_members(group, left_out, seen):
        key = path.rpartition("/")[2]
        name, kind = f"{prefix}{key}", _class(member)
        if key.startswith("#"):
            continue
        if isinstance(member, h5py.Datatype) or getattr(member, "shape", ()) is None:
            left_out.add(name, "they are types of numbers, or empty")
        elif "MATLAB_object_decode" in member.attrs or kind == "function_handle":
            left_out.add(name, _OBJECTS)
        elif "MATLAB_sparse" in member.attrs:
            left_out.add(name, "they are sparse")
        elif isinstance(member, h5py.Group):
            yield from _iterate_elements(member, name)
            yield from _iterate_stored(member, left_out, seen, f"{name}.")
        elif kind == "char":
            left_out.add(name, _TEXT)
        elif prefix and key in (*_VALUES, *_LABELS) and member.dtype.kind == "O" and kind != "cell":
            continue  # a field of an array of structures
        elif is_numeric(member.dtype) and kind in ("", *_NUMERIC):
            yield _name_field(prefix[:-1], key, _read_label(group)) if prefix else name, member
        else:
            left_out.add(name, _CELLS if member.dtype.kind == "O" else "they are complex numbers or objects")


def _iterate_elements(structures: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Yield the numbers in each of an array of structures, whose fields are lists of references."""
    for key in _VALUES:
        field_ = structures.get(key)
        if not isinstance(field_, h5py.Dataset) or h5py.check_ref_dtype(field_.dtype) is None or _class(field_) == "cell":
            continue
        labels = next((structures[key] for key in _LABELS if isinstance(structures.get(key), h5py.Dataset)), None)
        texts = labels[()].ravel() if labels is not None and labels.size == field_.size else [None] * field_.size
        for i, (reference, text) in enumerate(zip(field_[()].ravel()[:_MOST_ELEMENTS], texts, strict=False), start=1):
            member = structures.file[reference] if reference else None
            if isinstance(member, h5py.Dataset) and is_numeric(member.dtype) and not (member.external or member.is_virtual):
                yield _name_field(f"{name}({i})", key, _read_text(structures.file, text)), member


def _read_label(structure: Any) -> str:
    """Return the label of a single structure; empty without one."""
    return next((_read_text(None, structure[key]) for key in _LABELS if isinstance(structure.get(key), h5py.Dataset)), "")


def _read_text(file: Any, stored: Any) -> str:
    """Return a text, or one that a reference leads to; empty where it is none."""
    if isinstance(stored, h5py.Reference):
        stored = file[stored] if stored else None
    if not isinstance(stored, h5py.Dataset) or _class(stored) != "char" or not 0 < stored.size <= _LONGEST_LABEL:
        return ""
    return "".join(map(chr, stored[()].T.ravel(order="F")))


def _class(member: Any) -> str:
    """Return the class that MATLAB noted on a variable; empty for fields without a note."""
    noted = member.attrs.get("MATLAB_class", b"")
    return noted.decode("ascii", "replace") if isinstance(noted, bytes) else str(noted)
