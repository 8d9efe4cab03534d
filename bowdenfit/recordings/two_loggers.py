"""One clock for a recording whose input and output were logged by two loggers, each with a clock of its own.

The shift between the clocks is looked for with the play operator (`preparation.shift_scan`).

The best shift starts `preparation.delay`, which refines it and gives its standard error, as for two channels of one file.
A shift at which the output follows the input is only taken where no other fits nearly as well: periodic motion repeats.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from bowdenfit.description import Preparation, QuantityValue
from bowdenfit.errors import DatasetError
from bowdenfit.recordings.channel_clocks import FEW_SAMPLES
from bowdenfit.recordings.preparation import delays_of_parts, inspect_recording
from bowdenfit.recordings.preparation.checks import check_channels, check_sign
from bowdenfit.recordings.preparation.delay import Delay
from bowdenfit.recordings.preparation.shift_scan import AS_WELL, OVERLAP, ShiftScan, scan_shifts
from bowdenfit.recordings.recording import RawRecording

_MOST_POINTS = 1 << 18  # of the longer recording; a day at three points a second
_UNLIKE = 0.2  # judged: share of the output's variance that no shift explains where the two do not belong together
_FEWEST_PARTS, _MOST_PARTS = 8, 24  # judged: of a recording, whose delays tell how fast the output's clock runs
_PART = 25.0  # [s]; as much as is looked at for a delay
_CLEAR_DRIFT = 4.5  # standard errors; four in a thousand steady clocks by Student's t with 6 degrees of freedom
_ROUNDS = 5  # judged: of correcting the speed of a clock
_DAY = 86400.0  # [s]
_STATE = 'state what is to be added to the output\'s times, clock_shift = { value = ..., unit = "s" } in its [[recording]].'


@dataclass(frozen=True)
class ClockShift:
    """How the clock of the output's logger was brought to that of the input's.

    Args:
        value: What was added to the times of the output [s]; to those from the input's first date where both have dates.
        source: What says it.
        rate: By how much the output's clock runs faster [1].
    """

    value: float
    source: Literal["forces", "dates", "stated"]
    rate: float = 0.0

    def describe(self, raw: RawRecording, delay: float, sd: float) -> str:
        """Return the sentence for users.

        Args:
            raw: The recording.
            delay: How much later the output is after the shift [s].
            sd: Standard error of the shift [s]; NaN where it is taken as it is.
        """
        finite = np.isfinite(sd)
        value = self.value - delay - (0.0 if self.source == "forces" else date_shift(raw))
        total = f"the output's clock was shifted by {value:+.4f} s" + (f" ± {sd:.4f} s" if finite else "")
        origin = {
            "forces": f"{total}, found from the forces",
            "dates": f"the clocks were paired by their dates{f', and {total}, found from the forces' if finite else ''}",
            "stated": f"{total}, as stated{' and refined by the forces' if delay else ''}",
        }[self.source]
        ppm = 1e6 * self.rate
        drift = f"; it runs {abs(ppm):.3g} ppm {'fast' if ppm > 0 else 'slow'}, which was corrected" if ppm else ""
        return f"{raw.file}: {origin}{drift}."


def align_clocks(
    raw: RawRecording, stated: QuantityValue | str | None, settings: Preparation
) -> tuple[RawRecording, ClockShift, Preparation]:
    """Return a recording of two loggers with the output on the input's clock, the shift, and how to prepare it.

    Args:
        raw: The recording, each force on the clock of its logger.
        stated: The stated shift, or "estimated" from the forces; None for dates if both clocks have them, else estimated.
        settings: How it is to be prepared.

    Raises:
        DatasetError: The two do not overlap, do not belong together, or fit about as well at several shifts.
    """
    _refuse_tables(raw)
    check_channels(raw)
    by_dates = None if stated == "estimated" else _shift_by_dates(raw)
    if isinstance(stated, QuantityValue):
        value = stated.to("time") + (by_dates or 0.0)
        shift, what = ClockShift(value, "stated"), f"clock_shift = {stated.value:g} {stated.unit}"
        if stated.sd is not None:
            settings = settings.model_copy(update={"delay": "none"})
    elif by_dates is not None:
        shift, what = ClockShift(by_dates, "dates"), "the dates of their clocks"
    else:
        return (*_align_by_forces(raw, settings), settings)
    _refuse_short_overlap(raw, shift.value, what)
    if not raw.loop:
        shift = _refine(raw, shift, what, settings)
    return (*_correct_drift(_shifted(raw, shift), settings, shift), settings)


def _refuse_tables(raw: RawRecording) -> None:
    """Refuse a few readings that a person may have written down.

    Raises:
        DatasetError: Says how to join them.
    """
    for end, force in (("input", raw.input_force), ("output", raw.output_force)):
        if len(force) < FEW_SAMPLES:
            raise DatasetError(
                f"{raw.file}: the {end} has {len(force)} readings, too few to find the shift between two clocks. If these are "
                "tables of readings, put them into one by hand, a row for each reading with the force at both ends."
            )


def check_determined(raw: RawRecording, shift: ClockShift, delay: Delay) -> None:
    """Refuse a shift that the forces should give, and do not.

    Raises:
        DatasetError: They do not determine it.
    """
    if shift.source != "stated" and delay.reason:
        raise DatasetError(
            f"{raw.file}: the shift between the clocks of the two loggers cannot be found from the forces, because "
            f"{delay.reason}. Record strokes both ways with quick reversals, or {_STATE}"
        )


def date_shift(raw: RawRecording) -> float:
    """Return what brings the output's dates onto the input's clock before any correction [s]; 0 without dates."""
    return _shift_by_dates(raw) or 0.0


def _shift_by_dates(raw: RawRecording) -> float | None:
    """Return what brings times of the output onto the input's clock by their dates [s]; None where one has none."""
    if raw.input_start is None or raw.output_start is None:
        return None
    if min(raw.input_start, raw.output_start) >= _DAY:
        return raw.output_start - raw.input_start
    apart = (raw.output_start - raw.input_start) % _DAY  # one has times of day without dates
    return apart - _DAY if apart > _DAY / 2 else apart


def _align_by_forces(raw: RawRecording, settings: Preparation) -> tuple[RawRecording, ClockShift]:
    if raw.loop:
        raise DatasetError(
            f"{raw.file}: the shift between the clocks of two loggers is not looked for in a pull-pull loop, whose forces pass "
            f"through zero; {_STATE}"
        )
    if settings.delay != "estimated":
        raise DatasetError(
            f"{raw.file}: a delay is stated, but the shift between the clocks of the two loggers, which contains it, is not. "
            'State it, clock_shift = { value = ..., unit = "s" }, or write delay = "estimated".'
        )
    scan = _scan(raw, settings)
    value, off = scan.best
    if off > _UNLIKE:
        raise DatasetError(
            f"{raw.file}: the output does not follow the input at any shift of its clock; {100 * off:.0f} % of its variance "
            "remain unexplained at the best one. The usual causes are files of different runs, files that share less than "
            "half of the shorter one, or a clock that runs at quite another speed. Give the files of one run, cut to what both "
            f"recorded, or {_STATE}"
        )
    if (other := scan.rival()) is not None:
        raise DatasetError(
            f"{raw.file}: the shift between the clocks of the two loggers is ambiguous, because the motion repeats itself: the "
            f"forces fit about as well with the output's clock shifted by {value:+.2f} s as by {other:+.2f} s. Record a start "
            f"that both see, such as a pause before the first stroke, or {_STATE}"
        )
    shift = ClockShift(value, "forces")
    return _correct_drift(_shifted(raw, shift), settings, shift)


def _refine(raw: RawRecording, shift: ClockShift, what: str, settings: Preparation) -> ClockShift:
    """Return the shift that fits best near a known one; refuse that where another fits far better.

    Raises:
        DatasetError: Another does.
    """
    scan = _scan(raw, settings)
    best, least = scan.best
    value, off = scan.best_near(shift.value)
    if least > _UNLIKE:
        return shift  # the forces do not tell
    if off > AS_WELL * least:
        known = date_shift(raw)
        raise DatasetError(
            f"{raw.file}: by {what} the output's clock is to be shifted by {shift.value - known:+.3f} s, but the forces fit "
            f"far better with {best - known:+.3f} s ({100 * off:.2g} % of the output's variance remain unexplained, against "
            f"{100 * least:.2g} %). The usual causes are clocks that were not set, other time zones, or a wrong sign. Correct "
            'the shift, or leave it to the forces: clock_shift = "estimated" in the [[recording]] of cable.toml.'
        )
    return replace(shift, value=value) if settings.delay == "estimated" else shift


def _refuse_short_overlap(raw: RawRecording, shift: float, what: str) -> None:
    """Refuse recordings of which less than half of the shorter one lies within the other.

    Raises:
        DatasetError: Says when each was recorded, on the input's clock.
    """
    ends = (raw.input_time[0], raw.input_time[-1]), (raw.output_time[0] + shift, raw.output_time[-1] + shift)
    common = min(ends[0][1], ends[1][1]) - max(ends[0][0], ends[1][0])
    if common < OVERLAP * min(float(np.ptp(raw.input_time)), float(np.ptp(raw.output_time))):
        shared = f"overlap for only {common:.4g} s" if common > 0 else "do not overlap"
        raise DatasetError(
            f"{raw.file}: by {what} the input was recorded from {ends[0][0]:.10g} to {ends[0][1]:.10g} s and the output from "
            f"{ends[1][0]:.10g} to {ends[1][1]:.10g} s, which {shared}; at least half of the shorter one must lie within the "
            "other. The usual causes are files of different runs, clocks that were not set, or other time zones. Give the "
            'files of one run, cut to what both recorded; or leave the clocks aside: clock_shift = "estimated" in the '
            "[[recording]] of cable.toml."
        )


def _shifted(raw: RawRecording, shift: ClockShift) -> RawRecording:
    """Return the recording with the shift added to the times of the output."""
    return replace(raw, output_time=raw.output_time + shift.value)


def _scan(raw: RawRecording, settings: Preparation) -> ShiftScan:
    """Compare the output with what the play operator makes of the input, at every shift."""
    for name, force in (("input_force", raw.input_force), ("output_force", raw.output_force)):
        if settings.tare != "interval":
            check_sign(raw, name, force)
    return scan_shifts(raw.input_time, raw.input_force, raw.output_time, raw.output_force, _MOST_POINTS)


def _correct_drift(raw: RawRecording, settings: Preparation, shift: ClockShift) -> tuple[RawRecording, ClockShift]:
    """Return an aligned recording with the output's clock at the speed of the input's, where that clearly differs.

    A first correction brings parts within the range in which delays are looked for, whose drift the next one sees.
    """
    if settings.delay != "estimated" or raw.loop:
        return raw, shift
    total = 0.0
    for _ in range(_ROUNDS):
        rate, middle = _estimate_drift(raw, settings)
        if rate == 0:
            break
        raw, total = replace(raw, output_time=raw.output_time - rate * (raw.output_time - middle)), total + rate
    return raw, replace(shift, rate=total)


def _estimate_drift(raw: RawRecording, settings: Preparation) -> tuple[float, float]:
    """Return by how much the output's clock runs faster [1], 0 where that is not clear, and the middle of the recording [s].

    It is the slope of the delays of parts of the recording, with the standard error that their scatter about it gives.
    """
    count = int(np.clip(np.ptp(raw.input_time) / _PART, _FEWEST_PARTS, _MOST_PARTS))
    parts = delays_of_parts(inspect_recording(raw, settings), count)
    known = [(middle, delay.value) for middle, delay in parts if delay.sd > 0]
    if len(known) < _FEWEST_PARTS // 2:
        return 0.0, 0.0
    middles, delays = np.array(known).T
    apart = middles - middles.mean()
    rate = float(apart @ delays / (apart @ apart))
    scatter = delays - delays.mean() - rate * apart
    error = np.sqrt(scatter @ scatter / (len(delays) - 2) / (apart @ apart))
    return (rate if abs(rate) > _CLEAR_DRIFT * error else 0.0), float(middles.mean())
