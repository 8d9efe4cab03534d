"""The description of a cable, `cable.toml`, as frozen models; the only place where defaults are written."""

from collections.abc import Iterator
from math import hypot, sqrt
from typing import Annotated, Any, Literal, TypeVar

from pydantic import ConfigDict, Field, field_validator, model_validator

from bowdenfit.description.cable_parts import CableSettings, ContactSettings, MotorSettings, Pulleys, Route, WrapAngle
from bowdenfit.description.defaults import BenchErrors, PriorDefaults, Sampler, SamplerSettings, Sensors
from bowdenfit.description.measurements import (
    MOST_FILES,
    ForceLimits,
    Phase,
    Preparation,
    RecordingFile,
    Table,
    Tables,
    TableSettings,
)
from bowdenfit.description.stated_parameters import PreloadSettings, StretchSettings
from bowdenfit.description.values import (
    Choice,
    Finite,
    FrictionSetting,
    Frozen,
    HalfCauchyPrior,
    HalfNormalPrior,
    LogNormalPrior,
    Measured,
    Name,
    NonNegative,
    NormalPrior,
    ParameterSetting,
    Positive,
    PriorChoice,
    QuantityValue,
    Text,
    UniformPrior,
)
from bowdenfit.display import Display, Rows
from bowdenfit.errors import suggest_name
from bowdenfit.words import counted, listed

__all__ = [
    "BY_GROUP",
    "MOST_FILES",
    "RESERVED_NAMES",
    "SCHEMA",
    "BenchErrors",
    "CableSettings",
    "ContactSettings",
    "Description",
    "Finite",
    "ForceLimits",
    "FrictionSetting",
    "Geometry",
    "HalfCauchyPrior",
    "HalfNormalPrior",
    "LogNormalPrior",
    "Measured",
    "MotorSettings",
    "Noise",
    "NonNegative",
    "NormalPrior",
    "ParameterSetting",
    "Phase",
    "Positive",
    "PreloadSettings",
    "Preparation",
    "PriorChoice",
    "PriorDefaults",
    "QuantityValue",
    "RecordingFile",
    "Route",
    "Sampler",
    "SamplerSettings",
    "Sensors",
    "StretchSettings",
    "Table",
    "TableSettings",
    "Tables",
    "UniformPrior",
    "WrapAngle",
]

SCHEMA = 1
BY_GROUP = "by-group"
Geometry = Literal["continuous", "published"]
Noise = Literal["normal", "student"]
RESERVED_NAMES = ("chain", "draw", "optimal_length", "optimal_efficiency")
"""Columns that a file of draws has beside the coefficients, so that no coefficient can be called that."""

_MOST_CONTACTS = 100  # judged: on-body cables have three; equal ones can be joined, because their wrap angles add up
_DEPARTURE = {"continuous": "smooth", "published": "none"}  # of angles from their curves, where nothing is stated, by geometry
_MOST_SETTINGS = 1000  # judged: more than one for each coefficient of each group
AnySettings = TypeVar("AnySettings")


class Description(Display, Frozen):
    """Everything said about a cable and its measurements, defaults filled in."""

    schema_: Annotated[int, Field(alias="schema", ge=1, le=SCHEMA)] = SCHEMA
    name: Name
    source: Text = ""
    license: Text = ""
    geometry: Geometry = "continuous"
    friction_model: Choice = "capstan"
    group: Name | None = None
    noise: Noise = "normal"
    student_degrees_of_freedom: Annotated[int, Field(ge=2, le=100, multiple_of=2)] = 4
    reference_force: QuantityValue | None = None
    reference_velocity: QuantityValue | None = None
    cable: CableSettings = CableSettings()
    motor: MotorSettings | None = None
    route: Route | None = None
    contact: Annotated[tuple[ContactSettings, ...], Field(min_length=1, max_length=_MOST_CONTACTS)]
    friction: dict[str, FrictionSetting] = Field(default_factory=dict, max_length=_MOST_SETTINGS)
    prior: dict[str, ParameterSetting] = Field(default_factory=dict, max_length=_MOST_SETTINGS)
    stretch: StretchSettings = StretchSettings()
    preload: PreloadSettings = PreloadSettings()
    tables: Tables
    recording: Annotated[tuple[RecordingFile, ...], Field(max_length=MOST_FILES)] = ()
    sensors: Sensors = Sensors()
    errors: BenchErrors = BenchErrors()
    sampler: SamplerSettings = SamplerSettings()

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    @field_validator("friction_model")
    @classmethod
    def _hyphens(cls, model: str) -> str:
        """Options are written with hyphens; "by group" is understood."""
        return "+".join(part.strip().replace(" ", "-") for part in model.split("+"))

    @field_validator("contact")
    @classmethod
    def _distinct(cls, contacts: tuple[ContactSettings, ...]) -> tuple[ContactSettings, ...]:
        for names, what in (
            ([c.name for c in contacts], "name"),
            ([c.wrap_angle.column or "" for c in contacts if c.wrap_angle.curve], "curve's column"),
        ):
            twice = [n for n in names if names.count(n) > 1]
            if twice:
                raise ValueError(f"two contacts have the same {what}, {twice[0]!r}")
        return contacts

    @model_validator(mode="after")
    def _consistent(self) -> "Description":
        if faults := [*self._name_conflicts(), *self._setting_conflicts()]:
            raise ValueError("\n".join(faults))  # a line each
        return self

    def _name_conflicts(self) -> Iterator[str]:
        """Yield what names contradict."""
        used = [c.friction for c in self.contact]
        for name in self.coefficients:
            if name in RESERVED_NAMES:
                yield f"a friction coefficient cannot be called {name!r}, which results hold already; rename it"
            if len({c.by_group for c in self.contact if c.friction == name}) > 1:
                yield f"by_group is not the same in all contacts of {name!r}; write it in each, or use two names"
        for name in self.friction:
            if name not in used and name.partition("[")[0] not in used:
                yield f"[friction.{name}] belongs to no contact{suggest_name(name, used)}"
        if self.stretch.friction is not None and self.stretch.friction not in used:
            hint = suggest_name(self.stretch.friction, used)
            yield f"stretch.friction {self.stretch.friction!r} belongs to no contact{hint}"
        if self.group is not None and not self.by_group:
            yield 'group names the one that predictions are for, which belongs to friction_model = "by-group"'

    def _setting_conflicts(self) -> Iterator[str]:
        """Yield what settings contradict."""
        curved = [c for c in self.contact if c.wrap_angle.curve]
        if curved and self.route is None:
            yield f"the contact {curved[0].name!r} has a curve, so a [route] is needed: variable, unit, range"
        if self.geometry == "published" and not curved:
            yield 'geometry = "published" needs contacts with a curve'
        laws = [c.special_law for c in self.contact if c.friction == self.stretch.friction]
        if len(laws) > 1 and any(laws):
            yield (
                f"stretch.friction {self.stretch.friction!r} acts in {len(laws)} contacts, and by the "
                f"{next(filter(None, laws))} law their wrap angles together do not determine the friction of the rope; leave "
                "stretch.friction out, for a coefficient of its own"
            )
        freedom = type(self).model_fields["student_degrees_of_freedom"].default
        if self.noise != "student" and self.student_degrees_of_freedom != freedom:
            yield 'student_degrees_of_freedom belongs to noise = "student"; write that as well, or leave it out'
        if self.by_group and self.stretch.friction is not None:
            yield (
                "stretch.friction is a coefficient of which each group has its own, and the stretch belongs to no group; leave "
                "it out, for a coefficient of its own"
            )
        if self.cable.kind == "loop" and self.friction_model != "capstan":
            yield 'the equations of a loop hold for friction_model = "capstan" only; leave it out, or fit one rope alone'
        if self.motor is not None:
            yield from self._motor_conflicts()

    def _motor_conflicts(self) -> Iterator[str]:
        """Yield what contradicts a motor in the place of a load cell."""
        if self.cable.input_pulley_radius is None:
            yield '[motor] needs the radius of its pulley: [cable] input_pulley_radius = { value = 15, unit = "mm" }'
        if self.cable.kind == "loop":
            yield "[motor] is that of a single rope; a loop needs the torque at its input: write input_torque, without [motor]"
        if of_turns := sorted({"play", "dahl", "lugre"} & set(self.friction_model.split("+"))):
            yield (
                f'friction_model = "{of_turns[0]}" is of the turns of the motion, in which a gear has friction of its own; '
                "leave it out, or read a load cell at the input"
            )

    @property
    def fits_offsets(self) -> bool:
        """Whether the load cells' offsets are parameters."""
        return self.sensors.offset_sd is not None or any(settings.fits_offsets for settings in self.tables.stated.values())

    @property
    def shifts_forces(self) -> bool:
        """Whether forces at both ends need not be in proportion: offsets, or the friction of a gear, are in the fit."""
        return self.fits_offsets or self.motor is not None

    @property
    def gain_sd(self) -> float | None:
        """Standard deviation of the log ratio of both ends' gains [1]; None where nothing is said of either.

        That of a motor is the error of its constants; a load cell of which nothing is said then has the usual one.
        """
        if self.motor is None:
            return self.sensors.gain_sd
        radius = self.cable.input_pulley_radius
        of_radius = radius.sd / radius.value if radius is not None and radius.sd is not None else 0.0
        of_cells = self.errors.gain / sqrt(3) if self.sensors.gain_sd is None else self.sensors.gain_sd
        return hypot(of_cells, of_radius, *self.motor.relative_sds)

    @property
    def pulleys(self) -> Pulleys:
        """What turns torques and currents into forces."""
        radii = self.cable.input_pulley_radius, self.cable.output_pulley_radius
        of_input, of_output = (None if radius is None else radius.to("length") for radius in radii)
        return Pulleys(of_input, of_output, self.motor)

    @property
    def by_group(self) -> bool:
        """Whether each group of readings has friction coefficients of its own."""
        return BY_GROUP in self.friction_model.split("+")

    @property
    def noise_in_words(self) -> str:
        """How readings scatter, for people."""
        freedom = self.student_degrees_of_freedom
        return f"Student-t noise with {freedom} degrees of freedom" if self.noise == "student" else "normal noise"

    @property
    def laws_in_words(self) -> str:
        """Which contacts have another law than the usual one; empty where none has."""
        return listed([f"the {c.special_law} law in the contact {c.name!r}" for c in self.contact if c.special_law])

    @property
    def preload_follows_stretch(self) -> bool:
        """Whether preload depends on the wrap angle; so it does by default where a table says how."""
        measured = any(settings.measures_preload for settings in self.tables.stated.values())
        return (self.preload.model or ("stretch" if measured else "constant")) == "stretch"

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the friction coefficients, each once, in order of the contacts."""
        return tuple(dict.fromkeys(c.friction for c in self.contact))

    def departs(self, angle: WrapAngle) -> bool:
        """Whether an angle departs smoothly from its curve: unless stated otherwise or in the published geometry, it does."""
        return angle.curve is not None and (angle.departure or _DEPARTURE[self.geometry]) == "smooth"

    @property
    def has_routes(self) -> bool:
        """Whether a wrap angle is still to be measured along a route of points."""
        return any(c.wrap_angle.route is not None for c in self.contact)

    @property
    def curved(self) -> tuple[ContactSettings, ...]:
        """Contacts whose wrap angle is a curve."""
        return tuple(c for c in self.contact if c.wrap_angle.curve)

    @property
    def angle_columns(self) -> tuple[str, ...]:
        """Columns in which rows may carry their own wrap angle."""
        return tuple(self.angle_column_keys)

    @property
    def angle_column_keys(self) -> dict[str, tuple[str | int, ...]]:
        """Keys that lead to the name of each of these columns, in the last contact that has it."""
        columns = [contact.wrap_angle.column for contact in self.contact]
        return {column: ("contact", i, "wrap_angle", "column") for i, column in enumerate(columns) if column}

    def sentences(self) -> list[str]:
        """Return what the cable is."""
        route, names = self.route, self.coefficients
        along = f"; {route.variable} {route.range[0]:g} to {route.range[1]:g} {route.unit}" if route else ""
        coefficients = f"the coefficient{'s' if len(names) > 1 else ''} {listed(names)}"
        return [f"{self.name}: {counted(len(self.contact), 'contact')} with {coefficients}{along}."]

    def _table(self) -> Rows:
        rows = [
            {"contact": c.name, "friction": c.friction, "wrap_angle": c.wrap_angle.value, "unit": c.wrap_angle.unit,
             "column": c.wrap_angle.column, "curve": c.wrap_angle.curve}
            for c in self.contact
        ]  # fmt: skip
        return rows, {c.name: c.wrap_angle.unit or "" for c in self.contact}

    def table(self, of: type[AnySettings]) -> AnySettings | None:
        """Return what is said of the table whose kind has settings of a class; None if there is no such table."""
        return next((settings for settings in self.tables.stated.values() if type(settings) is of), None)

    def to_json(self) -> dict[str, Any]:
        """Return the resolved description as plain data."""
        return self.model_dump(mode="json", by_alias=True)
