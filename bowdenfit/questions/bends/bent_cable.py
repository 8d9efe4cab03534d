"""Efficiency, friction, slack, position error and stiffness of a bent cable, for one draw of the parameters."""

from collections.abc import Mapping
from dataclasses import dataclass

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.elasticity import LENGTHENING, PRELOAD, STIFFNESS, STRETCH_FRICTION, Elasticity
from bowdenfit.errors import UsageError
from bowdenfit.models import Model
from bowdenfit.physics.loop import (
    Rope,
    free_motion_loss,
    loop_input_force,
    loop_output_force,
    side_tensions,
    slack_load,
)
from bowdenfit.physics.stretch import extension_along, mean_tension, tension_from_extension

Values = Mapping[str, Array]


@dataclass(frozen=True)
class BentCable:
    """A cable bent to wrap angles; every function takes the values of one draw [internal units].

    Args:
        model: The model.
        contact: Number of the contact whose wrap angle is given, while the others keep theirs; None where it is that of all
            contacts together, which is enough to know how the rope stretches.
        wrap_angle: Wrap angles [rad].
    """

    model: Model
    contact: int | None
    wrap_angle: Float[Array, " bends"]

    @property
    def elastic(self) -> Elasticity:
        """Stretch and preload of the cable."""
        return self.model.cable.elasticity

    @property
    def _route(self) -> Float[Array, " bends"]:
        """The middle of the route at every bend; 0 without a route."""
        route = self.model.description.route
        return jnp.full_like(self.wrap_angle, route.middle if route else 0.0)

    def _angles(self, values: Values) -> Float[Array, "bends contacts"]:
        """Wrap angles of all contacts at the bends [rad]."""
        return self.model.cable.wrap_angles(values, self._route).at[:, self.contact].set(self.wrap_angle)

    def exponent(self, values: Values) -> Float[Array, " bends"]:
        """Friction exponent of one rope [1]."""
        return self.model.cable.friction_exponent(values, self._angles(values), route=self._route)

    def total_angle(self, values: Values) -> Float[Array, " bends"]:
        """Total wrap angle of the cable [rad]."""
        if self.contact is None:
            return self.wrap_angle
        return jnp.sum(self._angles(values), axis=-1)

    def preloads(self, values: Values, references: Float[Array, " preloads"]) -> Float[Array, "preloads bends"]:
        """Preload [N] of the cable preloaded in several ways."""
        bend = jnp.broadcast_to(self.total_angle(values), (len(references), len(self.wrap_angle)))
        return self.elastic.preload_from(values, references[:, None], bend)[0]

    def preload(self, values: Values, preload: float | Array | None = None) -> tuple[Array, Array]:
        """Preload [N] and slack [mm], of the cable as it is or preloaded otherwise [N]."""
        if preload is None and PRELOAD not in values:
            return jnp.zeros_like(self.wrap_angle), jnp.zeros_like(self.wrap_angle)
        reference = values[PRELOAD] if preload is None else jnp.asarray(preload)
        return self.elastic.preload_from(values, reference, self.total_angle(values))

    def rope(self, values: Values) -> Rope:
        """How the rope of a loop stretches; None where it is taken for linear."""
        return self.elastic.loop_rope(values)

    def output_force(
        self, values: Values, input_force: Float[Array, "*forces"], stroke: float = 1.0, preload: float | None = None
    ) -> Array:
        """Output force [N]; of a single rope by its friction model."""
        force, exponent = jnp.broadcast_arrays(input_force, self.exponent(values))
        if self.model.cable.is_loop:
            return loop_output_force(force, self.preload(values, preload)[0], exponent, jnp.asarray(stroke), self.rope(values))
        return self.model.cable.friction.output_force(values, force, exponent, jnp.asarray(stroke))

    def input_force(self, values: Values, output_force: Array, stroke: float, preload: float | None) -> Array:
        """Input force [N] that gives an output force: the inverse of `output_force`."""
        force, exponent = jnp.broadcast_arrays(output_force, self.exponent(values))
        if self.model.cable.is_loop:
            return loop_input_force(force, self.preload(values, preload)[0], exponent, jnp.asarray(stroke), self.rope(values))
        return self.model.cable.friction.input_force(values, force, exponent, jnp.asarray(stroke))

    def friction(self, values: Values, preload: float | Array | None = None) -> Float[Array, " bends"]:
        """Force that moving the unloaded cable takes [N]; a single rope has one side to drag."""
        loss = free_motion_loss(self.preload(values, preload)[0], self.exponent(values))
        return loss if self.model.cable.is_loop else loss / 2

    def slack_load(self, values: Values, preload: float | None = None) -> Float[Array, " bends"]:
        """Input force at which the return side of a loop goes slack [N]."""
        return slack_load(self.preload(values, preload)[0], self.exponent(values), self.rope(values))

    def position(
        self, values: Values, input_force: float, preload: float | None = None
    ) -> tuple[Float[Array, " bends"], Float[Array, " bends"]]:
        """Position error at the load side, and motion lost when the motor turns round [mm], by stretch and slack.

        The error is how far the load side stays behind a motor that pulls with this force, against the cable at rest; the
        lost motion, how far the motor turns back at the same force until the rope slides back all along.
        """
        force = jnp.full_like(self.wrap_angle, input_force)
        at_rest, slack = self.preload(values, preload)
        exponent = self.exponent(values) if self.model.cable.is_loop else self._stretch_exponent(values)
        tensions = (self._pulling_tension(values, force, at_rest, stroke) for stroke in (1.0, -1.0))
        forward, back = (self.elastic.extension_along(values, tension, exponent) for tension in tensions)
        return forward - self.elastic.extension(values, at_rest) + slack, back - forward + slack

    def _pulling_tension(self, values: Values, force: Array, preload: Array, stroke: float) -> Array:
        """Mean tension of the side that pulls [N]."""
        if self.model.cable.is_loop:
            return side_tensions(force, preload, self.exponent(values), jnp.asarray(stroke), self.rope(values))[0]
        return mean_tension(jnp.maximum(force, preload), stroke * self._stretch_exponent(values))

    def _stretch_exponent(self, values: Values) -> Array:
        """Friction exponent of the stretched rope, or of the cable where the stretch has none of its own."""
        name = self.model.description.stretch.friction or STRETCH_FRICTION
        return (
            self.elastic.friction_exponent(values, self.total_angle(values))
            if name in values
            else self.exponent(values)
        )

    def stiffness(self, values: Values, load: float, preload: float | None = None) -> Float[Array, " bends"]:
        r"""Stiffness seen at the load side with the motor locked, while the load moves against friction [N/mm].

        A loop's two sides act together, :math:`1/(a e'(\bar T_1)) + 1/(b e'(\bar T_2))`, until the returning one is slack; e'
        is averaged along the rope, whose ends bed in unlike each other.
        """
        force = jnp.full_like(self.wrap_angle, load)
        if not self.model.cable.is_loop:
            exponent = self._stretch_exponent(values)
            share = mean_tension(jnp.ones_like(exponent), exponent)
            return 1 / (share * self.elastic.compliance_along(values, share * force, exponent))
        exponent, at_rest = self.exponent(values), self.preload(values, preload)[0]
        unit = jnp.ones_like(exponent)
        a, b = mean_tension(unit, exponent), mean_tension(unit, -exponent)
        pulling, returning = side_tensions(force, at_rest, exponent, unit, self.rope(values))
        second = jnp.where(returning > 0, 1 / (b * self.elastic.compliance_along(values, returning, exponent)), 0.0)
        return 1 / (a * self.elastic.compliance_along(values, pulling, exponent)) + second

    def lowest_preload(self, values: Values, input_force: float) -> Float[Array, ""]:
        """Lowest preload, at the reference angle, at which both sides stay taut at all these bends [N].

        Args:
            values: Values of the parameters.
            input_force: Force up to which a loop's return side must stay taut moving forward; 0 for the unloaded cable [N].
        """
        exponent, rope = self.exponent(values), self.rope(values)
        alone = mean_tension(jnp.full_like(exponent, input_force if self.model.cable.is_loop else 0.0), exponent)
        needed = alone / 2 if rope is None else tension_from_extension(extension_along(alone, exponent, rope) / 2, *rope)
        return jnp.max(self._reference_preload(values, needed))

    def highest_preload(self, values: Values, friction: float) -> Float[Array, ""]:
        """Highest preload, at the reference angle, that is felt as no more than this force at any of these bends [N]."""
        sides = 2 if self.model.cable.is_loop else 1
        allowed = friction / (sides * jnp.maximum(self.exponent(values), 1e-12))
        return jnp.min(self._reference_preload(values, allowed))

    def _reference_preload(self, values: Values, preload: Float[Array, " bends"]) -> Float[Array, " bends"]:
        """The preload at the reference angle that gives such preloads at these bends [N]; 0 where none is needed."""
        if not self.model.description.preload_follows_stretch:
            return preload
        lengthened = values[LENGTHENING] * (self.total_angle(values) - self.elastic.reference_angle)
        return self.elastic.tension(values, self.elastic.extension(values, preload) - lengthened)


def find_bent_contact(model: Model) -> int:
    """Return the number of the contact that a wrap angle refers to: the only one, or the only one measured row by row.

    Raises:
        UsageError: There are several.
    """
    contacts = model.description.contact
    measured = [k for k, c in enumerate(contacts) if c.wrap_angle.column and not c.wrap_angle.curve]
    if len(contacts) == 1 or len(measured) == 1:
        return 0 if len(contacts) == 1 else measured[0]
    raise UsageError(
        f"this cable has {len(contacts)} contacts, and a wrap angle does not say which of them is bent; predict at lengths, or "
        "describe the cable with one contact whose wrap angle is a column of the tables."
    )


def has_stretch(model: Model) -> bool:
    """Return whether the model has a rope that stretches."""
    return STIFFNESS in {p.name for p in model.space.parameters}


def has_preload(model: Model) -> bool:
    """Return whether the model has a preload."""
    return PRELOAD in {p.name for p in model.space.parameters}
