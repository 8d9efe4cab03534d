"""How well the output follows the input at each shift of its clock, by the play operator.

The output that the operator predicts from the input is compared with the measured one at every shift, for friction exponents
from none to the largest at which the output still moves. The lag of a plain correlation would be off by a part of a stroke,
because the output stands still after each reversal of the input. The clocks of two loggers are paired by it, and a channel
that is later than `delay` looks for is found.
"""

from dataclasses import dataclass

import numpy as np

from bowdenfit.files.pieces import split_pieces, subsample
from bowdenfit.recordings.preparation.blocks import main_frequency
from bowdenfit.recordings.preparation.delay import RANGE
from bowdenfit.recordings.preparation.segments import play_along_rows
from bowdenfit.types import ChosenFlags, Flags, OtherVector, Vector

_STEP = 0.005  # [s] between points, at least
_EXPONENTS = np.linspace(0.0, 0.45, 12)  # over the range of log input force; at half of it the output stands still
_FINER = np.array([-0.75, -0.5, -0.25, 0.25, 0.5, 0.75])  # of the distance between them
_STARTS = np.array([-1.0, 0.0, 1.0])  # where in its band the rope may be at the start, in friction exponents
_LEAST_FORCE = 1e-3  # of the largest, below which a rope is slack
_HOLE = 0.05  # judged: of a period, from which a hole may hide a turn
_WILD = 1e-3  # share of the forces at each end that may be spikes
_MOVES = 0.3  # judged: of the output's variance, which the part in common must have at least
OVERLAP = 0.5  # judged: share of the shorter recording that must lie within the other
# Ratio of what two shifts leave unexplained, up to which they fit about as well: over 2 to 100 cycles of 3 s, with pauses that
# one logger or both saw and noise of 0.3 or 3 % of the load, shifts that a pause does not tell apart differed by 1.3 times at
# most, and the others by 2 to 280 times.
AS_WELL = 3.0
_FOLLOWED = 0.2  # judged: share of the output's variance that a late output may leave unexplained
_MUCH_BETTER = 3.0  # see AS_WELL
_BETTER = 1.5  # judged: the same, of an output whose delay lies at the end of the range or beyond it
_NEGLIGIBLE = 0.005  # judged: share of the output's variance that a late output leaves unexplained at least, when read as usual
_UNSURE = 0.04  # judged: of a quarter of the period; what a late output is not known to at best
_MUCH_LATER = 1.5  # judged: ratio of two delays from which the smaller is the likelier


@dataclass(frozen=True)
class LateOutput:
    """An output that is later than filters and buses make it.

    Args:
        delay: How much later it is [s]; negative where the input is.
        sd: Half the width of what fits about as well, at least a hundredth of the period [s].
        rival: Another delay that explains the output about as well; None if there is none [s].
    """

    delay: float
    sd: float
    rival: float | None


@dataclass(frozen=True)
class ShiftScan:
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

    @property
    def usual(self) -> float:
        """What the best shift within the range of `delay` leaves unexplained."""
        return float(np.min(self.unexplained, where=np.abs(self.shift) <= RANGE, initial=1.0))

    @property
    def follows(self) -> bool:
        """Whether the output follows the input within the range of `delay`, about as well as at any other shift."""
        least = self.best[1]
        return least <= _FOLLOWED and self.usual < _MUCH_BETTER * least

    def rival(self) -> float | None:
        """Return another shift that fits about as well as the best, with worse ones between them; None if there is none."""
        as_well = self.unexplained < AS_WELL * self.best[1]
        best, worse = int(np.argmin(self.unexplained)), np.flatnonzero(~as_well)
        after = int(np.searchsorted(worse, best))
        first, last = (worse[after - 1] + 1 if after else 0), (worse[after] if after < len(worse) else len(as_well))
        as_well[first:last] = False
        as_well &= np.abs(self.shift - self.shift[best]) > self.near
        rivals = np.flatnonzero(as_well)
        return float(self.shift[rivals[np.argmin(self.unexplained[rivals])]]) if len(rivals) else None

    def late_output(self, *, is_beyond: bool) -> LateOutput | None:
        """Return by how much an output is late beyond the range of `delay`.

        The shift nearest to none is taken; another one on that or the other side is ambiguous if it is not much larger. None
        where a delay within the range explains the output about as well, or nothing does.

        Args:
            is_beyond: Whether the delay is known to lie beyond the range, or at its end.
        """
        least = self.best[1]
        usual = self.usual
        if least > _FOLLOWED or usual < max((_BETTER if is_beyond else _MUCH_BETTER) * least, _NEGLIGIBLE):
            return None
        as_well = np.flatnonzero(self.unexplained <= np.sqrt(least * usual))
        valleys = np.split(as_well, np.flatnonzero(np.diff(as_well) > 1) + 1)
        valleys.sort(key=lambda valley: float(np.min(np.abs(self.shift[valley]))))
        shifts = [float(self.shift[valley[np.argmin(self.unexplained[valley])]]) for valley in valleys]
        best, wide = shifts[0], float(np.ptp(self.shift[valleys[0]]))
        rivals = [v for v in shifts[1:] if abs(v - best) > self.near and abs(v) < _MUCH_LATER * abs(best)]
        return LateOutput(-best, max(wide / 2, _UNSURE * self.near), -rivals[0] if rivals else None)


def scan_shifts(
    input_time: Vector,
    input_force: Vector,
    output_time: OtherVector,
    output_force: OtherVector,
    most_points: int,
    good: tuple[Flags, ChosenFlags] | None = None,
    overlap: float = OVERLAP,
) -> ShiftScan:
    """Compare the output with what the play operator makes of the input, at every shift.

    Args:
        input_time, input_force: Samples of the input [s, N].
        output_time, output_force: Samples of the output [s, N].
        good: Samples of both that may be used; None for all that are finite.
        overlap: Share of the shorter one that must lie within the other.
        most_points: Points of a coarse clock that the longer recording is averaged onto, at most.
    """
    longest = max(float(np.ptp(input_time)), float(np.ptp(output_time)))
    usual = [float(np.median(np.diff(subsample(time)))) for time in (input_time, output_time)]
    step = max(_STEP, longest / most_points, *usual)
    x, is_x = _average(input_time, input_force, good[0] if good else None, step)
    y, is_y = _average(output_time, output_force, good[1] if good else None, step)
    log_input = np.log(np.maximum(x, _LEAST_FORCE * np.max(x)))
    explained, main = np.zeros(len(x) + len(y) - 1), main_frequency(x, x, 1 / step)
    is_x = _drop_after_holes(is_x, 1 / (main * step)) if main > 0 else is_x
    reference = _Reference.of(is_x, y, is_y)
    rows = np.repeat(log_input[None], len(_STARTS), axis=0)
    exponents, apart = _EXPONENTS * np.ptp(log_input), np.ptp(log_input) * _EXPONENTS[1]
    for _ in range(2):  # the second time about the best of the first
        best = 0.0, 0.0
        for exponent in exponents:
            for output in play_along_rows(rows, log_input[0] + exponent * _STARTS, np.array([exponent]))[0]:
                followed = reference.explained_by(np.exp(output))
                best = max(best, (float(followed.max()), float(exponent)))
                explained = np.maximum(explained, followed)
        exponents = np.maximum(best[1] + apart * _FINER, 0.0)
    lags = np.arange(len(explained)) - (len(x) - 1)
    common = np.minimum(len(x), len(y) - lags) - np.maximum(0, -lags)
    unexplained = np.where(common >= overlap * min(len(x), len(y)), 1 - explained, 1.0)
    near = max(RANGE, 0.25 / main) if main > 0 else RANGE
    return ShiftScan(input_time[0] - output_time[0] - lags * step, unexplained, near)


def _drop_after_holes(is_x: np.ndarray, period: float) -> np.ndarray:
    """Return weights of the input without the period after each hole in which a turn may be missing.

    Only after a pull and a return does the operator follow the input again, whatever it was led through in the hole.

    Args:
        is_x: 1 where the input is known.
        period: Points of a cycle.
    """
    edges = np.diff(is_x, prepend=1.0, append=1.0)
    begins, ends = np.flatnonzero(edges < 0), np.flatnonzero(edges > 0)
    weights = is_x.copy()
    for end in ends[ends - begins > _HOLE * period]:
        weights[end : end + int(np.ceil(period))] = 0.0
    return weights


def _average(time: OtherVector, force: OtherVector, good: ChosenFlags | None, step: float) -> tuple[Vector, Vector]:
    """Return means of the force on a coarse clock from its first sample, without wild readings, and which points have any."""
    some = subsample(force)
    ends = np.quantile(some[np.isfinite(some)], (_WILD, 1 - _WILD))
    points = int((time[-1] - time[0]) / step) + 1
    count, total = np.zeros(points, dtype=int), np.zeros(points)
    for part in split_pieces(len(time)):
        there = np.isfinite(force[part]) if good is None else good[part]
        place = ((time[part] - time[0]) / step).astype(int)[there]
        count += np.bincount(place, minlength=points)
        total += np.bincount(place, np.clip(force[part][there], *ends), minlength=points)
    known = np.flatnonzero(count)
    return np.interp(np.arange(points), known, total[known] / count[known]), (count > 0).astype(float)


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
        y = (y - np.mean(y)) / max(float(np.std(y)), 1e-300)
        of_weight, of_first, of_second = (np.fft.rfft(column, size) for column in (is_y, is_y * y, is_y * y**2))
        of_input = np.fft.rfft(is_x[::-1], size)
        n, first, second = (np.fft.irfft(of_input * of, size)[:length] for of in (of_weight, of_first, of_second))
        n = np.maximum(n, 1.0)
        variance = second / n - (first / n) ** 2
        enough = (variance > _MOVES) & (n > 0.5 * OVERLAP * min(len(is_x), len(y)))
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
