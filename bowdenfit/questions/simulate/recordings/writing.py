"""The folder that made recordings are kept in: cable.toml, the recordings, the angles and truth.json."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.questions.simulate.bench import SimulatedRecording
from bowdenfit.questions.simulate.recordings.making import MadeRecording, MadeRecordings
from bowdenfit.questions.simulate.recordings.plan import RecordingsPlan
from bowdenfit.questions.simulate.recordings.planned import RPM, Sections
from bowdenfit.questions.simulate.tables import description_lines, table_texts, write_folder


def write_recordings(made: MadeRecordings, folder: Path) -> None:
    """Write cable.toml, the recordings, the angles and truth.json.

    Args:
        made: What was made.
        folder: Where to.
    """
    plan = made.plan
    files = table_texts(plan.description, made.tables)
    files |= {each.planned.file: _recording_text(each.simulated, plan.decimals) for each in made.each}
    truth = {"seed": made.seed, "truth": dict(made.truth), "recordings": [_truth_of(each) for each in made.each]}
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
        f"{time:.6f},{pulled},{given},{speed:.2f}"
        for time, pulled, given, speed in zip(simulated.time.tolist(), *forces, speeds, strict=True)
    ]
    return "\n".join(lines) + "\n"


def _truth_of(made: MadeRecording) -> dict[str, Any]:
    """What is true of one recording; contact states by the time of their first sample."""
    planned = made.planned
    return {
        "file": planned.file,
        "run": planned.run,
        "length": None if np.isnan(planned.length) else planned.length,
        "exponent": made.exponent,
        "efficiency": float(np.exp(-made.exponent)),
        "run_effect": made.run_effect,
        "wrap_angles_deg": {name: float(np.rad2deg(angle)) for name, angle in made.wrap_angles.items()},
        **planned.model_dump(include=set(Sections.model_fields)),
        "reversals": [round(time, 6) for time in made.simulated.reversals],
        "contact_changes": [[round(time, 6), state] for time, state in made.simulated.contact_changes],
    }
