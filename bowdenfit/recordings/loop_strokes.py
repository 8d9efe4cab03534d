"""What a recording of a pull-pull loop says of its phases: the play operator of its two sides that follows it best."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.description import Phase
from bowdenfit.errors import DatasetError, DescriptionError
from bowdenfit.recordings.preparation.hysteresis import (
    Deviations,
    Hysteresis,
    clear_of_turns,
    play_between,
    robust_cost,
    robust_minimum,
    smooth_input,
    white_noise,
)
from bowdenfit.recordings.recording import PULL, Blocks, describe_exchange
from bowdenfit.types import Flags, Labels, Vector

_FIT_BLOCKS = 2000  # more than these say no more about the loop
_LOSSES = (0.03, 0.1, 0.25, 0.45, 0.7, 0.9, 1.0)  # of the largest difference of the forces, where the fit is begun
_EXPONENTS = (0.2, 0.5, 0.8, 1.0, 1.2)  # of the one that explains that difference without preload
_LARGEST_SHARE = 0.95  # of the input force, that friction may take
_CENTER_SD = 0.25  # of the largest difference: how far load cells may disagree before the loop is believed off center
_COST_OF_NOISE = 1.5  # cost a block up to which a loop follows its recording as well as noise lets it
_CLEARLY = 0.5  # a fit the other way round must leave less than this fraction of the deviations to be believed
_SIGNIFICANT = 4.5  # what a cost must grow by, in independent blocks, where something that is told is left out: 3 sd
_CLEAR_OF_NOISE = 5.0  # standard deviations by which an output that moves must change
_OPPOSITE = -0.5  # correlation of the two forces below which one of them has its sign turned round
_LEAST = 1e-9  # that keeps a division finite
_LIMITS = np.array([[0.0, 0.0, -np.inf], [np.inf, 10.0, np.inf]])  # of loss, exponent and center


def loop_limits(force: Vector, loss: float, exponent: float) -> tuple[Vector, Vector]:
    """Return the output force while moving forward and while moving back [N]; see `bowdenfit.physics.loop.loop_band`.

    Args:
        force: Input force, of either sign [N].
        loss: 2 P Lambda [N].
        exponent: Lambda [1].
    """
    less, more = force * np.exp(-exponent), force * np.exp(exponent)
    return np.minimum(force - loss, np.minimum(less, more)), np.maximum(force + loss, np.maximum(less, more))


def fit_force_loop(force_in: Vector, force_out: Vector, taut: bool = True, slack: bool = True) -> Hysteresis:
    """Return the loop's play operator that follows the output force best, with loss, friction exponent and center free.

    Args:
        force_in, force_out: Forces, of either sign [N].
        taut: Whether force is lost while both sides are taut; else the loop has no preload.
        slack: Whether the return side may go slack; else all is lost as while both sides are taut.
    """
    thin = slice(None, None, -(-len(force_in) // _FIT_BLOCKS))
    likely = smooth_input(force_in)
    x, moved, y = force_in[thin], likely[thin], force_out[thin]
    apart, noise = float(np.quantile(np.abs(x - y), 0.98)), _noise(x, y)
    scale, free = max(apart, noise), np.array([taut, slack, True], dtype=float)

    def model(p: np.ndarray) -> Deviations:
        residuals, slopes = _residuals(x, moved, y, scale, noise, p * free)
        return residuals, slopes * free

    starts = sorted(_starts(x, y, scale), key=lambda p: robust_cost(model(p)[0]))[:2]
    best, cost = min((robust_minimum(model, start, *_LIMITS) for start in starts), key=lambda fit: fit[1])
    loss, exponent, center = (best * free * [scale, 1.0, scale]).tolist()
    deviation, followed, state = _deviation(force_in, likely, force_out, loss, exponent, center)
    state = clear_of_turns(state, likely)
    return Hysteresis(force_in, force_out, exponent, center, loss, deviation, followed, state, cost / len(x))


@dataclass(frozen=True)
class LoopStrokes:
    """The steps of `strokes.find_strokes` that a pull-pull loop takes in its own way.

    Args:
        preload: Preload that the user states, the same at all wrap angles [N].
        channels: Names of the channels of input and output force; see `RawRecording`.
    """

    preload: float | None = None
    channels: tuple[str, str] = ("", "")

    follow = staticmethod(fit_force_loop)
    unusable: ClassVar = (
        "are inside the range of the load cells; correct the limits under prepare in cable.toml, or leave the recording "
        "out."
    )

    @staticmethod
    def contact(loop: Hysteresis, velocity: Vector) -> Labels:
        """Return the contact of each block, as the operator has it."""
        del velocity
        return loop.state

    def usable(self, blocks: Blocks) -> Flags:
        """Return blocks inside the range of the load cells."""
        return ~blocks.saturated

    def refuse(self, loop: Hysteresis, velocity: Vector, file: str, name: str, by_hand: Sequence[Phase]) -> None:
        """Refuse phases to be ignored, channels that are the wrong way round, and a loop that never moves."""
        del velocity
        _check_none_ignored(by_hand, file)
        if not by_hand:
            _check_ends(loop, file, name, self.channels)
        _check_moves(loop, file, name)

    def estimate(
        self, loop: Hysteresis, state: Labels, strokes: set[int], correlation: float, name: str
    ) -> tuple[float, float, float, tuple[str, ...]]:
        """Return exponent, center, the force lost while both sides are taut, and remarks.

        Exponent and loss are NaN where the recording by itself does not tell them: without load beyond the taut branch only
        the loss is told, and the exponent is that of the stated preload.
        """
        del state
        loss, exponent = _identified(loop, correlation)
        remarks = _remarks(name, strokes, loop, loss, exponent, self.preload)
        if self.preload and np.isnan(exponent):
            exponent = loss / (2 * self.preload)
        return exponent, loop.center, loss, remarks


def _starts(x: Vector, y: Vector, scale: float) -> list[np.ndarray]:
    """Return where the fit may begin: loss over scale, exponent, center over scale."""
    share = min(scale / max(float(np.abs(x).max()), scale), _LARGEST_SHARE)
    largest = -np.log1p(-share)
    low, high = np.quantile(x - y, (0.05, 0.95))
    middle = float(low + high) / 2 / scale if low < 0 < high else 0.0
    return [
        np.array([loss, exponent * largest, center])
        for loss in _LOSSES
        for exponent in _EXPONENTS
        for center in dict.fromkeys((0.0, middle))
    ]


def _deviation(
    x: Vector, moved: Vector, y: Vector, loss: float, exponent: float, center: float
) -> tuple[Vector, Vector, Labels]:
    """Deviation of the output from the operator, the operator's output, and its contact; see `rope_strokes`."""
    limits, shown = loop_limits(moved, loss, exponent), loop_limits(x, loss, exponent)
    followed, state = play_between(*limits, float(y[0]) + center)
    followed += np.select([state > 0, state < 0], [after - before for before, after in zip(limits, shown, strict=True)])
    return y + center - followed, followed, state


def _residuals(x: Vector, moved: Vector, y: Vector, scale: float, noise: float, p: np.ndarray) -> Deviations:
    """Return deviations in units of their noise and what is known beforehand of the center, with slopes by all parameters.

    Args:
        x, moved, y: Input force as read and as it likely was, and output force [N].
        scale: Force that loss and center are measured in [N].
        noise: Standard deviation of a deviation [N].
        p: Loss over the scale, exponent, and center over the scale.
    """
    loss, exponent, center = scale * float(p[0]), float(p[1]), scale * float(p[2])
    deviation, followed, state = _deviation(x, moved, y, loss, exponent, center)
    touched = np.maximum.accumulate(np.where(state != 0, np.arange(len(state)), -1))
    known, side = touched >= 0, np.where(touched >= 0, state[touched], 0)
    at = np.where(state != 0, x, moved[touched])
    taut = np.isclose(followed, at - side * loss, rtol=0, atol=1e-9 * scale)  # else the return side is slack
    slopes = np.stack(
        [np.where(taut, scale * side, 0), np.where(taut, 0, side * np.abs(followed)), scale * known], axis=1
    )
    prior = np.sqrt(len(x)) * 0.1 / _CENTER_SD * np.array([0.0, 0.0, 1.0])
    return np.append(deviation / noise, prior @ p), np.vstack([slopes / noise, prior])


def _noise(force_in: Vector, force_out: Vector) -> float:
    """Return the standard deviation of a block's deviation while the loop moves [N]."""
    level = float(np.quantile(np.abs(force_in), 0.9))
    return float(np.hypot(max(white_noise(force_in), 1e-6 * level), max(white_noise(force_out), 1e-6 * level))) or 1e-12


def _identified(fit: Hysteresis, correlation: float) -> tuple[float, float]:
    """Return the loss and exponent, each NaN where the recording is followed as well without it."""
    enough = _SIGNIFICANT * correlation / len(fit.force_in)
    loss_identified = fit_force_loop(fit.force_in, fit.force_out, taut=False).cost - fit.cost > enough
    exponent_identified = fit_force_loop(fit.force_in, fit.force_out, slack=False).cost - fit.cost > enough
    return (fit.lost if loss_identified else float("nan")), (fit.exponent if exponent_identified else float("nan"))


def _check_none_ignored(by_hand: Sequence[Phase], file: str) -> None:
    ignored = next((span for span in by_hand if span.stroke == "ignore"), None)
    if ignored is not None:
        raise DescriptionError(
            f"cable.toml, recording {file!r}, strokes: the phase from {ignored.start:g} to {ignored.end:g} s is to be ignored, "
            "but where a loop stands depends on all that came before; write pull (moving forward), return or hold, or cut the "
            "file there."
        )


def _check_ends(fit: Hysteresis, file: str, name: str, channels: tuple[str, str]) -> None:
    """Refuse channels that are the wrong way round, or of which one counts the other direction as positive."""
    force_in, force_out = fit.force_in, fit.force_out
    if fit.cost < _COST_OF_NOISE:  # it follows to within its noise, which neither could
        return
    if np.ptp(force_in) > 0 and np.ptp(force_out) > 0 and np.corrcoef(force_in, force_out)[0, 1] < _OPPOSITE:
        option = f": --channel {shlex.quote(f'output_force={channels[1]}:-N')}" if channels[1] else ""
        raise DatasetError(
            f"{file}: in {name!r} the output force falls where the input force rises; both must be positive in the same "
            f"direction of motion. Turn the sign of one by a minus before its unit{option}."
        )
    other = fit_force_loop(force_out, force_in)
    if other.cost < _CLEARLY * fit.cost:
        raise DatasetError(
            f"{file}: in {name!r} the output force is ahead of the input force in the direction of motion, as if the loop "
            "gained force: it is the input that stands still at reversals. If input and output are swapped, "
            f"{describe_exchange(channels)}."
        )


def _check_moves(fit: Hysteresis, file: str, name: str) -> None:
    """Refuse a recording in which the output force just stands, somewhere inside the friction band."""
    force_in, force_out = fit.force_in, fit.force_out
    noise = max(white_noise(force_out), 1e-12)
    still = np.sum(np.sqrt(1 + ((force_out - np.median(force_out)) / _noise(force_in, force_out)) ** 2) - 1)
    moved = np.ptp(fit.followed) > _CLEAR_OF_NOISE * noise and fit.state.any()
    if not moved or float(still) - fit.cost * len(force_in) < _SIGNIFICANT:
        raise DatasetError(
            f"{file}: the output force of {name!r} stands still, at {np.median(force_out):.4g} N, while the input force goes "
            f"from {force_in.min():.4g} to {force_in.max():.4g} N: all inside the friction band, so that it gives only a bound "
            "on friction. Record the loop moving against a load, or write what moving it without load takes as a "
            "row of a loop table."
        )


def _remarks(
    name: str, strokes: set[int], fit: Hysteresis, loss: float, exponent: float, preload: float | None
) -> tuple[str, ...]:
    remarks = []
    if not strokes:
        remarks.append(f"{name}: no block lies safely inside a phase of motion.")
    elif len(strokes) == 1:
        which = "forward" if PULL in strokes else "back"
        remarks.append(
            f"{name} moves {which} throughout: offsets of the load cells cannot be separated from friction by it."
        )
    if len(strokes) == 2 and abs(fit.center) > _CENTER_SD * max(fit.lost, _LEAST):
        remarks.append(
            f"{name}: the input force is off the output force by {fit.center:+.3g} N in the middle of the loop; the usual "
            "cause is a load cell with a wrong tare: give [sensors] an offset_sd, or tare the recording."
        )
    if np.isnan(exponent) and preload is None and np.isfinite(loss):
        remarks.append(
            f"{name}: the return side does not go slack, so that this recording by itself determines what is lost, {loss:.3g} "
            "N = 2 x preload x friction exponent, and not the two apart; state or measure the preload, or record under more "
            "load."
        )
    return tuple(remarks)
