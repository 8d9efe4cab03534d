"""A bench on the computer: tables of a cable whose coefficients are known, for testing, planning and calibration.

`simulate` measures a design; `simulated_again` measures once more what a data set holds, at coefficients that are known.
Both draw readings as the likelihood takes them to scatter, so that a posterior can be asked to hold the truth.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.description import Description
from bowdenfit.errors import UsageError
from bowdenfit.kinds.angles.term import drawn_angles
from bowdenfit.kinds.drawn_readings import drawn_readings, with_drawn_readings
from bowdenfit.kinds.elastic_simulation import ElasticDesign, empty_elastic_tables
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.tables import AngleTable, EfficiencyTable, ForceTable, OwnAngles, Provenance
from bowdenfit.model import build_model


@dataclass(frozen=True)
class Design:
    """What is measured: at which lengths, and for forces at which input forces.

    Args:
        angles: Route values at which wrap angles are read.
        efficiencies: Route values at which an efficiency is measured.
        runs: Route value of each force run.
        input_forces: Input forces of every stroke of a run [N].
        strokes: +1 pulling, -1 return, in order.
        own_angles: Wrap angle of each run [rad], by column of a contact without a curve.
        elastic: What is measured of stretch, preload and a loop.
    """

    angles: tuple[float, ...] = ()
    efficiencies: tuple[float, ...] = ()
    runs: tuple[float, ...] = ()
    input_forces: tuple[float, ...] = ()
    strokes: tuple[int, ...] = (1, -1)
    own_angles: Mapping[str, tuple[float, ...]] | None = None
    elastic: ElasticDesign = field(default_factory=ElasticDesign)


def empty_tables(description: Description, design: Design) -> Measurements:
    """Tables of the design's shape with unremarkable readings, from which the model's parameters can be declared."""
    tables = description.tables
    columns = tuple(c.wrap_angle.column or "" for c in description.curved)
    angles = efficiencies = forces = None
    if tables.angles is not None:
        shape = (len(design.angles), len(columns))
        origin = _origin(tables.angles.file or "angles.csv", len(design.angles))
        angles = AngleTable(
            np.array(design.angles), columns, np.full(shape, np.deg2rad(30)), np.full(shape, np.nan), origin
        )
    if tables.efficiencies is not None:
        n = len(design.efficiencies)
        own, origin = _no_own_angles(description, n), _origin(tables.efficiencies.file or "efficiencies.csv", n)
        efficiencies = EfficiencyTable(np.array(design.efficiencies), np.full(n, 0.8), np.zeros(n), own, origin)
    if tables.forces is not None:
        forces = _force_rows(description, design)
    elastic = empty_elastic_tables(description, design.elastic)
    return elastic.with_tables(angles, efficiencies, forces)


def _force_rows(description: Description, design: Design) -> ForceTable:
    per_run = len(design.strokes) * len(design.input_forces)
    run = np.repeat(np.arange(len(design.runs)), per_run)
    stroke = np.tile(np.repeat(design.strokes, len(design.input_forces)), len(design.runs))
    force = np.tile(design.input_forces, len(design.runs) * len(design.strokes))
    names = description.angle_columns
    own = _no_own_angles(description, len(run))
    for k, name in enumerate(names):
        if design.own_angles and name in design.own_angles:
            own.angle[:, k] = np.asarray(design.own_angles[name])[run]
    route = np.asarray(design.runs, dtype=float)[run]
    labels = tuple(str(i + 1) for i in range(len(design.runs)))
    origin, velocity = _origin("forces.csv", len(run)), np.full(len(run), np.nan)
    return ForceTable(route, force, 0.8 * force, run, labels, stroke.astype(int), own, origin, velocity)


def _no_own_angles(description: Description, n: int) -> OwnAngles:
    names = description.angle_columns
    return OwnAngles(names, np.full((n, len(names)), np.nan), np.full((n, len(names)), np.nan))


def _origin(file: str, n: int) -> Provenance:
    return Provenance((file,), np.zeros(n, dtype=int), np.arange(2, n + 2))


def true_values(
    description: Description, tables: Measurements, truth: Mapping[str, float], key: jax.Array
) -> dict[str, float]:
    """True value of every parameter [internal units]: as given in shown units, else drawn from its prior.

    Raises:
        UsageError: A name in `truth` is no parameter.
    """
    space = build_model(Dataset(description, tables, {})).space
    unknown = [name for name in truth if name not in {p.name for p in space.parameters}]
    if unknown:
        known = ", ".join(p.name for p in space.parameters)
        raise UsageError(f"{unknown[0]!r} is no parameter of this cable; its parameters are {known}.")
    drawn = np.asarray(space.vector(jax.random.normal(key, (space.size,)))) if space.size else np.zeros(0)
    values = {p.name: float(v) for p, v in zip(space.free, drawn, strict=True)}
    values |= {p.name: float(p.fixed or 0.0) for p in space.fixed}
    return values | {p.name: truth[p.name] / p.shown_scale for p in space.parameters if p.name in truth}


def simulate(
    description: Description, design: Design, values: Mapping[str, float], key: jax.Array, noise: bool = True
) -> Dataset:
    """Tables as a bench would give them.

    Args:
        description: The cable.
        design: What is measured.
        values: True value of every parameter [internal units].
        key: Random key.
        noise: Whether readings scatter; without noise every reading is what the model expects.
    """
    dataset = Dataset(description, empty_tables(description, design), {})
    return simulated_again(dataset, values, key, noise=noise, beyond_curves=True)


def simulated_again(
    dataset: Dataset, values: Mapping[str, float], key: jax.Array, *, noise: bool = True, beyond_curves: bool = False
) -> Dataset:
    """The same tables, with readings drawn anew at known coefficients.

    Kept are lengths, runs, strokes, loads, the rows' own wrap angles and what is stated of their errors, and input forces,
    which stand for the true ones. Held readings are kept as they are.

    Args:
        dataset: What was measured.
        values: True value of every parameter [internal units].
        key: Random key.
        noise: Whether readings scatter.
        beyond_curves: Whether angles outside the range of the curves are drawn too, from the curves; else they are kept, as
            the rows' own wrap angles are.

    Raises:
        DatasetError: A table cannot be drawn anew, or the recordings drawn have no strokes that could be found.
    """
    named = {name: jnp.asarray(value, dtype=float) for name, value in values.items()}
    cable, scale = build_model(dataset).cable, 1.0 if noise else 0.0
    angles, beyond = dataset.measurements.angles, {}
    if beyond_curves and angles is not None:
        beyond = {"angles": drawn_angles(cable, angles, angles, named, key, scale, everywhere=True)}
        drawn = {name: np.asarray(array) for name, array in beyond["angles"].items()}
        dataset = replace(dataset, measurements=dataset.measurements.with_tables(replace(angles, **drawn)))
    return with_readings(dataset, drawn_readings(cable, dataset.measurements, named, key, scale) | beyond)


def with_readings(dataset: Dataset, readings: Mapping[str, Mapping[str, jax.Array]]) -> Dataset:
    """The data set with what `drawn_readings` gave; checksums do not hold for it.

    Raises:
        DatasetError: The strokes of a recording cannot be found.
    """
    return Dataset(dataset.description, with_drawn_readings(dataset.description, dataset.measurements, readings), {})
