"""Force at the motor against the displacement of the motor, and the history of its strokes and turns."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from bowdenfit.description import QuantityValue, Table
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.types import Flags, Labels, Vector

LEAST_SHARE = 0.01  # way back over all displacements from which it is a turn and no jitter; a judgement


ZERO = "displacement_zero"  # parameter: where the displacement of a run begins


@dataclass(frozen=True)
class Turns:
    """Turns of the motor, ordered so that a turn stands before those that come after it.

    Args:
        at: Displacement [mm].
        stroke: +1 where the motor pulled up to it, -1 where it let out; of the start of a run the way it is taken to have come.
        after: Number of the turn that it comes after; its own where all of the rope slides.
        run: Number of its run.
        depth: How many turns must be known before it.
    """

    at: Vector
    stroke: Labels
    after: Labels
    run: Labels
    depth: Labels


@dataclass(frozen=True)
class StrokeHistory:
    """Stroke of each reading, and the turn of the motor that it comes after.

    Args:
        stroke: +1 pulling, -1 letting out.
        after: Number of the turn it comes after.
        slides: Whether all of the rope is known to slide.
        first: Whether it belongs to the first stroke of its run, whose start nobody knows.
        turns: The turns.
    """

    stroke: Labels
    after: Labels
    slides: Flags
    first: Flags
    turns: Turns


def history_of_sliding_rope(stroke: Labels, displacement: Vector, run: Labels) -> StrokeHistory:
    """Return the history of readings that were all taken while the whole rope slides."""
    n, start = len(stroke), np.zeros(1, dtype=int)
    turns = Turns(displacement[:1], np.ones(1, dtype=int), start, run[:1], start)
    return StrokeHistory(stroke, np.zeros(n, dtype=int), np.ones(n, dtype=bool), np.zeros(n, dtype=bool), turns)


def follow_motor(displacement: Vector, run: Labels) -> StrokeHistory:
    """Return the history of readings in the order in which they were taken, run by run.

    A run starts as if the motor had come to its first displacement the other way, all of the rope sliding. Turns are
    remembered, and forgotten in pairs once the displacement has passed the one before, as friction between solids has it.

    Args:
        displacement: Displacement of each reading [mm].
        run: Number of its run.
    """
    n, memory = len(displacement), _Memory()
    stroke, after, slides, first = (np.zeros(n, dtype=int) for _ in range(4))
    least = LEAST_SHARE * max(np.ptp(displacement), 1e-300)
    for number in np.unique(run):
        rows = np.flatnonzero(run == number)
        x = displacement[rows]
        ends = _find_turns(x, least)
        way = 1 if len(ends) < 2 or x[ends[1]] >= x[ends[0]] else -1
        memory.begin(float(x[0]), -way, int(number))
        for k, (start, stop) in enumerate(pairwise(ends)):
            if k:
                memory.turn(float(x[start]), way, int(number))
                way = -way
            for i in range(start if k == 0 else start + 1, stop + 1):
                memory.pass_by(float(x[i]), way)
                stroke[rows[i]], slides[rows[i]], first[rows[i]] = way, not memory.open, k == 0
                after[rows[i]] = memory.open[-1] if memory.open else 0
    return StrokeHistory(stroke, after, slides.astype(bool), first.astype(bool), memory.turns())


def _find_turns(x: Vector, least: float) -> list[int]:
    """Return the first and last reading, and those between at which the displacement turned by more than jitter."""
    ends, far = [0], 0
    way = 0
    for i in range(1, len(x)):
        if way == 0:
            if abs(x[i] - x[0]) >= least:
                way, far = (1 if x[i] > x[0] else -1), i
        elif way * (x[i] - x[far]) >= 0:
            far = i
        elif way * (x[far] - x[i]) >= least:
            ends.append(far)
            way, far = -way, i
    return [*ends, len(x) - 1] if len(x) > 1 else [0, 0]


class _Memory:
    """Memory of turns, as in Preisach hysteresis: the turns so far, and which of them still matter."""

    def __init__(self) -> None:
        self.open: list[int] = []
        self._turns: list[tuple[float, int, int, int, int]] = []

    def begin(self, at: float, stroke: int, run: int) -> None:
        """Begin a run, and forget the turns of the one before."""
        self.open = []
        self._add(at, stroke, run)

    def turn(self, at: float, stroke: int, run: int) -> None:
        """Add a turn of the motor, which had moved one way."""
        self._add(at, stroke, run)

    def pass_by(self, at: float, way: int) -> None:
        """Move on to a displacement, and forget the pairs of turns that it passes."""
        while len(self.open) > 1 and way * (at - self._turns[self.open[-2]][0]) >= 0:
            self.open = self.open[:-2]

    def _add(self, at: float, stroke: int, run: int) -> None:
        number = len(self._turns)
        after = self.open[-1] if self.open else number
        depth = self._turns[after][4] + 1 if self.open else 0
        self._turns.append((at, stroke, after, run, depth))
        self.open.append(number)

    def turns(self) -> Turns:
        """Return all turns as arrays."""
        at, *others = zip(*self._turns, strict=True)
        return Turns(np.array(at), *(np.array(values, dtype=int) for values in others))


class DisplacementSettings(Table):
    """The table of force against displacement; what is at the far end, and how the rows were taken.

    Rows are readings in the order in which they were taken, or, with a column stroke, readings of a rope that slides.
    """

    end: Literal["spring", "stop"] = "spring"
    stop: QuantityValue | None = None
    rows: Literal["in order", "sliding"] | None = None


@dataclass(frozen=True)
class DisplacementTable:
    """Force at the motor against displacement.

    Args:
        route: Route variable; NaN where the cable has no route.
        force: Force at the motor [N].
        displacement: Displacement of the rope at the motor, growing as it pulls [mm].
        motion: How the motor moved.
        run: Number of the run (one mounting at one bend) of each row.
        run_names: Name of each run.
        used: Which rows are readings of what lies at the far end.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
        sliding: Whether rows are known to be taken while all of the rope slides.
    """

    route: Vector
    force: Vector
    displacement: Vector
    motion: StrokeHistory
    run: Labels
    run_names: tuple[str, ...]
    used: Flags
    own: OwnAngles
    origin: RowOrigin
    sliding: bool

    @property
    def pulls(self) -> Flags:
        """Readings that were taken while the motor pulled."""
        return self.used & (self.motion.stroke > 0)

    @property
    def shared(self) -> tuple[float, float]:
        """Range of displacements that pull and return have in common [mm]; its end is below its start without any."""
        x, back = self.displacement, self.used & (self.motion.stroke < 0)
        if not (self.pulls.any() and back.any()):
            return 0.0, -1.0
        return max(x[self.pulls].min(), x[back].min()), min(x[self.pulls].max(), x[back].max())
