"""Text of `bowdenfit compensate`: what to feed forward or back, at which risk, and what friction remains."""

from collections.abc import Iterator

from bowdenfit.addons.device.compensate.answer import (
    ACTIVE,
    KARNOPP,
    NONE,
    ROPE_DAMPING,
    Compensation,
    FeedbackGain,
    FeedForward,
)
from bowdenfit.display import Block, ResultTable, blocks_of, separate
from bowdenfit.words import decimals, listed, percent

_ROWS = 3  # of the bends in the table; a judgement
_LAWS = {NONE: "without compensation", KARNOPP: "with feed-forward", ACTIVE: "with feedback"}
_WORTHWHILE = 1.2  # times better, from which on a schedule is worth its trouble; a judgement
_LIKELY_SLACK = 0.005  # probability that rounds to 1 %


@blocks_of.register(Compensation)
def compensation_blocks(answer: Compensation) -> list[Block]:
    """Return the answer for people, the answer first, in at most 25 lines."""
    return separate(sentences(answer), _bend_table(answer), _simulation_sentences(answer))


def sentences(answer: Compensation) -> list[str]:
    """Say what to do, what friction remains, what it rests on, and what would be needed to say more."""
    parts = [
        *_feed_forward_sentences(answer),
        *_feedback_sentences(answer),
        *_caution_sentences(answer),
        _preload_sentence(answer),
        *_missing_sentences(answer),
    ]
    return [sentence for sentence in parts if sentence]


def format_torque(value: float) -> str:
    """Return a torque with its unit, as '0.216 N*m'."""
    return f"{value:.{max(decimals(abs(value)) + 1, 3) if abs(value) >= 1e-3 else 4}f} N*m"


def _describe_bends(answer: Compensation) -> str:
    low, high = (f"{angle:.4g}" for angle in answer.bends)
    return f"at {low} deg" if low == high else f"from {low} to {high} deg"


def _feed_forward_sentences(answer: Compensation) -> Iterator[str]:
    fixed, scheduled, most = answer.fixed, answer.scheduled, answer.most
    if fixed is None or scheduled is None:
        return
    friction, left = format_torque(most.friction.median), format_torque(fixed.left)
    risk = f"with at most {percent(answer.risk, 0)} probability the device then moves on its own"
    bends = _describe_bends(answer)
    if answer.bends[0] == answer.bends[1]:
        yield (
            f"Feed forward at most {format_torque(fixed.torque)} {bends}: {risk}. The hand then feels {left} of the "
            f"{friction} of friction."
        )
    elif scheduled.left * _WORTHWHILE < fixed.left:
        yield (
            f"Feed forward by bend, {scheduled.share:.2f} times the median friction: {risk} somewhere {bends}. At "
            f"{most.wrap_angle:.4g} deg the hand then feels {format_torque(scheduled.left)} of the {friction} of friction. One "
            f"torque for all bends may be {format_torque(fixed.torque)}, the limit at {fixed.decided_at:.4g} deg, and leaves "
            f"{left}."
        )
    else:
        yield (
            f"Feed forward at most {format_torque(fixed.torque)} at all bends: {risk} somewhere {bends}. At "
            f"{most.wrap_angle:.4g} deg the hand then feels {left} of the {friction} of friction; with feed-forward by bend it "
            f"would feel {format_torque(scheduled.left)}."
        )
    yield _mounting_sentence(answer, scheduled)


def _mounting_sentence(answer: Compensation, scheduled: FeedForward) -> str:
    """Say what the scatter from mounting to mounting costs."""
    source = "measured" if answer.scatter_from_fit else "stated, not measured"
    if answer.scatter == 0:
        seem = "so this holds for this mounting alone, and the next one may move on its own"
    elif scheduled.share >= answer.share_without_scatter:
        seem = "that matters little here"
    else:
        seem = f"neglecting it, {answer.share_without_scatter:.2f} would seem safe, and is not"
    return f"The relative scatter of the friction exponent between mountings (tau) is {answer.scatter:.2g} ({source}); {seem}."


def _feedback_sentences(answer: Compensation) -> Iterator[str]:
    gain = answer.gain
    if gain is None:
        return
    if gain.safe <= 0:
        yield (
            "No gain on the measured torque is safe: some devices within the uncertainty of the fit oscillate even at "
            f"the smallest. The deciding quantity is {gain.decided_by}; {_describe_remedy(gain)}, and damp the "
            f"rope{_describe_integral_remedy(gain)}."
        )
        return
    most = "10000 or more" if gain.safe >= 9999 else f"at most {gain.safe:.2g}"
    beside, fades = "", ""
    if gain.integral:
        beside = f" beside {gain.integral:.3g} 1/s times its integral"
        fades = f", which fades by two thirds in {(1 + gain.safe) / gain.integral:.2g} s of motion one way"
    yield (
        f"Feed back {most} times the torque measured at the joint{beside}: with at most {percent(answer.risk, 0)} probability "
        f"it then oscillates, {'with a hand on the device or without' if gain.with_hand else 'without a hand on the device'}. "
        f"The hand then feels {format_torque(gain.left.median)} of friction{fades}. {_passivity_sentence(gain)} The "
        f"largest gain is {gain.stable.q05:.2g} to {gain.stable.q95:.2g} (90 % interval); {percent(gain.decided_share, 0)} of "
        f"that comes from {gain.decided_by}: {_describe_remedy(gain)}."
    )


def _passivity_sentence(gain: FeedbackGain) -> str:
    if gain.passive <= 0:
        return "Some hand can make it oscillate at any gain."
    return f"Up to a gain of {gain.passive:.2g} it is passive: no hand can make it oscillate."


def _describe_integral_remedy(gain: FeedbackGain) -> str:
    return f", or integrate less than {gain.integral:.3g} 1/s" if gain.integral else ""


def _describe_remedy(gain: FeedbackGain) -> str:
    """Say what to do about the input that decides."""
    if gain.decided_by != ROPE_DAMPING:
        return "measure it"
    return "which was measured by a ring-down; measure more of them" if gain.from_ring_down else "measure it by a ring-down"


def _caution_sentences(answer: Compensation) -> Iterator[str]:
    if (
        answer.fixed is not None
        and answer.dead_zone > 0
        and answer.chatters_below
        and answer.dead_zone <= answer.chatters_below
    ):
        yield (
            f"Caution: a dead zone of {answer.dead_zone:.3g} rad/s is narrower than one count of the encoder in the time of "
            f"the filter, {answer.chatters_below:.3g} rad/s, so the motor will chatter; widen it."
        )
    if answer.slack > _LIKELY_SLACK:
        yield (
            f"Caution: at rest the loop is slack somewhere {_describe_bends(answer)} with {percent(answer.slack, 0)} "
            "probability; a slack loop has no friction to compensate, and does not follow at once. Increase the preload, or "
            "narrow the range with --wrap-angle."
        )


def _preload_sentence(answer: Compensation) -> str:
    """Say what less preload would give, and cost."""
    taut = [row for row in answer.preloads if row.slack_from.q05 > 0]
    if not taut or answer.slack > _LIKELY_SLACK:
        return ""
    least, own = taut[0], min(answer.preloads, key=lambda row: abs(row.preload - _find_own_preload(answer)))
    if least.preload >= own.preload:
        return f"Less preload than {own.preload:.3g} N would mean less friction to feel, but the loop could be slack at rest."
    return (
        f"With {least.preload:.3g} N of preload instead of {own.preload:.3g} N, friction is "
        f"{format_torque(least.friction.median)}, not {format_torque(own.friction.median)}, but one side goes slack at "
        f"{format_torque(least.slack_from.median)} at the motor, not {format_torque(own.slack_from.median)}."
    )


def _find_own_preload(answer: Compensation) -> float:
    """Return the preload of the cable as it is: that of which the others are shares."""
    return answer.preloads[len(answer.preloads) // 2].preload


def _missing_sentences(answer: Compensation) -> Iterator[str]:
    if not answer.device:
        yield (
            "Friction of the motor and damping, which would allow more, are taken as zero: name a device.toml that states "
            "them with --device."
        )
    if answer.missing:
        keys = listed([f"{key.replace('.', ', ')}" for key in answer.missing])
        where = "device.toml lacks" if answer.device else "it needs"
        yield f"How much of the measured torque may be fed back cannot be estimated, because {where} [section], key: {keys}."


def _bend_table(answer: Compensation) -> list[Block]:
    """Return some bends as a table; empty where there is nothing to list."""
    if answer.scheduled is None or len(answer.by_bend) == 1:
        return []
    rows = []
    last = len(answer.by_bend) - 1
    for i in range(_ROWS):
        bend = answer.by_bend[round(i * last / (_ROWS - 1))]
        friction = f"{bend.friction.median:.3f} ({bend.friction.q05:.3f} to {bend.friction.q95:.3f})"
        rows.append([f"{bend.wrap_angle:.4g}", friction, f"{bend.scheduled:.3f}", f"{bend.left_scheduled:.3f}"])
    return [ResultTable(["bend (deg)", "friction (N m)", "fed forward (N m)", "remaining (N m)"], rows)]


def _simulation_sentences(answer: Compensation) -> Iterator[str]:
    """Say what the simulation shows."""
    simulation = answer.simulated
    if simulation is None:
        return
    means = listed([f"{format_torque(law.mean_torque.median)} {_LAWS[law.name]}" for law in simulation.laws])
    peaks = listed([format_torque(law.peak_torque.median).removesuffix(" N*m") for law in simulation.laws])
    runaways = (
        ""
        if simulation.runaway_share is None
        else f" Once pushed, {percent(simulation.runaway_share, 1)} keep moving."
    )
    yield (
        f"In {simulation.draws} simulations at up to {simulation.speed:.2g} rad/s and {simulation.wrap_angle:.4g} deg, a hand "
        f"feels {means}, at reversals up to {peaks} N*m.{runaways}"
    )
