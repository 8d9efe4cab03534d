"""The checker of types at run time: beartype, by which the functions of some rooms are checked in the tests.

A number is a number: where `float` is written NumPy's and JAX's scalars may stand too, as Python's own arithmetic and the type
checkers have it. Where an array of JAX is written one of NumPy may stand, as in JAX's own functions; its shape is checked.
"""

from functools import reduce
from operator import or_
from types import UnionType
from typing import Any, Union, get_args, get_origin

import jax
import numpy as np
from beartype import BeartypeConf, FrozenDict, beartype
from jax.core import Tracer

_INTEGER = int | np.integer | jax.Array
_NUMBER = float | np.floating | _INTEGER
_BOOLEAN = bool | np.bool_ | jax.Array
_ARRAY = jax.Array | Tracer | np.ndarray | np.generic | float | int
_CONFIGURATION = BeartypeConf(
    hint_overrides=FrozenDict(
        {float: _NUMBER, int: _INTEGER, bool: _BOOLEAN, jax.Array: _ARRAY, np.ndarray: np.ndarray | np.generic}
    )
)


def check(function: Any) -> Any:
    """The function, checked at every call: jaxtyping's shapes and Python's types.

    Jaxtyping has two functions checked for each, one before the call, of the parameters, which returns `Any`; and one after
    it, of the parameters once more and of what was returned. Of that only the latter is looked at.
    """
    if not isinstance(function, type):
        hints = function.__annotations__
        looked_at = hints if hints.get("return", Any) is Any else {"return": hints["return"]}
        function.__annotations__ = {name: _of_either(hint) for name, hint in looked_at.items()}
    return beartype(function, conf=_CONFIGURATION)


def _of_either(hint: Any) -> Any:
    """A hint, of arrays of JAX or NumPy where it is of JAX's."""
    if get_origin(hint) in (Union, UnionType):
        return reduce(or_, (_of_either(part) for part in get_args(hint)))
    if getattr(hint, "array_type", None) is jax.Array:
        return hint.dtype[jax.Array | np.ndarray | np.generic, hint.dim_str]
    return hint
