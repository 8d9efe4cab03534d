"""Numbers at places that are known before anything is compiled, taken and put as slices.

XLA compiles an index into an array as a gather or scatter, of some ten operations, even where the places are constants.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float


def taken(whole: Float[Array, "*rows size"], places: np.ndarray) -> Float[Array, "*rows places"]:
    """What stands at places along the last axis, in their order.

    Args:
        whole: From which.
        places: Numbers of the places.
    """
    breaks = np.flatnonzero(np.diff(places) != 1) + 1
    runs = [(int(run[0]), int(run[-1]) + 1) for run in np.split(places, breaks)] if len(places) else [(0, 0)]
    if runs == [(0, whole.shape[-1])]:
        return whole
    pieces = [whole[..., start:end] for start, end in runs]
    return pieces[0] if len(pieces) == 1 else jnp.concatenate(pieces, axis=-1)


def put(whole: Float[Array, "*rows size"], places: np.ndarray, part: Float[Array, "*rows places"]) -> Array:
    """The whole with a part of it replaced, along the last axis.

    Args:
        whole: What stays elsewhere.
        places: Where the part goes.
        part: In the order of the places.
    """
    source = np.arange(whole.shape[-1])
    source[places] = whole.shape[-1] + np.arange(len(places))
    return taken(jnp.concatenate([whole, part], axis=-1), source)
