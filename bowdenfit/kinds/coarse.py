"""Readings so coarse that whatever was read again is alike to the last digit, so that how much they scatter does not show.

Who reads 14 N six times off a display of whole newtons knows the force to half a newton, and no better for the repetition; a
scatter that is found from what differs between readings is nothing then.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from bowdenfit.kinds.copies import NO_NOISE
from bowdenfit.types import Vector

_LEAST_AGAIN = 3  # readings of something that was read before, all alike, from which on the display is said to do that
_POWERS = range(6, -10, -1)  # of ten, that a last digit may be
_WHOLE = 1e-9  # as part of a multiple of a last digit, by which it may be off


@dataclass(frozen=True)
class Coarse:
    """What is known of such a table.

    Args:
        file: What the table is called.
        last_digit: Of its readings, with their unit.
        sd: Standard deviation that it gives a reading, in the same.
        different: Number of readings that do not repeat another.
        log_sd: Standard deviation that the last digit gives the logarithm of a reading, on average of these.
    """

    file: str
    last_digit: str
    sd: float
    different: int
    log_sd: float


def coarse(file: str, settings: Float[np.ndarray, "rows settings"], read: Vector, unit: str = "") -> Coarse | None:
    """What is known of a table whose repeated readings are all alike; None of any other.

    Args:
        file: What the table is called.
        settings: Under what each row was read, but for the mounting; NaN where one is not known.
        read: What was read; readings of 0 and below are not looked at, as their logarithms are not.
        unit: Its unit.
    """
    if not np.all(read > 0):
        return None
    settings = np.nan_to_num(settings, nan=-1.0)
    places = np.unique(settings, axis=0)
    different = np.unique(np.column_stack([settings, read]), axis=0)[:, -1]
    if len(different) > len(places) or len(read) - len(places) < _LEAST_AGAIN:
        return None
    last_digit = _last_digit(read)
    if last_digit == 0:
        return None
    log_sd = float(np.sqrt(np.mean((last_digit / different) ** 2) / 12))
    return Coarse(file, f"{last_digit:g} {unit}".strip(), last_digit / 12**0.5, len(different), log_sd)


def _last_digit(values: Vector) -> float:
    """The largest power of ten of which all values are multiples; 0 if there is none that a display would show."""
    for power in _POWERS:
        if 10.0**power < NO_NOISE * values.max():
            break
        counts = values / 10.0**power
        if np.all(np.abs(counts - np.round(counts)) < _WHOLE * counts):
            return 10.0**power
    return 0.0
