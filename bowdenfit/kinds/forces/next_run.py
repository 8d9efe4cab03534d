"""A force run that could be made next: its design, and its simulation with the effect of its mounting."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from typing_extensions import override

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.sensors import BLOCK_NOISE, FORCE_NOISE, RUN_SCATTER, LoadCells, scatter
from bowdenfit.kinds.candidate import (
    STROKE_WORDS,
    UNKNOWN_SCATTER,
    Candidate,
    CandidateKind,
    Simulation,
    Situation,
    choose_loads,
)
from bowdenfit.kinds.forces.stated_noise import STATED_NOISE
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.recordings.blocks import effective_counts, is_under_tension
from bowdenfit.kinds.recordings.reader import angles_of_recordings
from bowdenfit.kinds.row_angles import RowAngles, collect_row_angles, resolve_angles
from bowdenfit.kinds.rows import RowConditions
from bowdenfit.kinds.tables import Measurements
from bowdenfit.recordings.recording import Recordings
from bowdenfit.types import Matrix, Vector
from bowdenfit.words import significant

_MOST = 12  # forces of each stroke; more readings are joined, since a straight line needs no more points. A judgement
_LOADS = 3  # loads that are offered for a whole run: lowest, middle, highest
_SPREAD = 1.05  # ratio of the largest to the smallest force or speed that shows their effect; a judgement


@dataclass(frozen=True)
class RunDesign:
    """Forces and strokes of a run.

    Args:
        input_force: Input forces [N].
        stroke: +1 pulling, -1 return.
        velocity: Velocity as in the tables; NaN where it is not known.
        n_effective: How many independent readings each stands for [1].
        noise: Parameter that the standard deviation of one reading is in proportion to.
        sd: Stated standard deviations of the input and the output, over that parameter [N]; None where none are stated.
    """

    input_force: Vector
    stroke: Vector
    velocity: Vector
    n_effective: Vector
    noise: str
    sd: Matrix | None = None


def typical_run(measurements: Measurements) -> RunDesign | None:
    """Return the design of the run of median length so far; None where none slides."""
    forces, recordings = measurements.table(ForceTable), measurements.table(Recordings)
    if forces is not None and np.any(forces.stroke != 0):
        return _run_of_table(forces)
    if recordings is not None and not recordings.loop:
        return _run_of_recordings(recordings)
    return None


def _run_of_table(table: ForceTable) -> RunDesign:
    sliding = table.stroke != 0
    runs, counts = np.unique(table.run[sliding], return_counts=True)
    rows = sliding & (table.run == runs[np.argsort(counts, kind="stable")[len(runs) // 2]])
    n_effective, noise, sd = np.ones(int(rows.sum())), FORCE_NOISE, None
    if table.sd is not None:
        noise, sd = STATED_NOISE, table.sd[rows]
    return _join_readings(table.input_force[rows], table.stroke[rows], table.velocity[rows], n_effective, noise, sd)


def _run_of_recordings(recordings: Recordings) -> RunDesign | None:
    used = [r.strokes.used_sliding & is_under_tension(r) for r in recordings.items]
    order = [i for i in np.argsort([u.sum() for u in used], kind="stable") if used[i].any()]
    if not order:
        return None
    middle = order[len(order) // 2]
    recording, where = recordings.items[middle], used[middle]
    blocks, stroke = recording.blocks, recording.strokes.stroke
    n_effective = effective_counts(recording, np.flatnonzero(where))
    return _join_readings(blocks.input_force[where], stroke[where], blocks.velocity[where], n_effective, BLOCK_NOISE)


def _join_readings(
    force: Vector, stroke: Any, velocity: Vector, n_effective: Vector, noise: str, sd: Matrix | None = None
) -> RunDesign:
    """Join readings of like force, stroke by stroke."""
    groups = []
    for way in (1, -1):
        rows = np.flatnonzero(stroke == way)
        order = rows[np.argsort(force[rows], kind="stable")]
        groups += [part for part in np.array_split(order, _MOST) if len(part)]
    means = [[np.average(v[g], weights=n_effective[g]) for g in groups] for v in (force, velocity)]
    ways, total = [float(stroke[g[0]]) for g in groups], [n_effective[g].sum() for g in groups]
    sds = None if sd is None else np.array([np.sqrt(np.mean(sd[g] ** 2, axis=0)) for g in groups])
    return RunDesign(np.array(means[0]), np.array(ways), np.array(means[1]), np.array(total), noise, sds)


def set_load_and_stroke(design: RunDesign, load: float, stroke: int) -> RunDesign:
    """Return the run with all its readings at one load and of one stroke.

    Args:
        design: The run.
        load: Input force [N]; NaN to keep those of the run.
        stroke: +1 or -1; 0 to keep those of the run.
    """
    force = design.input_force if np.isnan(load) else np.full(len(design.input_force), load)
    return replace(design, input_force=force, stroke=np.full(len(force), float(stroke)) if stroke else design.stroke)


def make_run_simulator(
    cable: CableContacts, design: RunDesign
) -> tuple[Callable[[Mapping[str, Array], RowAngles, Array], Array], int]:
    """Return a function that simulates runs at rows of wrap angles, and how many numbers it gives for each.

    A run is told by the coefficients of a weighted straight-line fit to its log ratios: their mean, what differs between
    the strokes (the gain error of the load cells), and how they change with load and speed where the model lets them.

    Args:
        cable: The cable.
        design: Forces and strokes of every run.
    """
    fit = _straight_line(cable, design)
    force, stroke, velocity = (jnp.asarray(a) for a in (design.input_force, design.stroke, design.velocity))

    def simulate(values: Mapping[str, Array], rows: RowAngles, key: Array) -> Array:
        of_mounting, of_input, of_output = jax.random.split(key, 3)
        angles, variance = resolve_angles(cable, values, rows)
        exponent = cable.friction_exponent(values, angles, route=rows.route)
        sd = jnp.sqrt(values[RUN_SCATTER] ** 2 + cable.exponent_variance(values, angles, variance))
        mounted = exponent + sd * scatter(of_mounting, exponent.shape, cable.description)
        shift = mounted[:, None] * cable.friction.rate(values, velocity)
        output = cable.friction.output_force(values, force, shift, stroke)
        ratios = (cable.description.sensors.noise_ratio, 1.0) if design.sd is None else design.sd.T
        cells, noise = LoadCells.of(values), values[design.noise] / jnp.sqrt(jnp.asarray(design.n_effective))
        read_in = cells.shown_input(force, stroke) + noise * ratios[0] * jax.random.normal(of_input, output.shape)
        read_out = cells.shown_output(output) + noise * ratios[1] * jax.random.normal(of_output, output.shape)
        least = cable.friction.conditions.least_force
        ratio = jnp.log(jnp.maximum(read_in, least) / jnp.maximum(read_out, least))
        return ((stroke * ratio) @ fit).ravel()

    return simulate, fit.shape[1]


def _straight_line(cable: CableContacts, design: RunDesign) -> np.ndarray:
    """Return the matrix from log ratios to the coefficients of their weighted least-squares fit."""
    columns = [np.ones(len(design.stroke))]
    if len(np.unique(design.stroke)) > 1:
        columns.append(design.stroke)
    offsets = cable.description.shifts_forces
    if (cable.friction.depends_on_load or offsets) and np.ptp(np.log(design.input_force)) > np.log(_SPREAD):
        columns.append(np.log(design.input_force))
    speed = np.log(np.maximum(np.abs(np.nan_to_num(design.velocity)), 1e-9))
    if cable.friction.depends_on_rate and np.ptp(speed) > np.log(_SPREAD):
        columns.append(speed)
    weight = np.sqrt(design.n_effective) * design.input_force  # the noise of a log ratio falls with the force
    weight = weight if design.sd is None else weight / design.sd[:, 1]
    lines = np.column_stack(columns)
    lines[:, 1:] -= np.average(lines[:, 1:], axis=0, weights=weight**2)
    return np.asarray(np.linalg.pinv(lines * weight[:, None]) * weight).T


class ForceRunCandidates(CandidateKind):
    """A run of forces: as many readings in one mounting as the typical run so far."""

    name = "force"
    noun = "force run"
    order = 1
    needs = (RUN_SCATTER,)
    unknown = f"{UNKNOWN_SCATTER}; name an efficiency instead, or fit with a table of forces."
    along_route = True
    mounted_anew = True

    @override
    def is_possible(self, at: Situation) -> bool:
        return typical_run(at.measurements) is not None

    @override
    def describe_measurement(self, cable: CableContacts) -> str:
        return f"a force run{f' of the group {cable.friction.groups[0]}' if cable.friction.groups else ''}"

    @override
    def candidates(self, at: Situation) -> list[Candidate]:
        """Return runs at the lengths, or at the wrap angles of the runs made so far."""
        forces, recordings = at.measurements.table(ForceTable), at.measurements.table(Recordings)
        if typical_run(at.measurements) is None:
            return []
        own_angles = (
            forces.own if forces is not None else angles_of_recordings(recordings).own if recordings is not None else None
        )
        return at.along_cable(self.name, own_angles)

    @override
    def designs(self, at: Situation) -> list[tuple[float, int]]:
        """Return the lowest, a middle and the highest load of the runs made so far, and each of their strokes and both."""
        run = typical_run(at.measurements)
        if run is None:
            return []
        loads = choose_loads(run.input_force, _LOADS)
        strokes = [0, *sorted({int(stroke) for stroke in run.stroke}, reverse=True)]
        return [(load, stroke) for load in loads for stroke in (strokes if len(strokes) > 2 else (0,))]

    @override
    def describe_usual(self, at: Situation) -> str:
        """Return the typical run in words, such as "24 readings at 20 to 60 N, pulling and returning"."""
        run = typical_run(at.measurements)
        assert run is not None
        low, high = run.input_force.min(), run.input_force.max()
        near = significant(float(np.mean(run.input_force)))
        loads = f"{significant(low)} to {significant(high)} N" if high > _SPREAD * low else f"{near} N"
        ways = " and ".join(STROKE_WORDS[way] for way in (1, -1) if np.any(run.stroke == way))
        count = round(float(np.sum(run.n_effective)))
        return f"{count:,} {'reading' if count == 1 else 'readings'} at {loads}, {ways}"

    @override
    def simulation(self, at: Situation, candidates: Sequence[Candidate]) -> Simulation:
        typical = typical_run(at.measurements)
        assert typical is not None
        groups: dict[tuple[str, int], list[int]] = {}
        for i, candidate in enumerate(candidates):
            groups.setdefault((f"{candidate.load:g}", candidate.stroke), []).append(i)
        parts: list[tuple[Callable[..., Array], Any]] = []
        columns: list[tuple[int, ...]] = [()] * len(candidates)
        start = 0
        for members in groups.values():
            alike = [candidates[i] for i in members]
            route, own_angles, _ = at.rows(alike)
            simulate, width = make_run_simulator(at.cable, set_load_and_stroke(typical, alike[0].load, alike[0].stroke))
            parts.append((simulate, collect_row_angles(at.cable.description, RowConditions(route, own_angles), at.angles)))
            for i in members:
                columns[i] = tuple(range(start, start + width))
                start += width

        def readings(values: Mapping[str, Array], data: Sequence[Any], key: Array) -> Array:
            keys = jax.random.split(key, len(parts)) if len(parts) > 1 else [key]
            return jnp.concatenate(
                [part[0](values, own_angles, k) for part, own_angles, k in zip(parts, data, keys, strict=True)]
            )

        return Simulation(readings, [data for _, data in parts], columns)
