"""What a cable's output force does when the motor reverses: nothing, until the slip front has crossed the cable."""

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float


def play_operator(
    x: Float[Array, "time *batch"], band: Float[Array, "..."], start: Float[Array, "*batch"]
) -> Float[Array, "time *batch"]:
    r"""Output of a quasi-static rope on the scale g on which friction is a shift.

    .. math:: y_t = \text{clip}(y_{t-1},\ x_t - \Lambda,\ x_t + \Lambda), \quad x = g(F_\text{in}),\ y = g(F_\text{out})

    While pulling the output follows at :math:`x - \Lambda`, on the return at :math:`x + \Lambda`, and in between it
    stands still, however the input moves inside the band. It remembers noise peaks of the input as if the rope had moved:
    average recordings down to the mechanical bandwidth first.

    Args:
        x: Input force on the scale g [1], time first.
        band: Friction exponent [1], the same for all times or one for each.
        start: Output on the scale g before the first sample [1]; clipped into the band of the first sample.

    Returns:
        Output force on the scale g [1].

    References:
        On-body paper, figure 12 (its three phases are this operator's three states).
    """
    bands = jnp.broadcast_to(band, x.shape)

    def step(y: Array, now: tuple[Array, Array]) -> tuple[Array, Array]:
        y = jnp.clip(y, now[0] - now[1], now[0] + now[1])
        return y, y

    return jax.lax.scan(step, jnp.broadcast_to(start, x.shape[1:]).astype(x.dtype), (x, bands))[1]


def play_operator_with_slope(
    x: Float[Array, "time *batch"],
    band: Float[Array, "..."],
    start: Float[Array, "*batch"],
    restart: Float[Array, "time *batch"],
) -> tuple[Float[Array, "time *batch"], Float[Array, "time *batch"]]:
    r"""The play operator, and the derivative of its output by the friction exponent.

    The output is linear in :math:`\Lambda` between changes of contact: its slope is -1 from the moment the rope slides
    toward the motor, +1 from the moment it slides back, each kept while it stands still, and 0 before it has slid at all.

    Args:
        x: Input force on the scale g [1], time first.
        band: Friction exponent [1], the same for all times or one for each.
        start: Output on the scale g before the first sample [1].
        restart: Output on the scale g where it must be set anew, because the input before was not known [1]; NaN elsewhere.

    Returns:
        Output on the scale g, and its slope [1].
    """
    bands = jnp.broadcast_to(band, x.shape)

    def step(
        carry: tuple[Array, Array], now: tuple[Array, Array, Array]
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        y, slope = carry
        anew = ~jnp.isnan(now[2])
        y, slope = jnp.where(anew, now[2], y), jnp.where(anew, 0.0, slope)
        low, high = now[0] - now[1], now[0] + now[1]
        slope = jnp.where(y < low, -1.0, jnp.where(y > high, 1.0, slope))
        y = jnp.clip(y, low, high)
        return (y, slope), (y, slope)

    begin = jnp.broadcast_to(start, x.shape[1:]).astype(x.dtype)
    _, (y, slope) = jax.lax.scan(step, (begin, jnp.zeros_like(begin)), (x, bands, restart))
    return y, slope
