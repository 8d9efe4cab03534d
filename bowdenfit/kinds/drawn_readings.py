"""Every table of a data set measured again on the computer, at known coefficients."""

from collections.abc import Mapping

import jax
import numpy as np

from bowdenfit.cable.cable import Cable
from bowdenfit.description import Description
from bowdenfit.kinds.angles.table import AngleTable
from bowdenfit.kinds.bench import Truth
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.terms import measured_kinds

Readings = dict[str, dict[str, jax.Array]]


def drawn_readings(
    cable: Cable, tables: Measurements, values: Mapping[str, jax.Array], key: jax.Array, scale: float = 1.0
) -> Readings:
    """New readings by kind of table, of a function that JAX can compile.

    Args:
        cable: The cable.
        tables: What is measured again.
        values: True values [internal units].
        key: Random key.
        scale: Factor on all noise.
    """
    truth = Truth(cable, tables.table(AngleTable), values, key, scale)
    return {kind.name: kind.bench.draw(table, truth) for kind, table in measured_kinds(tables)}


def slipped(readings: Mapping[str, Mapping[str, jax.Array]]) -> bool:
    """Whether a bench could not have taken some of the readings as it says it did."""
    return any(np.any(np.asarray(of.get("slipped", False))) for of in readings.values())


def with_drawn_readings(
    description: Description, tables: Measurements, readings: Mapping[str, Mapping[str, jax.Array]]
) -> Measurements:
    """The tables with what `drawn_readings` gave; remarks on how tables were read do not hold for them.

    Raises:
        DatasetError: The strokes of a recording cannot be found.
    """
    drawn = {name: {field: np.asarray(array) for field, array in of.items()} for name, of in readings.items()}
    again = [kind.bench.table(description, table, drawn[kind.name]) for kind, table in measured_kinds(tables)]
    return Measurements(tuple(again))
