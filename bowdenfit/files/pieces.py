"""Long series a piece at a time, so that working with a recording takes hardly more memory than keeping it.

`PIECE` changes no result beyond rounding. What more than `PLENTY` samples say of noise and the like, that many say as well:
they are taken in stretches, evenly from all of the series.
"""

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from bowdenfit.types import Flags, Vector

PIECE = 1 << 20  # samples at once
PLENTY = 1 << 20  # samples that tell a scale
_STRETCHES = 256  # judged: so many places of a series that slow changes of its noise average out


class Filled:
    """A series with straight lines over the samples that are not good, worked out where it is looked at."""

    def __init__(self, values: Vector, good: Flags) -> None:
        """Keep the series, and which of its samples are good."""
        self._values, self._good = values, good

    def __len__(self) -> int:
        """Number of samples."""
        return len(self._values)

    def __getitem__(self, part: slice) -> Float[np.ndarray, " some"]:
        """Return some of it, in double precision."""
        start, stop, _ = part.indices(len(self))
        some, good = to_floats(self._values, slice(start, stop)), self._good[start:stop]
        if good.all():
            return some
        first, behind = max(last_set(self._good, start), 0), min(first_set(self._good, stop) + 1, len(self))
        positions = first + np.flatnonzero(self._good[first:behind])
        return np.interp(np.arange(start, stop), positions, np.asarray(self._values[positions], dtype=float))


Series: TypeAlias = Float[np.ndarray, " all"] | Filled
"""Samples, in memory or worked out where they are looked at."""


def split_pieces(samples: int) -> Iterator[slice]:
    """Return pieces of a series, one after the other."""
    return (slice(start, min(start + PIECE, samples)) for start in range(0, samples, PIECE))


def to_floats(values: Series, part: slice) -> Float[np.ndarray, " some"]:
    """Return some of a series in double precision."""
    return np.asarray(values[part], dtype=float)


def subsample(values: Series) -> Float[np.ndarray, " some"]:
    """Return a series, or stretches of it that are plenty to tell its noise, in double precision."""
    if len(values) <= PLENTY:
        return to_floats(values, slice(0, len(values)))
    length = PLENTY // _STRETCHES
    starts = np.linspace(0, len(values) - length, _STRETCHES).astype(int)
    return np.concatenate([to_floats(values, slice(start, start + length)) for start in starts])


def never_falls(values: Float[np.ndarray, " all"], strictly: bool = False) -> bool:
    """Return whether a series never falls, or rises with every sample."""
    for part in split_pieces(len(values)):
        some = values[part.start : part.stop + 1]
        if not np.all(some[1:] > some[:-1] if strictly else some[1:] >= some[:-1]):
            return False
    return True


def have_same_numbers(one: Float[np.ndarray, " one"], other: Float[np.ndarray, " other"]) -> bool:
    """Return whether two series have the same numbers, and miss the same."""
    if one is other:
        return True
    return len(one) == len(other) and all(
        np.array_equal(one[part], other[part], equal_nan=True) for part in split_pieces(len(one))
    )


def last_set(flags: Flags, stop: int) -> int:
    """Return the place of the last flag before `stop` that is set; -1 if none is."""
    width = 64
    while stop > 0:
        start = max(stop - width, 0)
        positions = np.flatnonzero(flags[start:stop])
        if len(positions):
            return start + int(positions[-1])
        stop, width = start, PIECE
    return -1


def first_set(flags: Flags, start: int) -> int:
    """Return the place of the first flag from `start` on that is set; their number if none is."""
    width = 64
    while start < len(flags):
        positions = np.flatnonzero(flags[start : start + width])
        if len(positions):
            return start + int(positions[0])
        start, width = start + width, PIECE
    return len(flags)


def interpolate(
    time: Float[np.ndarray, " wanted"],
    at: Vector,
    values: Vector,
    there: Flags,
    outside: float | None = None,
) -> Float[np.ndarray, " wanted"]:
    """Return straight lines between the samples that are there, as precise as these are kept.

    Args:
        time: Times wanted, rising.
        at: Times of the samples, rising.
        values: The samples.
        there: Which of them are there; at least one.
        outside: What stands before the first and behind the last of them; these themselves if omitted.
    """
    result = np.empty(len(time), dtype=values.dtype)
    for part in split_pieces(len(time)):
        wanted = time[part]
        first = max(last_set(there, int(np.searchsorted(at, wanted[0], side="right"))), 0)
        stop = min(first_set(there, int(np.searchsorted(at, wanted[-1], side="left"))) + 1, len(at))
        near = there[first:stop]
        result[part] = np.interp(
            wanted, at[first:stop][near], to_floats(values, slice(first, stop))[near], outside, outside
        )
    return result
