"""Every table of a data set measured again on the computer, at known coefficients."""

from collections.abc import Iterator, Mapping
from typing import Any

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
    return {kind.name: kind.draw(table, truth) for kind, table in measured_kinds(tables)}


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
    return Measurements(tuple(drawn_tables(description, tables, readings)))


def drawn_tables(
    description: Description, tables: Measurements, readings: Mapping[str, Mapping[str, jax.Array]]
) -> Iterator[Any]:
    """The same one by one: most that a bench would not hand in are known before the strokes of recordings are looked for.

    Raises:
        DatasetError: The strokes of a recording cannot be found.
    """
    for kind, table in measured_kinds(tables):
        drawn = {field: np.asarray(array) for field, array in readings[kind.name].items()}
        yield kind.with_readings(description, table, drawn)
