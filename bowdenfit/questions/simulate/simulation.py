"""A bench on the computer: tables of a cable whose coefficients are known, for testing, planning and calibration.

`simulate` measures a design; `resimulate` measures once more what a data set holds, at coefficients that are known.
Both draw readings as the likelihood takes them to scatter, so that a posterior can be asked to hold the truth.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.description import Description
from bowdenfit.errors import UsageError
from bowdenfit.inference.compilation import compile_program
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.angles.term import drawn_angles
from bowdenfit.kinds.kind import Design, PlannedKind
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.kinds.term import Truth
from bowdenfit.kinds.terms import Readings, drawn_readings, with_drawn_readings
from bowdenfit.model import build_model


def empty_tables(description: Description, design: Design) -> Measurements:
    """Tables of the design's shape with unremarkable readings, from which the model's parameters can be declared."""
    stated = description.tables.stated
    return Measurements(
        tuple(
            kind.empty_table(design, description, kind.file_name(stated[kind.name]))
            for kind in KINDS.values()
            if kind.name in stated and isinstance(kind, PlannedKind)
        )
    )


def draw_true_values(
    description: Description, tables: Measurements, truth: Mapping[str, float], key: jax.Array, run_once: bool = False
) -> dict[str, float]:
    """True value of every parameter [internal units]: as given in shown units, else drawn from its prior.

    Args:
        description: The cable.
        tables: Of the shape of what is measured.
        truth: What is given.
        key: Random key.
        run_once: See `simulate`.

    Raises:
        UsageError: A name in `truth` is no parameter.
    """
    space = build_model(Dataset(description, tables, {})).space
    unknown = [name for name in truth if name not in {p.name for p in space.parameters}]
    if unknown:
        known = ", ".join(p.name for p in space.parameters)
        raise UsageError(f"{unknown[0]!r} is no parameter of this cable; its parameters are {known}.")

    def draw(key: jax.Array) -> jax.Array:
        return space.vector(jax.random.normal(key, (space.size,)))

    needs_draw = any(p.name not in truth for p in space.free)
    prior_draw = np.asarray(_evaluate(draw, key, run_once=run_once)) if needs_draw else np.zeros(space.size)
    values = {p.name: float(v) for p, v in zip(space.free, prior_draw, strict=True)}
    values |= {p.name: float(p.fixed or 0.0) for p in space.fixed}
    return values | {p.name: truth[p.name] / p.shown_scale for p in space.parameters if p.name in truth}


def simulate(
    description: Description,
    design: Design,
    values: Mapping[str, float],
    key: jax.Array,
    noise: bool = True,
    run_once: bool = False,
) -> Dataset:
    """Tables as a bench would give them.

    Args:
        description: The cable.
        design: What is measured.
        values: True value of every parameter [internal units].
        key: Random key.
        noise: Whether readings scatter; without noise every reading is what the model expects.
        run_once: Whether this design is measured just once, so that one program of its own is compiled, in a third of the time
            of some hundred small ones, which would serve again.
    """
    dataset = Dataset(description, empty_tables(description, design), {})
    return resimulate(dataset, values, key, noise=noise, beyond_curves=True, run_once=run_once)


def resimulate(
    dataset: Dataset,
    values: Mapping[str, float],
    key: jax.Array,
    *,
    noise: bool = True,
    beyond_curves: bool = False,
    run_once: bool = False,
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
        run_once: See `simulate`.

    Raises:
        DatasetError: A table cannot be drawn anew, or the recordings drawn have no strokes that could be found.
    """
    named = {name: jnp.asarray(value, dtype=float) for name, value in values.items()}
    cable, scale = build_model(dataset).cable, 1.0 if noise else 0.0
    angles, beyond = dataset.measurements.table(AngleTable), {}
    if beyond_curves and angles is not None:
        table = angles

        def draw(named: Mapping[str, jax.Array], key: jax.Array) -> dict[str, jax.Array]:
            return drawn_angles(table, Truth(cable, table, named, key, scale), everywhere=True)

        beyond = {"angles": _evaluate(draw, named, key, run_once=run_once)}
        angle, limit = (np.asarray(beyond["angles"][name]) for name in ("angle", "limit"))
        measured = dataset.measurements.with_tables(replace(angles, angle=angle, limit=limit))
        dataset = replace(dataset, measurements=measured)
    tables = dataset.measurements

    def readings(named: Mapping[str, jax.Array], key: jax.Array) -> Readings:
        return drawn_readings(cable, tables, named, key, scale)

    return replace_readings(dataset, _evaluate(readings, named, key, run_once=run_once) | beyond)


def _evaluate(function: Callable[..., Any], *arguments: Any, run_once: bool) -> Any:
    """What a function of arrays gives, as one program where it is asked for once."""
    return (compile_program(function, *arguments, run_once=True) if run_once else function)(*arguments)


def replace_readings(dataset: Dataset, readings: Mapping[str, Mapping[str, jax.Array]]) -> Dataset:
    """The data set with what `drawn_readings` gave; checksums do not hold for it.

    Raises:
        DatasetError: The strokes of a recording cannot be found.
    """
    return Dataset(dataset.description, with_drawn_readings(dataset.description, dataset.measurements, readings), {})
