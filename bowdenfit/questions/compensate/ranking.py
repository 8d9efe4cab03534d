"""From the draws of a fit and what is said of a device to what may be fed forward and fed back."""

from collections.abc import Mapping

import numpy as np

from bowdenfit.description.device import Device, Known
from bowdenfit.device.coulomb import largest_safe_share, moves_by_itself, safe_shares
from bowdenfit.device.known import draw_device
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.bends.loop_draws import LoopDraws, loop_draws, range_of_bends
from bowdenfit.questions.compensate.answer import (
    BendCompensation,
    Compensation,
    FeedbackGain,
    FeedForward,
    PreloadOption,
)
from bowdenfit.questions.compensate.gain import NEEDED, estimate_feedback_gain
from bowdenfit.results.record import Record

PRELOAD_RATIOS = np.array([0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0])  # shares of the cable's own
STABILIZING = (
    "motor.friction",
    "motor.damping",
    "joint.damping",
)  # which make feeding forward safer; nothing where not stated
DEAD_ZONE, FILTER = "controller.dead_zone", "controller.filter_time"


def estimate_compensation(
    fit: Record, device: Device | None, stated: str | tuple[tuple[float, str], tuple[float, str]] | None, law: str | None,
    risk: float,
) -> tuple[Compensation, LoopDraws]:  # fmt: skip
    """The answer without simulation, and the draws of the cable that it was worked out from.

    Args:
        fit: The fit.
        device: What moves; None where nothing is said of it, so that all of it that helps counts as nothing.
        stated: Range of wrap angles.
        law: "karnopp", "active", or both.
        risk: Probability that is accepted.

    Raises:
        UsageError, DescriptionError: The fit does not tell it, or something that it needs is not stated.
    """
    if law == "active":
        (device or Device(name="-")).needed("the gain of the active law", *NEEDED)
    bends = range_of_bends(fit, stated)
    loop = loop_draws(fit, bends, device, PRELOAD_RATIOS)
    known = device.known(*STABILIZING, DEAD_ZONE, FILTER) if device is not None else {}
    motor_friction, damping, dead_zone = _draw_stabilizing(known, len(loop.friction), fit.provenance.seed)
    friction = loop.friction + motor_friction[:, None]
    margin, nominal = friction + damping[:, None], np.median(friction, axis=0)
    without_mounting = loop.without_mounting + motor_friction[:, None]
    share = largest_safe_share(margin, nominal, risk)
    constant = float(np.quantile(np.min(margin, axis=1), risk, method="lower"))
    fixed, scheduled = (
        _summarize_feed_forward(torque, margin, friction, bends)
        for torque in (np.full_like(nominal, constant), share * nominal)
    )
    gain, missing = (
        (None, []) if law == "karnopp" else _gain_or_missing(fit, device, loop, friction[:, np.argmax(nominal)], risk)
    )
    answer = Compensation(
        fit.name, device.name if device is not None else "", law, (float(np.rad2deg(bends[0])), float(np.rad2deg(bends[-1]))),
        risk, len(friction), loop.scatter, loop.scatter_from_fit, dead_zone, _chatters_below(device, known),
        fixed if law != "active" else None, scheduled if law != "active" else None,
        largest_safe_share(without_mounting + damping[:, None], np.median(without_mounting, axis=0), risk),
        tuple(_summarize_bend(bends[i], friction[:, i], share * nominal[i], constant) for i in range(len(bends))),
        gain, tuple(missing),
        tuple(
            PreloadOption(float(p), Interval.of(loop.friction_by_preload[:, i]), Interval.of(loop.slack_torque[:, i]))
            for i, p in enumerate(loop.references)
        ),
        float(np.mean(np.any(loop.preload <= 0, axis=1))),
    )  # fmt: skip
    return answer, loop


def _draw_stabilizing(known: Mapping[str, Known], n: int, seed: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Draws of F_m and of b dv [N m], and dv [rad/s]; nothing of what is not stated."""
    draws, zero = draw_device(known, n, seed), np.zeros(n)
    dead_zone = known[DEAD_ZONE].value if DEAD_ZONE in known else 0.0
    return (
        draws.get(STABILIZING[0], zero),
        sum((draws.get(name, zero) for name in STABILIZING[1:]), zero) * dead_zone,
        dead_zone,
    )


def _chatters_below(device: Device | None, known: Mapping[str, Known]) -> float | None:
    """One count of the encoder in the time of the filter [rad/s], where both are stated."""
    if device is None or device.controller.encoder_counts is None or FILTER not in known:
        return None
    return device.count / known[FILTER].value


def _gain_or_missing(
    fit: Record, device: Device | None, loop: LoopDraws, friction: np.ndarray, risk: float
) -> tuple[FeedbackGain | None, list[str]]:
    """The gain, or what would have to be stated for it."""
    if device is None:
        return None, list(NEEDED)
    missing = device.lacking(*NEEDED, *(("rope.stiffness",) if loop.stiffness is None else ()))
    return (None, missing) if missing else (estimate_feedback_gain(fit, device, loop, friction, risk), [])


def _summarize_feed_forward(
    torque: np.ndarray, margin: np.ndarray, friction: np.ndarray, bends: np.ndarray
) -> FeedForward:
    """What is fed forward by bend."""
    median = np.median(friction, axis=0)
    most = int(np.argmax(median))
    risk = float(np.mean(np.any(moves_by_itself(torque, margin, 0.0, 0.0), axis=1)))
    limits = np.bincount(np.argmin(safe_shares(margin, torque), axis=1)).argmax()
    share = float(torque[most] / max(median[most], 1e-300))
    return FeedForward(
        share, float(torque[most]), risk, float(median[most] - torque[most]), float(np.rad2deg(bends[limits]))
    )


def _summarize_bend(angle: float, friction: np.ndarray, scheduled: float, fixed: float) -> BendCompensation:
    interval = Interval.of(friction)
    left = interval.median - scheduled, interval.median - fixed
    return BendCompensation(float(np.rad2deg(angle)), interval, float(scheduled), *map(float, left))
