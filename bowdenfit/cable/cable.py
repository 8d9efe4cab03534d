"""The cable itself: its contacts in series, their wrap angles, and the friction exponent at any length."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float, Int

from bowdenfit.cable.conditions import Conditions
from bowdenfit.cable.curves import Curve
from bowdenfit.cable.elasticity import STRETCH_FRICTION, Elasticity
from bowdenfit.cable.friction import FrictionModel
from bowdenfit.cable.friction_options import friction_options
from bowdenfit.cable.laws import Capstan, ContactLaw, parameter_of
from bowdenfit.cable.registry import CONTACT_LAWS, CURVES, check_names, coefficient_of, load_class, sheath_length
from bowdenfit.description import ContactSettings, Description, PriorDefaults
from bowdenfit.errors import DescriptionError
from bowdenfit.parameters.space import Parameter
from bowdenfit.physics.loop import loop_input_force, loop_output_force

ANGLE_NOISE = "sigma_theta"


@dataclass(frozen=True)
class CableContacts:
    """Contacts in series along one route.

    Args:
        description: Parsed cable.toml.
        nominal: Wrap angle used in predictions for contacts measured row by row [rad], by contact name.
        friction: How friction depends on load and speed.
    """

    description: Description = field(repr=False)
    nominal: Mapping[str, float]
    friction: FrictionModel

    @cached_property
    def curves(self) -> dict[str, Curve]:
        """The curve of each curved contact, by its column."""
        route = self.description.route
        return {
            source.column: load_class(CURVES[source.curve].place)(source.column, route, self.description.departs(source))
            for source in (c.wrap_angle for c in self.description.contact)
            if route is not None and source.column is not None and source.curve is not None
        }

    def departing(self, columns: Collection[str]) -> "CableContacts":
        """Return the cable with smooth departures of the angles in columns from their curves."""
        contacts = []
        for contact in self.description.contact:
            if contact.wrap_angle.column in columns:
                angle = contact.wrap_angle.model_copy(update={"departure": "smooth"})
                contact = contact.model_copy(update={"wrap_angle": angle})
            contacts.append(contact)
        return replace(self, description=self.description.model_copy(update={"contact": tuple(contacts)}))

    @cached_property
    def elasticity(self) -> Elasticity:
        """How its rope stretches, under the law of the contact whose friction acts, and its preload."""
        acting = self.description.stretch.friction
        laws = [law for law in self.laws if law.friction == acting]
        return Elasticity(self.description, laws[0] if laws else Capstan("", STRETCH_FRICTION))

    @cached_property
    def laws_by_group(self) -> tuple[tuple[ContactLaw, ...], ...]:
        """The law of each contact in each group of readings; where all groups share their coefficients, one for all."""
        return tuple(
            tuple(
                load_class(CONTACT_LAWS[c.law])(
                    c.name,
                    coefficient_of(c.friction, group) if group and c.by_group else c.friction,
                    sheath_length(self.description, c),
                )
                for c in self.description.contact
            )
            for group in self.friction.groups or ("",)
        )

    @property
    def laws(self) -> tuple[ContactLaw, ...]:
        """The law of each contact, in the group that predictions are for, the first."""
        return self.laws_by_group[0]

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of all friction coefficients, each once, in order of the contacts."""
        by_contact = zip(*self.laws_by_group, strict=True)
        return tuple(dict.fromkeys(law.friction for laws in by_contact for law in laws))

    def law_parameters(self, defaults: PriorDefaults) -> list[Parameter]:
        """Return parameters that contact laws have of their own."""
        return [parameter for law in self.laws for parameter in law.parameters(defaults)]

    def wrap_angles(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, "rows contacts"]:
        """Return the wrap angle of each contact [rad] at values of the route variable."""
        columns = [self._wrap_angle(c, values, route) for c in self.description.contact]
        return jnp.stack(columns, axis=-1)

    def _wrap_angle(
        self, contact: ContactSettings, values: Mapping[str, Array], route: Float[Array, " rows"]
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
        self,
        values: Mapping[str, Array],
        wrap_angles: Float[Array, "rows contacts"],
        group: Int[Array, " rows"] | None = None,
        route: Float[Array, " rows"] | float | None = None,
    ) -> Float[Array, " rows"]:
        """Return the friction exponent [1].

        Args:
            values: Values of the parameters.
            wrap_angles: Wrap angle of each contact [rad].
            group: Number of each row's group; that of predictions if omitted.
            route: Route variable, where the length of a sheath follows it.

        Raises:
            DescriptionError: It does, and the route variable is not given.
        """

        def total(laws: tuple[ContactLaw, ...]) -> Array:
            return jnp.sum(jnp.stack([law.exponent(values, wrap_angles[..., k]) for k, law in enumerate(laws)]), axis=0)

        of_lengths = [law.exponent_along(values, route) for law in self.laws]  # whose coefficients are those of all groups
        return self._in_own_group(total, group) + sum(of_lengths)

    def _in_own_group(self, total: Callable[[tuple[ContactLaw, ...]], Array], group: Int[Array, " rows"] | None) -> Array:
        """Return what the laws of each row's group give."""
        if group is None or not self.friction.groups:
            return total(self.laws)
        by_group = jnp.stack([total(laws) for laws in self.laws_by_group], axis=-1)
        return jnp.take_along_axis(by_group, group[..., None], axis=-1)[..., 0]

    def exponent_variance(
        self,
        values: Mapping[str, Array],
        wrap_angles: Float[Array, "rows contacts"],
        angle_variance: Float[Array, "rows contacts"],
        group: Int[Array, " rows"] | None = None,
    ) -> Float[Array, " rows"]:
        """Return the variance of the friction exponent from independent errors of wrap angles [rad^2], by groups alike."""

        def total(laws: tuple[ContactLaw, ...]) -> Array:
            slopes = [law.slope(values, wrap_angles[..., k]) for k, law in enumerate(laws)]
            return jnp.sum(jnp.stack([slope**2 * angle_variance[..., k] for k, slope in enumerate(slopes)]), axis=0)

        return self._in_own_group(total, group)

    def efficiency_at(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """Return the efficiency while pulling with the reference force at the reference speed [1] at route values."""
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
        """Return the output force [N] at values of the route variable, at the reference speed.

        Args:
            values: Values of the parameters.
            route: Route variable.
            input_force: Force at the motor side [N].
            stroke: +1 pulling, -1 return.
            mounting: Effect of the mounting on the friction exponent [1].
        """
        return self.output_force_at_angles(values, self.wrap_angles(values, route), input_force, stroke, mounting, route)

    def output_force_at_angles(
        self, values: Mapping[str, Array], angles: Array, input_force: Array, stroke: Array, mounting: Array | float = 0.0,
        route: Array | None = None,
    ) -> Float[Array, "..."]:
        """Return the output force [N] at wrap angles [rad], contacts last; arguments as of `output_force_at`."""
        exponent, preload = self._friction_at_angles(values, angles, mounting, route)
        if preload is not None:
            return loop_output_force(input_force, preload, exponent, stroke, self.elasticity.loop_rope(values))
        return self.friction.output_force(values, input_force, exponent, stroke)

    def input_force_at(
        self,
        values: Mapping[str, Array],
        route: Float[Array, " rows"],
        output_force: Float[Array, ""],
        stroke: Float[Array, ""],
        mounting: Float[Array, ""] | float = 0.0,
    ) -> Float[Array, " rows"]:
        """Return the input force [N] that gives an output force [N], by the same arguments as `output_force_at`."""
        return self.input_force_at_angles(values, self.wrap_angles(values, route), output_force, stroke, mounting, route)

    def input_force_at_angles(
        self, values: Mapping[str, Array], angles: Array, output_force: Array, stroke: Array, mounting: Array | float = 0.0,
        route: Array | None = None,
    ) -> Float[Array, "..."]:
        """Return the input force [N] at wrap angles [rad], contacts last; arguments as of `input_force_at`."""
        exponent, preload = self._friction_at_angles(values, angles, mounting, route)
        if preload is not None:
            return loop_input_force(output_force, preload, exponent, stroke, self.elasticity.loop_rope(values))
        return self.friction.input_force(values, output_force, exponent, stroke)

    def _friction_at_angles(
        self, values: Mapping[str, Array], angles: Array, mounting: Array | float, route: Array | None
    ) -> tuple[Array, Array | None]:
        """Return the friction exponent [1] in a mounting, and the preload of a loop [N]; None for a single rope."""
        exponent = self.friction_exponent(values, angles, route=route) + mounting
        return exponent, self.elasticity.preload_or_none(values, jnp.sum(angles, axis=-1)) if self.is_loop else None

    def loss_at(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """Return what is least where efficiency is highest: the friction exponent, or of a loop the efficiency with a minus."""
        return -self.efficiency_at(values, route) if self.is_loop else self.exponent_at(values, route)

    def exponent_at(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """Return the friction exponent [1] at values of the route variable."""
        return self.friction_exponent(values, self.wrap_angles(values, route), route=route)


def constant_angle_name(contact: ContactSettings) -> str:
    """Return the name of the parameter for a constant wrap angle that is itself uncertain."""
    return parameter_of("wrap_angle", contact.name)


def make_cable(description: Description, own_angles: Mapping[str, float], conditions: Conditions) -> CableContacts:
    """Return the cable of a description.

    Args:
        description: Parsed cable.toml.
        own_angles: Mean of the wrap angles that were measured with each reading [rad], by column.
        conditions: At what loads and speeds it was measured.

    Raises:
        DescriptionError: A curve family, contact law or friction model is unknown, or a nominal angle.
    """
    check_names(description)
    nominal: dict[str, float] = {}
    for contact in description.contact:
        source = contact.wrap_angle
        if source.column is None or source.curve:
            continue
        if source.nominal is None and source.column not in own_angles:
            raise DescriptionError(
                f"cable.toml: no table has the column {source.column!r}, from which predictions would take their wrap "
                'angle; state it as nominal = { value = 90, unit = "deg" } of the contact.'
            )
        nominal[contact.name] = source.nominal.to("angle") if source.nominal else own_angles[source.column]
    return CableContacts(description, nominal, FrictionModel(friction_options(description.friction_model), conditions))
