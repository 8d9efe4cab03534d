"""TERMS: every kind's half in the likelihood, by the names of KINDS; what the kinds of a data set contribute together.

From here come the cable of a data set, the parameters of its model, and all its tables measured again on the computer.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import jax
import numpy as np

from bowdenfit.cable.cable import ANGLE_NOISE, CableContacts, make_cable
from bowdenfit.cable.conditions import make_conditions
from bowdenfit.cable.elasticity import (
    BEDDING_LOAD,
    BEDDING_STRETCH,
    LENGTHENING,
    STIFFNESS,
    STRETCH_FRICTION,
    STRETCH_ZERO,
)
from bowdenfit.cable.elasticity import PRELOAD as REFERENCE_PRELOAD
from bowdenfit.cable.sensors import (
    BLOCK_NOISE,
    DELAY_ERROR,
    FORCE_NOISE,
    GAIN_ERROR,
    GEAR_FRICTION,
    GEAR_LOSS,
    INPUT_OFFSET,
    OUTPUT_OFFSET,
    RUN_SCATTER,
)
from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.extensions import load_class_of_extension
from bowdenfit.kinds import KINDS, find_kind, iterate_tables
from bowdenfit.kinds.angles.term import AngleTerms
from bowdenfit.kinds.candidate import CandidateKind
from bowdenfit.kinds.descriptions import order_groups
from bowdenfit.kinds.displacement.term import DisplacementTerms
from bowdenfit.kinds.efficiencies.term import EfficiencyTerms
from bowdenfit.kinds.forces.stated_noise import STATED_NOISE
from bowdenfit.kinds.forces.term import ForceTerms
from bowdenfit.kinds.kind import FrictionKind, RopeKind
from bowdenfit.kinds.loop.term import LOOP_MOUNTING, LoopTerms
from bowdenfit.kinds.preload.term import PRELOAD_NOISE, PreloadTerms
from bowdenfit.kinds.recordings.term import RecordingTerms
from bowdenfit.kinds.ringdown.term import RingDownTerms
from bowdenfit.kinds.shared_parameters import declare_gain_error
from bowdenfit.kinds.stretch.term import STRETCH_NOISE, StretchTerms
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.kinds.term import Circumstances, TermKind, Truth
from bowdenfit.parameters.space import Parameter
from bowdenfit.recordings.recording import Recordings

_ALL: tuple[TermKind[Any], ...] = (
    AngleTerms(),
    EfficiencyTerms(),
    ForceTerms(),
    RecordingTerms(),
    StretchTerms(),
    PreloadTerms(),
    LoopTerms(),
    DisplacementTerms(),
    RingDownTerms(),
)


def _collect_added_terms() -> Iterator[TermKind[Any]]:
    """Yield the halves in the likelihood of kinds that add-ons give."""
    for name, kind in KINDS.items():
        if kind.term_class:
            term_kind = load_class_of_extension(kind.term_class, name)
            if term_kind is not None:
                yield term_kind()


TERMS: dict[str, TermKind[Any]] = {kind.name: kind for kind in (*_ALL, *_collect_added_terms())}
"""Every kind's half in the likelihood, by name."""

_ORDER = (
    *(STIFFNESS, BEDDING_STRETCH, BEDDING_LOAD, LENGTHENING, STRETCH_ZERO, STRETCH_FRICTION, REFERENCE_PRELOAD),
    *(LOOP_MOUNTING, ANGLE_NOISE, RUN_SCATTER, FORCE_NOISE, STATED_NOISE, BLOCK_NOISE, STRETCH_NOISE, PRELOAD_NOISE),
    *(GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET, DELAY_ERROR, GEAR_LOSS, GEAR_FRICTION),
)  # in z, which what a seed draws depends on; those of other kinds come after these


Readings = dict[str, dict[str, jax.Array]]


def iterate_term_kinds(measurements: Measurements) -> Iterator[tuple[TermKind[Any], Any]]:
    """Yield every table with what its kind adds to the likelihood, in the order of the kinds."""
    for kind, table in iterate_tables(measurements):
        yield TERMS[kind.name], table


def collect_parameters(cable: CableContacts, measurements: Measurements) -> list[Parameter]:
    """Collect the parameters that the kinds of a data set need, each declared once."""
    kinds = list(iterate_term_kinds(measurements))
    circumstances = Circumstances(cable, measurements, any(kind.shows_mounting_scatter for kind, _ in kinds))
    needed = {p.name: p for kind, table in kinds for p in kind.parameters(table, circumstances)}
    needed |= {p.name: p for p in declare_gain_error(cable.description)}
    return sorted(needed.values(), key=lambda p: _ORDER.index(p.name) if p.name in _ORDER else len(_ORDER))


def candidate_kinds() -> dict[str, CandidateKind]:
    """Return what can be measured next, by name."""
    kinds = (kind.candidate for kind in TERMS.values() if kind.candidate is not None)
    return {candidate.name: candidate for candidate in sorted(kinds, key=lambda candidate: candidate.order)}


def find_term_kind(readings: str) -> TermKind[Any]:
    """Return the kind that has readings of this name.

    Raises:
        KeyError: None has.
    """
    kind = find_kind(readings)
    return TERMS[kind.name if kind is not None else readings]


def make_measured_cable(description: Description, measurements: Measurements) -> CableContacts:
    """Return the cable of a description; nominal angles, reference force and speed are measured ones where none is stated.

    Raises:
        DescriptionError: A curve family, contact law or friction model is unknown, or velocities are of two kinds.
    """
    tables = list(iterate_tables(measurements))
    friction = [(kind, table) for kind, table in tables if isinstance(kind, FrictionKind)]
    forces = _concatenate_positive([kind.forces(table) for kind, table in friction])
    tensions = _concatenate_positive([kind.tensions(table) for kind, table in tables if isinstance(kind, RopeKind)])
    speeds = _concatenate_positive([kind.speeds(table) for kind, table in friction])
    unit = _common_velocity_unit([kind.velocity_unit(table) for kind, table in friction])
    groups = order_groups(description, measurements)
    recordings = measurements.table(Recordings)
    shows_turns = recordings is not None and not recordings.loop
    conditions = make_conditions(description, forces, tensions, speeds, unit, groups, shows_turns)
    return make_cable(description, _mean_own_angles(description, friction), conditions)


def _mean_own_angles(description: Description, friction: Sequence[tuple[FrictionKind[Any], Any]]) -> dict[str, float]:
    """Return the mean of the measured angles in each column of a contact without a nominal angle [rad]."""
    rows = [kind.conditions(table).own for kind, table in friction]
    sources, means = [c.wrap_angle for c in description.contact], {}
    for name in [s.column for s in sources if s.column is not None and s.curve is None and s.nominal is None]:
        if rows:
            means[name] = float(np.mean(np.concatenate([own.column(name)[0] for own in rows])))
    return means


def _common_velocity_unit(stated: Sequence[str]) -> str:
    units = {unit for unit in stated if unit}
    if len(units) > 1:
        raise DescriptionError(
            "velocities are of the rope (mm/s) in one table and of the motor (r/min) in another; give both in the same kind."
        )
    return units.pop() if units else ""


def _concatenate_positive(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Return all values that are positive and finite."""
    values = np.concatenate([np.zeros(0), *parts])
    return values[np.isfinite(values) & (values > 0)]


def draw_readings(
    cable: CableContacts, tables: Measurements, values: Mapping[str, jax.Array], key: jax.Array, scale: float = 1.0
) -> Readings:
    """Draw new readings by kind of table, in a function that JAX can compile.

    Args:
        cable: The cable.
        tables: Measurements to draw again.
        values: True values [internal units].
        key: Random key.
        scale: Factor on all noise.
    """
    truth = Truth(cable, tables.table(AngleTable), values, key, scale)
    return {kind.name: kind.draw(table, truth) for kind, table in iterate_term_kinds(tables)}


def any_slipped(readings: Mapping[str, Mapping[str, jax.Array]]) -> bool:
    """Return whether a bench could not have taken some of the readings as it says it did."""
    return any(np.any(np.asarray(of.get("slipped", False))) for of in readings.values())


def replace_table_readings(
    description: Description, tables: Measurements, readings: Mapping[str, Mapping[str, jax.Array]]
) -> Measurements:
    """Return the tables with what `draw_readings` gave; remarks on how tables were read do not hold for them.

    Raises:
        DatasetError: The strokes of a recording cannot be found.
    """
    return Measurements(tuple(iterate_replaced_tables(description, tables, readings)))


def iterate_replaced_tables(
    description: Description, tables: Measurements, readings: Mapping[str, Mapping[str, jax.Array]]
) -> Iterator[Any]:
    """Yield the tables with new readings one by one: most implausible ones are known before strokes are searched for.

    Raises:
        DatasetError: The strokes of a recording cannot be found.
    """
    for kind, table in iterate_term_kinds(tables):
        arrays = {field: np.asarray(array) for field, array in readings[kind.name].items()}
        yield kind.with_readings(description, table, arrays)
