"""One clock for a recording whose input and output were logged by two loggers, each with a clock of its own.

The shift between the clocks is looked for with the play operator: the output that it predicts from the input is compared with
the measured one at every shift, for friction exponents from none to the largest at which the output still moves. The lag of a
plain correlation would be off by a part of a stroke, because the output stands still after each reversal of the input.

The best shift starts `preparation.delay`, which refines it and gives its standard error, as for two channels of one file.
A shift at which the output follows the input is only taken where no other fits nearly as well: periodic motion repeats.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from bowdenfit.description import Preparation, QuantityValue
from bowdenfit.errors import DatasetError
from bowdenfit.files.pieces import subsample
from bowdenfit.recordings.forces import FEW_SAMPLES
from bowdenfit.recordings.preparation import delays_of_parts, inspect_recording
from bowdenfit.recordings.preparation.blocks import main_frequency
from bowdenfit.recordings.preparation.checks import check_channels, check_sign
from bowdenfit.recordings.preparation.delay import RANGE, Delay
from bowdenfit.recordings.preparation.segments import play_along_rows
from bowdenfit.recordings.recording import RawRecording
from bowdenfit.types import OtherVector, Vector

_STEP = 0.005  # [s] between points, at least
_MOST_POINTS = 1 << 18  # of the longer recording; a day at three points a second
_EXPONENTS = np.linspace(0.0, 0.45, 12)  # over the range of log input force; at half of it the output stands still
_STARTS = np.array([-1.0, 0.0, 1.0])  # where in its band the rope may be at the start, in friction exponents
_LEAST_FORCE = 1e-3  # of the largest, below which a rope is slack
_WILD = 1e-3  # share of the forces at each end that may be spikes
_OVERLAP = 0.5  # judged: share of the shorter recording that must lie within the other
_MOVES = 0.3  # judged: of the output's variance, which the part in common must have at least
_UNLIKE = 0.2  # judged: share of the output's variance that no shift explains where the two do not belong together
# Ratio of what two shifts leave unexplained, up to which they fit about as well: over 2 to 100 cycles of 3 s, with pauses that
# one logger or both saw and noise of 0.3 or 3 % of the load, shifts that a pause does not tell apart differed by 1.3 times at
# most, and the others by 2 to 280 times.
_AS_WELL = 3.0
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


@dataclass(frozen=True)
class _Scan:
    """How well the output follows the input at each shift of its clock.

    Args:
        shift: What is added to the output's times [s].
        unexplained: Share of the output's variance that the input leaves unexplained; 1 where the two share too little.
        near: Shifts that differ by less are of one fit [s].
    """

    shift: Vector
    unexplained: Vector
    near: float

    def best_near(self, shift: float) -> tuple[float, float]:
        """Return the best shift near another, and what it leaves unexplained."""
        off = np.where(np.abs(self.shift - shift) <= self.near, self.unexplained, np.inf)
        best = int(np.argmin(off))
        return float(self.shift[best]), float(off[best])

    @property
    def best(self) -> tuple[float, float]:
        """The best shift, and what it leaves unexplained."""
        best = int(np.argmin(self.unexplained))
        return float(self.shift[best]), float(self.unexplained[best])

    def rival(self) -> float | None:
        """Return another shift that fits about as well as the best, with worse ones between them; None if there is none."""
        as_well = self.unexplained < _AS_WELL * self.best[1]
        best, worse = int(np.argmin(self.unexplained)), np.flatnonzero(~as_well)
        at = int(np.searchsorted(worse, best))
        first, last = (worse[at - 1] + 1 if at else 0), (worse[at] if at < len(worse) else len(as_well))
        as_well[first:last] = False
        as_well &= np.abs(self.shift - self.shift[best]) > self.near
        others = np.flatnonzero(as_well)
        return float(self.shift[others[np.argmin(self.unexplained[others])]]) if len(others) else None


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
    scan = _scan_shifts(raw, settings)
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
    scan = _scan_shifts(raw, settings)
    best, least = scan.best
    value, off = scan.best_near(shift.value)
    if least > _UNLIKE:
        return shift  # the forces do not tell
    if off > _AS_WELL * least:
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
    if common < _OVERLAP * min(float(np.ptp(raw.input_time)), float(np.ptp(raw.output_time))):
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


def _scan_shifts(raw: RawRecording, settings: Preparation) -> _Scan:
    """Compare the output with what the play operator makes of the input, at every shift."""
    for name, force in (("input_force", raw.input_force), ("output_force", raw.output_force)):
        if settings.tare != "interval":
            check_sign(raw.file, name, force)
    longest = max(float(np.ptp(raw.input_time)), float(np.ptp(raw.output_time)))
    usual = [float(np.median(np.diff(subsample(time)))) for time in (raw.input_time, raw.output_time)]
    step = max(_STEP, longest / _MOST_POINTS, *usual)
    x, is_x = _average(raw.input_time, raw.input_force, step)
    y, is_y = _average(raw.output_time, raw.output_force, step)
    log_input = np.log(np.maximum(x, _LEAST_FORCE * np.max(x)))
    explained = np.zeros(len(x) + len(y) - 1)
    reference = _Reference.of(is_x, y, is_y)
    rows = np.repeat(log_input[None], len(_STARTS), axis=0)
    for exponent in _EXPONENTS * np.ptp(log_input):
        for output in play_along_rows(rows, log_input[0] + exponent * _STARTS, np.array([exponent]))[0]:
            explained = np.maximum(explained, reference.explained_by(np.exp(output)))
    lags = np.arange(len(explained)) - (len(x) - 1)
    common = np.minimum(len(x), len(y) - lags) - np.maximum(0, -lags)
    unexplained = np.where(common >= _OVERLAP * min(len(x), len(y)), 1 - explained, 1.0)
    main = main_frequency(x, x, 1 / step)
    near = max(RANGE, 0.25 / main) if main > 0 else RANGE
    return _Scan(raw.input_time[0] - raw.output_time[0] - lags * step, unexplained, near)


def _average(time: OtherVector, force: OtherVector, step: float) -> tuple[Vector, Vector]:
    """Return means of the force on a coarse clock from its first sample, without wild readings, and which points have any."""
    there = np.isfinite(force)
    forces = np.clip(force, *np.quantile(subsample(force[there]), (_WILD, 1 - _WILD)))
    place = ((time - time[0]) / step).astype(int)
    count = np.bincount(place[there], minlength=place[-1] + 1)
    total = np.bincount(place[there], forces[there], minlength=place[-1] + 1)
    known = np.flatnonzero(count)
    return np.interp(np.arange(len(count)), known, total[known] / count[known]), (count > 0).astype(float)


@dataclass(frozen=True)
class _Reference:
    """A measured output with which predictions are compared at every lag, by transforms.

    Args:
        is_x: Points of the input that are known.
        size: Size of the transforms.
        of_output: Transforms of the output's weight, and of that times the output.
        count: Points in common at each lag.
        mean, variance: Of the output in these, in units of its standard deviation.
        enough: Whether that is enough, and moves.
    """

    is_x: np.ndarray
    size: int
    of_output: tuple[np.ndarray, np.ndarray]
    count: np.ndarray
    mean: np.ndarray
    variance: np.ndarray
    enough: np.ndarray

    @classmethod
    def of(cls, is_x: np.ndarray, y: np.ndarray, is_y: np.ndarray) -> "_Reference":
        """Return the reference for an input whose points are known where `is_x` is 1."""
        length = len(is_x) + len(y) - 1
        size = 1 << length.bit_length()
        y = (y - np.mean(y)) / np.std(y)
        of_weight, of_first, of_second = (np.fft.rfft(column, size) for column in (is_y, is_y * y, is_y * y**2))
        of_input = np.fft.rfft(is_x[::-1], size)
        n, first, second = (np.fft.irfft(of_input * of, size)[:length] for of in (of_weight, of_first, of_second))
        n = np.maximum(n, 1.0)
        variance = second / n - (first / n) ** 2
        enough = (variance > _MOVES) & (n > 0.5 * _OVERLAP * min(len(is_x), len(y)))
        return cls(is_x, size, (of_weight, of_first), n, first / n, variance, enough)

    def explained_by(self, predicted: np.ndarray) -> np.ndarray:
        """Return the squared correlation with a predicted output at each lag; 0 where it is negative or not enough is known."""
        scaled = (predicted - np.mean(predicted)) / max(float(np.std(predicted)), 1e-300)
        of_first, of_second = (np.fft.rfft((self.is_x * column)[::-1], self.size) for column in (scaled, scaled**2))
        products = of_first * self.of_output[0], of_second * self.of_output[0], of_first * self.of_output[1]
        first, second, both = (np.fft.irfft(product, self.size)[: len(self.count)] / self.count for product in products)
        covariance = both - first * self.mean
        variance = np.maximum((second - first**2) * self.variance, 1e-9)
        return np.where(self.enough & (covariance > 0), covariance**2 / variance, 0.0)


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
