r"""What the channels of a recording reveal about its bench: a zero that jumps, friction that changes, crosstalk, and drag.

A bench with one of these faults makes a smooth loop that looks healthy, and another coefficient. So the play operator is fitted
with and without each fault, with friction exponent, gain, drag and delay free, and the fault that explains most is taken if it
explains far more than noise of as many independent blocks would, and matters. What changes gradually in time is fitted as well:
a jump must explain more than a drift of a zero, a trend of friction, or friction that depends on speed does.

For a fault with one parameter, of blocks whose deviations stay alike over :math:`\tau` of them,

.. math:: F = \frac{S_0 - S_1}{S_1 \tau / n}

with the robust sums of squares without the fault and with it. Least squares of the whole cable see none of these: they weigh
the sliding blocks of a mounting by how far mountings differ.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from bowdenfit.recordings.preparation.blocks import FINER
from bowdenfit.recordings.preparation.hysteresis import (
    Deviations,
    play_between,
    robust_minimum,
    smooth_input,
    white_noise,
)
from bowdenfit.recordings.preparation.noise import correlation_time
from bowdenfit.recordings.recording import Blocks, Recording
from bowdenfit.types import OtherLabels, Vector

FaultKind = Literal["input_zero", "output_zero", "friction", "crosstalk", "drag", "creep", "none"]

# Judged where nothing else is said; tests/recordings/test_bench_faults.py counts false alarms.
_MOST_BLOCKS, _STRETCH = 800, 50  # more say no more about a fault; blocks of each of the stretches that are taken of more
_OF_CYCLE = 24  # blocks that thinning leaves of a cycle
_FEWEST_BLOCKS = 60  # of a recording in which a fault can be told from noise
_PLACES = np.linspace(0.1, 0.9, 17)  # of the recording, at which a jump is looked for
_SLIDES = 5  # blocks safely inside sliding phases before a jump, and after it, of which it can be told; a judgement
_SCREENED = 0.05  # share of the sum of squares that a fault must explain to first order to be fitted
_CLEAR = 50.0  # F from which a fault is not taken for noise
_SHOWN = 20.0  # F from which shorter blocks show crosstalk as well, and creep where something departs from the model
_MATTERS: dict[FaultKind, float] = {"input_zero": 0.02, "output_zero": 0.02, "friction": 0.1, "crosstalk": 0.02}
_MOVED = 0.05  # relative change of the friction exponent by a drag that is left out, from which the drag is named
_LEAST = 1e-3  # of the typical output, below which no logarithm is taken
_STEP = 1e-4  # of numerical slopes
_SLOWEST = 0.01  # of the fastest change, below which friction is taken to depend on speed no more; a judgement
_SOME_DRAG = 0.05  # of the typical output, from which a second search starts
_EXPONENT, _CENTER, _DRAG, _DELAY, _SIZE, _SHARE = range(6)
_USUAL = (_EXPONENT, _CENTER, _DRAG, _DELAY)
_LIMITS = np.array([[1e-6, -1.0, 0.0, -3.0, -0.9, 0.0], [5.0, 1.0, 1.0, 3.0, 5.0, 0.3]])  # of each; the delay in blocks
_SIZES: dict[FaultKind, tuple[float, float]] = {
    "input_zero": (-1.0, 1.0),
    "output_zero": (-1.0, 1.0),
    "crosstalk": (0.0, 0.3),
    "creep": (2e-3, 1.0),
}
# F up to which crosstalk adds nothing to creep. In the shortest blocks of ropes that creep, LuGre's too, it was 0.3 at most; of
# 28 benches with crosstalk of 5 % 10 and more but for one, which seems to creep by 0.038.
_ADDS = 4.0
_LEAST_CREEP = 0.05  # force that moves while friction builds up, over the friction, from which it is told from 5 % of crosstalk
_CREPT = 0.1  # relative change of the friction exponent by creep, up to which blocks safely inside sliding show the right one
_SOME_CREEP = 0.05  # force that moves while friction builds up, over the friction, from which its search starts
_ALMOST = 0.95  # share of the friction from which a rope that creeps counts as sliding


@dataclass(frozen=True)
class BenchFault:
    """A fault of the bench that a recording shows.

    Args:
        kind: What it is.
        size: Jump of a zero, or drag [N]; friction after over friction before, less 1; share of the input in the output.
        time: When it came [s]; NaN of what is there throughout.
        exponent: Friction exponent with the fault taken into account, before it came [1].
        usual_exponent: Friction exponent without it [1].
        significance: F of the docstring [1].
    """

    kind: FaultKind
    size: float
    time: float
    exponent: float
    usual_exponent: float
    significance: float


@dataclass(frozen=True)
class _Loop:
    """Blocks of a recording, thinned, and what is tried on them.

    Args:
        time: Middle of each block [s].
        force_in, likely, force_out: Input force, the same without its noise, and output force [N].
        noise: Standard deviations of the forces [N].
        level: Typical output force [N].
        starts: First block of each stretch.
    """

    time: Vector
    force_in: Vector
    likely: Vector
    force_out: Vector
    noise: tuple[float, float]
    level: float
    starts: OtherLabels

    def deviations(self, p: np.ndarray, fault: FaultKind, shape: Vector) -> Vector:
        """Return deviations from the play operator in units of their noise.

        Args:
            p: Friction exponent, log ratio of the gains, drag over the level, delay [s], size of the fault, and crosstalk next
                to it.
            fault: Which fault.
            shape: How much of it is there in each block.
        """
        size, drag, least = p[_SIZE] * shape, self.level * p[_DRAG], _LEAST * self.level
        force_in, likely, band = self.force_in, self.likely, p[_EXPONENT] * np.ones(len(shape))
        force_out = np.interp(self.time + p[_DELAY], self.time, self.force_out) - p[_SHARE] * likely
        if fault == "input_zero":
            force_in, likely = force_in - self.level * size, likely - self.level * size
        elif fault == "output_zero":
            force_out = force_out - self.level * size
        elif fault == "crosstalk":
            force_out = force_out - size * likely
        elif fault == "friction":
            band = band * np.maximum(1 + size, 0.0)
        force_in, likely, force_out = (np.maximum(force, least) + drag for force in (force_in, likely, force_out))
        x, moved, y = np.log(force_in), np.log(likely), np.log(force_out) + p[_CENTER]
        lower, upper, ends = moved - band, moved + band, [*self.starts[1:], len(y)]
        stretches = list(zip(self.starts, ends, strict=True))
        if fault == "creep":
            parts = [_creep(moved[a:b], float(moved[a] - y[a]), p[_EXPONENT], 1 / p[_SIZE]) for a, b in stretches]
        else:
            parts = [play_between(lower[a:b], upper[a:b], float(y[a])) for a, b in stretches]
        followed, state = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        followed += np.where(state != 0, x - moved, 0.0)
        return (y - followed) / np.hypot(self.noise[0] / force_in, self.noise[1] / force_out)

    @cached_property
    def block(self) -> float:
        """Typical time between blocks [s]."""
        return float(np.median(np.diff(self.time)))

    @cached_property
    def log_rate(self) -> Vector:
        """Logarithm of how fast the input changes, over its median: that of the speed where a spring holds the far end."""
        rate = np.abs(np.gradient(self.likely, self.time))
        rate = np.log(np.maximum(rate, _SLOWEST * np.max(rate)))
        return rate - np.median(rate)

    def minimum(self, start: np.ndarray, free: Sequence[int], fault: FaultKind, shape: Vector) -> tuple[np.ndarray, float]:
        """Return the parameters of the least robust cost, of which only some are free, and that cost."""
        chosen, limits = list(free), _LIMITS.copy()
        limits[:, _DELAY] *= self.block
        if fault in _SIZES:
            limits[:, _SIZE] = _SIZES[fault]

        def model(part: np.ndarray) -> Deviations:
            point = start.copy()
            point[chosen] = part
            return self.linearized(point, chosen, fault, shape)

        least, most = limits[:, chosen]
        part, cost = robust_minimum(model, np.clip(start[chosen], least, most), least, most)
        point = start.copy()
        point[chosen] = part
        return point, cost

    def linearized(self, point: np.ndarray, chosen: Sequence[int], fault: FaultKind, shape: Vector) -> Deviations:
        """Return deviations, and their slopes by some of the parameters."""
        deviation, slopes = self.deviations(point, fault, shape), []
        for i in chosen:
            step = _STEP * (self.block if i == _DELAY else 1.0)
            changed = point.copy()
            changed[i] += step
            slopes.append((self.deviations(changed, fault, shape) - deviation) / step)
        return deviation, np.stack(slopes, axis=1)

    def significance(self, fit: tuple[np.ndarray, float], fault: FaultKind, shape: Vector, cost: float) -> float:
        """Return F of a fit with a fault against the cost of one without it."""
        alike = correlation_time(self.deviations(fit[0], fault, shape))
        return (cost - fit[1]) / max(fit[1], 1e-12) * len(self.time) / alike


def _creep(log_input: Vector, friction: float, exponent: float, stiffness: float) -> tuple[Vector, Vector]:
    r"""Return the log output of a rope that creeps (Dahl's model), and where it slides: 1 pulling, -1 returning, 0 neither.

    While the input moves one way, :math:`f' = k (1 - f / \Lambda) y'` and :math:`x' = y' + f'` have the solution
    :math:`w + \log w = \mathrm{const} - k x / \Lambda` with :math:`w = k (1 - f / \Lambda)`, which is Wright's omega function.

    Args:
        log_input: Log input force of successive blocks.
        friction: Log ratio of input and output of the first.
        exponent, stiffness: Friction exponent, and k.
    """
    from scipy.special import wrightomega  # takes half a second to load, and few recordings need it

    frictions, friction = [friction], float(np.clip(friction, -exponent, exponent))
    for step in np.diff(log_input):
        sign = 1.0 if step >= 0 else -1.0
        w = max(stiffness * (1 - sign * friction / exponent), 1e-12)
        friction = sign * exponent * (1 - float(wrightomega(w + np.log(w) - stiffness * abs(step) / exponent)) / stiffness)
        frictions.append(friction)
    followed = np.array(frictions)
    return log_input - followed, np.where(np.abs(followed) > _ALMOST * exponent, np.sign(followed), 0.0)


def find_bench_fault(recording: Recording, *, expects_drag: bool = False, expects_creep: bool = False) -> BenchFault | None:
    """Return the fault of the bench that explains most of what the play operator leaves unexplained; None without a clear one.

    Args:
        recording: A recording of a single rope.
        expects_drag: Whether the fit has a drag, or offsets of the cells, so that one is no fault.
        expects_creep: Whether the fit has a rope that creeps after a reversal, as crosstalk makes it seem.
    """
    loop = _thin_blocks(recording.blocks)
    if loop is None:
        return None
    strokes, none = recording.strokes, np.zeros(len(loop.time))
    start = np.array([max(strokes.exponent, 1e-3), strokes.center, 0.0, 0.0, 0.0, 0.0])
    starts = start, start + np.array([0.0, 0.0, _SOME_DRAG, 0.0, 0.0, 0.0])
    usual, cost = min((loop.minimum(s, _USUAL, "none", none) for s in starts), key=lambda fit: fit[1])
    jumps: tuple[FaultKind, ...] = ("input_zero", "output_zero", "friction")
    places = _places_between_slides(recording, loop)
    faults = [fault for kind in jumps if (fault := _find_jump(loop, usual, cost, kind, places))] if len(places) else []
    everywhere = np.ones(len(loop.time))
    if not expects_creep and _screen(loop, usual, "crosstalk", [everywhere])[0] > _SCREENED:
        fit = loop.minimum(usual, (*_USUAL, _SIZE), "crosstalk", everywhere)
        faults.append(_make_fault(loop, "crosstalk", fit, everywhere, np.nan, usual, cost))
    clear = [f for f in faults if f.significance > _CLEAR and abs(f.size) > _MATTERS[f.kind] * _scale(loop, f.kind)]
    if any(fault.kind == "crosstalk" for fault in clear):
        finest = _refine(recording, loop, usual, cost)
        clear = [f for f in clear if f.kind != "crosstalk" or _shows_within_blocks(*finest)]
    if clear:
        clearest = max(clear, key=lambda fault: fault.significance)
        creep = _find_creep(*finest, clearest) if clearest.kind == "crosstalk" else None
        # Blocks safely inside sliding phases give the friction of a rope that creeps little: of ten ropes within 1.2 %.
        return None if creep is not None and abs(creep.exponent / creep.usual_exponent - 1) < _CREPT else clearest
    return None if expects_drag else _find_drag(loop, usual, cost, start)


def shows_creep(recording: Recording) -> bool:
    """Return whether the rope of a recording creeps after its reversals, rather than that its cells have crosstalk."""
    loop, strokes = _thin_blocks(recording.blocks), recording.strokes
    if loop is None:
        return False
    start = np.array([max(strokes.exponent, 1e-3), strokes.center, 0.0, 0.0, 0.0, 0.0])
    fit = loop.minimum(start, _USUAL, "none", np.zeros(len(loop.time)))
    loop, usual, cost = _refine(recording, loop, *fit)
    everywhere = np.ones(len(loop.time))
    crossed = loop.minimum(usual, (*_USUAL, _SIZE), "crosstalk", everywhere)
    creep = _find_creep(loop, usual, cost, _make_fault(loop, "crosstalk", crossed, everywhere, np.nan, usual, cost))
    return creep is not None and creep.significance > _SHOWN


def _refine(recording: Recording, loop: _Loop, usual: np.ndarray, cost: float) -> tuple[_Loop, np.ndarray, float]:
    """Return shorter blocks and their fit without a fault; the usual ones where there are none."""
    finer = _thin_blocks(recording.blocks.finer, FINER) if recording.blocks.finer is not None else None
    return (loop, usual, cost) if finer is None else (finer, *finer.minimum(usual, _USUAL, "none", np.zeros(len(finer.time))))


def _shows_within_blocks(loop: _Loop, usual: np.ndarray, cost: float) -> bool:
    """Return whether crosstalk shows in the shortest blocks as well.

    The block in which the rope begins to slide holds both: its mean output has moved, and its mean input may not have crossed
    the play. Where a phase of sticking has few blocks, that looks like crosstalk of several percent. In shorter blocks two such
    healthy benches had F of 0 and 7, and eight with 5 % of crosstalk 41 and more; of 120 of each, none and 55 are named.
    """
    everywhere = np.ones(len(loop.time))
    fit = loop.minimum(usual, (*_USUAL, _SIZE), "crosstalk", everywhere)
    return loop.significance(fit, "crosstalk", everywhere, cost) > _SHOWN and fit[0][_SIZE] > _MATTERS["crosstalk"] / 2


def _find_creep(loop: _Loop, usual: np.ndarray, cost: float, crosstalk: BenchFault) -> BenchFault | None:
    """Return how a rope creeps after reversals; None if it does not, or if the cells have crosstalk.

    Both are fitted at once: crosstalk moves the output as soon as the motor turns round, and creep only as friction has built
    up, so that of a rope that creeps no crosstalk is left. Blocks of the usual length are too long to tell that.
    """
    everywhere, creeps, both = np.ones(len(loop.time)), usual.copy(), usual.copy()
    creeps[_SIZE] = _SOME_CREEP
    fit = loop.minimum(creeps, (*_USUAL, _SIZE), "creep", everywhere)
    both[[_EXPONENT, _SIZE, _SHARE]] = crosstalk.exponent, _SIZES["creep"][0], crosstalk.size
    fits = (loop.minimum(start, (*_USUAL, _SIZE, _SHARE), "creep", everywhere) for start in (fit[0], both))
    adds = loop.significance(min(fits, key=lambda fit: fit[1]), "creep", everywhere, fit[1])
    creep = _make_fault(loop, "creep", fit, everywhere, np.nan, usual, cost)
    return creep if adds < _ADDS and creep.size > _LEAST_CREEP else None


def _places_between_slides(recording: Recording, loop: _Loop) -> Vector:
    """Return the places of the recording at which a jump may be: a rope that only sticks before it or after it shows none.

    There one level of the output alone speaks for the jump, with the noise of the block in which the rope stopped.
    """
    slides = recording.blocks.time[recording.strokes.used_sliding]
    if len(slides) < 2 * _SLIDES:
        return np.zeros(0)
    first, last = (slides[[_SLIDES - 1, -_SLIDES]] - loop.time[0]) / np.ptp(loop.time)
    return _PLACES[(first < _PLACES) & (last > _PLACES)]


def _find_jump(loop: _Loop, usual: np.ndarray, cost: float, kind: FaultKind, places: Vector) -> BenchFault | None:
    """Return a jump of one kind that explains more than any gradual change does, and than friction that depends on speed."""
    elapsed = (loop.time - loop.time[0]) / np.ptp(loop.time)
    steps = [np.where(elapsed > place, 1.0, 0.0) for place in places]
    gains = _screen(loop, usual, kind, steps)
    best = int(np.argmax(gains))
    if gains[best] < _SCREENED:
        return None
    near = [i for i in (best, best - 1, best + 1) if 0 <= i < len(steps)]
    fits = {i: loop.minimum(usual, (*_USUAL, _SIZE), kind, steps[i]) for i in near}
    best = min(fits, key=lambda i: fits[i][1])
    gradual: tuple[FaultKind, ...] = ("input_zero", "output_zero", "friction")
    trends = [loop.minimum(usual, (*_USUAL, _SIZE), other, elapsed - 0.5)[1] for other in gradual]
    trends.append(loop.minimum(usual, (*_USUAL, _SIZE), "friction", loop.log_rate)[1])
    if min(trends) < fits[best][1]:
        return None
    time = float(loop.time[0] + places[best] * np.ptp(loop.time))
    return _make_fault(loop, kind, fits[best], steps[best], time, usual, cost)


def _find_drag(loop: _Loop, usual: np.ndarray, cost: float, start: np.ndarray) -> BenchFault | None:
    """Return a drag without which the friction exponent would be another."""
    none = np.zeros(len(loop.time))
    without = usual.copy()
    without[_DRAG] = 0.0
    plain_fits = (loop.minimum(point, (_EXPONENT, _CENTER, _DELAY), "none", none) for point in (without, start))
    plain, plain_cost = min(plain_fits, key=lambda fit: fit[1])
    significance = loop.significance((usual, cost), "none", none, plain_cost)
    if significance < _CLEAR or abs(plain[_EXPONENT] / usual[_EXPONENT] - 1) < _MOVED:
        return None
    exponents = float(usual[_EXPONENT]), float(plain[_EXPONENT])
    return BenchFault("drag", float(usual[_DRAG]) * loop.level, np.nan, *exponents, significance)


def _screen(loop: _Loop, usual: np.ndarray, kind: FaultKind, shapes: Sequence[Vector]) -> list[float]:
    """Return the share of the sum of squares that a fault of each shape explains to first order."""
    residuals, slopes = loop.linearized(usual, _USUAL, "none", np.zeros(len(loop.time)))
    followed, _ = np.linalg.qr(slopes)
    left = residuals - followed @ (followed.T @ residuals)
    columns = (loop.linearized(usual, [_SIZE], kind, shape)[1][:, 0] for shape in shapes)
    columns = (column - followed @ (followed.T @ column) for column in columns)
    total = float(left @ left)
    return [float((column @ left) ** 2 / max(column @ column, 1e-300) / max(total, 1e-300)) for column in columns]


def _make_fault(
    loop: _Loop,
    kind: FaultKind,
    fit: tuple[np.ndarray, float],
    shape: Vector,
    time: float,
    usual: np.ndarray,
    cost: float,
) -> BenchFault:
    """Return a fitted fault in its units."""
    exponents = float(fit[0][_EXPONENT]), float(usual[_EXPONENT])
    return BenchFault(
        kind, float(fit[0][_SIZE]) * _scale(loop, kind), time, *exponents, loop.significance(fit, kind, shape, cost)
    )


def _scale(loop: _Loop, kind: FaultKind) -> float:
    """Return what the size of a fault is measured in."""
    return loop.level if kind in ("input_zero", "output_zero") else 1.0


def _thin_blocks(blocks: Blocks, finer: int = 1) -> _Loop | None:
    """Return blocks under tension, of very many those of stretches evenly from the whole recording; None of too few.

    Args:
        blocks: The blocks.
        finer: How many there are to a usual block.
    """
    usable = np.flatnonzero(~blocks.saturated & (blocks.input_force > 0) & (blocks.output_force > 0))
    if len(usable) < _FEWEST_BLOCKS:
        return None
    most, stretch = finer * _MOST_BLOCKS, finer * _STRETCH
    likely = smooth_input(blocks.input_force[usable])
    heading = np.sign(np.diff(likely))
    cycles = np.count_nonzero(np.diff(heading[heading != 0])) / 2
    thin = max(min(len(usable) // most, int(len(usable) / max(cycles, 1.0) / (finer * _OF_CYCLE))), 1)
    chosen, starts = np.arange(0, len(usable), thin), np.zeros(1, dtype=int)
    if len(chosen) > 2 * most:
        count = most // stretch
        begins = np.linspace(0, len(chosen) - stretch, count).astype(int)
        chosen, starts = chosen[(begins[:, None] + np.arange(stretch)).ravel()], np.arange(count) * stretch
    noise = [white_noise(force[usable][::thin]) for force in (blocks.input_force, blocks.output_force)]
    places = usable[chosen]
    force_in, force_out = blocks.input_force[places], blocks.output_force[places]
    level = float(np.median(force_out))
    least = 1e-5 * level
    return _Loop(
        blocks.time[places],
        force_in,
        likely[chosen],
        force_out,
        (max(noise[0], least), max(noise[1], least)),
        level,
        starts,
    )


def describe_bench_fault(fault: BenchFault, file: str) -> str:
    """Describe a fault of a bench, with its usual cause and what to do."""
    with_and_without = f"the friction exponent is {fault.exponent:.3g} with it, and {fault.usual_exponent:.3g} without"
    end = "input" if fault.kind == "input_zero" else "output"
    jump = (
        f"the zero of {end}_force jumps by {fault.size:+.2g} N at about {fault.time:.3g} s; {with_and_without}. The usual "
        "cause is a load cell that was tared or hit in the middle of a recording. Cut the file there into two recordings."
    )
    sentences = {
        "friction": f"friction changes at about {fault.time:.3g} s, from an exponent of {fault.exponent:.3g} to "
        f"{fault.exponent * (1 + fault.size):.3g}. The usual causes are grease, a rope that settles, and a cable that was "
        "moved or remounted. Cut the file there into two recordings, each a run of its own.",
        "crosstalk": f"right after each reversal, while the rope sticks, the output moves by {100 * fault.size:.2g} % of the "
        "input. The usual causes are crosstalk between the load cells or their amplifiers, and a rope that creeps. Load each "
        "cell by itself and read the other; if it stays still, fit with --friction dahl.",
        "drag": f"not all of the lost force is in proportion to the load: the loop shows a drag of {fault.size:.2g} N; "
        f"{with_and_without}. The usual causes are adhesion, seals, bending stiffness, and a zero that is wrong. Fit with "
        "--friction drag, and tare the load cells with the rope slack.",
    }
    return f"{file}: {sentences.get(fault.kind, jump)}"
