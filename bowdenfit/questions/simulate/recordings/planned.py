"""The recordings that a plan asks for, one by one: their settings, and names and files that tell them apart."""

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationError

from bowdenfit.description import Description, Finite
from bowdenfit.description.values import Frozen
from bowdenfit.errors import DescriptionError, UsageError, suggest_name
from bowdenfit.questions.simulate.bench import (
    BenchFriction,
    BenchSettings,
    LoadCellFaults,
    MotorProfile,
    check_settings,
)

RECORDINGS_FOLDER = "recordings"
RPM = 2 * np.pi / 60  # rad/s
_SPEED = re.compile(r"\s*([0-9]*\.?[0-9]+)\s*(r/min|rpm|rad/s)\s*")


class RecordingSettings(Frozen):
    """How a recording is made, as written: what is missing is that of all recordings, or the default."""

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


def plan_recordings(page: RecordingsPage, description: Description, file: str) -> tuple[PlannedRecording, ...]:
    """All recordings, with names and files that tell them apart."""
    lengths: Sequence[float | None] = page.lengths or ((None,) if description.route is None else ())
    rows = [(ExtraRecording(length=length, speed=speed), "recordings") for length in lengths for speed in page.speeds]
    rows += [(also, f"recordings.also.{i}") for i, also in enumerate(page.also)]
    planned: list[PlannedRecording] = []
    for also, where in rows:
        if (also.length is None) != (description.route is None):
            wanted = "needs a length" if also.length is None else "has a length, but the plan has no [route]"
            raise DescriptionError(f"{file}, {where}: the recording {wanted}.")
        planned.append(_plan_recording(also, page, description, f"{file}, {where}", planned))
    if not planned:
        raise DescriptionError(f"{file}, recordings: nothing to record; name lengths, such as lengths = [440, 470].")
    return tuple(planned)


def _plan_recording(
    also: ExtraRecording, page: RecordingsPage, description: Description, where: str, earlier: Sequence[PlannedRecording]
) -> PlannedRecording:
    speed = also.speed or page.speeds[0]
    sections = {name: {**getattr(page, name), **getattr(also, name)} for name in RecordingSettings.model_fields}
    if "speed" in sections["profile"]:
        raise DescriptionError(f"{where}, profile: unknown key 'speed'; write speeds or speed beside [profile].")
    sections["profile"]["speed"] = _motor_speed(speed, where)
    name = (
        f"{also.length:g} {description.route.unit}, {speed}" if also.length is not None and description.route else speed
    )
    stem = _file_stem(name)
    taken = sum(re.sub(r"_\d+$", "", Path(p.file).stem) == stem for p in earlier)
    run, number = (f"{name} ({taken + 1})", f"_{taken + 1}") if taken else (name, "")
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
        raise DescriptionError(f"{where}, {_explain(error)}") from None
    except UsageError as error:
        raise DescriptionError(f"{where}: {error}") from None
    return planned


def _explain(error: ValidationError) -> str:
    """The first thing that is wrong with the sections of a recording."""
    first = next((e for e in error.errors() if e["type"] == "unexpected_keyword_argument"), error.errors()[0])
    section, *where = map(str, first["loc"])
    if first["type"] == "unexpected_keyword_argument":
        kind: Any = PlannedRecording.model_fields[section].annotation
        known = [field.name for field in dataclasses.fields(kind) if field.name != "speed" or kind is not MotorProfile]
        return f"{section}: unknown key {where[0]!r}{suggest_name(where[0], known)}"
    message = f"{first['msg'][:1].lower()}{first['msg'][1:]}"
    return f"{section}, {'.'.join(where)}: {message} (found {first['input']!r})."


def _motor_speed(text: str, where: str) -> float:
    """Motor speed [rad/s]."""
    match = _SPEED.fullmatch(text)
    if match is None or float(match[1]) == 0:
        raise DescriptionError(f'{where}: {text!r} is no motor speed; write one such as "20 r/min" or "2.1 rad/s".')
    return float(match[1]) * (1.0 if match[2] == "rad/s" else RPM)


def _file_stem(name: str) -> str:
    """A file name: `440mm_20rpm` for the recording "440 mm, 20 r/min"."""
    plain = name.replace("r/min", "rpm").replace("rad/s", "radps").replace(" ", "").replace(",", "_")
    return re.sub(r"[^A-Za-z0-9_.-]", "", plain)
