"""Recordings made from known truth: simulating those of a plan, and writing the folder of their data set.

The truth is drawn or taken from the plan, and each recording is simulated from it.
"""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.cable.cable import ANGLE_NOISE, CableContacts
from bowdenfit.cable.sensors import FORCE_NOISE, GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET, RUN_SCATTER
from bowdenfit.dataset import Dataset, load_dataset
from bowdenfit.kinds.descriptions import design_without_recordings
from bowdenfit.kinds.tables import AngleSettings, AngleTable, Measurements
from bowdenfit.models import build_model
from bowdenfit.questions.simulate.bench import SimulatedRecording, simulate_recording
from bowdenfit.questions.simulate.recordings_plan import (
    RPM,
    PlannedRecording,
    RecordingSettings,
    RecordingsPlan,
    read_recordings_plan,
)
from bowdenfit.questions.simulate.tables import (
    description_lines,
    draw_true_values,
    empty_tables,
    simulate_design,
    table_texts,
    write_folder,
)

# Judgement [N]: standard deviations of load cells of which the plan says nothing are half-normal with this one.
_CELL_NOISE = 2.0


@dataclass(frozen=True)
class RecordingWithTruth:
    """One recording and its truth: friction exponent without the effect of its run, that effect, wrap angles [rad]."""

    planned: PlannedRecording
    simulated: SimulatedRecording
    exponent: float
    run_effect: float
    wrap_angles: Mapping[str, float]


@dataclass(frozen=True)
class RecordingSet:
    """Everything that the folder will hold; `truth` in shown units."""

    plan: RecordingsPlan
    seed: int
    truth: Mapping[str, float]
    tables: Measurements
    recordings: tuple[RecordingWithTruth, ...]


def make_recorded_data_set(path: Path, output: Path, seed: int, noise: bool) -> Dataset:
    """Make a data set of recordings from known truth, and write and read it.

    Args:
        path: The plan.
        output: Folder of the data set.
        seed: Random seed.
        noise: Whether readings, angles and mountings scatter.

    Raises:
        DescriptionError: The plan is missing or wrong.
        UsageError: The truth names no parameter, or a friction exponent comes out negative.
        StoreError: The folder cannot be written.
    """
    plan = read_recordings_plan(path)
    with jax.enable_x64(True):
        recording_set = make_recordings(plan, seed, noise)
    write_recordings(recording_set, output)
    return load_dataset(output)


def make_recordings(plan: RecordingsPlan, seed: int, noise: bool = True) -> RecordingSet:
    """Make the recordings of a plan.

    Args:
        plan: The plan.
        seed: Random seed.
        noise: Whether readings, angles and mountings scatter, and spikes and gaps occur; the other faults stay.

    Raises:
        UsageError: A name in the truth is no parameter, or a friction exponent comes out negative.
    """
    truth_key, readings_key = jax.random.split(jax.random.key(seed))
    noise_generator, run_generator, angle_generator, *recording_generators = np.random.default_rng(seed).spawn(
        3 + len(plan.recordings)
    )
    lengths = np.array([r.length for r in plan.recordings])
    design = design_without_recordings(plan.description, plan.angles)
    tables, stated = empty_tables(plan.description, design), dict(plan.truth)
    force_noise = stated.pop(FORCE_NOISE, abs(noise_generator.standard_normal()) * _CELL_NOISE)
    values = draw_true_values(plan.description, tables, stated, truth_key, run_once=True)
    model = build_model(Dataset(plan.description, tables, {}))
    truth = {p.name: values[p.name] * p.shown_scale for p in model.space.parameters} | {FORCE_NOISE: float(force_noise)}
    named = {name: jnp.asarray(value, dtype=float) for name, value in values.items()}
    angles = _compute_true_angles(plan, model.cable, named, lengths)
    exponents = np.asarray(model.cable.friction_exponent(named, jnp.asarray(angles)), dtype=float)
    scatter = values[RUN_SCATTER] * noise
    effects = {
        run: scatter * float(run_generator.standard_normal()) for run in dict.fromkeys(r.run for r in plan.recordings)
    }
    contacts = [c.name for c in plan.description.contact]
    recordings = []
    for i, (planned, generator) in enumerate(zip(plan.recordings, recording_generators, strict=True)):
        cell_noise = plan.description.sensors.noise_ratio * float(force_noise), float(force_noise)
        recording = _add_true_faults(planned, cell_noise, values.get(GAIN_ERROR, 0.0), noise)
        exponent, effect = float(exponents[i]), effects[recording.run]
        simulated = simulate_recording(
            exponent, recording.friction, recording.profile, recording.bench, recording.faults, generator, effect
        )
        wrap = dict(zip(contacts, map(float, angles[i]), strict=True))
        recordings.append(RecordingWithTruth(recording, simulated, exponent, effect, wrap))
    dataset = simulate_design(plan.description, design, values, readings_key, noise, run_once=True) if plan.angles else None
    table = dataset.measurements.table(AngleTable) if dataset else None
    angle_tables = (
        () if table is None else (_add_measured_angles(table, plan, values[ANGLE_NOISE] * noise, angle_generator),)
    )
    return RecordingSet(
        plan, seed, {**truth, **_collect_common_truth(recordings)}, Measurements(angle_tables), tuple(recordings)
    )


def _collect_common_truth(recordings: Sequence[RecordingWithTruth]) -> dict[str, float]:
    """Return what all recordings share of friction's dependences and of the sensors, by the names of a fit's parameters."""
    motor = recordings[0].planned.friction.speed == "motor"
    unit_factors = {"stribeck_speed": 1 / RPM, "viscous": RPM} if motor else {}
    common: dict[str, float] = {}
    for name in ("load_exponent", "drag", "stribeck", "stribeck_speed", "viscous"):
        values = {getattr(recording.planned.friction, name) for recording in recordings}
        switched_on = name != "stribeck_speed" or "stribeck" in common
        if len(values) == 1 and switched_on and 0.0 not in values:
            common[name] = values.pop() * unit_factors.get(name, 1.0)
    for name in (GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET):
        values = {getattr(recording.planned.faults, name) for recording in recordings}
        if len(values) == 1 and 0.0 not in values:
            common[name] = values.pop()
    return common


def _compute_true_angles(
    plan: RecordingsPlan, cable: CableContacts, values: Mapping[str, jax.Array], lengths: np.ndarray
) -> np.ndarray:
    """Return the wrap angle of each recording and contact [rad]: the curve's, or the stated one outside the range."""
    angles = np.array(cable.wrap_angles(values, jnp.asarray(np.nan_to_num(lengths))), dtype=float)
    for k, contact in enumerate(plan.description.contact):
        for i, length in enumerate(lengths.tolist()):
            if contact.wrap_angle.curve and length in plan.measured_angles:
                angles[i, k] = np.deg2rad(plan.measured_angles[length][contact.wrap_angle.column or ""])
    return angles


def _add_true_faults(
    planned: PlannedRecording, cell_noise: tuple[float, float], gain_error: float, noise: bool
) -> PlannedRecording:
    """Return the recording with what the truth says of noise and gain where the plan says nothing."""
    true_faults: dict[str, Any] = {"input_noise": cell_noise[0], "output_noise": cell_noise[1], "gain_error": gain_error}
    faults = dataclasses.replace(planned.faults, **{k: v for k, v in true_faults.items() if k not in planned.stated_faults})
    if not noise:
        faults = dataclasses.replace(faults, input_noise=0.0, output_noise=0.0, spikes=0.0, dropouts=0.0)
    return planned.model_copy(update={"faults": faults})


def _add_measured_angles(
    table: AngleTable, plan: RecordingsPlan, noise: float, generator: np.random.Generator
) -> AngleTable:
    """Return the angle table with the rows outside the curves' range at its end."""
    if not plan.measured_angles:
        return table
    route = np.array(list(plan.measured_angles), dtype=float)
    true = np.deg2rad([[row[name] for name in table.names] for row in plan.measured_angles.values()])
    reading = np.maximum(true + noise * generator.standard_normal(true.shape), 0.0)
    settings = plan.description.table(AngleSettings)
    limit = settings.detection_limit.to("angle") if settings and settings.detection_limit else -np.inf
    hidden = reading < limit
    return dataclasses.replace(
        table,
        route=np.append(table.route, route),
        angle=np.vstack([table.angle, np.where(hidden, np.nan, reading)]),
        limit=np.vstack([table.limit, np.where(hidden, limit, np.nan)]),
    )


def write_recordings(recording_set: RecordingSet, folder: Path) -> None:
    """Write cable.toml, the recordings, the angles and truth.json.

    Args:
        recording_set: Simulated recordings.
        folder: Where to.
    """
    plan = recording_set.plan
    files = table_texts(plan.description, recording_set.tables)
    files |= {
        recording.planned.file: _recording_text(recording.simulated, plan.decimals)
        for recording in recording_set.recordings
    }
    truth = {
        "seed": recording_set.seed,
        "truth": dict(recording_set.truth),
        "recordings": [_recording_truth(recording) for recording in recording_set.recordings],
    }
    write_folder(folder, _description_text(plan), files, truth)


def _description_text(plan: RecordingsPlan) -> str:
    """Return the plan without its truth and design, and with one [[recording]] a file."""
    lines = description_lines(plan.text, "bowdenfit simulate --recordings", "recordings")
    for recording in plan.recordings:
        lines += ["", "[[recording]]", f"file = {json.dumps(recording.file)}", f"run = {json.dumps(recording.run)}"]
        if not np.isnan(recording.length):
            lines.append(f"at = {recording.length:g}")
        lines.append('channels = { velocity = { name = "motor_speed_rpm", unit = "r/min" } }')
    return "\n".join(lines) + "\n"


def _recording_text(simulated: SimulatedRecording, decimals: int) -> str:
    forces = (
        ["" if np.isnan(force) else f"{force:.{decimals}f}" for force in column.tolist()]
        for column in (simulated.input_force, simulated.output_force)
    )
    speeds = (simulated.motor_speed / RPM + 0.0).tolist()
    lines = ["time_s,input_force_N,output_force_N,motor_speed_rpm"]
    lines += [
        f"{time:.6f},{input_},{output},{speed:.2f}"
        for time, input_, output, speed in zip(simulated.time.tolist(), *forces, speeds, strict=True)
    ]
    return "\n".join(lines) + "\n"


def _recording_truth(recording: RecordingWithTruth) -> dict[str, Any]:
    """Return what is true of one recording; contact states by the time of their first sample."""
    planned = recording.planned
    return {
        "file": planned.file,
        "run": planned.run,
        "length": None if np.isnan(planned.length) else planned.length,
        "exponent": recording.exponent,
        "efficiency": float(np.exp(-recording.exponent)),
        "run_effect": recording.run_effect,
        "wrap_angles_deg": {name: float(np.rad2deg(angle)) for name, angle in recording.wrap_angles.items()},
        **planned.model_dump(include=set(RecordingSettings.model_fields)),
        "reversals": [round(time, 6) for time in recording.simulated.reversals],
        "contact_changes": [[round(time, 6), state] for time, state in recording.simulated.contact_changes],
    }
