"""A plan of recordings (`bench.toml` with [recordings]): reading it, and refusing what does not fit together."""

import dataclasses
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationError

from bowdenfit.description import Description, Finite, QuantityValue
from bowdenfit.description.values import Frozen
from bowdenfit.description.wrong_keys import explain_validation_error
from bowdenfit.errors import DatasetError, DescriptionError, UsageError, suggest_name
from bowdenfit.kinds.descriptions import description_without_recordings
from bowdenfit.questions.simulate.bench import (
    BenchFriction,
    BenchSettings,
    LoadCellFaults,
    MotorProfile,
    check_settings,
)
from bowdenfit.questions.simulate.tables import parse_truth, read_plan_file

RECORDINGS_FOLDER = "recordings"
RPM = 2 * np.pi / 60  # rad/s
_SPEED = re.compile(r"\s*([0-9]*\.?[0-9]+)\s*(r/min|rpm|rad/s)\s*")


class RecordingSettings(Frozen):
    """Settings of a recording as written: what is missing is that of all recordings, or the default."""

    profile: dict[str, Any] = Field(default_factory=dict)
    bench: dict[str, Any] = Field(default_factory=dict)
    friction: dict[str, Any] = Field(default_factory=dict)
    faults: dict[str, Any] = Field(default_factory=dict)


class ExtraRecording(RecordingSettings):
    """[[recordings.also]]: one more recording, and in what it differs from the others."""

    length: Finite | None = None
    speed: str | None = None
    run: str | None = None


class RecordingsPage(RecordingSettings):
    """[recordings] as written: one recording for each length at each speed, and then those of `also`."""

    lengths: tuple[Finite, ...] = ()
    speeds: Annotated[tuple[str, ...], Field(min_length=1)]
    angles: tuple[Finite, ...] = ()
    measured_angles: tuple[dict[str, Finite], ...] = ()
    decimals: Annotated[int, Field(ge=0, le=9)] = 3
    also: tuple[ExtraRecording, ...] = ()


class _Plan(Frozen):
    """The part of a plan that is about recordings."""

    recordings: RecordingsPage


class PlannedRecording(Frozen):
    """One recording to be made.

    Args:
        run: Mounting of the cable that it belongs to.
        file: File below the data set's folder.
        length: Route value; NaN without a route.
        speed: Motor speed as written.
        profile, bench, friction, faults: How it is made.
        stated_faults: Faults that the plan gives; noise and gain error are otherwise those of the truth.
    """

    run: str
    file: str
    length: float
    speed: str
    profile: MotorProfile
    bench: BenchSettings
    friction: BenchFriction
    faults: LoadCellFaults
    stated_faults: frozenset[str]


@dataclass(frozen=True)
class RecordingsPlan:
    """Recordings to simulate, and the cable.

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
    """Read a plan from plain data.

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
    if "motor" in raw:
        raise DescriptionError(
            f"{file} has a [motor], and recordings are simulated of two load cells; leave it out, or plan tables with [design]."
        )
    truth, description = parse_truth(raw, file), description_without_recordings(raw, file)
    try:
        page = _Plan.model_validate({"recordings": raw["recordings"]}).recordings
    except ValidationError as error:
        remedy = 'write it, such as speeds = ["20 r/min"]'
        raise explain_validation_error(error, raw, _Plan, file, remedy) from None
    measured = _read_measured_angles(page, description, file)
    recordings = plan_recordings(_add_reference_force(page, raw, file), description, file)
    _check_lengths(recordings, measured, description, file)
    if description.curved and not page.angles:
        variable = description.route.variable if description.route else "the route variable"
        raise DescriptionError(
            f"{file}, recordings: the angle curves need angles, the values of {variable} at which wrap "
            "angles are read, such as angles = [430, 450, 470]."
        )
    angles = page.angles if description.curved else ()
    return RecordingsPlan(text, description, truth, angles, measured, recordings, page.decimals)


def _add_reference_force(page: RecordingsPage, raw: Mapping[str, Any], file: str) -> RecordingsPage:
    """Return the page with the description's reference force, where it states one and the page does not."""
    if "reference_force" not in raw or "reference_force" in page.friction:
        return page
    try:
        force = QuantityValue.model_validate(raw["reference_force"]).to("force")
    except (ValidationError, DatasetError):
        raise DescriptionError(
            f'{file}, reference_force: write a force, such as reference_force = {{ value = 50, unit = "N" }}.'
        ) from None
    return page.model_copy(update={"friction": {**page.friction, "reference_force": force}})


def _read_measured_angles(page: RecordingsPage, description: Description, file: str) -> dict[float, dict[str, float]]:
    columns = [c.wrap_angle.column or "" for c in description.curved]
    angles: dict[float, dict[str, float]] = {}
    for i, row in enumerate(page.measured_angles):
        place = f"{file}, recordings.measured_angles.{i}"
        for name in row:
            if name not in ["at", *columns]:
                raise DescriptionError(f"{place}: unknown key {name!r}{suggest_name(name, ['at', *columns])}")
        for name in ["at", *columns]:
            if name not in row:
                raise DescriptionError(f"{place}: the key {name!r} is missing; angles are in deg.")
        if _is_inside_range(description, row["at"]):
            raise DescriptionError(f"{place}: {row['at']:g} lies inside the range of the route, where the curves hold.")
        angles[row["at"]] = {name: row[name] for name in columns}
    return angles


def _is_inside_range(description: Description, length: float) -> bool:
    return description.route is None or description.route.range[0] <= length <= description.route.range[1]


def _check_lengths(
    recordings: Sequence[PlannedRecording], measured: Mapping[float, Any], description: Description, file: str
) -> None:
    """Refuse recordings without wrap angles, and recordings of one mounting at several lengths."""
    run_lengths: dict[str, float] = {}
    for recording in recordings:
        length = recording.length
        if description.curved and not _is_inside_range(description, length) and length not in measured:
            raise DescriptionError(
                f"{file}, recordings: {length:g} lies outside the range of the route, where the curves do not hold; "
                f"give its wrap angles in [[recordings.measured_angles]] with at = {length:g}."
            )
        if not np.isnan(length) and run_lengths.setdefault(recording.run, length) != length:
            raise DescriptionError(
                f"{file}, recordings: the run {recording.run!r} has the lengths {run_lengths[recording.run]:g} and "
                f"{length:g}, but a run is one mounting of the cable."
            )


def plan_recordings(page: RecordingsPage, description: Description, file: str) -> tuple[PlannedRecording, ...]:
    """Return all recordings, with names and files that tell them apart."""
    lengths: Sequence[float | None] = page.lengths or ((None,) if description.route is None else ())
    rows = [(ExtraRecording(length=length, speed=speed), "recordings") for length in lengths for speed in page.speeds]
    rows += [(also, f"recordings.also.{i}") for i, also in enumerate(page.also)]
    planned: list[PlannedRecording] = []
    for also, location in rows:
        if (also.length is None) != (description.route is None):
            expected = "needs a length" if also.length is None else "has a length, but the plan has no [route]"
            raise DescriptionError(f"{file}, {location}: the recording {expected}.")
        planned.append(_plan_recording(also, page, description, f"{file}, {location}", planned))
    if not planned:
        raise DescriptionError(f"{file}, recordings: nothing to record; name lengths, such as lengths = [440, 470].")
    return tuple(planned)


def _plan_recording(
    also: ExtraRecording, page: RecordingsPage, description: Description, where: str, earlier: Sequence[PlannedRecording]
) -> PlannedRecording:
    speed = also.speed or page.speeds[0]
    sections = {name: {**getattr(page, name), **getattr(also, name)} for name in RecordingSettings.model_fields}
    if "speed" in sections["profile"]:
        raise DescriptionError(f"{where}, profile: unknown key 'speed'; write speeds or speed next to [profile].")
    sections["profile"]["speed"] = _parse_motor_speed(speed, where)
    name = (
        f"{also.length:g} {description.route.unit}, {speed}" if also.length is not None and description.route else speed
    )
    stem = _make_file_stem(name)
    n_same_stem = sum(re.sub(r"_\d+$", "", Path(p.file).stem) == stem for p in earlier)
    run, number = (f"{name} ({n_same_stem + 1})", f"_{n_same_stem + 1}") if n_same_stem else (name, "")
    try:
        planned = PlannedRecording.model_validate(
            {
                "run": also.run or run,
                "file": f"{RECORDINGS_FOLDER}/{stem}{number}.csv",
                "length": float("nan") if also.length is None else also.length,
                "speed": speed,
                "stated_faults": frozenset(sections["faults"]),
                **sections,
            }
        )
        check_settings(planned.profile, planned.faults)
    except ValidationError as error:
        raise DescriptionError(f"{where}, {_describe_first_fault(error)}") from None
    except UsageError as error:
        raise DescriptionError(f"{where}: {error}") from None
    return planned


def _describe_first_fault(error: ValidationError) -> str:
    """Say the first thing that is wrong with the sections of a recording."""
    first = next((e for e in error.errors() if e["type"] == "unexpected_keyword_argument"), error.errors()[0])
    section, *where = map(str, first["loc"])
    if first["type"] == "unexpected_keyword_argument":
        kind: Any = PlannedRecording.model_fields[section].annotation
        known = [field.name for field in dataclasses.fields(kind) if field.name != "speed" or kind is not MotorProfile]
        return f"{section}: unknown key {where[0]!r}{suggest_name(where[0], known)}"
    message = f"{first['msg'][:1].lower()}{first['msg'][1:]}"
    return f"{section}, {'.'.join(where)}: {message} (found {first['input']!r})."


def _parse_motor_speed(text: str, where: str) -> float:
    """Return the motor speed [rad/s]."""
    match = _SPEED.fullmatch(text)
    if match is None or float(match[1]) == 0:
        raise DescriptionError(f'{where}: {text!r} is not a motor speed; write one such as "20 r/min" or "2.1 rad/s".')
    return float(match[1]) * (1.0 if match[2] == "rad/s" else RPM)


def _make_file_stem(name: str) -> str:
    """Return a file name: `440mm_20rpm` for the recording "440 mm, 20 r/min"."""
    plain = name.replace("r/min", "rpm").replace("rad/s", "radps").replace(" ", "").replace(",", "_")
    return re.sub(r"[^A-Za-z0-9_.-]", "", plain)
