"""The cable itself: its contacts in series, their wrap angles, and the friction exponent at any length."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TypeVar, runtime_checkable

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.curves import CURVES, Curve
from bowdenfit.cable.elasticity import Elasticity
from bowdenfit.cable.friction import FrictionModel, make_friction_model
from bowdenfit.cable.laws import CONTACT_LAWS, ContactLaw
from bowdenfit.description import Contact, Description
from bowdenfit.errors import DescriptionError, nearest
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.tables import AngleTable, OwnAngles
from bowdenfit.physics.loop import loop_output_force

ANGLE_NOISE = "sigma_theta"
Entry = TypeVar("Entry")


@dataclass(frozen=True)
class Cable:
    """Contacts in series along one route.

    Args:
        description: What was said about the cable.
        nominal: Wrap angle used in predictions for contacts measured row by row [rad], by contact name.
        friction: How friction depends on load and speed.
    """

    description: Description
    nominal: Mapping[str, float]
    friction: FrictionModel

    @cached_property
    def curves(self) -> dict[str, Curve]:
        """The curve of each curved contact, by its column."""
        route = self.description.route
        return {
            c.wrap_angle.column: _lookup(CURVES, c.wrap_angle.curve, "curve", c)(c.wrap_angle.column, route)
            for c in self.description.curved
            if route is not None and c.wrap_angle.column is not None
        }

    @cached_property
    def elasticity(self) -> Elasticity:
        """How its rope stretches, and its preload."""
        return Elasticity(self.description)

    @cached_property
    def laws(self) -> tuple[ContactLaw, ...]:
        """The law of each contact."""
        return tuple(_lookup(CONTACT_LAWS, c.law, "law", c) for c in self.description.contact)

    def wrap_angles(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, "rows contacts"]:
        """Wrap angle of each contact [rad] at values of the route variable."""
        columns = [self._wrap_angle(c, values, route) for c in self.description.contact]
        return jnp.stack(columns, axis=-1)

    def _wrap_angle(
        self, contact: Contact, values: Mapping[str, Array], route: Float[Array, " rows"]
    ) -> Float[Array, " rows"]:
        source = contact.wrap_angle
        if source.curve and source.column:
            angle = self.curves[source.column].wrap_angle(values, route)
            if self.description.geometry == "published" and source.published_range:
                low, high = source.published_range
                angle = jnp.where((route >= low) & (route <= high), angle, 0.0)
            return angle
        if source.constant is None:
            return jnp.full(route.shape, self.nominal[contact.name])
        name = constant_angle_name(contact)
        return jnp.broadcast_to(values[name] if name in values else source.constant.to("angle"), route.shape)

    def friction_exponent(
        self, values: Mapping[str, Array], wrap_angles: Float[Array, "rows contacts"]
    ) -> Float[Array, " rows"]:
        """Friction exponent [1] at given wrap angles [rad]."""
        contacts = zip(self.description.contact, self.laws, strict=True)
        terms = [law.exponent(values[c.friction], wrap_angles[..., k]) for k, (c, law) in enumerate(contacts)]
        return jnp.sum(jnp.stack(terms), axis=0)

    def exponent_variance(
        self,
        values: Mapping[str, Array],
        wrap_angles: Float[Array, "rows contacts"],
        angle_variance: Float[Array, "rows contacts"],
    ) -> Float[Array, " rows"]:
        """Variance of the friction exponent from independent errors of the wrap angles [rad^2]."""
        contacts = zip(self.description.contact, self.laws, strict=True)
        terms = [
            law.sensitivity(values[c.friction], wrap_angles[..., k]) ** 2 * angle_variance[..., k]
            for k, (c, law) in enumerate(contacts)
        ]
        return jnp.sum(jnp.stack(terms), axis=0)

    def efficiency_at(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """Efficiency while pulling with the reference force at the reference speed [1] at values of the route variable."""
        if self.is_loop:
            force = self.friction.conditions.reference_force
            return self.output_force_at(values, route, jnp.asarray(force), jnp.ones(())) / force
        return self.friction.efficiency(values, self.exponent_at(values, route))

    @property
    def is_loop(self) -> bool:
        """Whether it is a pull-pull loop."""
        return self.description.cable.kind == "loop"

    def output_force_at(
        self,
        values: Mapping[str, Array],
        route: Float[Array, " rows"],
        input_force: Float[Array, ""],
        stroke: Float[Array, ""],
        mounting: Float[Array, ""] | float = 0.0,
    ) -> Float[Array, " rows"]:
        """Output force [N] at values of the route variable, at the reference speed.

        Args:
            values: Values of the parameters.
            route: Route variable.
            input_force: Force at the motor side [N].
            stroke: +1 pulling, -1 return.
            mounting: Effect of the mounting on the friction exponent [1].
        """
        angles = self.wrap_angles(values, route)
        exponent = self.friction_exponent(values, angles) + mounting
        if self.is_loop:
            preload = self.elasticity.preload_or_none(values, jnp.sum(angles, axis=-1))
            return loop_output_force(input_force, preload, exponent, stroke)
        return self.friction.output_force(values, input_force, exponent, stroke)

    def loss_at(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """What is least where efficiency is highest: the friction exponent, or of a loop the efficiency with a minus."""
        return -self.efficiency_at(values, route) if self.is_loop else self.exponent_at(values, route)

    def exponent_at(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """Friction exponent [1] at values of the route variable."""
        return self.friction_exponent(values, self.wrap_angles(values, route))


@dataclass(frozen=True)
class RowAngles:
    """Which wrap angle each row of a table has: the curve's, or its own measured one with its error.

    All are arrays over rows and contacts; `data` hands them to jitted functions.
    """

    route: np.ndarray
    own: np.ndarray
    is_own: np.ndarray
    known_sd: np.ndarray
    has_angle_noise: np.ndarray

    @property
    def data(self) -> dict[str, np.ndarray]:
        """As plain data."""
        return {
            "route": self.route,
            "own": self.own,
            "is_own": self.is_own,
            "known_variance": self.known_sd**2,
            "noisy": self.has_angle_noise,
        }


@runtime_checkable
class Measured(Protocol):
    """Anything measured at values of the route variable, some with wrap angles of their own."""

    @property
    def route(self) -> np.ndarray:
        """Route variable; NaN where the cable has no route."""
        ...

    @property
    def own(self) -> OwnAngles:
        """Wrap angles measured with the row."""
        ...


def row_angles(cable: Cable, table: Measured, angles: AngleTable | None) -> RowAngles:
    """The wrap angles of a table's rows, before any parameter is known.

    A row's own angle comes first; then, outside the range of the curves, the angle table's row at the same length;
    else the curve. An own angle without a stated sd has the angle table's noise where its contact has a curve, and is
    exact otherwise. An angle too small to detect outside the range counts as half the limit, sd limit/sqrt(12).
    """
    contacts, n = cable.description.contact, len(table.route)
    own, sd, noisy = (
        np.zeros((n, len(contacts))),
        np.zeros((n, len(contacts))),
        np.zeros((n, len(contacts)), dtype=bool),
    )
    is_own = np.zeros((n, len(contacts)), dtype=bool)
    for k, contact in enumerate(contacts):
        if contact.wrap_angle.column is None:
            continue
        angle, angle_sd = table.own.column(contact.wrap_angle.column)
        if contact.wrap_angle.curve and angles is not None:
            angle, angle_sd = _outside_curves(cable, contact.wrap_angle.column, table.route, angle, angle_sd, angles)
        has = ~np.isnan(angle)
        own[has, k], is_own[has, k] = angle[has], True
        sd[has, k] = np.nan_to_num(angle_sd[has])
        noisy[has, k] = np.isnan(angle_sd[has]) & bool(contact.wrap_angle.curve)
    return RowAngles(np.nan_to_num(table.route), own, is_own, sd, noisy)


def _outside_curves(
    cable: Cable, column: str, route: np.ndarray, angle: np.ndarray, sd: np.ndarray, angles: AngleTable
) -> tuple[np.ndarray, np.ndarray]:
    """Own angles completed from the angle table for rows outside the range of the curves."""
    limits = cable.description.route
    angle, sd = angle.copy(), sd.copy()
    measured, detection_limit = angles.column(column)
    for i in np.flatnonzero(np.isnan(angle)):
        if limits is None or limits.range[0] <= route[i] <= limits.range[1]:
            continue
        at = np.flatnonzero(angles.route == route[i])
        readings = np.where(np.isnan(measured[at]), detection_limit[at] / 2, measured[at])
        angle[i] = readings.mean()
        if np.isnan(measured[at]).any():
            sd[i] = np.nanmax(detection_limit[at]) / np.sqrt(12)
    return angle, sd


def resolve_angles(
    cable: Cable, values: Mapping[str, Array], rows: Mapping[str, Array]
) -> tuple[Float[Array, "rows contacts"], Float[Array, "rows contacts"]]:
    """Wrap angle [rad] and its variance [rad^2] for each row and contact, at given parameters."""
    angles = jnp.where(rows["is_own"], rows["own"], cable.wrap_angles(values, rows["route"]))
    variance = rows["known_variance"]
    if ANGLE_NOISE in values:
        variance = variance + jnp.where(rows["noisy"], values[ANGLE_NOISE] ** 2, 0.0)
    return angles, variance


def constant_angle_name(contact: Contact) -> str:
    """Name of the parameter for a constant wrap angle that is itself uncertain."""
    return "wrap_angle_" + "_".join(contact.name.lower().split())


def make_cable(description: Description, measurements: Measurements) -> Cable:
    """The cable of a description, with nominal angles for predictions from the description or the rows' mean.

    Raises:
        DescriptionError: A curve family or contact law is unknown.
    """
    nominal: dict[str, float] = {}
    for contact in description.contact:
        source = contact.wrap_angle
        if source.column is None or source.curve:
            continue
        if source.nominal is not None:
            nominal[contact.name] = source.nominal.to("angle")
        else:
            nominal[contact.name] = _mean_angle(measurements, source.column)
    cable = Cable(description, nominal, make_friction_model(description, measurements))
    _ = cable.curves, cable.laws
    return cable


def _mean_angle(measurements: Measurements, column: str) -> float:
    """Mean of the angles that rows and recordings carry in a column [rad]."""
    tables = [t for t in (measurements.efficiencies, measurements.forces, measurements.loop) if t is not None]
    angles = [t.own.column(column)[0] for t in tables]
    if measurements.recordings is not None:
        k = measurements.recordings.columns.index(column)
        angles.append(np.array([r.own_angle[k] for r in measurements.recordings.each]))
    if not angles:
        raise DescriptionError(
            f"cable.toml: no table has the column {column!r}, from which predictions would take their wrap angle; state it as "
            'nominal = { value = 90, unit = "deg" } of the contact.'
        )
    return float(np.mean(np.concatenate(angles)))


def _lookup(registry: Mapping[str, Entry], name: str | None, what: str, contact: Contact) -> Entry:
    if name is None or name not in registry:
        raise DescriptionError(
            f"cable.toml, contact {contact.name!r}: the {what} {name!r} is unknown{nearest(str(name), list(registry))}"
        )
    return registry[name]
