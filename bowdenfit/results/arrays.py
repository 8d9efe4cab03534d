"""Dataclasses of large arrays in one file, figures.npz: each is read back by itself, without what it was worked out from."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.errors import StoreError
from bowdenfit.inputs import refuse_packed, refuse_special
from bowdenfit.results.folder import replace_atomically
from bowdenfit.results.plain import deserialize, serialize

_PAGE, _ARRAY = "page", "array"


def write_arrays(path: Path, data: Mapping[str, Any]) -> None:
    """Write data whole; an array that stands in several places is written once.

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
            file, allow_pickle=False, **{_PAGE: page}, **{f"{i}": array for i, array in enumerate(arrays.values())}
        )


def read_arrays(path: Path, kinds: Mapping[str, Any]) -> dict[str, Any]:
    """What was written under some names, as far as it was.

    Args:
        path: The file.
        kinds: Annotated type of what is wanted, by name.
    """
    refuse_special(path, StoreError)
    with path.open("rb") as opened, np.load(opened) as file:  # what is opened here is closed where it is no archive
        refuse_packed(file)

        def take(data: Any) -> Any:
            if isinstance(data, list):
                return [take(one) for one in data]
            if not isinstance(data, dict):
                return data
            return file[str(data[_ARRAY])] if _ARRAY in data else {key: take(one) for key, one in data.items()}

        page = json.loads(file[_PAGE].tobytes())
        return {name: deserialize(kinds[name], take(page[name])) for name in kinds if name in page}
