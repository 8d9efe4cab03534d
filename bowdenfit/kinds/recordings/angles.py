"""Where and at which wrap angles recordings were made."""

import numpy as np

from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.rows import OwnAngles, RowConditions
from bowdenfit.recordings.recording import Recordings


def recorded_angles(recordings: Recordings) -> RowConditions:
    """Route values and own angles, one row a recording."""
    shape = (len(recordings.each), len(recordings.columns))
    angle, sd = (np.array([getattr(r, n) for r in recordings.each]).reshape(shape) for n in ("own_angle", "own_sd"))
    return RowConditions(np.array([r.route for r in recordings.each]), OwnAngles(recordings.columns, angle, sd))


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
