"""Readings that could be taken next: what a candidate is, and what each draw of the posterior would give as its reading."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.draws import for_each_draw
from bowdenfit.kinds.angles.table import AngleSettings
from bowdenfit.kinds.angles.term import angles_term
from bowdenfit.kinds.efficiencies.term import efficiencies_term
from bowdenfit.kinds.loop.term import loop_term
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.preload.term import preload_term
from bowdenfit.kinds.row_angles import row_angles
from bowdenfit.kinds.stretch.term import stretch_term
from bowdenfit.kinds.tables import (
    AngleTable,
    EfficiencyTable,
    LoopTable,
    OwnAngles,
    PreloadTable,
    Provenance,
    StretchTable,
)
from bowdenfit.kinds.term import Term
from bowdenfit.model import Model
from bowdenfit.questions.next.possible_runs import RunDesign, run_readings

KINDS = ("angle", "force", "efficiency", "stretch", "preload", "loop")


@dataclass(frozen=True, eq=False)
class Candidate:
    """One reading, or one run, that could be taken next.

    Args:
        kind: One of `KINDS`.
        route: Value of the route variable; NaN without one.
        angles: Wrap angles [rad]: of the contacts measured row by row, in the order of their columns, or the total one.
        load: Load of the rope, or input force of a loop [N]; NaN where the kind has none.
    """

    kind: str
    route: float = float("nan")
    angles: tuple[float, ...] = ()
    load: float = float("nan")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Candidate) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @property
    def _key(self) -> tuple[object, ...]:
        """What makes two the same; NaN equals nothing, None does."""
        route, load = (None if np.isnan(value) else value for value in (self.route, self.load))
        return self.kind, route, self.angles, load


Columns = Mapping[int, tuple[int, ...]]  # places of each candidate's columns among its kind's readings
Simulate = Callable[[Mapping[str, Array], Any, Array], Array]


@dataclass(frozen=True)
class Simulation:
    """Readings of all candidates of one kind together.

    Args:
        simulate: Function of parameter values, data and a random key: all readings.
        data: Its data.
        columns: Which readings belong to which candidate.
        lowest: Reading below which nothing can be told but that it is below; minus infinity without one.
    """

    simulate: Simulate
    data: Any
    columns: Columns
    lowest: float = float("-inf")


def simulated_readings(
    model: Model,
    measurements: Measurements,
    candidates: Sequence[Candidate],
    design: RunDesign | None,
    z: np.ndarray,
    seed: int,
    repeats: int = 1,
) -> list[np.ndarray]:
    """The reading of each candidate as each draw would give it: arrays over draws, repeats and columns.

    Args:
        model: The fitted model; its parameters stay as they are.
        measurements: What was measured so far, whose angles hold outside the range of the curves.
        candidates: The candidates.
        design: Forces of a run; None where no candidate is one.
        z: Draws of the posterior, one a row.
        seed: Seed of the noise.
        repeats: How often each reading is taken, each time with a new mounting where it has one.
    """
    kinds = tuple(dict.fromkeys(c.kind for c in candidates))
    parts = {kind: _simulation(model, measurements, candidates, kind, design) for kind in kinds}
    data, key = {kind: part.data for kind, part in parts.items()}, jax.random.key(seed)

    def readings(z_and_number: Array, data: Any) -> dict[str, Array]:
        values, number = model.space.constrain(z_and_number[:-1]), z_and_number[-1].astype(jnp.uint32)
        keys = jax.random.split(jax.random.fold_in(key, number), (len(parts), repeats))
        return {
            kind: jax.vmap(lambda k, part=part, kind=kind: part.simulate(values, data[kind], k))(keys[i])
            for i, (kind, part) in enumerate(parts.items())
        }

    program = for_each_draw(readings, model.space.size + 1, data, run_once=True)
    drawn = program(np.column_stack([z, np.arange(len(z), dtype=float)]))
    return [
        np.maximum(drawn[c.kind][:, :, list(parts[c.kind].columns[i])], parts[c.kind].lowest)
        for i, c in enumerate(candidates)
    ]


def _simulation(
    model: Model, measurements: Measurements, candidates: Sequence[Candidate], kind: str, design: RunDesign | None
) -> Simulation:
    """All candidates of one kind as the rows of one table."""
    places = [i for i, c in enumerate(candidates) if c.kind == kind]
    wanted = [candidates[i] for i in places]
    if kind == "angle":
        return _angles(model, places, wanted)
    if kind == "force":
        assert design is not None  # the caller has one wherever there are runs
        rows = row_angles(model.description, _rows(model, wanted, EfficiencyTable), measurements.angles).data
        simulate, width = run_readings(model.cable, design)
        return Simulation(simulate, rows, {i: tuple(range(n * width, (n + 1) * width)) for n, i in enumerate(places)})
    term = _term(model, measurements, kind, wanted)
    return Simulation(term.simulate, term.data, {i: (n,) for n, i in enumerate(places)})


def _term(model: Model, measurements: Measurements, kind: str, wanted: Sequence[Candidate]) -> Term:
    """The likelihood's own term of a table with one row a candidate, which knows what such a row would read."""
    load = np.array([c.load for c in wanted])
    bend, origin = np.array([sum(c.angles) for c in wanted]), _origin(len(wanted))
    if kind == "efficiency":
        return efficiencies_term(model.cable, _rows(model, wanted, EfficiencyTable), measurements.angles)
    if kind == "stretch":
        up, alone = np.zeros(len(wanted), dtype=bool), np.arange(len(wanted))
        names = tuple(str(i) for i in alone)
        return stretch_term(model.cable, StretchTable(load, bend, 0.01 * load, up, load, alone, names, origin))
    if kind == "preload":
        return preload_term(model.cable, PreloadTable(bend, np.full(len(wanted), 20.0), origin))
    table = _rows(model, wanted, LoopTable)
    return loop_term(model.cable, replace(table, input_force=load, output_force=0.8 * load), measurements.angles)


def _rows(model: Model, wanted: Sequence[Candidate], table: type) -> Any:
    """A table with one unremarkable row a candidate, at its length and wrap angles."""
    n, names = len(wanted), model.description.angle_columns
    own = OwnAngles(names, np.full((n, len(names)), np.nan), np.full((n, len(names)), np.nan))
    without_curve = [k for k, name in enumerate(names) if name not in model.cable.curves]
    for row, candidate in enumerate(wanted):
        for k, angle in zip(without_curve, candidate.angles, strict=False):
            own.angle[row, k] = angle
    route, nothing = np.array([c.route for c in wanted]), np.full(n, np.nan)
    if table is LoopTable:
        return LoopTable(route, nothing, nothing, np.ones(n, dtype=int), nothing, own, _origin(n))
    return EfficiencyTable(route, np.full(n, 0.8), np.zeros(n), own, _origin(n))


def _angles(model: Model, places: Sequence[int], wanted: Sequence[Candidate]) -> Simulation:
    """Angles of all curved contacts; what is read below the detection limit is not detected."""
    columns, settings = tuple(model.cable.curves), model.description.table(AngleSettings)
    shape = (len(wanted), len(columns))
    route = np.array([c.route for c in wanted])
    table = AngleTable(route, columns, np.full(shape, np.deg2rad(30)), np.full(shape, np.nan), _origin(len(wanted)))
    term = angles_term(model.cable, table)
    # Every row is detected, so readings are curve by curve; a curve may hold over a part of the range only.
    at = np.concatenate([term.data["route"][column] for column in columns])
    limit = settings.detection_limit.to("angle") if settings and settings.detection_limit else 0.0
    found = {i: tuple(int(k) for k in np.flatnonzero(at == route[n])) for n, i in enumerate(places)}
    return Simulation(term.simulate, term.data, found, float(np.rad2deg(limit)))


def _origin(n: int) -> Provenance:
    return Provenance(("next",), np.zeros(n, dtype=int), np.arange(2, n + 2))
