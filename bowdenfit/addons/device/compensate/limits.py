"""Limits of friction compensation over the draws of a fit and of a device: feed-forward torque and feedback gain."""

from collections.abc import Mapping

import numpy as np

from bowdenfit.addons.device.compensate.answer import (
    ROPE_DAMPING,
    BendCompensation,
    Compensation,
    FeedbackGain,
    FeedForward,
    PreloadOption,
)
from bowdenfit.addons.device.description import Device, Known
from bowdenfit.addons.device.loop import LoopDraws, draw_loop, read_bends
from bowdenfit.addons.device.mechanics.limits import (
    LinearDevice,
    largest_safe_share,
    moves_by_itself,
    passive_gain,
    safe_shares,
    stable_gain,
)
from bowdenfit.addons.device.mechanics.plant import draw_device
from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.inference.interval import Interval
from bowdenfit.results.record import Record
from bowdenfit.units import conversion_factor

# Shares of the cable's own preload that are looked at; a judgement.
PRELOAD_RATIOS = np.array([0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0])
_PLANT = ("motor.inertia", "motor.damping", "joint.inertia", "joint.damping", "rope.damping", "controller.sample_time")
NEEDED = (*_PLANT, "motor.friction")
STABILIZING = (
    "motor.friction",
    "motor.damping",
    "joint.damping",
)  # which make feeding forward safer; nothing where not stated
DEAD_ZONE, FILTER = "controller.dead_zone", "controller.filter_time"
INTEGRAL = "controller.integral_gain"
HAND = ("hand.inertia", "hand.damping", "hand.stiffness")
_DRAWS, _BENDS = 300, 3  # draws, and bends among them; so many that a 5 % quantile has 15 draws below it
_NAMES = {
    "motor.inertia": "the inertia of the motor",
    "motor.damping": "the damping of the motor",
    "joint.inertia": "the inertia of the joint",
    "joint.damping": "the damping of the joint",
    "rope.damping": ROPE_DAMPING,
    "controller.sample_time": "the sampling time",
    "stiffness": "the stiffness of the cable",
}
_DEFAULT_RISK = (5.0, "%")  # of moving by itself, the accepted probability if none is given; a judgement


def parse_risk(risk: tuple[float, str] | None) -> float:
    """Return an accepted probability between 0.1 % and 50 %; 5 % if none is given.

    Raises:
        UsageError: It is no such probability.
    """
    value, unit = risk or _DEFAULT_RISK
    try:
        share = value * conversion_factor(unit, "ratio")
    except DatasetError as error:
        raise UsageError(f"--risk: {error}.") from None
    if not 0.001 <= share <= 0.5:
        raise UsageError(f"--risk {value:g}{unit} is not between 0.1 % and 50 %; write it as 5%.")
    return float(share)


def estimate_feedback_gain(
    fit: Record, device: Device, loop: LoopDraws, friction: np.ndarray, risk: float
) -> FeedbackGain:
    """Estimate the largest gain, without a hand on the device and with one.

    Args:
        fit: The fit.
        device: The device, which says all of `NEEDED`.
        loop: Draws of the cable, with its stiffness.
        friction: Friction of loop and motor where it is most, by draw [N m].
        risk: Probability that is accepted.

    Raises:
        DescriptionError: A quantity that is measured has no sd.
    """
    assert loop.stiffness is not None
    n = len(loop.stiffness)
    has_hand = device.states(*HAND)
    stated = device.needed("the gain of the active law", *NEEDED, *(HAND if has_hand else ()))
    integral = device.known(INTEGRAL)[INTEGRAL].value if device.states(INTEGRAL) else 0.0
    draws = draw_device(stated, n, fit.provenance.seed)
    picked = np.unique(np.linspace(0, n - 1, min(n, _DRAWS)).round().astype(int))
    bends = np.unique(np.linspace(0, len(loop.bends) - 1, _BENDS).round().astype(int))
    picked_draws = {name: values[picked] for name, values in draws.items()}
    stiffness = loop.stiffness[np.ix_(picked, bends)]
    free = _linearize(picked_draws, stiffness, integral, with_hand=False)
    stable = stable_gain(free).reshape(stiffness.shape)
    with_hand = (
        stable_gain(_linearize(picked_draws, stiffness, integral, with_hand=True)).reshape(stiffness.shape)
        if has_hand
        else stable
    )
    least = np.minimum(stable, with_hand).min(axis=1)
    passive = passive_gain(free, stable.ravel()).reshape(stiffness.shape).min(axis=1)
    safe = float(np.quantile(least, risk, method="lower"))
    inputs = {name: picked_draws[name] for name in _PLANT} | {
        "stiffness": stiffness[np.arange(len(picked)), stable.argmin(axis=1)]
    }
    shares = {name: _squared_rank_correlation(values, least) for name, values in inputs.items()}
    decisive = max(shares, key=lambda name: shares[name])
    return FeedbackGain(
        safe,
        Interval.of(least),
        float(np.quantile(passive, risk, method="lower")),
        has_hand,
        _NAMES[decisive],
        shares[decisive],
        Interval.of(friction / (1 + safe)),
        bool(stated["rope.damping"].draws),
        integral,
    )


def _linearize(draws: dict[str, np.ndarray], stiffness: np.ndarray, integral: float, with_hand: bool) -> LinearDevice:
    """Return the linear device of every draw and bend while its rope slides, with or without the hand."""
    repeated = {name: np.repeat(values, stiffness.shape[1]) for name, values in draws.items()}
    inertia, damping, hand = (repeated[name] if with_hand else 0.0 for name in HAND)
    return LinearDevice(
        stiffness.ravel(),
        repeated["rope.damping"],
        repeated["motor.inertia"],
        repeated["joint.inertia"] + inertia,
        repeated["motor.damping"],
        repeated["joint.damping"] + damping,
        np.broadcast_to(hand, stiffness.size),
        repeated["controller.sample_time"],
        integral,
    )


def _squared_rank_correlation(values: np.ndarray, gain: np.ndarray) -> float:
    """Return the squared rank correlation: the share of the scatter of a gain that an input explains."""
    if np.ptp(values) == 0 or np.ptp(gain) == 0:
        return 0.0
    first, second = (np.argsort(np.argsort(sample)).astype(float) for sample in (values, gain))
    return float(np.corrcoef(first, second)[0, 1] ** 2)


def estimate_compensation(
    fit: Record, device: Device | None, stated: str | tuple[tuple[float, str], tuple[float, str]] | None, law: str | None,
    risk: float,
) -> tuple[Compensation, LoopDraws]:  # fmt: skip
    """Estimate the compensation without simulation; return also the draws of the cable.

    Args:
        fit: The fit.
        device: Motor, joint and hand; None if nothing is stated, so that nothing of it helps.
        stated: Range of wrap angles.
        law: "karnopp", "active", or both.
        risk: Probability that is accepted.

    Raises:
        UsageError, DescriptionError: The fit does not tell it, or something that it needs is not stated.
    """
    if law == "active":
        (device or Device(name="-")).needed("the gain of the active law", *NEEDED)
    bends = read_bends(fit, stated)
    loop = draw_loop(fit, bends, device, PRELOAD_RATIOS)
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
        (None, []) if law == "karnopp" else _try_feedback_gain(fit, device, loop, friction[:, np.argmax(nominal)], risk)
    )
    answer = Compensation(
        fit.name, device.name if device is not None else "", law, (float(np.rad2deg(bends[0])), float(np.rad2deg(bends[-1]))),
        risk, len(friction), loop.scatter, loop.scatter_from_fit, dead_zone, _compute_chatter_speed(device, known),
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
    """Draw motor friction F_m and b dv [N m], and return dv [rad/s]; 0 for what is not stated."""
    draws, zero = draw_device(known, n, seed), np.zeros(n)
    dead_zone = known[DEAD_ZONE].value if DEAD_ZONE in known else 0.0
    return (
        draws.get(STABILIZING[0], zero),
        sum((draws.get(name, zero) for name in STABILIZING[1:]), zero) * dead_zone,
        dead_zone,
    )


def _compute_chatter_speed(device: Device | None, known: Mapping[str, Known]) -> float | None:
    """Return one count of the encoder per time constant of the filter [rad/s], where both are stated."""
    if device is None or device.controller.encoder_counts is None or FILTER not in known:
        return None
    return device.count / known[FILTER].value


def _try_feedback_gain(
    fit: Record, device: Device | None, loop: LoopDraws, friction: np.ndarray, risk: float
) -> tuple[FeedbackGain | None, list[str]]:
    """Return the feedback gain, or the keys that are missing for it."""
    if device is None:
        return None, list(NEEDED)
    missing = device.lacking(*NEEDED, *(("rope.stiffness",) if loop.stiffness is None else ()))
    return (None, missing) if missing else (estimate_feedback_gain(fit, device, loop, friction, risk), [])


def _summarize_feed_forward(
    torque: np.ndarray, margin: np.ndarray, friction: np.ndarray, bends: np.ndarray
) -> FeedForward:
    """Summarize a feed-forward torque by bend."""
    median = np.median(friction, axis=0)
    largest = int(np.argmax(median))
    risk = float(np.mean(np.any(moves_by_itself(torque, margin, 0.0, 0.0), axis=1)))
    limits = np.bincount(np.argmin(safe_shares(margin, torque), axis=1)).argmax()
    share = float(torque[largest] / max(median[largest], 1e-300))
    return FeedForward(
        share, float(torque[largest]), risk, float(median[largest] - torque[largest]), float(np.rad2deg(bends[limits]))
    )


def _summarize_bend(angle: float, friction: np.ndarray, scheduled: float, fixed: float) -> BendCompensation:
    interval = Interval.of(friction)
    remaining = interval.median - scheduled, interval.median - fixed
    return BendCompensation(float(np.rad2deg(angle)), interval, float(scheduled), *map(float, remaining))
