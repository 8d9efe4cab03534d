"""The folder that made recordings are kept in: cable.toml, the recordings, the angles and truth.json."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.questions.simulate.bench import SimulatedRecording
from bowdenfit.questions.simulate.recordings.making import RecordingSet, RecordingWithTruth
from bowdenfit.questions.simulate.recordings.plan import RecordingsPlan
from bowdenfit.questions.simulate.recordings.planned import RPM, RecordingSettings
from bowdenfit.questions.simulate.tables import description_lines, table_texts, write_folder


def write_recordings(recording_set: RecordingSet, folder: Path) -> None:
    """Write cable.toml, the recordings, the angles and truth.json.

    Args:
        recording_set: What was made.
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
    """The plan without its truth and design, and with one [[recording]] a file."""
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
    """What is true of one recording; contact states by the time of their first sample."""
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
