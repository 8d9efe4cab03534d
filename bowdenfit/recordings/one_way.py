"""Recordings without a reversal, which have no loop to find: where their rope slides, and whether the output follows at all."""

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.recordings.preparation.play import Hysteresis, white_noise
from bowdenfit.recordings.recording import PULL, RETURN
from bowdenfit.types import Flags, Labels, Vector

_WINDOW, _SHARE = 5, 20  # least blocks on both sides over which a force must rise, and one part in so many of the recording
_CLEARLY = 4.0  # standard errors by which it must
_STILL = 0.05  # fraction of the highest speed below which the motor is taken to stand
_FOLLOWS = 0.5  # correlation, and share of the output's variance that friction explains, below both of which it does not
_CHANGES = 3.0  # spread of the input, in units of its noise, from which the output could follow it


def sliding_one_way(loop: Hysteresis, velocity: Vector) -> Labels:
    """Contact of each block, where the recording has no reversal also by other signs that the rope slides.

    Friction lets the output rise while the input does only if the rope slides; and where the motor moves, the rope slides
    whatever the forces do, even if they stay the same.

    Args:
        loop: What the play operator finds.
        velocity: Of the blocks; NaN where it is not known.
    """
    ratio = np.log(loop.force_in / loop.force_out)
    if RETURN in loop.state or np.median(ratio) <= 0:
        return loop.state
    known = np.isfinite(velocity)
    highest = np.max(np.abs(velocity[known]), initial=0.0)
    signs = set(np.sign(velocity[known & (np.abs(velocity) > _STILL * highest)]).tolist())
    if len(signs) > 1:
        return loop.state
    moves = known & (np.abs(velocity) > _STILL * highest) if highest > 0 else np.zeros(len(known), dtype=bool)
    rises = _rises(loop.force_in) & _rises(loop.force_out)
    return np.where(moves | (rises & ~known), PULL, loop.state)


def _rises(force: Vector) -> Flags:
    """Where a force is clearly higher after a block than before it."""
    n, window = len(force), max(_WINDOW, len(force) // _SHARE)
    if n <= 2 * window:
        return np.zeros(n, dtype=bool)
    total = np.append(0.0, np.cumsum(force))
    at = np.arange(n)
    before, after = np.maximum(at - window, 0), np.minimum(at + window, n - 1)
    earlier = (total[at + 1] - total[before]) / (at + 1 - before)
    later = (total[after + 1] - total[at]) / (after + 1 - at)
    error = white_noise(force) * np.sqrt(1 / (at + 1 - before) + 1 / (after + 1 - at))
    return later - earlier > _CLEARLY * error


def refuse_dead(force_in: Vector, force_out: Vector, file: str, name: str, loop: Hysteresis | None = None) -> None:
    """Refuse a recording whose output does not follow its input.

    Args:
        force_in, force_out: Forces of the blocks [N].
        file: File name, for errors.
        name: Name of the recording.
        loop: What friction makes of them; None where that cannot be said.

    Raises:
        DatasetError: The input changes, the output hardly with it, and friction does not explain it.
    """
    if len(force_in) < 2 or not np.std(force_in) > _CHANGES * white_noise(force_in):
        return
    alike = float(np.corrcoef(force_in, force_out)[0, 1]) if np.ptp(force_out) > 0 else 0.0
    spread = float(np.var(np.log(loop.force_out + loop.lost))) if loop is not None else 0.0
    explained = 1 - float(np.var(loop.deviation)) / spread if loop is not None and spread > 0 else 0.0
    if alike < _FOLLOWS and explained < _FOLLOWS:
        raise DatasetError(
            f"{file}: the output does not follow the input in {name!r}: correlation {alike:.2f}, while the input goes from "
            f"{force_in.min():.4g} to {force_in.max():.4g} N and the output from {force_out.min():.4g} to "
            f"{force_out.max():.4g} N. The usual causes are a dead load cell, another channel than meant, and a rope that "
            "never slid; map the right channel, or leave the recording out."
        )
