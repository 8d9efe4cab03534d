"""The move that samples the wrong distribution, for controls that must fail."""

import jax.numpy as jnp
import numpy as np

from bowdenfit.inference.moves import differential_evolution


def snooker(numbers, moving, resting):
    """`DESnookerMove` as emcee 3.1.6 has it: shifts are divided by the root of a distance, as if it were its square."""
    sets, uniform = jnp.array_split(resting, 3), numbers.uniform
    chosen = jnp.stack([item[(uniform[:, i] * len(item)).astype(int)] for i, item in enumerate(sets)], axis=1)
    order = jnp.argsort(uniform[:, 3:6], axis=1)
    z, *remaining = jnp.moveaxis(jnp.take_along_axis(chosen, order[..., None], axis=1), 1, 0)
    delta = moving - z
    norm = jnp.linalg.norm(delta, axis=1, keepdims=True)
    u = delta / jnp.sqrt(norm)
    first, other = (jnp.sum(u * other, axis=1, keepdims=True) for other in remaining)
    places = moving + u * 1.7 * (first - other)
    further = jnp.log(jnp.linalg.norm(places - z, axis=1)) - jnp.log(norm[:, 0])
    return places, 0.5 * (np.shape(moving)[1] - 1.0) * further


def snooker_mixture():
    """The popular mixture."""
    return [(differential_evolution, 0.8), (snooker, 0.2)]
