"""The description of a cable, `cable.toml`, as frozen models; the only place where defaults are written."""

from typing import Annotated, Any, Literal, TypeVar

from pydantic import ConfigDict, Field, field_validator, model_validator

from bowdenfit.description.elastic import CableSettings, PreloadSettings, StretchSettings
from bowdenfit.description.recordings import ForceLimits, Phase, Preparation, RecordingFile
from bowdenfit.description.values import (
    Finite,
    FrictionSetting,
    Frozen,
    HalfNormalPrior,
    LogNormalPrior,
    Measured,
    NonNegative,
    NormalPrior,
    ParameterSetting,
    Positive,
    PriorChoice,
    QuantityValue,
    UniformPrior,
)
from bowdenfit.errors import nearest
from bowdenfit.units import ColumnSource
from bowdenfit.words import listed

__all__ = [
    "SCHEMA",
    "CableSettings",
    "Contact",
    "Description",
    "Finite",
    "ForceLimits",
    "FrictionSetting",
    "Geometry",
    "HalfNormalPrior",
    "LogNormalPrior",
    "Measured",
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
Geometry = Literal["continuous", "published"]
Noise = Literal["normal", "student"]
Sampler = Literal["emcee", "nuts", "both"]
AnySettings = TypeVar("AnySettings")


class Route(Frozen):
    """What the design question varies: a column of the tables, and where the angle curves hold."""

    variable: str = "cable_length"
    unit: str = "mm"
    range: tuple[Finite, Finite]
    choices: tuple[Finite, ...] = ()

    @model_validator(mode="after")
    def _ordered(self) -> "Route":
        if not self.range[0] < self.range[1]:
            raise ValueError("range must be [lowest, highest]")
        outside = [c for c in self.choices if not self.range[0] <= c <= self.range[1]]
        if outside:
            raise ValueError(f"choices must lie inside range; {outside[0]:g} does not")
        return self

    @property
    def middle(self) -> float:
        """Middle of the range."""
        return (self.range[0] + self.range[1]) / 2

    @property
    def half_width(self) -> float:
        """Half the range."""
        return (self.range[1] - self.range[0]) / 2

    @property
    def label(self) -> str:
        """Name and unit for an axis or a heading."""
        return f"{self.variable.replace('_', ' ').capitalize()} ({self.unit})"


class WrapAngle(Frozen):
    """Where a contact's wrap angle comes from: a curve through the angle table, each row, or a constant."""

    curve: str | None = None
    column: str | None = None
    published_range: tuple[Finite, Finite] | None = None
    nominal: QuantityValue | None = None
    value: NonNegative | None = None
    unit: str | None = None
    sd: Positive | None = None

    @model_validator(mode="after")
    def _one_source(self) -> "WrapAngle":
        if (self.value is None) == (self.column is None):
            raise ValueError(
                'write either { value = 45, unit = "deg" } or { column = "..." }, with curve where it has one'
            )
        if self.value is not None and (self.unit is None or self.curve is not None):
            raise ValueError('a constant wrap angle needs a unit and no curve, such as { value = 45, unit = "deg" }')
        if self.column is not None and (self.unit is not None or self.sd is not None):
            raise ValueError("unit and sd belong to a constant angle; a column carries its unit in its heading")
        if self.published_range is not None and self.curve is None:
            raise ValueError("published_range belongs to a curve")
        if self.nominal is not None and self.curve is not None:
            raise ValueError("nominal belongs to an angle measured in each row, without a curve")
        return self

    @property
    def constant(self) -> QuantityValue | None:
        """The constant angle, if it is one."""
        if self.value is None or self.unit is None:
            return None
        return QuantityValue(value=self.value, unit=self.unit, sd=self.sd)


class Contact(Frozen):
    """One place where rope rubs."""

    name: str
    friction: str
    law: str = "capstan"
    wrap_angle: WrapAngle

    @property
    def special_law(self) -> str:
        """Its law where that is not the usual one; empty otherwise."""
        return "" if self.law == type(self).model_fields["law"].default else self.law


class TableSettings(Frozen):
    """What all that stands under [tables] has in common."""

    @property
    def fits_offsets(self) -> bool:
        """Whether it asks for the load cells' offsets to be parameters."""
        return False

    @property
    def tells_preload(self) -> bool:
        """Whether its readings tell how preload depends on the wrap angle."""
        return False


class Table(TableSettings):
    """One table: its file or files, and columns that do not carry the usual names."""

    file: str | None = None
    files: str | tuple[str, ...] | None = None
    columns: dict[str, ColumnSource] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one_source(self) -> "Table":
        if (self.file is None) == (self.files is None):
            raise ValueError('write either file = "name.csv" or files = "folder/*.csv"')
        return self


class Tables(Frozen):
    """The tables of a data set by their kinds, which `bowdenfit.kinds.settings` adds as fields."""

    @model_validator(mode="after")
    def _some(self) -> "Tables":
        if not self.model_fields_set:
            raise ValueError('name at least one table, such as efficiencies = { file = "efficiencies.csv" }')
        return self

    @property
    def stated(self) -> dict[str, Any]:
        """What is said of each table that there is, by the name of its kind."""
        return {name: said for name in type(self).model_fields if (said := getattr(self, name)) is not None}


class Sensors(Frozen):
    """What the data sheets of the load cells say."""

    force_noise: QuantityValue | None = None
    gain_error_sd: Positive | None = None
    offset_sd: QuantityValue | None = None


class SamplerSettings(Frozen):
    """How long and how carefully the posterior is sampled, by emcee's ensembles of walkers, by NUTS, or by both.

    `max_steps` is that of each walker or chain, and does not count the warm-up of NUTS.
    """

    method: Sampler = "emcee"
    n_ensembles: Annotated[int, Field(ge=2)] = 4
    n_walkers: Annotated[int, Field(ge=16, multiple_of=2)] = 256
    n_chains: Annotated[int, Field(ge=4)] = 16
    target_acceptance: Annotated[float, Field(ge=0.6, lt=1)] = 0.98
    max_steps: Annotated[int, Field(ge=200)] = 12000
    target_r_hat: Annotated[float, Field(gt=1)] = 1.01
    target_ess: Annotated[int, Field(ge=100)] = 1000


class PriorDefaults(Frozen):
    """The weak priors of everything the user says nothing of; angles in degrees, forces in N."""

    friction: LogNormalPrior = LogNormalPrior(median=0.12, log_sd=0.7)
    curve_level_sd: Positive = 1.5
    curve_level_degrees_without_data: Positive = 30.0
    curve_slope_sd: Positive = 3.0
    curve_curvature_sd: Positive = 0.5
    curve_steepness_sd: Positive = 5.0
    curve_end_over_median: Positive = 3.0
    angle_noise_degrees: Positive = 5.0
    run_scatter: Positive = 0.02
    force_noise_newtons: Positive = 2.0
    block_noise_newtons: Positive = 0.5
    offset_newtons: Positive = 1.0
    drag_newtons: Positive = 5.0
    wobble_degrees: Positive = 30.0
    stribeck: Positive = 0.3
    viscous_at_highest_speed: Positive = 0.5
    stribeck_speed_log_sd: Positive = 1.0
    stiffness: LogNormalPrior = LogNormalPrior(median=50.0, log_sd=1.5)
    bedding_stretch_mm: Positive = 2.0
    bedding_load: LogNormalPrior = LogNormalPrior(median=20.0, log_sd=1.0)
    lengthening_mm_per_radian: Positive = 1.0
    stretch_zero_mm: Positive = 5.0
    preload: LogNormalPrior = LogNormalPrior(median=20.0, log_sd=1.0)
    stretch_noise_mm: Positive = 0.1
    preload_noise_newtons: Positive = 2.0


class Description(Frozen):
    """Everything said about a cable and its measurements, defaults filled in."""

    schema_: Annotated[int, Field(alias="schema", ge=1, le=SCHEMA)] = SCHEMA
    name: str
    source: str = ""
    license: str = ""
    geometry: Geometry = "continuous"
    friction_model: str = "capstan"
    noise: Noise = "normal"
    student_degrees_of_freedom: Annotated[int, Field(ge=2, le=100, multiple_of=2)] = 4
    reference_force: QuantityValue | None = None
    reference_velocity: QuantityValue | None = None
    cable: CableSettings = CableSettings()
    route: Route | None = None
    contact: Annotated[tuple[Contact, ...], Field(min_length=1)]
    friction: dict[str, FrictionSetting] = Field(default_factory=dict)
    prior: dict[str, ParameterSetting] = Field(default_factory=dict)
    stretch: StretchSettings = StretchSettings()
    preload: PreloadSettings = PreloadSettings()
    tables: Tables
    recording: tuple[RecordingFile, ...] = ()
    sensors: Sensors = Sensors()
    sampler: SamplerSettings = SamplerSettings()

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    @field_validator("contact")
    @classmethod
    def _distinct(cls, contacts: tuple[Contact, ...]) -> tuple[Contact, ...]:
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
        used = [c.friction for c in self.contact]
        for name in self.friction:
            if name not in used:
                raise ValueError(f"[friction.{name}] belongs to no contact{nearest(name, used)}")
        curved = [c for c in self.contact if c.wrap_angle.curve]
        if curved and self.route is None:
            raise ValueError(
                f"the contact {curved[0].name!r} has a curve, so a [route] is needed: variable, unit, range"
            )
        if self.geometry == "published" and not curved:
            raise ValueError('geometry = "published" needs contacts with a curve')
        if self.stretch.friction is not None and self.stretch.friction not in used:
            hint = nearest(self.stretch.friction, used)
            raise ValueError(f"stretch.friction {self.stretch.friction!r} belongs to no contact{hint}")
        laws = [c.special_law for c in self.contact if c.friction == self.stretch.friction]
        if len(laws) > 1 and any(laws):
            raise ValueError(
                f"stretch.friction {self.stretch.friction!r} acts in {len(laws)} contacts, and by the "
                f"{next(filter(None, laws))} law their wrap angles together do not tell the friction of the rope; leave "
                "stretch.friction out, for a coefficient of its own"
            )
        freedom = type(self).model_fields["student_degrees_of_freedom"].default
        if self.noise != "student" and self.student_degrees_of_freedom != freedom:
            raise ValueError(
                'student_degrees_of_freedom belongs to noise = "student"; write that beside it, or leave it out'
            )
        if self.cable.kind == "loop" and self.friction_model != "capstan":
            raise ValueError(
                'the equations of a loop hold for friction_model = "capstan" only; leave it out, or fit one rope alone'
            )
        return self

    @property
    def fits_offsets(self) -> bool:
        """Whether the load cells' offsets are parameters."""
        return self.sensors.offset_sd is not None or any(said.fits_offsets for said in self.tables.stated.values())

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
        told = any(said.tells_preload for said in self.tables.stated.values())
        return (self.preload.model or ("stretch" if told else "constant")) == "stretch"

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the friction coefficients, each once, in order of the contacts."""
        return tuple(dict.fromkeys(c.friction for c in self.contact))

    @property
    def curved(self) -> tuple[Contact, ...]:
        """Contacts whose wrap angle is a curve."""
        return tuple(c for c in self.contact if c.wrap_angle.curve)

    @property
    def angle_columns(self) -> tuple[str, ...]:
        """Columns in which rows may carry their own wrap angle."""
        return tuple(dict.fromkeys(c.wrap_angle.column for c in self.contact if c.wrap_angle.column))

    def table(self, of: type[AnySettings]) -> AnySettings | None:
        """What is said of the table whose kind has settings of a class; None if there is no such table."""
        return next((said for said in self.tables.stated.values() if type(said) is of), None)

    def to_json(self) -> dict[str, Any]:
        """The resolved description as plain data."""
        return self.model_dump(mode="json", by_alias=True)
