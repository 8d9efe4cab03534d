"""Tables of stretch, preload and a loop, measured on the computer."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.load_cells import FORCE_NOISE, RUN_SCATTER, LoadCells
from bowdenfit.cable.noise import scatter
from bowdenfit.description import Description
from bowdenfit.kinds.elastic_term import ElasticTerm
from bowdenfit.kinds.loop.term import LOOP_MOUNTING
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.preload.term import PRELOAD_NOISE
from bowdenfit.kinds.resolve_angles import resolve_angles
from bowdenfit.kinds.row_angles import row_angles
from bowdenfit.kinds.stretch.term import STRETCH_NOISE, stretch_term
from bowdenfit.kinds.tables import LoopTable, OwnAngles, PreloadTable, Provenance, StretchTable
from bowdenfit.physics.loop import free_motion_loss, loop_output_force


@dataclass(frozen=True)
class ElasticDesign:
    """What is measured of stretch, preload and a loop.

    Args:
        loads: Loads of every loading of the rope, growing [N].
        stretch_angles: Wrap angles at which the rope is stretched [rad].
        unloading: Whether it is read on the way down too.
        preload_angles: Wrap angles at which the preload is read [rad].
        loop_angles: Wrap angles at which the loop is moved under load [rad].
        input_forces: Input forces of the loop at each of them [N].
        strokes: +1 forward, -1 back, in order.
        free_angles: Wrap angles at which the loop is moved without load [rad].
    """

    loads: tuple[float, ...] = ()
    stretch_angles: tuple[float, ...] = ()
    unloading: bool = False
    preload_angles: tuple[float, ...] = ()
    loop_angles: tuple[float, ...] = ()
    input_forces: tuple[float, ...] = ()
    strokes: tuple[int, ...] = (1,)
    free_angles: tuple[float, ...] = ()


def empty_elastic_tables(description: Description, design: ElasticDesign) -> Measurements:
    """Tables of the design's shape with unremarkable readings."""
    tables = description.tables
    return Measurements().with_tables(
        _stretch_rows(design, tables.stretch.file or "stretch.csv") if tables.stretch else None,
        _preload_rows(design, tables.preload.file or "preload.csv") if tables.preload else None,
        _loop_rows(description, design, tables.loop.file or "loop.csv") if tables.loop else None,
    )


def _stretch_rows(design: ElasticDesign, file: str) -> StretchTable:
    loads, angles = np.asarray(design.loads, dtype=float), np.asarray(design.stretch_angles, dtype=float)
    cycle = np.concatenate([loads, loads[-2::-1]]) if design.unloading else loads
    down = np.arange(len(cycle)) >= len(loads)
    n = len(angles)
    load, wrap_angle = np.tile(cycle, n), np.repeat(angles, len(cycle))
    peak = np.full(len(load), loads.max(initial=0.0))
    names = tuple(f"{angle:.4g} deg" for angle in np.rad2deg(angles))
    of_cycle = np.repeat(np.arange(n), len(cycle))
    origin = _origin(file, len(load))
    return StretchTable(load, wrap_angle, 0.01 * load, np.tile(down, n), peak, of_cycle, names, origin)


def _preload_rows(design: ElasticDesign, file: str) -> PreloadTable:
    angles = np.asarray(design.preload_angles, dtype=float)
    return PreloadTable(angles, np.full(len(angles), 20.0), _origin(file, len(angles)))


def _loop_rows(description: Description, design: ElasticDesign, file: str) -> LoopTable:
    """Rows under load, wrap angle by wrap angle, then those of free motion, which have no input force yet."""
    loaded = [(a, f, s) for a in design.loop_angles for s in design.strokes for f in design.input_forces]
    free = [(a, np.nan, s) for a in design.free_angles for s in design.strokes]
    rows = np.array([*loaded, *free], dtype=float).reshape(-1, 3)
    names, n = description.angle_columns, len(rows)
    own = OwnAngles(names, np.full((n, len(names)), np.nan), np.full((n, len(names)), np.nan))
    column = next((c.wrap_angle.column for c in description.contact if c.wrap_angle.column), None)
    if column is not None:
        own.angle[:, names.index(column)] = rows[:, 0]
    nothing = np.full(n, np.nan)
    return LoopTable(nothing, rows[:, 1], 0.8 * rows[:, 1], rows[:, 2].astype(int), nothing, own, _origin(file, n))


def _origin(file: str, n: int) -> Provenance:
    return Provenance((file,), np.zeros(n, dtype=int), np.arange(2, n + 2))


def drawn_elastic_readings(
    cable: Cable, tables: Measurements, values: Mapping[str, jax.Array], key: jax.Array, scale: float
) -> dict[str, dict[str, jax.Array]]:
    """New readings of the tables of stretch, preload and a loop, by table; their noise is multiplied by `scale`."""
    of_stretch, of_preload, of_loop = jax.random.split(key, 3)
    stretch, preload = tables.stretch, tables.preload
    readings: dict[str, dict[str, jax.Array]] = {}
    if stretch is not None:
        term = stretch_term(cable, stretch)
        noise = scale * values[STRETCH_NOISE] * scatter(of_stretch, stretch.load.shape, cable.description)
        readings["stretch"] = {"stretch": term.expected(values, _arrays(term)) + noise}
    if preload is not None:
        noise = scale * values[PRELOAD_NOISE] * scatter(of_preload, preload.wrap_angle.shape, cable.description)
        expected = cable.elasticity.preload(values, jnp.asarray(preload.wrap_angle))[0]
        readings["preload"] = {"preload": jnp.maximum(expected + noise, 0.0)}
    if tables.loop is not None:
        readings["loop"] = _drawn_loop(cable, tables, values, of_loop, scale)
    return readings


def with_elastic_readings(tables: Measurements, drawn: Mapping[str, Any]) -> Measurements:
    """The tables with what `drawn_elastic_readings` gave."""
    return tables.with_tables(
        tables.stretch and replace(tables.stretch, **drawn["stretch"]),
        tables.preload and replace(tables.preload, **drawn["preload"]),
        tables.loop and replace(tables.loop, **drawn["loop"]),
    )


def _arrays(term: ElasticTerm) -> dict[str, jax.Array]:
    return {name: jnp.asarray(array) for name, array in term.data.items()}


def _drawn_loop(
    cable: Cable, tables: Measurements, values: Mapping[str, jax.Array], key: jax.Array, scale: float
) -> dict[str, jax.Array]:
    """Forces of a loop with noise in both cells; rows without an input force are of free motion."""
    table = tables.loop
    assert table is not None  # the caller asked
    of_input, of_output = jax.random.split(key)
    rows = {
        name: jnp.asarray(array) for name, array in row_angles(cable.description, table, tables.angles).data.items()
    }
    angles, variance = resolve_angles(cable, values, rows)
    own = cable.elasticity.preload(values, jnp.sum(angles, axis=-1))[0]
    preload = jnp.where(jnp.isnan(table.preload), own, jnp.nan_to_num(table.preload))
    angles = angles + scale * jnp.sqrt(variance) * jax.random.normal(jax.random.fold_in(key, 2), angles.shape)
    mounting = values[RUN_SCATTER] * values[LOOP_MOUNTING] if LOOP_MOUNTING in values else 0.0
    exponent, stroke = cable.friction_exponent(values, angles) + mounting, jnp.asarray(table.stroke, dtype=float)
    free = stroke * free_motion_loss(preload, exponent)
    force = jnp.where(jnp.isnan(table.input_force), free, jnp.nan_to_num(table.input_force))
    output = loop_output_force(force, preload, exponent, stroke)
    cells, noise = LoadCells.of(values), scale * values[FORCE_NOISE]
    return {
        "input_force": cells.shown_input(force) + noise * jax.random.normal(of_input, force.shape),
        "output_force": cells.shown_output(output) + noise * scatter(of_output, force.shape, cable.description),
    }
