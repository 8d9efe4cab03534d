"""Force recordings: two load cells sampled while a motor pulls, stops, reverses and returns."""

import numpy as np

from bowdenfit.files.matching import Quantity
from bowdenfit.kinds.asked import Asked, Wanted
from bowdenfit.kinds.copies import NO_NOISE
from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.readings import Readings, efficiencies
from bowdenfit.kinds.recordings.angles import check_angles, recorded_angles
from bowdenfit.kinds.recordings.settings import RecordingsTable, contradiction, quantities_of
from bowdenfit.kinds.recordings.table import read_recordings
from bowdenfit.kinds.recordings.words import alone, count, implausible, recordings_text
from bowdenfit.recordings.recording import Recordings
from bowdenfit.types import Vector


def _forces(recordings: Recordings) -> Vector:
    """Of both ends; a loop's force passes through zero, and what is asked of it is asked under load."""
    read = [force for r in recordings.each for force in (r.blocks.input_force, r.blocks.output_force)]
    return np.concatenate([f[f > 0.2 * f.max()] for f in read] if recordings.loop else read)


def _typical_speeds(recordings: Recordings) -> list[float]:
    """The median of each recording."""
    used = [np.abs(r.blocks.velocity[r.strokes.used_sliding]) for r in recordings.each]
    return [float(np.nanmedian(speeds)) for speeds in used if np.isfinite(speeds).any()]


def _copies(recordings: Recordings) -> list[str]:
    """Recordings of noisy cells whose forces are all the same; the files may have other names and clocks."""
    known: dict[bytes, str] = {}
    told = []
    for each in recordings.each:
        forces = np.concatenate([each.blocks.input_force, each.blocks.output_force])
        name = known.setdefault(forces.tobytes(), each.name)
        if name != each.name and min(each.account.noise) > NO_NOISE * np.abs(forces).max():
            told.append(f"the recording {each.name} holds the same forces as the recording {name}, to the last digit")
    return told


RECORDINGS = Kind(
    name="recordings",
    table=Recordings,
    readings=(
        efficiencies("recorded_efficiency", "recordings", "recordings", "recording {}", are_runs=True),
        Readings("recorded_loss", "recordings", "recordings", "recording {}", "Force lost (N)"),
    ),
    read=read_recordings,
    settings=RecordingsTable,
    contradiction=contradiction,
    quantities=quantities_of,
    check=check_angles,
    describe=lambda recordings, _: recordings_text(recordings),
    copies=_copies,
    alone=alone,
    heading="Recordings",
    method="Recordings were averaged over blocks, phases of sliding were told by a play operator, and all readings of one "
    "mounting shared its error.",
    implausible=implausible,
    count=count,
    conditions=recorded_angles,
    forces=_forces,
    speeds=lambda recordings: np.concatenate(
        [np.abs(r.blocks.velocity[r.strokes.used_sliding]) for r in recordings.each]
    ),
    typical_speeds=_typical_speeds,
    velocity_unit=lambda recordings: recordings.velocity_unit,
    takes_channels=True,
    asked=Asked(
        "a recording of two load cells, sampled while the motor moves",
        (
            Wanted(Quantity("input_force", "force"), "the force at the motor"),
            Wanted(Quantity("output_force", "force"), "the force at the load"),
        ),
        several=True,
        is_guessed=False,
    ),
)
