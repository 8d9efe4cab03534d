"""Readings of a motor as a load cell at its pulley would have given them: its gear is taken off by its median, to be shown."""

from dataclasses import replace

import numpy as np

from bowdenfit.cable.sensors import GEAR_FRICTION, GEAR_LOSS, Gear
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.runs import RunsTerm
from bowdenfit.kinds.tables import Measurements
from bowdenfit.kinds.term import Term
from bowdenfit.recordings.recording import Recording, Recordings
from bowdenfit.results.record import Record, cached_per_fit, parameter_values
from bowdenfit.types import Vector

GEAR_NOTE = "The gear of the motor is taken off by its median: input forces and efficiencies are those of the cable."


@cached_per_fit
def find_median_gear(fit: Record) -> Gear | None:
    """Return the gear of a motor by the medians of its parameters; None where the input has a load cell."""
    if fit.dataset.description.motor is None:
        return None
    values = parameter_values(fit)
    return Gear(float(np.median(values[GEAR_LOSS])), float(np.median(values[GEAR_FRICTION])))


@cached_per_fit
def rope_measurements(fit: Record) -> Measurements:
    """Return the measurements of a fit with forces on the rope at the input; as they are where a load cell was there."""
    gear, measurements = find_median_gear(fit), fit.dataset.measurements
    if gear is None:
        return measurements
    table, recordings = measurements.table(ForceTable), measurements.table(Recordings)
    if table is not None:
        force = np.maximum(gear.rope_force(table.input_force, table.stroke), fit.model.cable.friction.conditions.least_force)
        measurements = measurements.with_tables(replace(table, input_force=force))
    if recordings is not None:
        items = tuple(_take_off(gear, recording) for recording in recordings.items)
        measurements = measurements.with_tables(replace(recordings, items=items))
    return measurements


def _take_off(gear: Gear, recording: Recording) -> Recording:
    """Return a recording of the force on the rope, which stands still while the motor turns around, and its own exponent."""
    blocks, strokes = recording.blocks, recording.strokes
    lowest, highest = (np.asarray(gear.rope_force(blocks.input_force, stroke)) for stroke in (1.0, -1.0))
    slides = strokes.contact[strokes.contact != 0]
    last = lowest[0] if not len(slides) or slides[0] > 0 else highest[0]
    force = np.full(len(lowest), np.nan)
    for i in np.flatnonzero(np.isfinite(lowest)):
        last = force[i] = np.clip(last if np.isfinite(last) else lowest[i], lowest[i], highest[i])
    used = strokes.used_sliding & (force > 0) & (blocks.output_force > 0)
    ratio = strokes.stroke[used] * np.log(force[used] / blocks.output_force[used])
    exponent = float(np.median(ratio)) if len(ratio) else np.nan
    return replace(
        recording,
        blocks=replace(blocks, input_force=force, input_turn=None, finer=None),
        strokes=replace(strokes, exponent=exponent),
    )


def gear_factors(fit: Record, term: Term) -> Vector:
    """Return the efficiency of the cable over that of the cable with its motor's gear, of each reading of a term; 1 without.

    Args:
        fit: The fit.
        term: A term of its model.
    """
    gear = find_median_gear(fit)
    if gear is None or not isinstance(term, RunsTerm) or term.rows is None:
        return np.ones(len(term.labels))
    rows, weight = term.rows, term.rows.weight(fit.dataset.description.sensors.noise_ratio)
    force = np.maximum(gear.rope_force(rows.input_force, rows.stroke), fit.model.cable.friction.conditions.least_force)
    run = np.unique(rows.run, return_inverse=True)[1]
    more = np.bincount(run, weight * rows.stroke * np.log(np.asarray(force) / rows.input_force)) / np.bincount(run, weight)
    return np.asarray(np.exp(-more))
