"""A plan of recordings (`bench.toml` with [recordings]): reading it, and refusing what does not fit together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from bowdenfit.description import Description, QuantityValue
from bowdenfit.description.values import Frozen
from bowdenfit.description.wrong_keys import explain_validation_error
from bowdenfit.errors import DatasetError, DescriptionError, suggest_name
from bowdenfit.kinds.descriptions import description_without_recordings
from bowdenfit.questions.simulate.recordings.planned import PlannedRecording, RecordingsPage, plan_recordings
from bowdenfit.questions.simulate.tables import parse_truth, read_plan_file


class _Plan(Frozen):
    """What of a plan is about recordings."""

    recordings: RecordingsPage


@dataclass(frozen=True)
class RecordingsPlan:
    """What to simulate.

    Args:
        text: The plan as written.
        description: The cable, with no table but that of the angles.
        truth: True values as far as they are given [shown units].
        angles: Route values at which wrap angles are read off the curves.
        measured_angles: True wrap angles outside the curves [deg], by route value and column.
        recordings: The recordings.
        decimals: Digits of a force in the files.
    """

    text: str
    description: Description
    truth: Mapping[str, float]
    angles: tuple[float, ...]
    measured_angles: Mapping[float, Mapping[str, float]]
    recordings: tuple[PlannedRecording, ...]
    decimals: int


def read_recordings_plan(path: Path) -> RecordingsPlan:
    """Read a plan with [recordings].

    Raises:
        DescriptionError: The file is missing or no TOML, or a table or key in it is wrong.
    """
    text, raw = read_plan_file(path)
    return parse_recordings_plan(raw, text, path.name)


def parse_recordings_plan(raw: Mapping[str, Any], text: str, file: str = "bench.toml") -> RecordingsPlan:
    """A plan from plain data.

    Args:
        raw: The plan.
        text: The same as written; the description in the data set is cut out of it.
        file: File name, for errors.

    Raises:
        DescriptionError: A table or key is wrong.
    """
    if "recordings" not in raw:
        raise DescriptionError(
            f'{file} has no [recordings]: say what to record, such as lengths = [440, 470], speeds = ["20 r/min"].'
        )
    truth, description = parse_truth(raw, file), description_without_recordings(raw, file)
    try:
        page = _Plan.model_validate({"recordings": raw["recordings"]}).recordings
    except ValidationError as error:
        remedy = 'write it, such as speeds = ["20 r/min"]'
        raise explain_validation_error(error, raw, _Plan, file, remedy) from None
    measured = _measured_angles(page, description, file)
    recordings = plan_recordings(_with_reference_force(page, raw, file), description, file)
    _check_lengths(recordings, measured, description, file)
    if description.curved and not page.angles:
        variable = description.route.variable if description.route else "the route variable"
        raise DescriptionError(
            f"{file}, recordings: the angle curves need angles, the values of {variable} at which wrap "
            "angles are read, such as angles = [430, 450, 470]."
        )
    angles = page.angles if description.curved else ()
    return RecordingsPlan(text, description, truth, angles, measured, recordings, page.decimals)


def _with_reference_force(page: RecordingsPage, raw: Mapping[str, Any], file: str) -> RecordingsPage:
    """The page with the description's reference force, where it states one and the page does not."""
    if "reference_force" not in raw or "reference_force" in page.friction:
        return page
    try:
        force = QuantityValue.model_validate(raw["reference_force"]).to("force")
    except (ValidationError, DatasetError):
        raise DescriptionError(
            f'{file}, reference_force: write a force, such as reference_force = {{ value = 50, unit = "N" }}.'
        ) from None
    return page.model_copy(update={"friction": {**page.friction, "reference_force": force}})


def _measured_angles(page: RecordingsPage, description: Description, file: str) -> dict[float, dict[str, float]]:
    columns = [c.wrap_angle.column or "" for c in description.curved]
    angles: dict[float, dict[str, float]] = {}
    for i, row in enumerate(page.measured_angles):
        where = f"{file}, recordings.measured_angles.{i}"
        for name in row:
            if name not in ["at", *columns]:
                raise DescriptionError(f"{where}: unknown key {name!r}{suggest_name(name, ['at', *columns])}")
        for name in ["at", *columns]:
            if name not in row:
                raise DescriptionError(f"{where}: the key {name!r} is missing; angles are in deg.")
        if _inside(description, row["at"]):
            raise DescriptionError(f"{where}: {row['at']:g} lies inside the range of the route, where the curves hold.")
        angles[row["at"]] = {name: row[name] for name in columns}
    return angles


def _inside(description: Description, length: float) -> bool:
    return description.route is None or description.route.range[0] <= length <= description.route.range[1]


def _check_lengths(
    recordings: Sequence[PlannedRecording], measured: Mapping[float, Any], description: Description, file: str
) -> None:
    """Every recording has wrap angles, and recordings of one mounting have one length."""
    run_lengths: dict[str, float] = {}
    for recording in recordings:
        length = recording.length
        if description.curved and not _inside(description, length) and length not in measured:
            raise DescriptionError(
                f"{file}, recordings: {length:g} lies outside the range of the route, where the curves do not hold; "
                f"give its wrap angles in [[recordings.measured_angles]] with at = {length:g}."
            )
        if not np.isnan(length) and run_lengths.setdefault(recording.run, length) != length:
            raise DescriptionError(
                f"{file}, recordings: the run {recording.run!r} has the lengths {run_lengths[recording.run]:g} and "
                f"{length:g}, but a run is one mounting of the cable."
            )
