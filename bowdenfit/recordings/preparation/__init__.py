"""From a recording as read to block means that a fit can use.

The steps, one file each: `checks`, `flags`, `tare`, `delay`, `blocks`; each is a function of arrays that can be used by itself.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bowdenfit.description import Preparation, QuantityValue
from bowdenfit.errors import DatasetError
from bowdenfit.files import pieces
from bowdenfit.recordings.preparation.blocks import (
    FINER,
    CommonClock,
    average_blocks,
    choose_block_samples,
    cut_into_windows,
    estimate_bandwidth,
    main_frequency,
    refuse_too_long,
)
from bowdenfit.recordings.preparation.checks import FEWEST_SAMPLES, check_recording, check_sign
from bowdenfit.recordings.preparation.clock import (
    DROPOUT,
    EXCLUDED,
    GOOD,
    KINDS,
    NO_OVERLAP,
    QUIET,
    Sampled,
    read_at,
    spread_repeated,
    step_of,
)
from bowdenfit.recordings.preparation.delay import BEYOND, RANGE, Delay, estimate_delay
from bowdenfit.recordings.preparation.excluded import collect_flagged
from bowdenfit.recordings.preparation.flags import flag_samples
from bowdenfit.recordings.preparation.noise import describe_noise, estimate_tare, noise_about_trend
from bowdenfit.recordings.preparation.shift_scan import AS_WELL, OVERLAP, LateOutput, ShiftScan, scan_shifts
from bowdenfit.recordings.recording import Account, Blocks, RawRecording
from bowdenfit.types import Flags, Vector

_MIRRORED = -0.9  # judged: correlation below which the output falls by all that the input rises
_USUAL_BLOCK = 0.05
_POINTS_OF_SCAN = 1 << 13  # judged: 22 points in each of 360 cycles, the most that a recording may have
_MANY_DROPOUTS = 0.01  # share of the samples of a channel from which they are named; a judgement
_SHARE_OF_PERIOD = 0.25  # judged: delay up to which an output is looked for, over the period; a later one may be an early one
_ALL = 0.99  # share of a part of the output that lies within the input at every shift
_LATE = (
    "{0}: the output is {1:.3g} s {2} than the input, which was found from the forces and taken off; the usual causes are a "
    "channel that a logger buffers, and channels that did not start together. State the delay if it is another."
)
NO_DELAY_OF_LOOPS = (
    "How much later the output channel is than the input channel is not estimated for a loop, whose forces pass through zero. "
    'No delay was assumed; state one if it is known: delay = { value = 10, unit = "ms" } under prepare in cable.toml.'
)


@dataclass(frozen=True)
class _Cleaned:
    """Both channels on their own clocks, without tare and with faults; the ends of the range, and the tares."""

    input: Sampled
    output: Sampled
    limits: tuple[float, float]
    tare: tuple[float, float]
    tare_sd: tuple[float, float]


def prepare(raw: RawRecording, settings: Preparation) -> tuple[Blocks, Account]:
    """Check a recording, leave out what is no reading, shift the output back by its delay, and average in blocks.

    Args:
        raw: The recording as read.
        settings: Which steps are done, and with what.

    Returns:
        The block means, and an account of every sample; `Account.limits` holds the limits that were taken, of both load
        cells together.

    Raises:
        DatasetError: The recording cannot be one; see `checks.check_recording` and `tare.estimate_tare`.
    """
    return average_recording(inspect_recording(raw, settings))


@dataclass(frozen=True)
class Inspected:
    """A recording whose samples are flagged and tared, and whose delay is known as far as it tells it.

    Args:
        raw: As it was read.
        settings: Which steps are done, and with what.
        remarks: Remarks, in sentences.
        cleaned: Both channels on their own clocks.
        together: Both on one clock, before any delay is taken off.
        delay: How much later the output channel is.
    """

    raw: RawRecording
    settings: Preparation
    remarks: tuple[str, ...]
    cleaned: _Cleaned
    together: CommonClock
    delay: Delay


def inspect_recording(raw: RawRecording, settings: Preparation) -> Inspected:
    """Return the steps before averaging, so that several recordings can be given one delay; see `prepare`."""
    remarks = check_recording(raw)
    cleaned = _clean(raw, settings)
    together = _together(raw, cleaned, settings, 0.0)
    return Inspected(raw, settings, remarks, cleaned, together, _delay(raw, cleaned, together, settings))


def inspect_parts(raw: RawRecording, settings: Preparation) -> tuple[Inspected, ...]:
    """Return the steps before averaging of a recording, or of the parts of one with more cycles than its blocks can show.

    The parts have equal lengths and their own delays. Of a recording with very many cycles they are apart from each other: more
    cycles say little more of a mounting.
    """
    remarks, cleaned = check_recording(raw), _clean(raw, settings)
    together = _together(raw, cleaned, settings, 0.0)
    windows = [] if raw.loop or settings.block != "auto" else cut_into_windows(together, _main_frequency(together))
    if not windows:
        return (Inspected(raw, settings, remarks, cleaned, together, _delay(raw, cleaned, together, settings)),)
    parts, remarks = list[Inspected](), (*remarks, _describe_cut(raw, together, windows))
    for i, window in enumerate(windows, start=1):
        some = slice(*np.searchsorted(raw.velocity_time, window).tolist())
        name = f"{raw.name}, part {i} of {len(windows)}"
        part = replace(raw, name=name, velocity_time=raw.velocity_time[some], velocity=raw.velocity[some])
        of_part = replace(cleaned, input=cleaned.input.between(*window), output=cleaned.output.between(*window))
        common = _together(part, of_part, settings, 0.0)
        if not np.any(common.fault == GOOD):
            remarks = (*remarks, f"{name} is left out, because none of its samples is good.")
            continue
        parts.append(Inspected(part, settings, remarks, of_part, common, _delay(part, of_part, common, settings)))
        remarks = ()
    return tuple(parts)


def _main_frequency(common: CommonClock) -> float:
    """Return the frequency at which the forces move most [Hz]; 0 where they do not, or no sample is good."""
    good = common.fault == GOOD
    if not good.any():
        return 0.0
    return main_frequency(pieces.Filled(common.input_force, good), pieces.Filled(common.output_force, good), 1 / common.step)


def _describe_cut(raw: RawRecording, common: CommonClock, windows: Sequence[tuple[float, float]]) -> str:
    """Return how a recording was cut, in a sentence."""
    whole, length = float(np.ptp(common.time)), windows[0][1] - windows[0][0]
    between = whole - len(windows) * length
    unused = f"; {between:,.0f} s between them are left out: more cycles say little more of a mounting" if between > 1 else ""
    return (
        f"{raw.name} lasts {whole:,.0f} s, with more cycles than one recording may have. It was cut into {len(windows)} parts "
        f"of {length:,.0f} s, which count as one mounting{unused}."
    )


def average_recording(inspected: Inspected, shared_delay: tuple[float, float] | None = None) -> tuple[Blocks, Account]:
    """Return the steps after the delay is known; see `prepare`.

    Args:
        inspected: The recording.
        shared_delay: Delay and its standard error [s] that replace those of this recording.
    """
    raw, settings, remarks, cleaned = inspected.raw, inspected.settings, inspected.remarks, inspected.cleaned
    delay = inspected.delay
    if shared_delay is not None:
        delay = Delay(*shared_delay, delay.exponent, delay.remark if delay.sd > 0 else "")
    common = _together(raw, cleaned, settings, delay.value) if delay.value else inspected.together
    _require_some_good(raw, common)
    good = common.fault == GOOD
    filled = [pieces.Filled(force, good) for force in (common.input_force, common.output_force)]
    main = main_frequency(filled[0], filled[1], 1 / common.step)
    bandwidth = estimate_bandwidth(filled[0], filled[1], 1 / common.step, main, raw.loop)
    noise = _noise(cleaned.input, bandwidth), _noise(cleaned.output, bandwidth)
    sample_sds, noise_times = zip(_describe_noise(cleaned.input), _describe_noise(cleaned.output), strict=True)
    samples = _samples_of_block(inspected, common, bandwidth, main, noise)
    blocks, counts = average_blocks(common, samples, noise[0])
    if samples >= FINER:
        blocks = replace(blocks, finer=average_blocks(common, samples // FINER, noise[0])[0])
    account = Account(
        counts=counts,
        samples=len(common.time),
        rate=1 / common.step,
        bandwidth=bandwidth,
        block=samples * common.step,
        tare=cleaned.tare,
        tare_sd=cleaned.tare_sd,
        delay=delay.value,
        delay_sd=delay.sd,
        noise=noise,
        limits=cleaned.limits,
        flagged=collect_flagged(common, raw, delay.value),
        remarks=(*remarks, *_remarks(cleaned, delay, counts)),
        sample_sd=sample_sds,
        noise_time=noise_times,
    )
    return blocks, account


def _clean(raw: RawRecording, settings: Preparation) -> _Cleaned:
    """Flag and tare each channel on its own clock, and check its sign."""
    times = spread_repeated(raw.input_time), spread_repeated(raw.output_time)
    forces = raw.input_force, raw.output_force
    pairs = ((0, 1), (1, 0))
    flagged = [flag_samples(times[one], forces[one], times[two], forces[two], settings) for one, two in pairs]
    if raw.excluded is not None:
        for channel, _ in flagged:
            channel.fault[raw.excluded.covers(channel.time)] = EXCLUDED
    names = "input_force", "output_force"
    tares = [_tare(raw.file, name, channel, settings) for name, (channel, _) in zip(names, flagged, strict=True)]
    channels = [
        replace(c, force=c.force - tare if tare else c.force) for (c, _), (tare, _) in zip(flagged, tares, strict=True)
    ]
    for name, channel in zip(names, channels, strict=True):
        if not raw.loop:
            check_sign(raw, name, channel.force)
    ends = max(e[0] for _, e in flagged), min(e[1] for _, e in flagged)
    return _Cleaned(channels[0], channels[1], ends, (tares[0][0], tares[1][0]), (tares[0][1], tares[1][1]))


def _tare(file: str, name: str, channel: Sampled, settings: Preparation) -> tuple[float, float]:
    if settings.tare != "interval":
        return 0.0, 0.0
    if settings.quiet is None:
        raise DatasetError(
            f"{file}: {name} is to be tared, but no quiet interval is stated. State the start and end of an interval "
            "without load in seconds, or no tare."
        )
    return estimate_tare(file, name, channel.time, channel.force, settings.quiet, channel.fault == GOOD)


def _together(raw: RawRecording, cleaned: _Cleaned, settings: Preparation, delay: float) -> CommonClock:
    """Return both channels on the clock of the one with more samples, the output shifted back by the delay."""
    if len(cleaned.input.time) >= len(cleaned.output.time):
        time = cleaned.input.time
        (input_force, input_fault), (output_force, output_fault) = (
            read_at(cleaned.input, time),
            read_at(cleaned.output, time, delay),
        )
    else:
        time = cleaned.output.time - delay if delay else cleaned.output.time
        (input_force, input_fault), (output_force, output_fault) = (
            read_at(cleaned.input, time),
            (cleaned.output.force, cleaned.output.fault),
        )
    fault = np.maximum(input_fault, output_fault)
    if settings.tare == "interval" and settings.quiet is not None:
        quiet = (time >= settings.quiet[0]) & (time <= settings.quiet[1])
        fault[quiet & (fault != NO_OVERLAP)] = QUIET
    return CommonClock(time, step_of(time), input_force, output_force, _velocity(raw, time), fault)


def _velocity(raw: RawRecording, time: Vector) -> Vector:
    there = np.isfinite(raw.velocity)
    if there.sum() < 2:
        return np.broadcast_to(np.nan, len(time))
    clock = spread_repeated(raw.velocity_time)
    if there.all() and pieces.have_same_numbers(clock, time):
        return raw.velocity
    return pieces.interpolate(time, clock, raw.velocity, there, outside=np.nan)


def _delay(raw: RawRecording, cleaned: _Cleaned, common: CommonClock, settings: Preparation) -> Delay:
    if settings.delay == "none":
        return Delay(0.0, math.nan, math.nan)
    if isinstance(settings.delay, QuantityValue):
        return Delay(settings.delay.to("time"), math.nan, math.nan)
    if raw.loop:
        return Delay(0.0, math.nan, math.nan, NO_DELAY_OF_LOOPS)
    estimate = _estimate_delay(common, settings, slice(None))
    is_beyond = estimate.reason.startswith(BEYOND)
    if late := _find_late_output(raw, cleaned, common, is_beyond=is_beyond):
        remainder = _estimate_delay(_together(raw, cleaned, settings, late.delay), settings, slice(None))
        sd = remainder.sd if remainder.sd > 0 else late.sd
        estimate = Delay(late.delay + remainder.value, sd, remainder.exponent)
    elif is_beyond and (main := _main_frequency(common)) > 0:
        further = _estimate_delay(common, settings, slice(None), max(_SHARE_OF_PERIOD / main, RANGE))
        estimate = further if further.sd > 0 else estimate
    if abs(estimate.value) <= RANGE:
        return estimate
    side = "later" if estimate.value > 0 else "earlier"
    return replace(estimate, remark=_LATE.format(raw.name, abs(estimate.value), side))


def _find_late_output(
    raw: RawRecording, cleaned: _Cleaned, common: CommonClock, *, is_beyond: bool
) -> LateOutput | None:
    """Return by how much the output is late, if that is more than `estimate_delay` looks for.

    Raises:
        DatasetError: The motion repeats itself, so that another delay explains the output about as well.
    """
    good = common.fault == GOOD
    is_short = np.ptp(common.time) < 2 * RANGE  # no room for a delay beyond the range
    if is_short or np.count_nonzero(good) < FEWEST_SAMPLES or _is_opposed(common, good):
        return None
    ends = [read_at(channel, common.time)[1] == GOOD for channel in (cleaned.input, cleaned.output)]
    scan = _scan(common, ends, slice(None), OVERLAP)
    late = scan.late_output(is_beyond=is_beyond)
    if late is None:
        return None
    swapped = replace(common, input_force=common.output_force, output_force=common.input_force)
    if AS_WELL * _scan(swapped, ends[::-1], slice(None), OVERLAP).usual < scan.best[1]:
        return None  # the ends are exchanged, which is refused later
    limits = common.time[0] + max(late.delay, 0.0), common.time[-1] + min(late.delay, 0.0)
    lasting = slice(*np.searchsorted(common.time, limits).tolist())  # what has a partner with the delay and without
    if _scan(common, ends, lasting, _ALL).late_output(is_beyond=is_beyond) is None:
        return None  # something else than the delay differs between the parts of the recording
    if abs(late.delay) > scan.near and any(_scan(common, ends, part, _ALL).follows for part in _thirds(common)):
        return None  # as where one cell was tared in between, which the rest does not share
    if late.rival is not None:
        raise DatasetError(
            f"{raw.file}: in {raw.name!r} the output follows the input if it is {late.delay:.3g} s late, and about as well if "
            f"it is {late.rival:.3g} s late (negative: early), because the motion repeats itself. The usual causes are "
            "channels that a logger buffers, or that did not start together. State which it is, such as --set "
            f"'tables.recordings.prepare.delay={{value={late.delay:.3g},unit=\"s\"}}' (in cable.toml delay under prepare), or "
            "record a pause before the first stroke."
        )
    return late


def _thirds(common: CommonClock) -> list[slice]:
    """Return three parts of a recording of equal length, of which a single event leaves two as they are."""
    ends = [0, *(len(common.time) * part // 3 for part in (1, 2)), len(common.time)]
    return [slice(begin, end) for begin, end in pairwise(ends)]


def _is_opposed(common: CommonClock, good: Flags) -> bool:
    """Return whether the output falls by all that the input rises, as in a pull-pull pair; that is refused later."""
    some = slice(None, None, max(1, len(good) // _POINTS_OF_SCAN))
    forces = [force[some][good[some]] for force in (common.input_force, common.output_force)]
    return all(np.ptp(force) > 0 for force in forces) and float(np.corrcoef(*forces)[0, 1]) < _MIRRORED


def _scan(common: CommonClock, good: Sequence[Flags], part: slice, overlap: float) -> ShiftScan:
    """Compare the good samples of the input with those of a part of the output, at every shift."""
    time, force, both = common.time, common.output_force, (good[0], good[1][part])
    return scan_shifts(time, common.input_force, time[part], force[part], _POINTS_OF_SCAN, both, overlap)


def delays_of_parts(inspected: Inspected, count: int) -> list[tuple[float, Delay]]:
    """Return the middle [s] and the delay of so many parts of equal length of a recording."""
    common = inspected.together
    there = np.flatnonzero(common.fault == GOOD)
    ends = np.linspace(common.time[there[0]], common.time[there[-1]], count + 1)
    at = np.searchsorted(common.time, ends)
    parts = [slice(begin, end) for begin, end in pairwise(at.tolist()) if end - begin > 1]
    return [(float(common.time[part].mean()), _estimate_delay(common, inspected.settings, part)) for part in parts]


def _estimate_delay(common: CommonClock, settings: Preparation, part: slice, reach: float = RANGE) -> Delay:
    shortest = _USUAL_BLOCK if settings.block == "auto" else _stated_block(settings)
    good = common.fault[part] == GOOD
    return estimate_delay(common.time[part], common.input_force[part], common.output_force[part], good, shortest, reach)


def _stated_block(settings: Preparation) -> float:
    """Return the length of a block [s], 0 for none."""
    return settings.block.to("time") if isinstance(settings.block, QuantityValue) else 0.0


def _require_some_good(raw: RawRecording, common: CommonClock) -> None:
    if not np.any(common.fault == GOOD):
        most = KINDS[int(np.argmax([np.count_nonzero(common.fault == kind) for kind, _ in enumerate(KINDS)]))]
        raise DatasetError(
            f"{raw.file}: none of the {len(common.time)} samples of {raw.name} is left, most of them for {most}. Look at "
            "the recording, or switch off the step of the preparation that leaves them out."
        )


def _noise(channel: Sampled, bandwidth: float) -> float:
    """Return the standard deviation of a single sample, from the channel on its own clock [N]."""
    stretch = max(4, round(1 / (2 * bandwidth * step_of(channel.time))))
    return noise_about_trend(pieces.Filled(channel.force, channel.fault == GOOD), stretch)


def _describe_noise(channel: Sampled) -> tuple[float, float]:
    """Return the noise of a sample without the motion [N] and its correlation time [s]."""
    sd, samples = describe_noise(pieces.Filled(channel.force, channel.fault == GOOD))
    return sd, samples * step_of(channel.time)


def _samples_of_block(
    inspected: Inspected, common: CommonClock, bandwidth: float, main: float, noise: tuple[float, float]
) -> int:
    """Return samples of a block of the common clock, 0 for no blocks; a slower channel counts with fewer samples."""
    raw, cleaned, settings = inspected.raw, inspected.cleaned, inspected.settings
    if settings.block == "auto":
        thinned = [step_of(channel.time) / common.step for channel in (cleaned.input, cleaned.output)]
        per_sample = noise[0] * math.sqrt(thinned[0]), noise[1] * math.sqrt(thinned[1])
        refuse_too_long(raw.file, raw.name, common, main)
        return choose_block_samples(common, bandwidth, main, per_sample, raw.loop)
    block = _stated_block(settings)
    return max(1, round(block / common.step)) if block > 0 else 0


def _remarks(cleaned: _Cleaned, delay: Delay, counts: dict[str, int]) -> list[str]:
    remarks = [delay.remark] if delay.remark else []
    for name, channel in (("input_force", cleaned.input), ("output_force", cleaned.output)):
        if channel.gap.any():
            before = np.flatnonzero(channel.gap)
            length = float((channel.time[before + 1] - channel.time[before]).sum())
            remarks.append(f"The clock of {name} has {int(channel.gap.sum())} gaps, {length:.3g} s together.")
        missing = channel.fault == DROPOUT
        if np.count_nonzero(missing) > _MANY_DROPOUTS * len(missing):
            first = np.flatnonzero(np.diff(missing, prepend=False) & missing)
            remarks.append(
                f"{np.count_nonzero(missing)} samples of {name} are missing, frozen, or jump to one reading and back; they "
                f"were left out. They are in {len(first)} places, the first at {channel.time[first[0]]:.2f} s (sample "
                f"{first[0] + 1}). The usual causes are a loose plug and a logger that skips samples."
            )
    if counts["saturated"]:
        remarks.append(
            f"{counts['saturated']} samples rest at the lowest or the highest reading of a load cell, as of one that is "
            "overloaded or whose plug is loose; the force is not known there."
        )
    return remarks
