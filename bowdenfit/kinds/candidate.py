"""One reading, or one run, that could be taken next: what a kind of measurement offers, and how it would be read."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jax import Array

from bowdenfit.cable.cable import CableContacts
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.kinds.tables import AngleTable, Measurements

UNKNOWN_SCATTER = "the fit does not know how such readings scatter, because it has no table of them"
GRID, MOST_ANGLES, MOST_LOADS = 11, 9, 5  # default candidates: lengths without choices, wrap angles, loads; judgements
USUAL_LOAD = 20.0  # load of examples [N]
STROKE_WORDS = {1: "pulling", -1: "returning"}
Simulate = Callable[[Mapping[str, Array], Any, Array], Array]


@dataclass(frozen=True, eq=False)
class Candidate:
    """One reading, or one run, that could be taken next.

    Args:
        kind: Name of its `CandidateKind`.
        route: Value of the route variable; NaN without one.
        angles: Wrap angles [rad]: of the contacts measured row by row, in the order of their columns, or the total one.
        load: Load of the rope, or input force of a loop or of all readings of a run [N]; NaN where the kind has none, or of
            a run with the loads of those made so far.
        stroke: Stroke of all readings of a run, +1 pulling and -1 returning; 0 as in those made so far.
    """

    kind: str
    route: float = float("nan")
    angles: tuple[float, ...] = ()
    load: float = float("nan")
    stroke: int = 0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Candidate) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @property
    def _key(self) -> tuple[object, ...]:
        """Fields by which two candidates are equal; None stands for NaN, which equals nothing."""
        route, load = (None if np.isnan(value) else value for value in (self.route, self.load))
        return self.kind, route, self.angles, load, self.stroke


@dataclass(frozen=True)
class Situation:
    """The cable and its measurements before the next one.

    Args:
        cable: The cable.
        measurements: Measurements so far, whose angles hold outside the range of the curves.
        parameters: Names of the model's parameters.
    """

    cable: CableContacts
    measurements: Measurements
    parameters: frozenset[str]

    @property
    def angles(self) -> AngleTable | None:
        """Measured wrap angles."""
        return self.measurements.table(AngleTable)

    @property
    def columns_without_curve(self) -> tuple[str, ...]:
        """Columns of contacts whose wrap angle is measured row by row."""
        return tuple(name for name in self.cable.description.angle_columns if name not in self.cable.curves)

    @property
    def lengths(self) -> list[float]:
        """Lengths that can be bought, or a grid over the range; none without a route."""
        route = self.cable.description.route
        return [] if route is None else [float(at) for at in (route.choices or np.linspace(*route.range, GRID))]

    def along_cable(self, kind: str, own: OwnAngles | None) -> list[Candidate]:
        """Return a candidate at each length, and at lengths outside the range at which angles were read."""
        route = self.cable.description.route
        if route is not None:
            read = self.angles.route if self.angles is not None else np.zeros(0)
            beyond = np.unique(read[(read < route.range[0]) | (read > route.range[1])])
            return [Candidate(kind, at) for at in sorted({*self.lengths, *(float(at) for at in beyond)})]
        if own is None or not self.columns_without_curve:
            return [Candidate(kind)]
        angles = np.column_stack([own.column(name)[0] for name in self.columns_without_curve])
        cases = np.unique(np.deg2rad(np.rad2deg(angles[np.isfinite(angles).all(axis=1)]).round(1)), axis=0)
        chosen = cases[_evenly_spaced(len(cases), MOST_ANGLES)] if len(cases) else cases
        return [Candidate(kind, angles=tuple(float(angle) for angle in case)) for case in chosen]

    def rows(self, wanted: Sequence[Candidate]) -> tuple[np.ndarray, OwnAngles, RowOrigin]:
        """Return route values, wrap angles and row origins of a table with one row a candidate."""
        n, names = len(wanted), self.cable.description.angle_columns
        own_angles = OwnAngles.none(names, n)
        for row, candidate in enumerate(wanted):
            for name, angle in zip(self.columns_without_curve, candidate.angles, strict=False):
                own_angles.angle[row, names.index(name)] = angle
        return np.array([c.route for c in wanted]), own_angles, RowOrigin.below_heading("next", n)


@dataclass(frozen=True)
class Simulation:
    """Readings of all candidates of one kind together.

    Args:
        simulate: Function of parameter values, data and a random key: all readings.
        data: Its data.
        columns: Which readings belong to each candidate.
        lowest: Detection limit: a lower reading is only known to be below it; minus infinity without one.
    """

    simulate: Simulate
    data: Any
    columns: Sequence[tuple[int, ...]]
    lowest: float = float("-inf")


class CandidateKind(ABC):
    """A measurement that can be made next; what a subclass must give is abstract here.

    A candidate is named by where it is read: at a value of the route where the cable has one and `along_route` holds, else at
    wrap angles; then by a load where it is `loaded`, or by one of the loads and strokes of `designs`.

    Attributes:
        along_route: Whether it is made at a value of the route, where there is one.
        angles: Which wrap angles name it elsewhere: none, those measured row by row, or the total one.
        loaded: Whether it is made under a load.
        measures_curves: Whether it is of the wrap angles themselves, so that no measured angle can stand in.
        mounted_anew: Whether each means mounting the cable anew.
    """

    along_route: bool = False
    angles: Literal["none", "columns", "total"] = "columns"
    loaded: bool = False
    measures_curves: bool = False
    mounted_anew: bool = False

    @property
    @abstractmethod
    def name(self) -> str:
        """Name as users write it before the @."""

    @property
    @abstractmethod
    def order(self) -> int:
        """Position among the candidate kinds where the user names none."""

    @property
    @abstractmethod
    def needs(self) -> tuple[str, ...]:
        """Parameters without which such readings cannot be simulated."""

    @property
    @abstractmethod
    def unknown(self) -> str:
        """Sentence that says why readings cannot be simulated where one of `needs` is missing."""

    @abstractmethod
    def candidates(self, at: Situation) -> list[Candidate]:
        """Return the candidates that the tables of the description can hold."""

    @abstractmethod
    def simulation(self, at: Situation, candidates: Sequence[Candidate]) -> Simulation:
        """Return how candidates would be read."""

    def is_possible(self, at: Situation) -> bool:
        """Return whether the cable is one that has such readings."""
        return True

    def designs(self, at: Situation) -> list[tuple[float, int]]:
        """Return loads [N] and strokes at which a run could be read, where a candidate leaves them open.

        NaN and 0 stand for those of the runs made so far.
        """
        return []

    def describe_usual(self, at: Situation) -> str:
        """Return loads and strokes of the runs made so far, in words; needed where there are `designs`."""
        return ""

    @property
    def noun(self) -> str:
        """Noun for one such reading or run, such as "force run"."""
        return self.name

    @property
    def phrase(self) -> str:
        """The noun with its article, such as "a stretch"."""
        return f"{'an' if self.noun[0] in 'aeiou' else 'a'} {self.noun}"

    @property
    def heading(self) -> str:
        """Heading of such candidates in figures."""
        return self.noun[0].upper() + self.noun[1:]

    def describe_measurement(self, cable: CableContacts) -> str:
        """Return what is measured, such as "the stretch"."""
        return f"the {self.noun}"

    def why_unknown(self, at: Situation) -> str:
        """Return why such readings cannot be simulated; empty where they can."""
        return "" if set(self.needs) <= at.parameters and self.is_possible(at) else self.unknown

    def example(self, at: Situation) -> Candidate:
        """Return a plausible candidate for this cable: halfway along the route, or at right angles."""
        lengths = at.lengths if self.along_route else []
        n = {"none": 0, "columns": len(at.columns_without_curve), "total": 1}[self.angles] if not lengths else 0
        route = lengths[len(lengths) // 2] if lengths else float("nan")
        return Candidate(self.name, route, (np.pi / 2,) * n, USUAL_LOAD if self.loaded else float("nan"))


def simulate_rows(term: Any) -> Simulation:
    """Return the simulation of candidates that are one row of a term each."""
    return Simulation(term.simulate, term.data, [(row,) for row in range(len(term.labels))])


def choose_loads(loads: np.ndarray, most: int = MOST_LOADS) -> list[float]:
    """Choose some of the measured loads, rounded to two digits: as they were meant, without the noise of reading."""
    return _choose_distinct(np.array([float(f"{load:.2g}") for load in loads if load > 0]), most)


def choose_wrap_angles(angles: np.ndarray) -> list[float]:
    """Choose some of the measured wrap angles [rad], rounded to a tenth of a degree."""
    return _choose_distinct(np.deg2rad(np.rad2deg(angles).round(1)), MOST_ANGLES)


def _choose_distinct(values: np.ndarray, most: int) -> list[float]:
    """Return the distinct values, evenly thinned where there are more than `most`."""
    different = np.unique(values)
    return [float(v) for v in different[_evenly_spaced(len(different), most)]] if len(different) else []


def _evenly_spaced(n: int, most: int) -> np.ndarray:
    """Return indices of at most `most` of n items, evenly spaced."""
    return np.unique(np.linspace(0, n - 1, most).round().astype(int))
