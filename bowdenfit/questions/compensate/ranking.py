"""From the draws of a fit and what is said of a device to what may be fed forward and fed back."""

from collections.abc import Mapping

import numpy as np

from bowdenfit.description.device import Device, Known
from bowdenfit.device.coulomb import largest_share, moves_by_itself, shares
from bowdenfit.device.known import drawn
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.bends.loop_draws import LoopDraws, loop_draws, range_of_bends
from bowdenfit.questions.compensate.answer import Bend, Compensation, FeedForward, Gain, Preload
from bowdenfit.questions.compensate.gain import NEEDED, gain_of
from bowdenfit.results.record import Record

PRELOADS = np.array([0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0])  # shares of the cable's own
HELPING = (
    "motor.friction",
    "motor.damping",
    "joint.damping",
)  # which make feeding forward safer; nothing where not stated
DEAD_ZONE, FILTER = "controller.dead_zone", "controller.filter_time"


def compensation_of(
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
    loop = loop_draws(fit, bends, device, PRELOADS)
    known = device.known(*HELPING, DEAD_ZONE, FILTER) if device is not None else {}
    dry, helping, zone = _helping(known, len(loop.friction), fit.provenance.seed)
    felt = loop.friction + dry[:, None]
    margin, nominal = felt + helping[:, None], np.median(felt, axis=0)
    alone = loop.without_mounting + dry[:, None]
    share = largest_share(margin, nominal, risk)
    constant = float(np.quantile(np.min(margin, axis=1), risk, method="lower"))
    fixed, scheduled = (_fed(fed, margin, felt, bends) for fed in (np.full_like(nominal, constant), share * nominal))
    gain, missing = (None, []) if law == "karnopp" else _gain(fit, device, loop, felt[:, np.argmax(nominal)], risk)
    answer = Compensation(
        fit.name, device.name if device is not None else "", law, (float(np.rad2deg(bends[0])), float(np.rad2deg(bends[-1]))),
        risk, len(felt), loop.scatter, loop.scatter_from_fit, zone, _chatters_below(device, known),
        fixed if law != "active" else None, scheduled if law != "active" else None,
        largest_share(alone + helping[:, None], np.median(alone, axis=0), risk),
        tuple(_bend(bends[i], felt[:, i], share * nominal[i], constant) for i in range(len(bends))),
        gain, tuple(missing),
        tuple(
            Preload(float(p), Interval.of(loop.felt[:, i]), Interval.of(loop.slack_from[:, i]))
            for i, p in enumerate(loop.references)
        ),
        float(np.mean(np.any(loop.preload <= 0, axis=1))),
    )  # fmt: skip
    return answer, loop


def _helping(known: Mapping[str, Known], n: int, seed: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Draws of F_m and of b dv [N m], and dv [rad/s]; nothing of what is not stated."""
    draws, zero = drawn(known, n, seed), np.zeros(n)
    zone = known[DEAD_ZONE].value if DEAD_ZONE in known else 0.0
    return draws.get(HELPING[0], zero), sum((draws.get(name, zero) for name in HELPING[1:]), zero) * zone, zone


def _chatters_below(device: Device | None, known: Mapping[str, Known]) -> float | None:
    """One count of the encoder in the time of the filter [rad/s], where both are stated."""
    if device is None or device.controller.encoder_counts is None or FILTER not in known:
        return None
    return device.count / known[FILTER].value


def _gain(
    fit: Record, device: Device | None, loop: LoopDraws, felt: np.ndarray, risk: float
) -> tuple[Gain | None, list[str]]:
    """The gain, or what would have to be stated for it."""
    if device is None:
        return None, list(NEEDED)
    missing = device.lacking(*NEEDED, *(("rope.stiffness",) if loop.stiffness is None else ()))
    return (None, missing) if missing else (gain_of(fit, device, loop, felt, risk), [])


def _fed(fed: np.ndarray, margin: np.ndarray, felt: np.ndarray, bends: np.ndarray) -> FeedForward:
    """What is fed forward by bend."""
    usual = np.median(felt, axis=0)
    most = int(np.argmax(usual))
    risk = float(np.mean(np.any(moves_by_itself(fed, margin, 0.0, 0.0), axis=1)))
    limits = np.bincount(np.argmin(shares(margin, fed), axis=1)).argmax()
    share = float(fed[most] / max(usual[most], 1e-300))
    return FeedForward(share, float(fed[most]), risk, float(usual[most] - fed[most]), float(np.rad2deg(bends[limits])))


def _bend(angle: float, felt: np.ndarray, scheduled: float, fixed: float) -> Bend:
    known = Interval.of(felt)
    left = known.median - scheduled, known.median - fixed
    return Bend(float(np.rad2deg(angle)), known, float(scheduled), *map(float, left))
