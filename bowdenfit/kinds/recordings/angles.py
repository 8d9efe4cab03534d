"""Where and at which wrap angles recordings were made."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.angles.table import AngleTable
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.rows import OwnAngles
from bowdenfit.recordings.recording import Recordings


@dataclass(frozen=True)
class RecordedAngles:
    """Where and at which wrap angles each recording was made; see `Conditions`."""

    route: np.ndarray
    own: OwnAngles


def recorded_angles(recordings: Recordings) -> RecordedAngles:
    """Route values and own angles, one row a recording."""
    shape = (len(recordings.each), len(recordings.columns))
    angle, sd = (np.array([getattr(r, n) for r in recordings.each]).reshape(shape) for n in ("own_angle", "own_sd"))
    return RecordedAngles(np.array([r.route for r in recordings.each]), OwnAngles(recordings.columns, angle, sd))


def check_placed(recordings: Recordings, description: Description) -> None:
    """Every recording can be given a wrap angle in every contact."""
    route = description.route
    for recording in recordings.each:
        for contact in description.contact:
            column = contact.wrap_angle.column
            if column is None or np.isfinite(recording.own_angle[recordings.columns.index(column)]):
                continue
            if not contact.wrap_angle.curve:
                raise DatasetError(
                    f"the recording {recording.name!r} has no wrap angle for the contact {contact.name!r}; add it to its "
                    f'[[recording]]: wrap_angles = {{ {column} = {{ value = 90, unit = "deg" }} }}.'
                )
            if np.isnan(recording.route):
                at = f"at = 470   # {route.variable}, in {route.unit}" if route else "at = 470"
                raise DatasetError(
                    f"the recording {recording.name!r} does not say at which {route.variable if route else 'length'} it was "
                    f'made; add that to its [[recording]] ({at}), or read it from the file names: pattern = "{{at}}mm*".'
                )


def check_angles(recordings: Recordings, description: Description, measurements: Measurements) -> None:
    """Every recording outside the range of the curves has its wrap angles measured, in its own place or in the table.

    Raises:
        DatasetError: A recording has none.
    """
    route, angles = description.route, measurements.table(AngleTable)
    if route is None or angles is None:
        return
    curved = [recordings.columns.index(c.wrap_angle.column) for c in description.curved if c.wrap_angle.column]
    for recording in recordings.each:
        outside = not route.range[0] <= recording.route <= route.range[1]
        if outside and not np.isfinite(recording.own_angle[curved]).all() and recording.route not in angles.route:
            raise DatasetError(
                f"the recording {recording.name!r} was made at {recording.route:g} {route.unit}, outside the range "
                f"{route.range[0]:g} to {route.range[1]:g} {route.unit} where the angle curves hold, and the angle table has "
                "no row there; measure the wrap angles there, and add them to the table or as wrap_angles to its [[recording]]."
            )
