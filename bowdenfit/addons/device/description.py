"""The description of a device, `device.toml`: what a plant and its controller need beside the cable, with units and sds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Annotated

from pydantic import ConfigDict, Field, PrivateAttr, ValidationError

from bowdenfit.addons.device.description_keys import KEYS, Key
from bowdenfit.description import SCHEMA
from bowdenfit.description.values import Frozen, Name, QuantityValue
from bowdenfit.description.wrong_keys import explain_validation_error
from bowdenfit.errors import BowdenfitError, DatasetError, DescriptionError, Faults, combine_errors
from bowdenfit.inputs import read_toml_file

ENCODER = "controller.encoder_counts"
_SI = {"torque": 1e-3, "length": 1e-3, "stiffness": 1e3}  # of the internal units that are not SI
Quantity = QuantityValue | None


class Motor(Frozen):
    """The motor behind its reducer."""

    inertia: Quantity = None
    damping: Quantity = None
    friction: Quantity = None
    largest_torque: Quantity = None


class Joint(Frozen):
    """The joint, and what is fixed to it."""

    inertia: Quantity = None
    damping: Quantity = None
    pulley_radius: Quantity = None


class RopeSettings(Frozen):
    """What the fit of the cable does not tell of it; `ringdown` is the results folder of a fit that tells its damping."""

    damping: Quantity = None
    ringdown: Annotated[str, Field(min_length=1, max_length=4096)] | None = None
    stiffness: Quantity = None
    mounting_scatter: Quantity = None
    spring: Quantity = None


class ControllerSettings(Frozen):
    """The controller of the motor; its encoder by counts a turn."""

    sample_time: Quantity = None
    filter_time: Quantity = None
    dead_zone: Quantity = None
    torque_noise: Quantity = None
    encoder_counts: Annotated[int, Field(ge=4, le=10**9)] | None = None
    integral_gain: Quantity = None
    active_zone: Quantity = None
    linear_dead_zone: bool = False


class HandSettings(Frozen):
    """The hand at the joint."""

    inertia: Quantity = None
    damping: Quantity = None
    stiffness: Quantity = None


class SlaveSettings(Frozen):
    """The slave that the device commands."""

    inertia: Quantity = None
    damping: Quantity = None
    friction: Quantity = None
    largest_torque: Quantity = None


class Wall(Frozen):
    """What the slave touches."""

    stiffness: Quantity = None
    damping: Quantity = None


class Coupling(Frozen):
    """What is sent between master and slave, haptic paper, figure 8."""

    master_stiffness: Quantity = None
    master_damping: Quantity = None
    slave_stiffness: Quantity = None
    slave_damping: Quantity = None
    torque_to_master: Quantity = None
    torque_to_slave: Quantity = None
    local_gain: Quantity = None
    delay: Quantity = None
    position_to_slave: Quantity = None
    position_to_master: Quantity = None


@dataclass(frozen=True)
class Known:
    """A quantity in SI units, with its standard deviation; 0 of what is set.

    Args:
        value: The value.
        sd: Its standard deviation.
        draws: Draws of the fit that determines it, in place of a Normal distribution.
        beside: Key of what those draws hold too, which is then to be taken from them.
    """

    value: float
    sd: float = 0.0
    draws: tuple[float, ...] = ()
    beside: str = ""


class Device(Frozen):
    """Everything said about a device. What an answer needs and is not said is asked by name; nothing has a default."""

    schema_: Annotated[int, Field(alias="schema", ge=1, le=SCHEMA)] = SCHEMA
    name: Name
    source: str = ""
    motor: Motor = Motor()
    joint: Joint = Joint()
    rope: RopeSettings = RopeSettings()
    controller: ControllerSettings = ControllerSettings()
    hand: HandSettings = HandSettings()
    slave: SlaveSettings = SlaveSettings()
    wall: Wall = Wall()
    coupling: Coupling = Coupling()

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)
    _fitted: dict[str, Known] = PrivateAttr(default_factory=dict)

    def with_fitted(self, more: Mapping[str, Known]) -> "Device":
        """Return the same with quantities that a fit tells [SI]."""
        device = self.model_copy()
        device._fitted = {**self._fitted, **more}
        return device

    def states(self, *keys: str) -> bool:
        """Return whether it says all of these."""
        return not self.lacking(*keys)

    def lacking(self, *keys: str) -> list[str]:
        """Those that it does not say."""
        return [key for key in keys if key not in self._fitted and self._stated(key) is None]

    def known(self, *keys: str) -> dict[str, Known]:
        """Quantities by key, of those that are stated [SI].

        Raises:
            DescriptionError: One that is measured has no sd.
        """
        faults, known = Faults(), {}
        for key in keys:
            with faults.collect():
                if key in self._fitted:
                    known[key] = self._fitted[key]
                elif (stated := self._stated(key)) is not None:
                    known[key] = _known(key, stated)
        faults.refuse()
        return known

    def needed(self, what: str, *keys: str) -> dict[str, Known]:
        """Quantities by key, of which none may be missing [SI].

        Args:
            what: That needs them, in words.
            keys: Which.

        Raises:
            DescriptionError: Some are not stated, or have no sd; says all of them.
        """
        if missing := self.lacking(*keys):
            raise missing_settings(what, missing)
        return self.known(*keys)

    def _stated(self, key: str) -> QuantityValue | None:
        part, name = key.split(".")
        stated: QuantityValue | None = getattr(getattr(self, part), name)
        return stated

    @property
    def count(self) -> float:
        """Angle of one count of the encoder [rad].

        Raises:
            DescriptionError: It is not stated.
        """
        if self.controller.encoder_counts is None:
            raise missing_settings("a simulation", [ENCODER])
        return 2 * pi / self.controller.encoder_counts


def missing_settings(what: str, missing: Sequence[str]) -> BowdenfitError:
    """Return what to write into `device.toml`, by name, for an answer that needs it.

    Args:
        what: That needs it, in words.
        missing: Keys.
    """
    return combine_errors([DescriptionError(_missing_setting(what, key)) for key in missing])


def _missing_setting(what: str, key: str) -> str:
    part, name = key.split(".")
    if key not in KEYS:
        return f"{what} needs the counts of the encoder in a turn; write encoder_counts = 2000 under [{part}] of device.toml."
    known = KEYS[key]
    return f"{what} needs the {known.meaning}; write {name} = {known.example} under [{part}] of device.toml{known.remedy}."


def _known(key: str, stated: QuantityValue) -> Known:
    of = KEYS[key]
    factor = _SI.get(of.dimension, 1.0)
    sd = stated.sd_to(of.dimension)
    if sd is None and of.is_measured:
        raise DescriptionError(
            f"device.toml, {key}: {stated.value:g} {stated.unit} has no sd, and the answer is a probability over what is known "
            f"about it; write sd = ... next to it, as in {of.example}."
        )
    return Known(stated.to(of.dimension) * factor, 0.0 if sd is None else sd * factor)


def read_device(path: Path) -> Device:
    """Read `device.toml`.

    Args:
        path: The file.

    Raises:
        DescriptionError: It is missing or no TOML, keys are unknown, or quantities are impossible; says all of them.
    """
    remedy = "name a device.toml that says what moves; docs/device.md shows one"
    _, raw = read_toml_file(path, remedy)
    try:
        device = Device.model_validate(raw)
    except ValidationError as error:
        units = {key: entry.example.split('"')[1] for key, entry in KEYS.items()}
        raise explain_validation_error(error, raw, Device, path.name, 'write it, such as name = "knee"', units) from None
    faults = Faults()
    for key, stated in _quantities(device):
        with faults.collect():
            _check(f"{path.name}, {key}", KEYS[key], stated)
    faults.refuse()
    return device


def _quantities(device: Device) -> Iterator[tuple[str, QuantityValue]]:
    for key in KEYS:
        if (stated := device._stated(key)) is not None:
            yield key, stated


def _check(place: str, key: Key, stated: QuantityValue) -> None:
    written = f"{stated.value:g} {stated.unit}"
    try:
        stated.to(key.dimension)
    except DatasetError as error:
        raise DescriptionError(f"{place}: {error}.") from None
    if stated.value < 0 or (stated.value == 0 and not key.may_be_zero):
        raise DescriptionError(
            f"{place}: {written} is not possible for the {key.meaning}; write one such as {key.example}."
        )
    if stated.sd is not None and not key.is_measured:
        raise DescriptionError(f"{place}: the {key.meaning} is set, not measured; leave its sd out.")
    if stated.sd is not None and stated.sd > stated.value > 0:
        raise DescriptionError(
            f"{place}: an sd of {stated.sd:g} is more than the {written} themselves, so that nothing is known about it; "
            "measure it, or write an sd of less."
        )
