"""Dataclasses to JSON and back, and dataclasses of large arrays to a file (figures.npz) and back."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from bowdenfit.inputs import open_arrays
from bowdenfit.outputs import replace_atomically
from bowdenfit.results.folder import kept_file
from bowdenfit.types import Flags, Labels, Matrix


def plain_data(answer: Any) -> Any:
    """Return an answer as plain data for JSON; numbers that are not finite become None.

    A dataclass gives its fields, or what its `JSON` lists: names of attributes and methods, where `...` stands for all fields,
    ("key", "name") for an attribute under another key, and "name?" for one that is left out where it is None.

    Args:
        answer: Dataclasses, dictionaries, sequences, arrays and numbers, one in the other.
    """
    return _plain(answer, keep=False)


def serialize(data: Any, put: Callable[[np.ndarray], Any] | None = None) -> Any:
    """Return data so that `deserialize` restores them: all fields of dataclasses, and infinity as a word.

    Args:
        data: As for `plain`.
        put: Gives what stands for an array; its numbers do if omitted.
    """
    return _plain(data, keep=True, put=put)


def _plain(data: Any, keep: bool, put: Callable[[np.ndarray], Any] | None = None) -> Any:
    if is_dataclass(data):
        data = dict(_attributes(data, (...,) if keep else getattr(data, "JSON", (...,))))
    if isinstance(data, Mapping):
        return {key: _plain(value, keep, put) for key, value in data.items()}
    if put and isinstance(data, np.ndarray):
        return put(data)
    if isinstance(data, np.ndarray | np.generic):
        as_it_is = data.dtype.kind in "biu" or (data.dtype.kind == "f" and np.isfinite(data).all())
        data = data.tolist()
        if as_it_is:
            return data
    if isinstance(data, list | tuple):
        return [_plain(value, keep, put) for value in data]
    if isinstance(data, float) and not np.isfinite(data):
        return None if np.isnan(data) or not keep else "Infinity" if data > 0 else "-Infinity"
    return data


def _attributes(data: Any, listed: Iterable[Any]) -> Iterator[tuple[str, Any]]:
    """Yield keys and values of a dataclass."""
    for entry in listed:
        if entry is ...:
            yield from ((f.name, getattr(data, f.name)) for f in fields(data))
            continue
        key, name = entry if isinstance(entry, tuple) else (entry.removesuffix("?"), entry)
        value = getattr(data, name.removesuffix("?"))
        value = value() if callable(value) else value
        if value is not None or not name.endswith("?"):
            yield key, value


def deserialize(kind: Any, value: Any) -> Any:
    """Return a value of an annotated type from what `serialize` made of it.

    Args:
        kind: The type; of an optional one the first that is not None.
        value: Plain data, in which arrays may stand as they are.

    Raises:
        TypeError: Something is not of its type.
    """
    if isinstance(value, np.ndarray):
        return value
    if value is None and NoneType in get_args(kind):
        return None
    parts, origin = [part for part in get_args(kind) if part is not NoneType], get_origin(kind)
    if isinstance(kind, UnionType):
        return deserialize(parts[0], value)
    for container, plain in ((dict, dict), (Mapping, dict), (list, list), (tuple, list)):
        if origin is container and not isinstance(value, plain):
            raise TypeError(f"{_shorten(value)} is no {plain.__name__}")
    if origin in (dict, Mapping):
        return {key: deserialize(parts[1], item) for key, item in value.items()}
    if origin is list:
        return [deserialize(parts[0], item) for item in value]
    if origin is tuple:
        types = [parts[0]] * len(value) if Ellipsis in parts else parts
        return tuple(deserialize(part, item) for part, item in zip(types, value, strict=True))
    if isinstance(kind, type) and is_dataclass(kind):
        if not isinstance(value, dict):
            raise TypeError(f"{_shorten(value)} is no {kind.__name__}")
        hints = get_type_hints(kind)
        required = [f.name for f in fields(kind) if f.default is MISSING and f.default_factory is MISSING]
        present = [f.name for f in fields(kind) if f.name in value or f.name in required]  # others are newer than the data
        return kind(**{name: deserialize(hints[name], value[name]) for name in present})
    if np.ndarray in (kind, origin, getattr(kind, "array_type", None)):
        return _array(kind, value)
    if kind in (str, int, bool) and type(value) is not kind:
        raise TypeError(f"{_shorten(value)} is no {kind.__name__}")
    return _number(value) if kind is float else value


def values_by_key(data: Any) -> dict[str, Any]:
    """Return the fields of a dataclass by name."""
    return dict(_attributes(data, (...,)))


def _array(kind: Any, value: list[Any]) -> np.ndarray:
    if kind in (Labels, Flags):
        return np.array(value, dtype=int if kind is Labels else bool)
    if kind is np.ndarray and value and all(isinstance(item, str) for item in value):
        return np.array(value)
    array = np.array(value, dtype=float)
    return array.reshape(len(value), len(value[0]) if value else 0) if kind is Matrix else array


def _number(value: Any) -> float:
    if type(value) not in (int, float) and value not in (None, "Infinity", "-Infinity"):
        raise TypeError(f"{_shorten(value)} is not a number")
    return float("nan") if value is None else float(value)


def _shorten(value: Any) -> str:
    return f"{str(value)[:40]!r}"


_PAGE, _ARRAY = "page", "array"
_LARGEST_PAGE = 40e6  # bytes; a judgement: far more than figures need
_UNSEEN = 1e-3  # of a standard deviation that rounding may move a draw by; far less than the Monte Carlo error
_SD_OF_QUARTILES = 0.741  # standard deviation of a normal distribution, of the distance between its quartiles


def to_single(values: np.ndarray) -> np.ndarray:
    """Return numbers as they are in single precision, in the type that they have; infinite where they are too large for it."""
    with np.errstate(over="ignore"):
        return values.astype(np.float32).astype(values.dtype) if values.dtype == np.float64 else values


def round_draws(values: np.ndarray) -> np.ndarray:
    """Round draws (chain, draw, ...) of each quantity to single precision, where that hides nothing of how they scatter.

    They stay as they are where rounding moves a draw by more than a thousandth of a standard deviation, as it does in a
    posterior that is very narrow for its distance from 0, and where a number is not finite or too large for single precision.
    """
    rounded = to_single(values)
    if values.dtype != np.float64 or values.ndim < 2 or not values.size:
        return rounded
    with np.errstate(over="ignore", invalid="ignore"):
        moved = np.abs(rounded - values).max(axis=(0, 1))
        seen = ~(moved <= _UNSEEN * values.std(axis=(0, 1)))
    return np.where(seen, values, rounded)


def coarsen_predictions(values: np.ndarray) -> np.ndarray:
    """Round what draws predict of each reading (chain, draw, reading) to multiples of a power of two, which pack well.

    The multiple moves no prediction by more than a thousandth of the standard deviation of most, which is worked out from
    the quartiles, so that a few far out do not hide how the others scatter. A reading of which half of the predictions are
    the same, or a quartile is not finite, stays as it is. Parameters are not rounded so, because combinations of them may be
    known far better than each alone.
    """
    if values.dtype != np.float64 or values.ndim < 2 or not values.size:
        return values
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        low, high = np.quantile(values, (0.25, 0.75), axis=(0, 1))
        multiple = 2.0 ** np.floor(np.log2(2 * _UNSEEN * _SD_OF_QUARTILES * (high - low)))
        is_scattered = np.isfinite(multiple) & (multiple > 0)
        step = np.where(is_scattered, multiple, 1.0)
        return np.where(is_scattered & np.isfinite(values), step * np.round(values / step), values)


def pack_single(values: np.ndarray) -> np.ndarray:
    """Return 64-bit numbers as 32-bit ones where that changes none of them; anything else as it is."""
    is_single = values.dtype == np.float64 and np.array_equal(values, to_single(values), equal_nan=True)
    return values.astype(np.float32) if is_single else values


def unpack_single(values: np.ndarray) -> np.ndarray:
    """Return what `pack_single` was given."""
    return values.astype(np.float64) if values.dtype == np.float32 else values


def write_arrays(path: Path, data: Mapping[str, Any]) -> None:
    """Write data whole; an array that stands in several places is written once, in single precision where that loses nothing.

    Args:
        path: The file.
        data: Dataclasses, tuples and lists of them, by name.
    """
    arrays: dict[int, np.ndarray] = {}

    def put(array: np.ndarray) -> dict[str, int]:
        arrays[id(array)] = array
        return {_ARRAY: list(arrays).index(id(array))}

    page = np.frombuffer(json.dumps({name: serialize(one, put) for name, one in data.items()}).encode(), dtype=np.uint8)
    with replace_atomically(path) as temporary, temporary.open("wb") as file:
        np.savez(
            file, allow_pickle=False, **{_PAGE: page}, **{f"{i}": pack_single(array) for i, array in enumerate(arrays.values())}
        )


def read_arrays(path: Path, kinds: Mapping[str, Any]) -> dict[str, Any]:
    """Return what was written under some names, as far as it was.

    Args:
        path: The file.
        kinds: Annotated type of what is wanted, by name.
    """
    with kept_file(path.parent, path.name).open("rb") as opened, open_arrays(opened) as file:
        arrays = {name: unpack_single(file[name]) for name in file.files}  # each once, however often it is named

        def take(data: Any) -> Any:
            if isinstance(data, list):
                return [take(one) for one in data]
            if not isinstance(data, dict):
                return data
            return arrays[str(data[_ARRAY])] if _ARRAY in data else {key: take(one) for key, one in data.items()}

        if arrays[_PAGE].nbytes > _LARGEST_PAGE:
            raise ValueError("its page is too large")
        page = json.loads(arrays[_PAGE].tobytes())
        return {name: deserialize(kinds[name], take(page[name])) for name in kinds if name in page}
