"""A pull-pull loop through any motion: its output force, and how that changes with the friction exponent."""

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from bowdenfit.physics.loop import loop_band


def loop_play_with_slope(
    input_force: Float[Array, "time recordings"],
    preload: Float[Array, " recordings"],
    friction_exponent: Float[Array, " recordings"],
    start: Float[Array, " recordings"],
    restart: Float[Array, "time recordings"],
) -> tuple[Float[Array, "time recordings"], Float[Array, "time recordings"]]:
    r"""The play operator of a loop, and the derivative of its output by the friction exponent.

    .. math:: y_t = \text{clip}(y_{t-1},\ f_-(x_t),\ f_+(x_t))

    with the limits of `bowdenfit.physics.loop.loop_band`. The slope is that of the limit that was touched last, where it
    was touched, kept while nothing moves, and 0 before the loop has moved at all.

    Args:
        input_force: x of each recording, time first [N].
        preload: P of each [N].
        friction_exponent: Lambda of one side, of each [1].
        start: Output force before the first time [N].
        restart: Output force where it must be set anew, because the input before was not known [N]; NaN elsewhere.

    Returns:
        Output force and its slope [N].
    """

    def band(exponent: Array) -> tuple[Array, Array]:
        return loop_band(input_force, preload, exponent)

    limits, slopes = jax.jvp(band, (friction_exponent,), (jnp.ones_like(friction_exponent),))

    def step(carry: tuple[Array, Array], now: tuple[Array, ...]) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        (y, slope), (low, high, by_low, by_high, anew) = carry, now
        y, slope = jnp.where(jnp.isnan(anew), y, anew), jnp.where(jnp.isnan(anew), slope, 0.0)
        slope = jnp.where(y < low, by_low, jnp.where(y > high, by_high, slope))
        y = jnp.clip(y, low, high)
        return (y, slope), (y, slope)

    begin = jnp.broadcast_to(start, input_force.shape[1:]).astype(input_force.dtype)
    _, (y, slope) = jax.lax.scan(step, (begin, jnp.zeros_like(begin)), (*limits, *slopes, restart))
    return y, slope
