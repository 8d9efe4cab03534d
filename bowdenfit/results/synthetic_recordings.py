"""Recordings made from known truth: the plan (`bench.toml` with [recordings]), and the folder that comes of it."""

import dataclasses
import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from bowdenfit.dataset import DESCRIPTION_FILE, Dataset
from bowdenfit.description import Description, Finite, PriorDefaults, QuantityValue
from bowdenfit.description_file import parse_description
from bowdenfit.errors import DatasetError, DescriptionError, UsageError, nearest
from bowdenfit.measurements.tables import AngleTable
from bowdenfit.models.bench import (
    BenchFriction,
    BenchSettings,
    Faults,
    Profile,
    SimulatedRecording,
    check_settings,
    simulate_recording,
)
from bowdenfit.models.build import build_model
from bowdenfit.models.cable import ANGLE_NOISE, Cable
from bowdenfit.models.scatter import FORCE_NOISE, GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET, RUN_SCATTER
from bowdenfit.models.simulation import Design, empty_tables, simulate, true_values
from bowdenfit.results.folder import write_text

TRUTH_FILE = "truth.json"
RECORDINGS_FOLDER = "recordings"
_RPM = 2 * np.pi / 60
_SPEED = re.compile(r"\s*([0-9]*\.?[0-9]+)\s*(r/min|rpm|rad/s)\s*")
_HEADING = re.compile(r"\s*\[\[?\s*([A-Za-z\"'][^\],]*?)\s*\]\]?\s*(#.*)?")
_SECTIONS: dict[str, type] = {"profile": Profile, "bench": BenchSettings, "friction": BenchFriction, "faults": Faults}
_FITTED_FRICTION = ("friction_model", "reference_force", "reference_velocity")
Settings = TypeVar("Settings")


class _Also(BaseModel):
    """[[recordings.also]]: one more recording, and in what it differs from the others."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    length: Finite | None = None
    speed: str | None = None
    run: str | None = None
    profile: dict[str, Any] = {}
    bench: dict[str, Any] = {}
    friction: dict[str, Any] = {}
    faults: dict[str, Any] = {}


class _Page(BaseModel):
    """[recordings] as written: one recording for each length at each speed, and then those of `also`."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    lengths: tuple[Finite, ...] = ()
    speeds: Annotated[tuple[str, ...], Field(min_length=1)]
    angles: tuple[Finite, ...] = ()
    measured_angles: tuple[dict[str, Finite], ...] = ()
    decimals: Annotated[int, Field(ge=0, le=9)] = 3
    also: tuple[_Also, ...] = ()
    profile: dict[str, Any] = {}
    bench: dict[str, Any] = {}
    friction: dict[str, Any] = {}
    faults: dict[str, Any] = {}


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


@dataclass(frozen=True)
class MadeRecording:
    """One recording and its truth: friction exponent without and with the effect of its run, wrap angles [rad]."""

    planned: PlannedRecording
    faults: Faults
    simulated: SimulatedRecording
    exponent: float
    run_effect: float
    wrap_angles: Mapping[str, float]


@dataclass(frozen=True)
class MadeRecordings:
    """Everything that the folder will hold; `truth` in shown units."""

    plan: RecordingsPlan
    seed: int
    truth: Mapping[str, float]
    angles: AngleTable | None
    each: tuple[MadeRecording, ...]


def read_recordings_plan(path: Path) -> RecordingsPlan:
    """Read a plan with [recordings].

    Raises:
        DescriptionError: The file is missing or no TOML, or a table or key in it is wrong.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        raw = tomllib.loads(text)
    except OSError as error:
        raise DescriptionError(f"{path} cannot be read ({error.strerror}); name a bench.toml.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DescriptionError(f"{path.name} is not valid TOML: {error}.") from None
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
    truth = raw.get("truth", {})
    for name, value in truth.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise DescriptionError(f"{file}, truth.{name}: {value!r} is not a number.")
    description = _description(raw, file)
    try:
        page = _Page.model_validate(raw["recordings"])
    except ValidationError as error:
        raise DescriptionError(_explained(error, file)) from None
    measured = _measured_angles(page, description, file)
    recordings = _planned(_with_reference_force(page, raw, file), description, file)
    _check_lengths(recordings, measured, description, file)
    if description.curved and not page.angles:
        raise DescriptionError(
            f"{file}, recordings: the angle curves need angles, the values of {_route_name(description)} at which wrap "
            "angles are read, such as angles = [430, 450, 470]."
        )
    angles = page.angles if description.curved else ()
    return RecordingsPlan(text, description, truth, angles, measured, recordings, page.decimals)


def _description(raw: Mapping[str, Any], file: str) -> Description:
    """The cable without what needs its recordings, whose files do not exist yet: a table of efficiencies stands in for
    them, and [recordings.friction] for a model of friction.
    """
    tables = raw.get("tables", {})
    if "recording" in raw:
        raise DescriptionError(f"{file}: a plan has no [[recording]]; these are made from [recordings].")
    for name in tables:
        if name not in {"angles", "recordings"}:
            raise DescriptionError(
                f"{file}, tables.{name}: a plan of recordings makes angles and recordings only; leave it out, or plan it "
                "with [design] in a file of its own."
            )
    kept = {k: v for k, v in raw.items() if k not in {"truth", "recordings", "tables", *_FITTED_FRICTION}}
    angles = {"angles": tables["angles"]} if "angles" in tables else {}
    description = parse_description({**kept, "tables": {**angles, "efficiencies": {"file": "none.csv"}}}, file)
    for contact in description.contact:
        if contact.wrap_angle.constant is None and contact.wrap_angle.curve is None:
            raise DescriptionError(
                f"{file}, contact {contact.name!r}: recordings are simulated from a constant wrap angle or a curve; "
                "this contact has only a column."
            )
    return description


def _explained(error: ValidationError, file: str) -> str:
    """The first thing that is wrong, as a sentence."""
    first = next((e for e in error.errors() if e["type"] == "extra_forbidden"), error.errors()[0])
    where = ".".join(["recordings", *map(str, first["loc"])])
    if first["type"] == "extra_forbidden":
        page = _Also if first["loc"][0] == "also" else _Page
        return f"{file}: unknown key {where!r}{nearest(str(first['loc'][-1]), list(page.model_fields))}"
    if first["type"] == "missing":
        return f'{file}: the key {where!r} is missing; write it, such as speeds = ["20 r/min"].'
    return f"{file}, {where}: {first['msg'][:1].lower()}{first['msg'][1:]} (found {first['input']!r})."


def _settings(kind: type[Settings], raw: Mapping[str, Any], place: str, **given: Any) -> Settings:
    """One of the four sections as its frozen class."""
    fields = [f.name for f in dataclasses.fields(kind) if f.name not in given]  # type: ignore[arg-type]
    for name in raw:
        if name not in fields:
            raise DescriptionError(f"{place}: unknown key {name!r}{nearest(name, fields)}")
    try:
        return TypeAdapter(kind).validate_python({**raw, **given})
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        message = f"{first['msg'][:1].lower()}{first['msg'][1:]}"
        raise DescriptionError(f"{place}, {where}: {message} (found {first['input']!r}).") from None


def _with_reference_force(page: _Page, raw: Mapping[str, Any], file: str) -> _Page:
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


def _speed(text: str, place: str) -> float:
    """Motor speed [rad/s]."""
    match = _SPEED.fullmatch(text)
    if match is None or float(match[1]) == 0:
        raise DescriptionError(f'{place}: {text!r} is no motor speed; write one such as "20 r/min" or "2.1 rad/s".')
    return float(match[1]) * (1.0 if match[2] == "rad/s" else _RPM)


def _planned(page: _Page, description: Description, file: str) -> tuple[PlannedRecording, ...]:
    """All recordings, with names and files that tell them apart."""
    lengths: Sequence[float | None] = page.lengths or ((None,) if description.route is None else ())
    rows = [(_Also(length=length, speed=speed), "recordings") for length in lengths for speed in page.speeds]
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
    also: _Also, page: _Page, description: Description, place: str, earlier: Sequence[PlannedRecording]
) -> PlannedRecording:
    speed = also.speed or page.speeds[0]
    raw = {name: {**getattr(page, name), **getattr(also, name)} for name in _SECTIONS}
    profile = _settings(Profile, raw["profile"], f"{place}, profile", speed=_speed(speed, place))
    bench = _settings(BenchSettings, raw["bench"], f"{place}, bench")
    friction = _settings(BenchFriction, raw["friction"], f"{place}, friction")
    faults = _settings(Faults, raw["faults"], f"{place}, faults")
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


def _stem(name: str) -> str:
    """A file name: `440mm_20rpm` for the recording "440 mm, 20 r/min"."""
    plain = name.replace("r/min", "rpm").replace("rad/s", "radps").replace(" ", "").replace(",", "_")
    return re.sub(r"[^A-Za-z0-9_.-]", "", plain)


def _measured_angles(page: _Page, description: Description, file: str) -> dict[float, dict[str, float]]:
    columns = [c.wrap_angle.column or "" for c in description.curved]
    found: dict[float, dict[str, float]] = {}
    for i, row in enumerate(page.measured_angles):
        place = f"{file}, recordings.measured_angles.{i}"
        for name in row:
            if name not in ["at", *columns]:
                raise DescriptionError(f"{place}: unknown key {name!r}{nearest(name, ['at', *columns])}")
        for name in ["at", *columns]:
            if name not in row:
                raise DescriptionError(f"{place}: the key {name!r} is missing; angles are in deg.")
        if _inside(description, row["at"]):
            raise DescriptionError(f"{place}: {row['at']:g} lies inside the range of the route, where the curves hold.")
        found[row["at"]] = {name: row[name] for name in columns}
    return found


def _inside(description: Description, length: float) -> bool:
    return description.route is None or description.route.range[0] <= length <= description.route.range[1]


def _route_name(description: Description) -> str:
    return description.route.variable if description.route else "the route variable"


def _check_lengths(
    recordings: Sequence[PlannedRecording], measured: Mapping[float, Any], description: Description, file: str
) -> None:
    """Every recording has wrap angles, and recordings of one mounting have one length."""
    of_run: dict[str, float] = {}
    for recording in recordings:
        length = recording.length
        if description.curved and not _inside(description, length) and length not in measured:
            raise DescriptionError(
                f"{file}, recordings: {length:g} lies outside the range of the route, where the curves do not hold; "
                f"give its wrap angles in [[recordings.measured_angles]] with at = {length:g}."
            )
        if not np.isnan(length) and of_run.setdefault(recording.run, length) != length:
            raise DescriptionError(
                f"{file}, recordings: the run {recording.run!r} has the lengths {of_run[recording.run]:g} and "
                f"{length:g}, but a run is one mounting of the cable."
            )


def make_recordings(plan: RecordingsPlan, seed: int, noise: bool = True) -> MadeRecordings:
    """Make the recordings of a plan.

    Args:
        plan: The plan.
        seed: Seed of everything random.
        noise: Whether readings, angles and mountings scatter, and spikes and gaps occur; the other faults stay.

    Raises:
        UsageError: A name in the truth is no parameter, or a friction exponent comes out negative.
    """
    of_truth, of_readings = jax.random.split(jax.random.key(seed))
    of_noise, of_runs, of_angles, *of_each = np.random.default_rng(seed).spawn(3 + len(plan.recordings))
    lengths = np.array([r.length for r in plan.recordings])
    design = _design(plan)
    tables, given = empty_tables(plan.description, design), dict(plan.truth)
    force_noise = given.pop(FORCE_NOISE, abs(of_noise.standard_normal()) * PriorDefaults().force_noise_newtons)
    values = true_values(plan.description, tables, given, of_truth)
    model = build_model(Dataset(plan.description, tables, {}))
    truth = {p.name: values[p.name] * p.shown_scale for p in model.space.parameters} | {FORCE_NOISE: float(force_noise)}
    named = {name: jnp.asarray(value, dtype=float) for name, value in values.items()}
    angles = _true_angles(plan, model.cable, named, lengths)
    exponents = np.asarray(model.cable.friction_exponent(named, jnp.asarray(angles)), dtype=float)
    scatter = values[RUN_SCATTER] * noise
    effects = {run: scatter * float(of_runs.standard_normal()) for run in dict.fromkeys(r.run for r in plan.recordings)}
    contacts = [c.name for c in plan.description.contact]
    each = []
    for i, (planned, generator) in enumerate(zip(plan.recordings, of_each, strict=True)):
        faults = _faults(planned, float(force_noise), values.get(GAIN_ERROR, 0.0), noise)
        exponent, effect = float(exponents[i]), effects[planned.run]
        simulated = simulate_recording(
            exponent, planned.friction, planned.profile, planned.bench, faults, generator, effect
        )
        wrap = dict(zip(contacts, map(float, angles[i]), strict=True))
        each.append(MadeRecording(planned, faults, simulated, exponent, effect, wrap))
    dataset = simulate(plan.description, design, values, of_readings, noise) if plan.angles else None
    table = (
        dataset
        and dataset.measurements.angles
        and _with_measured(dataset.measurements.angles, plan, values[ANGLE_NOISE] * noise, of_angles)
    )
    return MadeRecordings(plan, seed, {**truth, **_common_truth(each)}, table or None, tuple(each))


def _common_truth(each: Sequence[MadeRecording]) -> dict[str, float]:
    """What all recordings share of friction's dependences and of the sensors, by the names of a fit's parameters."""
    motor = each[0].planned.friction.speed == "motor"
    shown = {"stribeck_speed": 1 / _RPM, "viscous": _RPM} if motor else {}
    found: dict[str, float] = {}
    for name in ("load_exponent", "drag", "stribeck", "stribeck_speed", "viscous"):
        values = {getattr(recording.planned.friction, name) for recording in each}
        switched_on = name != "stribeck_speed" or "stribeck" in found
        if len(values) == 1 and switched_on and 0.0 not in values:
            found[name] = values.pop() * shown.get(name, 1.0)
    for name in (GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET):
        values = {getattr(recording.faults, name) for recording in each}
        if len(values) == 1 and 0.0 not in values:
            found[name] = values.pop()
    return found


def _design(plan: RecordingsPlan) -> Design:
    """Tables from which the parameters are declared; one efficiency at a place where all curves hold."""
    route = plan.description.route
    return Design(angles=plan.angles, efficiencies=(route.middle if route else 0.0,))


def _true_angles(
    plan: RecordingsPlan, cable: Cable, values: Mapping[str, jax.Array], lengths: np.ndarray
) -> np.ndarray:
    """Wrap angle of each recording and contact [rad]: the curve's, or the stated one outside the range."""
    angles = np.array(cable.wrap_angles(values, jnp.asarray(np.nan_to_num(lengths))), dtype=float)
    for k, contact in enumerate(plan.description.contact):
        for i, length in enumerate(lengths.tolist()):
            if contact.wrap_angle.curve and length in plan.measured_angles:
                angles[i, k] = np.deg2rad(plan.measured_angles[length][contact.wrap_angle.column or ""])
    return angles


def _faults(planned: PlannedRecording, force_noise: float, gain_error: float, noise: bool) -> Faults:
    """The faults of a recording, with what the truth says of noise and gain where the plan says nothing."""
    faults = planned.faults
    if not planned.states_noise[0]:
        faults = dataclasses.replace(faults, input_noise=force_noise)
    if not planned.states_noise[1]:
        faults = dataclasses.replace(faults, output_noise=force_noise)
    if not planned.states_gain:
        faults = dataclasses.replace(faults, gain_error=gain_error)
    return faults if noise else dataclasses.replace(faults, input_noise=0.0, output_noise=0.0, spikes=0.0, dropouts=0.0)


def _with_measured(table: AngleTable, plan: RecordingsPlan, noise: float, generator: np.random.Generator) -> AngleTable:
    """The angle table with the rows outside the curves' range at its end."""
    if not plan.measured_angles:
        return table
    route = np.array(list(plan.measured_angles), dtype=float)
    true = np.deg2rad([[row[name] for name in table.names] for row in plan.measured_angles.values()])
    reading = np.maximum(true + noise * generator.standard_normal(true.shape), 0.0)
    settings = plan.description.tables.angles
    limit = settings.detection_limit.to("angle") if settings and settings.detection_limit else -np.inf
    hidden = reading < limit
    return dataclasses.replace(
        table,
        route=np.append(table.route, route),
        angle=np.vstack([table.angle, np.where(hidden, np.nan, reading)]),
        limit=np.vstack([table.limit, np.where(hidden, limit, np.nan)]),
    )


def write_recordings(made: MadeRecordings, folder: Path) -> None:
    """Write cable.toml, the recordings, the angles and truth.json.

    Args:
        made: What was made.
        folder: Where to.
    """
    (folder / RECORDINGS_FOLDER).mkdir(parents=True, exist_ok=True)
    write_text(folder / DESCRIPTION_FILE, _description_text(made.plan))
    if made.angles is not None:
        settings = made.plan.description.tables.angles
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
        (simulated.motor_speed / _RPM + 0.0).tolist(),
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
