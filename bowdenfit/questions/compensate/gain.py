"""How large the gain on the measured torque may be, over what is known of cable and device."""

import numpy as np

from bowdenfit.description.device import Device
from bowdenfit.device.gains import LinearDevice, passive_gain, stable_gain
from bowdenfit.device.known import draw_device
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.bends.loop_draws import LoopDraws
from bowdenfit.questions.compensate.answer import ROPE_DAMPING, FeedbackGain
from bowdenfit.results.record import Record

_PLANT = ("motor.inertia", "motor.damping", "joint.inertia", "joint.damping", "rope.damping", "controller.sample_time")
NEEDED = (*_PLANT, "motor.friction")
INTEGRAL = "controller.integral_gain"
HAND = ("hand.inertia", "hand.damping", "hand.stiffness")
_DRAWS, _BENDS = 300, 3  # draws, and bends among them
_NAMES = {
    "motor.inertia": "the inertia of the motor",
    "motor.damping": "the damping of the motor",
    "joint.inertia": "the inertia of the joint",
    "joint.damping": "the damping of the joint",
    "rope.damping": ROPE_DAMPING,
    "controller.sample_time": "the sampling time",
    "stiffness": "the stiffness of the cable",
}


def estimate_feedback_gain(
    fit: Record, device: Device, loop: LoopDraws, friction: np.ndarray, risk: float
) -> FeedbackGain:
    """The largest gain, hands off and on.

    Args:
        fit: The fit.
        device: The device, which says all of `NEEDED`.
        loop: Draws of the cable, with its stiffness.
        felt: Friction of loop and motor where it is most, by draw [N m].
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
    """The device of every draw and bend while its rope slides, with or without the hand."""
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
    """Square of the rank correlation: the share of a gain's scatter that goes with an input."""
    if np.ptp(values) == 0 or np.ptp(gain) == 0:
        return 0.0
    first, second = (np.argsort(np.argsort(sample)).astype(float) for sample in (values, gain))
    return float(np.corrcoef(first, second)[0, 1] ** 2)
