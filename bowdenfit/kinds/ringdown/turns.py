"""What the turns of a ring-down say at a glance of damping and friction: where a fit begins to look."""

import numpy as np

from bowdenfit.kinds.ringdown.table import RingDownTable

_LARGE = 0.15  # of the first swing, above which one counts; smaller ones are more and more noise
_LEAST, _MOST = 0.05, 0.999  # decay of a half swing


def decay(table: RingDownTable, run: int) -> tuple[float, float]:
    r"""Decay rho of a half swing by damping, and how far f friction can hold the bar, in units of the reading.

    From the way D from one turn to the next, which needs no place of rest:

    .. math:: D_{n + 1} = \rho D_n - 2 (1 + \rho) f

    Args:
        table: The table.
        run: Number of the run.
    """
    reading = table.reading[table.run == run]
    away = reading - np.median(reading[-max(len(reading) // 10, 3) :])
    turned = np.flatnonzero(np.diff(np.sign(away)) != 0) + 1
    swings = [part for part in np.split(away, turned) if len(part)]
    peaks = np.array([part[np.argmax(np.abs(part))] for part in swings])
    ways = np.abs(np.diff(peaks))
    last = np.argmax(ways < _LARGE * ways[0]) if np.any(ways < _LARGE * ways[0]) else len(ways)
    ways = ways[: max(last, 2)]
    if len(ways) < 3:  # damping and friction share alike
        ratio = float(np.clip(ways[-1] / ways[0], _LEAST, _MOST))
        rho = np.sqrt(ratio)
        return float(rho), float((rho - ratio) * ways[0] / (2 * (1 + rho)))
    slope, shift = np.polyfit(ways[:-1], ways[1:], 1)
    rho = float(np.clip(slope, _LEAST, _MOST))
    shift = float(np.mean(ways[1:] - rho * ways[:-1])) if rho != slope else shift
    return rho, max(float(-shift) / (2 * (1 + rho)), 0.0)
