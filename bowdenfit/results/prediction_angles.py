"""Wrap angles that predictions at route values use: the curves', and stated ones in their place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float

from bowdenfit.cable.cable import Cable
from bowdenfit.inference.draws import for_each_draw
from bowdenfit.model import Model
from bowdenfit.words import listed

NO_ANGLES: Mapping[int, float] = MappingProxyType({})


@dataclass(frozen=True)
class PredictionAngles:
    """Wrap angle of each contact at each route value: the curve's, or one of its own.

    Args:
        route: Route values; any one number without a route.
        own: Own wrap angles [rad], route values by contacts; 0 without one.
        is_own: Whether there is one.
        notes: What takes the place of the contacts' usual wrap angles at each route value, in words; empty for nothing.
    """

    route: Float[np.ndarray, " places"]
    own: Float[np.ndarray, "places contacts"]
    is_own: Bool[np.ndarray, "places contacts"]
    notes: tuple[str, ...]

    def resolve(self, cable: Cable, values: Mapping[str, Array]) -> Float[Array, "places contacts"]:
        """Return the wrap angles [rad] at given parameters."""
        return jnp.where(self.is_own, self.own, cable.wrap_angles(values, jnp.asarray(self.route)))


def choose_angles(model: Model, route: np.ndarray, stated: Mapping[int, float]) -> PredictionAngles:
    """Return the wrap angles that a prediction uses.

    Args:
        model: The model.
        route: Route values.
        stated: Stated wrap angles [rad], by number of the contact; they hold at all route values.
    """
    contacts = model.description.contact
    shape = len(route), len(contacts)
    own, is_own = np.zeros(shape), np.zeros(shape, dtype=bool)
    for contact, angle in stated.items():
        own[:, contact], is_own[:, contact] = angle, True
    words = listed([f"{contacts[k].name!r} bent by {np.rad2deg(angle):.4g} deg" for k, angle in stated.items()])
    return PredictionAngles(np.asarray(route, dtype=float), own, is_own, (words,) * len(route))


def predict_forces(
    model: Model,
    z: np.ndarray,
    angles: PredictionAngles,
    force: float,
    stroke: int,
    mountings: Sequence[np.ndarray],
    *,
    inverse: bool = False,
) -> list[np.ndarray]:
    """Return the output force [N] of draws (rows) at route values (columns), at the reference speed, for some mountings.

    Args:
        model: The model.
        z: Draws, one a row.
        angles: Wrap angles at the route values.
        force: Force at the motor side [N].
        stroke: +1 pulling, -1 return.
        mountings: Effect of each mounting on the friction exponent of each draw [1].
        inverse: Return the input force instead, given the force at the load side.
    """
    cable = model.cable
    function = cable.input_force_at_angles if inverse else cable.output_force_at_angles

    def other_end(z_and_mounting: Float[Array, " free_and_one"]) -> Float[Array, " places"]:
        values = model.space.constrain(z_and_mounting[:-1])
        bends = angles.resolve(cable, values)
        return function(values, bends, jnp.asarray(float(force)), jnp.asarray(float(stroke)), z_and_mounting[-1])

    program = for_each_draw(other_end, model.space.size + 1)
    return [program(np.column_stack([z, mounting])) for mounting in mountings]
