"""What `bowdenfit compensate` prints: what to feed forward or back, with which probability, and what is left to feel."""

from collections.abc import Iterator

from bowdenfit.display import text_of
from bowdenfit.questions.compensate.answer import ROPE_DAMPING, Compensation, FeedForward, Gain
from bowdenfit.questions.compensate.simulated import ACTIVE, KARNOPP, NONE
from bowdenfit.words import decimals, filled, listed, percent, table

_ROWS = 3  # of the bends in the table
_LAWS = {NONE: "with nothing hidden", KARNOPP: "when it is fed forward", ACTIVE: "when it is fed back"}
_WORTH = 1.2  # times better, from which on a schedule is worth its trouble
_SURELY = 0.005


@text_of.register(Compensation)
def compensation_text(found: Compensation) -> str:
    """The answer for people, the answer first, in at most 25 lines."""
    blocks = ["\n".join(filled(line) for line in sentences(found)), _by_bend(found)]
    if found.simulated is not None:
        blocks.append("\n".join(filled(line) for line in _through_time(found)))
    return "\n\n".join(block for block in blocks if block) + "\n"


def sentences(found: Compensation) -> list[str]:
    """What to do, what is left, what it rests on, and what would be needed to say more."""
    said = [*_fed_forward(found), *_fed_back(found), *_cautions(found), _preload(found), *_asked(found)]
    return [sentence for sentence in said if sentence]


def newton_metres(value: float) -> str:
    """'0.216 N*m'"""
    return f"{value:.{max(decimals(abs(value)) + 1, 3) if abs(value) >= 1e-3 else 4}f} N*m"


def _range(found: Compensation) -> str:
    low, high = (f"{angle:.4g}" for angle in found.bends)
    return f"at {low} deg" if low == high else f"from {low} to {high} deg"


def _fed_forward(found: Compensation) -> Iterator[str]:
    fixed, scheduled, most = found.fixed, found.scheduled, found.most
    if fixed is None or scheduled is None:
        return
    of, left = newton_metres(most.friction.median), newton_metres(fixed.left)
    risk = f"with at most {percent(found.risk, 0)} probability the device then moves by itself"
    if found.bends[0] == found.bends[1]:
        yield f"Feed forward at most {newton_metres(fixed.torque)} {_range(found)}: {risk}. That leaves {left} of {of} to feel."
    elif scheduled.left * _WORTH < fixed.left:
        yield (
            f"Feed forward by bend, {scheduled.share:.2f} times the median friction: {risk} somewhere {_range(found)}. At "
            f"{most.wrap_angle:.4g} deg that leaves {newton_metres(scheduled.left)} of {of} to feel. One torque for all bends "
            f"may be {newton_metres(fixed.torque)}, what the device bears at {fixed.decided_at:.4g} deg, and leaves {left}."
        )
    else:
        yield (
            f"Feed forward at most {newton_metres(fixed.torque)} at all bends: {risk} somewhere {_range(found)}. At "
            f"{most.wrap_angle:.4g} deg that leaves {left} of {of} to feel, and by bend {newton_metres(scheduled.left)}."
        )
    yield _mountings(found, scheduled)


def _mountings(found: Compensation, scheduled: FeedForward) -> str:
    """What the scatter from mounting to mounting costs."""
    source = "measured" if found.scatter_from_fit else "stated, not measured"
    if found.scatter == 0:
        seem = "so this holds for this mounting alone, and the next one may move by itself"
    elif scheduled.share >= found.share_without_scatter:
        seem = "that hardly matters here"
    else:
        seem = f"without it {found.share_without_scatter:.2f} would seem safe, and is not"
    return f"Friction scatters from mounting to mounting by {found.scatter:.2g} of its exponent ({source}); {seem}."


def _fed_back(found: Compensation) -> Iterator[str]:
    gain = found.gain
    if gain is None:
        return
    if gain.safe <= 0:
        yield (
            "No gain on the measured torque is safe: some devices that fit what is known oscillate with the least of them. "
            f"What decides is {gain.decided_by}; {_measure(gain)}, and damp the rope{_or_integrate_less(gain)}."
        )
        return
    most = "10000 or more" if gain.safe >= 9999 else f"at most {gain.safe:.2g}"
    beside, fades = "", ""
    if gain.integral:
        beside = f" beside {gain.integral:.3g} 1/s times its integral"
        fades = f", which fades by two thirds in {(1 + gain.safe) / gain.integral:.2g} s of motion one way"
    yield (
        f"Feed back {most} times the torque measured at the joint{beside}: with at most {percent(found.risk, 0)} probability "
        f"it then oscillates, {'hands off or on' if gain.with_hand else 'hands off'}. That leaves "
        f"{newton_metres(gain.left.median)} to feel{fades}. {_no_hand(gain)} The largest gain is {gain.stable.q05:.2g} to "
        f"{gain.stable.q95:.2g} (90 % interval); {percent(gain.decided_share, 0)} of that goes with {gain.decided_by}: "
        f"{_measure(gain)}."
    )


def _no_hand(gain: Gain) -> str:
    if gain.passive <= 0:
        return "Some hand can make it oscillate at any gain."
    return f"Up to {gain.passive:.2g} no hand can make it oscillate."


def _or_integrate_less(gain: Gain) -> str:
    return f", or integrate less than {gain.integral:.3g} 1/s" if gain.integral else ""


def _measure(gain: Gain) -> str:
    """What to do about the input that decides."""
    if gain.decided_by != ROPE_DAMPING:
        return "measure it"
    return "which a ring-down told; measure more of them" if gain.from_ring_down else "measure it by a ring-down"


def _cautions(found: Compensation) -> Iterator[str]:
    if (
        found.fixed is not None
        and found.dead_zone > 0
        and found.chatters_below
        and found.dead_zone <= found.chatters_below
    ):
        yield (
            f"Caution: a dead zone of {found.dead_zone:.3g} rad/s is narrower than one count of the encoder in the time of the "
            f"filter, {found.chatters_below:.3g} rad/s, so the motor will chatter; widen it."
        )
    if found.slack > _SURELY:
        yield (
            f"Caution: at rest the loop is slack somewhere {_range(found)} with {percent(found.slack, 0)} probability; there "
            "it has no friction to hide, and does not follow at once. Preload it more, or narrow the range with --wrap-angle."
        )


def _preload(found: Compensation) -> str:
    """What less preload would give, and cost."""
    taut = [row for row in found.preloads if row.slack_from.q05 > 0]
    if not taut or found.slack > _SURELY:
        return ""
    least, own = taut[0], min(found.preloads, key=lambda row: abs(row.preload - _own(found)))
    if least.preload >= own.preload:
        return f"Less preload than its {own.preload:.3g} N would be felt less, but the loop could be slack at rest."
    return (
        f"Preloaded with {least.preload:.3g} N instead of {own.preload:.3g} N the loop is felt as "
        f"{newton_metres(least.felt.median)} instead of {newton_metres(own.felt.median)}, but one side is slack from "
        f"{newton_metres(least.slack_from.median)} at the motor on instead of {newton_metres(own.slack_from.median)}."
    )


def _own(found: Compensation) -> float:
    """Preload of the cable as it is: that of which the others are shares."""
    return found.preloads[len(found.preloads) // 2].preload


def _asked(found: Compensation) -> Iterator[str]:
    if not found.device:
        yield (
            "Friction of the motor and damping, which would allow more, count as nothing: name a device.toml that says them "
            "with --device."
        )
    if found.missing:
        keys = listed([f"{key.replace('.', ', ')}" for key in found.missing])
        where = "device.toml lacks" if found.device else "it needs"
        yield f"How much of the measured torque may be fed back is not said, because {where} [section], key: {keys}."


def _by_bend(found: Compensation) -> str:
    """Some bends, as a table."""
    if found.scheduled is None or len(found.by_bend) == 1:
        return ""
    rows = []
    last = len(found.by_bend) - 1
    for i in range(_ROWS):
        bend = found.by_bend[round(i * last / (_ROWS - 1))]
        known = f"{bend.friction.median:.3f} ({bend.friction.q05:.3f} to {bend.friction.q95:.3f})"
        rows.append([f"{bend.wrap_angle:.4g}", known, f"{bend.scheduled:.3f}", f"{bend.left_scheduled:.3f}"])
    return table(["bend (deg)", "friction (N m)", "fed forward (N m)", "left (N m)"], rows)


def _through_time(found: Compensation) -> Iterator[str]:
    """What the simulation shows."""
    seen = found.simulated
    if seen is None:
        return
    felt = listed([f"{newton_metres(law.felt.median)} {_LAWS[law.name]}" for law in seen.laws])
    peaks = listed([newton_metres(law.peak.median) for law in seen.laws])
    went = "" if seen.went_on is None else f" Pushed and let go, {percent(seen.went_on, 1)} go on by themselves."
    yield (
        f"{seen.draws} simulated devices, moved at up to {seen.speed:.2g} rad/s at {seen.wrap_angle:.4g} deg, are felt as "
        f"{felt}; turning round, as {peaks}.{went}"
    )
