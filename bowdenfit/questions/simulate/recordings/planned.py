"""The recordings that a plan asks for, one by one: their settings, and names and files that tell them apart."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError, UsageError
from bowdenfit.questions.simulate.bench import BenchFriction, BenchSettings, Faults, Profile, check_settings
from bowdenfit.questions.simulate.recordings.page import Also, Page, settings_of

RECORDINGS_FOLDER = "recordings"
RPM = 2 * np.pi / 60  # rad/s
_SPEED = re.compile(r"\s*([0-9]*\.?[0-9]+)\s*(r/min|rpm|rad/s)\s*")
_SECTIONS = ("profile", "bench", "friction", "faults")


@dataclass(frozen=True)
class PlannedRecording:
    """One recording to be made.

    Args:
        run: Mounting of the cable that it belongs to.
        file: File below the data set's folder.
        length: Route value; NaN without a route.
        speed: Motor speed as written.
        profile, bench, friction, faults: How it is made.
        states_noise: Whether the plan gives the noise of the cells, instead of the truth's sigma_F.
        states_gain: Whether the plan gives the gain error.
    """

    run: str
    file: str
    length: float
    speed: str
    profile: Profile
    bench: BenchSettings
    friction: BenchFriction
    faults: Faults
    states_noise: tuple[bool, bool]
    states_gain: bool


def planned_recordings(page: Page, description: Description, file: str) -> tuple[PlannedRecording, ...]:
    """All recordings, with names and files that tell them apart."""
    lengths: Sequence[float | None] = page.lengths or ((None,) if description.route is None else ())
    rows = [(Also(length=length, speed=speed), "recordings") for length in lengths for speed in page.speeds]
    rows += [(also, f"recordings.also.{i}") for i, also in enumerate(page.also)]
    planned: list[PlannedRecording] = []
    for also, place in rows:
        if (also.length is None) != (description.route is None):
            wanted = "needs a length" if also.length is None else "has a length, but the plan has no [route]"
            raise DescriptionError(f"{file}, {place}: the recording {wanted}.")
        planned.append(_one(also, page, description, f"{file}, {place}", planned))
    if not planned:
        raise DescriptionError(f"{file}, recordings: nothing to record; name lengths, such as lengths = [440, 470].")
    return tuple(planned)


def _one(
    also: Also, page: Page, description: Description, place: str, earlier: Sequence[PlannedRecording]
) -> PlannedRecording:
    speed = also.speed or page.speeds[0]
    raw = {name: {**getattr(page, name), **getattr(also, name)} for name in _SECTIONS}
    profile = settings_of(Profile, raw["profile"], f"{place}, profile", speed=_motor_speed(speed, place))
    bench = settings_of(BenchSettings, raw["bench"], f"{place}, bench")
    friction = settings_of(BenchFriction, raw["friction"], f"{place}, friction")
    faults = settings_of(Faults, raw["faults"], f"{place}, faults")
    try:
        check_settings(profile, faults)
    except UsageError as error:
        raise DescriptionError(f"{place}: {error}") from None
    unit = description.route.unit if description.route else ""
    name = f"{also.length:g} {unit}, {speed}" if also.length is not None else speed
    stem = _stem(name)
    taken = sum(re.sub(r"_\d+$", "", Path(p.file).stem) == stem for p in earlier)
    suffix = f" ({taken + 1})" if taken else ""
    file = f"{RECORDINGS_FOLDER}/{stem}{f'_{taken + 1}' if taken else ''}.csv"
    length = float("nan") if also.length is None else also.length
    states = ("input_noise" in raw["faults"], "output_noise" in raw["faults"])
    gain = "gain_error" in raw["faults"]
    return PlannedRecording(
        also.run or name + suffix, file, length, speed, profile, bench, friction, faults, states, gain
    )


def _motor_speed(text: str, place: str) -> float:
    """Motor speed [rad/s]."""
    match = _SPEED.fullmatch(text)
    if match is None or float(match[1]) == 0:
        raise DescriptionError(f'{place}: {text!r} is no motor speed; write one such as "20 r/min" or "2.1 rad/s".')
    return float(match[1]) * (1.0 if match[2] == "rad/s" else RPM)


def _stem(name: str) -> str:
    """A file name: `440mm_20rpm` for the recording "440 mm, 20 r/min"."""
    plain = name.replace("r/min", "rpm").replace("rad/s", "radps").replace(" ", "").replace(",", "_")
    return re.sub(r"[^A-Za-z0-9_.-]", "", plain)
