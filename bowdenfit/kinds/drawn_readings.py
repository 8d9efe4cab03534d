"""Readings of tables drawn at known coefficients, as the likelihood takes them to scatter; see `models.simulation`."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.cable.cable import ANGLE_NOISE, Cable
from bowdenfit.cable.load_cells import FORCE_NOISE, RUN_SCATTER, LoadCells
from bowdenfit.cable.noise import scatter
from bowdenfit.dataset import Dataset
from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.efficiencies.term import efficiencies_term
from bowdenfit.kinds.elastic_simulation import drawn_elastic_readings, with_elastic_readings
from bowdenfit.kinds.forces.term import HeldForcesTerm, force_terms
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.recordings.simulation import drawn_recordings, recorded_again
from bowdenfit.kinds.resolve_angles import resolve_angles
from bowdenfit.kinds.row_angles import row_angles
from bowdenfit.kinds.tables import AngleTable

Readings = dict[str, dict[str, jax.Array]]


def drawn_readings(
    cable: Cable, tables: Measurements, values: Mapping[str, jax.Array], key: jax.Array, scale: float = 1.0
) -> Readings:
    """New readings by table, of a function that JAX can compile.

    Args:
        cable: The cable.
        tables: What is measured again.
        values: True values [internal units].
        key: Random key.
        scale: Factor on all noise.

    Returns:
        Arrays by table. Those of "held" say which held readings would have slipped instead, which a bench that reads them
        as held rules out.
    """
    keys = jax.random.split(key, 3)
    readings: Readings = {}
    if tables.angles is not None:
        readings["angles"] = drawn_angles(cable, tables.angles, values, keys[0], scale)
    if tables.efficiencies is not None:
        term = efficiencies_term(cable, tables.efficiencies, tables.angles)
        mean, sd = term._mean_and_sd(values, jax.tree.map(jnp.asarray, term.data), values)
        noise = scale * sd * scatter(keys[1], mean.shape, cable.description)
        readings["efficiencies"] = {"efficiency": jnp.exp(-(mean + noise))}
    if tables.forces is not None:
        readings["forces"] = _drawn_forces(cable, tables, values, keys[2], scale)
        readings["held"] = _slipped(cable, tables, values, jax.random.fold_in(key, 5))
    # Readings of the other tables stay what they were without these.
    readings |= drawn_elastic_readings(cable, tables, values, jax.random.fold_in(key, 3), scale)
    if tables.recordings is not None:
        readings["recordings"] = drawn_recordings(cable, tables, values, jax.random.fold_in(key, 4), scale)
    return readings


def with_readings(dataset: Dataset, readings: Mapping[str, Mapping[str, jax.Array]]) -> Dataset:
    """The data set with what `drawn_readings` gave; remarks on the reading and checksums do not hold for it.

    Raises:
        DatasetError: The strokes of a recording cannot be found.
    """
    tables = dataset.measurements
    drawn: dict[str, Any] = {table: {name: np.asarray(a) for name, a in of.items()} for table, of in readings.items()}
    angles, efficiencies, forces = tables.angles, tables.efficiencies, tables.forces
    if angles is not None:
        angles = with_angles(angles, drawn["angles"])
    if efficiencies is not None:
        # A stated standard deviation is taken to be in proportion to the efficiency.
        share = efficiencies.sd / efficiencies.efficiency
        efficiency = drawn["efficiencies"]["efficiency"]
        efficiencies = replace(efficiencies, efficiency=efficiency, sd=share * efficiency)
    if forces is not None:
        forces = replace(forces, **drawn["forces"])
    recordings = tables.recordings and recorded_again(dataset.description, tables.recordings, drawn["recordings"])
    again = with_elastic_readings(tables, drawn)
    made = replace(again.with_tables(angles, efficiencies, forces, recordings), remarks=())
    return Dataset(dataset.description, made, {})


def drawn_angles(
    cable: Cable,
    table: AngleTable,
    values: Mapping[str, jax.Array],
    key: jax.Array,
    scale: float = 1.0,
    everywhere: bool = False,
) -> dict[str, jax.Array]:
    """Wrap angles and detection limits of an angle table [rad].

    Args:
        cable: The cable.
        table: The table.
        values: True values [internal units].
        key: Random key.
        scale: Factor on all noise.
        everywhere: Whether rows outside the range of the curves are drawn too; else they are kept.
    """
    route = jnp.asarray(table.route)
    theta = jnp.stack([curve.wrap_angle(values, route) for curve in cable.curves.values()], axis=-1)
    reading = theta + scale * values[ANGLE_NOISE] * scatter(key, theta.shape, cable.description)
    limit = detection_limit(cable.description, table)
    low, high = cable.description.route.range if cable.description.route else (-np.inf, np.inf)
    kept = np.zeros(len(table.route), dtype=bool) if everywhere else (table.route < low) | (table.route > high)
    undetected = reading < limit
    angle = jnp.where(undetected, jnp.nan, jnp.maximum(reading, 0.0))
    return {
        "angle": jnp.where(kept[:, None], table.angle, angle),
        "limit": jnp.where(kept[:, None], table.limit, jnp.where(undetected, limit, jnp.nan)),
    }


def detection_limit(description: Description, table: AngleTable) -> float:
    """The angle below which nothing is detected [rad]: that of the description, or the one in the table's cells.

    Raises:
        DatasetError: The cells name several, so that it is not known which one holds where an angle was detected.
    """
    settings = description.tables.angles
    if settings is not None and settings.detection_limit is not None:
        return settings.detection_limit.to("angle")
    limits = np.unique(table.limit[np.isfinite(table.limit)])
    if len(limits) > 1:
        shown = " and ".join(f"<{limit:.3g}" for limit in np.rad2deg(limits[:2]))
        raise DatasetError(
            f"{table.origin.files[0]} has cells with different detection limits ({shown} deg), so that it is not known what "
            "would be detected in the other cells; state detection_limit for the table in cable.toml."
        )
    return float(limits[0]) if len(limits) else -np.inf


def with_angles(table: AngleTable, drawn: Mapping[str, Any]) -> AngleTable:
    """The table with what `drawn_angles` gave."""
    return replace(table, angle=np.asarray(drawn["angle"]), limit=np.asarray(drawn["limit"]))


def _drawn_forces(
    cable: Cable, tables: Measurements, values: Mapping[str, jax.Array], key: jax.Array, scale: float
) -> dict[str, jax.Array]:
    """Forces of sliding rows with noise in both cells around true ones; all rows of a run share its mounting and angles."""
    table = tables.forces
    assert table is not None  # the caller asked
    of_run, of_input, of_output = jax.random.split(key, 3)
    runs, run = len(table.run_names), jnp.asarray(table.run)
    rows = {
        name: jnp.asarray(array) for name, array in row_angles(cable.description, table, tables.angles).data.items()
    }
    angles, variance = resolve_angles(cable, values, rows)
    of_angles = jax.random.normal(jax.random.fold_in(key, 3), (runs, angles.shape[1]))
    angles = angles + scale * jnp.sqrt(variance) * of_angles[run]
    mounting = scale * values[RUN_SCATTER] * scatter(of_run, (runs,), cable.description)
    exponent = cable.friction_exponent(values, angles) * cable.friction.rate(values, jnp.asarray(table.velocity))
    stroke, force = jnp.asarray(table.stroke, dtype=float), jnp.asarray(table.input_force)
    output = cable.friction.output_force(values, force, exponent + mounting[run], stroke)
    cells, noise, slides = LoadCells.of(values), scale * values[FORCE_NOISE], table.stroke != 0
    read = cells.shown_input(force) + noise * jax.random.normal(of_input, force.shape)
    return {
        "input_force": jnp.where(slides, read, force),
        "output_force": jnp.where(
            slides,
            cells.shown_output(output) + noise * jax.random.normal(of_output, force.shape),
            table.output_force,
        ),
    }


def _slipped(
    cable: Cable, tables: Measurements, values: Mapping[str, jax.Array], key: jax.Array
) -> dict[str, jax.Array]:
    """Which held readings would have slipped: their likelihood is the probability that friction holds their forces."""
    assert tables.forces is not None  # the caller asked
    held = [t for t in force_terms(cable, tables.forces, tables.angles) if isinstance(t, HeldForcesTerm)]
    log_probability = [term.log_likelihood(values, jax.tree.map(jnp.asarray, term.data)) for term in held]
    slipped = [jnp.log(jax.random.uniform(key, p.shape)) > p for p in log_probability]
    return {"slipped": jnp.concatenate([*slipped, jnp.zeros(0, dtype=bool)])}
