"""The folder that made recordings are kept in: cable.toml, the recordings, the angles and truth.json."""

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.kinds.angles.table import AngleSettings
from bowdenfit.questions.simulate.bench import SimulatedRecording
from bowdenfit.questions.simulate.recordings.making import MadeRecording, MadeRecordings
from bowdenfit.questions.simulate.recordings.plan import RecordingsPlan
from bowdenfit.questions.simulate.recordings.planned import RECORDINGS_FOLDER, RPM
from bowdenfit.questions.simulate.tables import TRUTH_FILE
from bowdenfit.results.folder import write_text

_HEADING = re.compile(r"\s*\[\[?\s*([A-Za-z\"'][^\],]*?)\s*\]\]?\s*(#.*)?")


def write_recordings(made: MadeRecordings, folder: Path) -> None:
    """Write cable.toml, the recordings, the angles and truth.json.

    Args:
        made: What was made.
        folder: Where to.
    """
    (folder / RECORDINGS_FOLDER).mkdir(parents=True, exist_ok=True)
    write_text(folder / DESCRIPTION_FILE, _description_text(made.plan))
    if made.angles is not None:
        settings = made.plan.description.table(AngleSettings)
        write_text(folder / ((settings and settings.file) or "angles.csv"), _angles_text(made))
    for recording in made.each:
        write_text(folder / recording.planned.file, _recording_text(recording.simulated, made.plan.decimals))
    write_text(folder / TRUTH_FILE, _truth_text(made))


def _description_text(plan: RecordingsPlan) -> str:
    """The plan without its opening comment, [truth] and [recordings], and with one [[recording]] a file."""
    lines = plan.text.splitlines()
    while lines and lines[0].lstrip().startswith("#"):
        lines = lines[1:]
    kept, skipping = ["# Written by `bowdenfit simulate --recordings`; the truth is in truth.json."], False
    for line in lines:
        heading = _HEADING.fullmatch(line)
        if heading:
            skipping = heading[1].split(".")[0].strip("\"' ") in {"truth", "recordings"}
        if not skipping:
            kept.append(line)
    while not kept[-1].strip():
        kept.pop()
    for recording in plan.recordings:
        kept += ["", "[[recording]]", f"file = {json.dumps(recording.file)}", f"run = {json.dumps(recording.run)}"]
        if not np.isnan(recording.length):
            kept.append(f"at = {recording.length:g}")
        kept.append('channels = { velocity = { name = "motor_speed_rpm", unit = "r/min" } }')
    return "\n".join(kept) + "\n"


def _angles_text(made: MadeRecordings) -> str:
    table, route = made.angles, made.plan.description.route
    assert table is not None and route is not None  # a table of angles has a route
    lines = [",".join([f"{route.variable}_{route.unit}", *(f"{name}_deg" for name in table.names)])]
    for at, angles, limits in zip(table.route, np.rad2deg(table.angle), np.rad2deg(table.limit), strict=True):
        cells = [f"<{limits[k]:g}" if np.isnan(angle) else f"{angle:.1f}" for k, angle in enumerate(angles)]
        lines.append(",".join([f"{at:g}", *cells]))
    return "\n".join(lines) + "\n"


def _recording_text(simulated: SimulatedRecording, decimals: int) -> str:
    columns = zip(
        simulated.time.tolist(),
        simulated.input_force.tolist(),
        simulated.output_force.tolist(),
        (simulated.motor_speed / RPM + 0.0).tolist(),
        strict=True,
    )
    lines = ["time_s,input_force_N,output_force_N,motor_speed_rpm"]
    lines += [
        f"{time:.6f},{_cell(pulled, decimals)},{_cell(given, decimals)},{speed:.2f}"
        for time, pulled, given, speed in columns
    ]
    return "\n".join(lines) + "\n"


def _cell(force: float, decimals: int) -> str:
    return "" if np.isnan(force) else f"{force:.{decimals}f}"


def _truth_text(made: MadeRecordings) -> str:
    each = [_truth_of(recording) for recording in made.each]
    page = {"seed": made.seed, "truth": dict(made.truth), "recordings": each}
    return json.dumps(page, indent=1) + "\n"


def _truth_of(made: MadeRecording) -> dict[str, Any]:
    """What is true of one recording; contact states by the time of their first sample."""
    planned = made.planned
    changes = [[round(time, 6), state] for time, state in made.simulated.contact_changes]
    return {
        "file": planned.file,
        "run": planned.run,
        "length": None if np.isnan(planned.length) else planned.length,
        "exponent": made.exponent,
        "efficiency": float(np.exp(-made.exponent)),
        "run_effect": made.run_effect,
        "wrap_angles_deg": {name: float(np.rad2deg(angle)) for name, angle in made.wrap_angles.items()},
        "profile": dataclasses.asdict(planned.profile),
        "bench": dataclasses.asdict(planned.bench),
        "friction": dataclasses.asdict(planned.friction),
        "faults": dataclasses.asdict(made.faults),
        "reversals": [round(time, 6) for time in made.simulated.reversals],
        "contact_changes": changes,
    }
