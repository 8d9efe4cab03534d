"""Phases of a recording, found by the play operator instead of by hand: pulling, switching, returning.

Of a pull-pull loop: moving forward, between, moving back.
"""

from collections.abc import Sequence

import numpy as np

from bowdenfit.description import Description, Phase
from bowdenfit.errors import DatasetError
from bowdenfit.recordings.loop_strokes import LoopStrokes
from bowdenfit.recordings.preparation.noise import autocorrelation
from bowdenfit.recordings.recording import PULL, RETURN, SWITCH, Blocks, Strokes
from bowdenfit.recordings.rope_strokes import RopeStrokes, refuse_dead
from bowdenfit.types import Flags, Labels, Vector

_FEWEST = 10  # judged: blocks in which strokes can be found
_STILL = 0.05  # fraction of the typical speed below which the rope is taken to stand still
_STEADY = 0.2  # relative change of speed from one block to the next up to which a block is of one speed
_SIGNS: dict[str, int] = {"pull": PULL, "return": RETURN, "hold": SWITCH, "ignore": SWITCH}
_ROPE = RopeStrokes()


def find_strokes(
    blocks: Blocks, file: str, name: str, by_hand: Sequence[Phase] = (), cable: RopeStrokes | LoopStrokes = _ROPE
) -> Strokes:
    """Return the phases of a recording, from the contact state of the play operator and, where recorded, the velocity.

    Args:
        blocks: The prepared recording.
        file: File name, for errors.
        name: Name of the recording, for errors and remarks.
        by_hand: Phases set by the user, of a loop "pull" for moving forward and "return" for back; they replace what is
            found where they apply.
        cable: A single rope, unless stated.

    Raises:
        DatasetError: It is too short, or a phase lies outside it; hardly anything is under tension, or a loop never moves;
            input and output are swapped, or one has its sign turned round; only the return is there.
        DescriptionError: A phase of a loop is to be ignored.
    """
    _check_length(blocks, file, name, by_hand)
    usable = cable.usable(blocks)
    if usable.sum() < _FEWEST:
        refuse_dead(blocks.input_force, blocks.output_force, file, name)
        raise DatasetError(f"{file}: only {int(usable.sum())} blocks of the recording {name!r} {cable.unusable}")
    loop = cable.follow(blocks.input_force[usable], blocks.output_force[usable])
    sliding = cable.contact(loop, blocks.velocity[usable])
    velocity = _toward_motor(blocks.velocity[usable], sliding)
    cable.refuse(loop, velocity, file, name, by_hand)
    state, contact = np.zeros((2, len(usable)), dtype=int)
    state[usable], contact[usable] = sliding, loop.state
    moving = np.ones(len(usable), dtype=bool)
    moving[usable] = _moving_steadily(velocity, sliding)
    used = _inside_sliding(state) & usable & moving
    if by_hand:
        used &= ~np.any([_inside(blocks.time, span) for span in by_hand], axis=0)
    for span in by_hand:
        inside = _inside(blocks.time, span)
        state[inside] = contact[inside] = _SIGNS[span.stroke]
        used[inside] = usable[inside] & (_SIGNS[span.stroke] != SWITCH)
    correlation = correlation_time(loop.deviation[used[usable]]) if used.any() else 1.0
    estimates = cable.estimate(loop, state[usable], set(state[used].tolist()), correlation, name)
    exponent, center, lost, remarks = estimates
    noise = float(1.4826 * np.median(np.abs(loop.deviation))) or 1e-12
    return Strokes(state, contact, used, exponent, center, lost, noise, correlation, bool(by_hand), remarks)


def cable_of(description: Description) -> RopeStrokes | LoopStrokes:
    """Return what the strokes of a cable are found by; of a loop with the preload that is stated for all wrap angles."""
    if description.cable.kind != "loop":
        return RopeStrokes(description.gain_sd or 0.0, description.shifts_forces)
    stated = description.preload.value
    return LoopStrokes(stated.to("force") if stated is not None and not description.preload_follows_stretch else None)


def _toward_motor(velocity: Vector, state: Labels) -> Vector:
    """Velocity with pulling as positive, whatever sign the recording gives it."""
    pulling = velocity[(state == PULL) & np.isfinite(velocity)]
    return -velocity if len(pulling) and np.median(pulling) < 0 else velocity


def _moving_steadily(velocity: Vector, state: Labels) -> Flags:
    """Return where the rope moves the way its contact says, and steadily; everywhere without a velocity.

    While the motor speeds up or slows down, a block is of several speeds, and at the slow end of a stroke the rope may stand
    already.
    """
    finite = np.isfinite(velocity)
    if not finite.any():
        return np.ones(len(velocity), dtype=bool)
    speeds = np.abs(velocity[finite])
    typical = float(np.median(speeds[speeds > speeds.max() * _STILL])) if speeds.max() > 0 else np.inf
    steady = np.abs(np.gradient(velocity)) < _STEADY * np.abs(velocity) if len(velocity) > 1 else finite
    return ~finite | ((velocity * state > _STILL * typical) & steady)


def _inside_sliding(state: Labels) -> Flags:
    """Return blocks whose neighbors on both sides are in the same contact: where one phase meets the next, a block is both."""
    same = np.diff(state) == 0
    return (state != SWITCH) & np.append(True, same) & np.append(same, True)


def _inside(time: Vector, span: Phase) -> Flags:
    return (time >= span.start) & (time <= span.end)


def _check_length(blocks: Blocks, file: str, name: str, by_hand: Sequence[Phase]) -> None:
    """Refuse a recording of a few blocks, and phases that lie outside it."""
    if len(blocks.time) < _FEWEST:
        raise DatasetError(
            f"{file}: the recording {name!r} has too few blocks to identify its phases ({len(blocks.time)}, at least {_FEWEST} "
            "needed); the usual cause is a block that is too long or a recording that was cut off: state a shorter block "
            "under prepare in cable.toml, or leave the recording out."
        )
    for span in by_hand:
        if not _inside(blocks.time, span).any():
            raise DatasetError(
                f"{file}: the phase {span.stroke!r} of {name!r} from {span.start:g} to {span.end:g} s holds nothing of the "
                f"recording, which goes from {blocks.time[0]:.4g} to {blocks.time[-1]:.4g} s; correct its start and end in "
                "cable.toml, in seconds of the recording's clock."
            )


def correlation_time(deviation: Vector) -> float:
    """Return the integrated autocorrelation time of a series in steps, at least 1: how many of its values say as much as one.

    The sum of autocorrelations in pairs, until a pair is no longer positive.

    References:
        Geyer 1992, "Practical Markov chain Monte Carlo" (Statistical Science 7).
    """
    n, correlation = len(deviation), autocorrelation(deviation)
    if n < 8 or correlation is None:
        return 1.0
    pairs = correlation[0 : n - 1 : 2] + correlation[1:n:2]
    stop = int(np.argmax(pairs <= 0)) if np.any(pairs <= 0) else len(pairs)
    return float(np.clip(2 * pairs[:stop].sum() - 1, 1.0, n / 4))
