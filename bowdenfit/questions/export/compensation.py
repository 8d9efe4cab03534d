"""What may be compensated, as parameters of a controller: the answer of `bowdenfit compensate`, by name and unit."""

from typing import Any

from bowdenfit.inference.interval import Interval
from bowdenfit.questions.compensate.answer import Compensation, FeedbackGain, FeedForward


def compensation_parameters(answer: Compensation) -> dict[str, Any]:
    """The answer in plain data; what it does not hold is left out.

    Args:
        answer: Of both laws.
    """
    bends = answer.by_bend
    page: dict[str, Any] = {
        "device": answer.device,
        "wrap_angle_deg": [bend.wrap_angle for bend in bends],
        "accepted_probability": answer.risk,
        "mounting_scatter": answer.scatter,
        "mounting_scatter_is_measured": answer.scatter_from_fit,
        "probability_of_slack": answer.slack,
        "friction_N_m": {
            "q05": [bend.friction.q05 for bend in bends],
            "q50": [bend.friction.median for bend in bends],
            "q95": [bend.friction.q95 for bend in bends],
        },
        "dead_zone_rad_per_s": answer.dead_zone or None,
        "chatters_below_rad_per_s": answer.chatters_below,
    }
    if answer.fixed is not None:
        page["fixed"] = {"torque_N_m": answer.fixed.torque, **_feed_forward_parameters(answer.fixed)}
    if answer.scheduled is not None:
        page["scheduled"] = {
            "torque_N_m": [bend.scheduled for bend in bends],
            **_feed_forward_parameters(answer.scheduled),
        }
    if answer.gain is not None:
        page["gain"] = _gain_parameters(answer.gain)
    return page | {"not_stated": list(answer.missing)}


def _feed_forward_parameters(feed_forward: FeedForward) -> dict[str, float]:
    return {
        "share": feed_forward.share,
        "probability_of_moving_by_itself": feed_forward.risk,
        "left_N_m": feed_forward.left,
    }


def _gain_parameters(gain: FeedbackGain) -> dict[str, Any]:
    return {
        "safe": gain.safe,
        "passive": gain.passive,
        "stable_up_to": _quantile_parameters(gain.stable),
        "left_N_m": _quantile_parameters(gain.left),
        "decided_by": gain.decided_by,
    }


def _quantile_parameters(interval: Interval) -> dict[str, float]:
    return {"q05": interval.q05, "q50": interval.median, "q95": interval.q95}
