"""What a cable's output force does when the motor reverses: nothing, until the slip front has crossed the cable."""

from typing import Any

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float


def play_operator(
    low: Float[Array, "time *batch"],
    high: Float[Array, "time *batch"],
    start: Float[Array, "*batch"],
    slopes: tuple[Float[Array, "time *batch"], Float[Array, "time *batch"]] | None = None,
    restart: Float[Array, "time *batch"] | None = None,
) -> tuple[Float[Array, "time *batch"], Float[Array, "time *batch"]]:
    r"""Output of a quasi-static rope that stands still between two limits, and its derivative by the friction exponent.

    .. math:: y_t = \text{clip}(y_{t-1},\ f_-(x_t),\ f_+(x_t))

    Of a single rope the limits are :math:`x \mp \Lambda` on the scale g on which friction is a shift, x = g(F_in) and
    y = g(F_out): while pulling the output follows at :math:`x - \Lambda`, on the return at :math:`x + \Lambda`, and in
    between it stands still, however the input moves inside the band. It remembers noise peaks of the input as if the rope
    had moved: average recordings down to the mechanical bandwidth first, and lead it through what is left as
    `bowdenfit.recordings.preparation.likely_input` has it.

    The slope is that of the limit that was touched last, where it was touched: kept while the output stands still, and 0
    before the rope has slid at all.

    Args:
        low: Output while sliding toward the motor, time first.
        high: Output while sliding back.
        start: Output before the first sample; clipped into the band there.
        slopes: Derivatives of both limits by the friction exponent; those of a single rope, -1 and 1, if omitted.
        restart: Output where it must be set anew, because the input before was not known; NaN elsewhere.

    Returns:
        Output and its slope.

    References:
        On-body paper, figure 12 (its three phases are this operator's three states).
    """
    restarts = jnp.full(low.shape, jnp.nan) if restart is None else restart

    def step(carry: tuple[Array, Array], now: tuple[Any, ...]) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        (y, slope), (low, high, own, restarts) = carry, now
        by_low, by_high = (-1.0, 1.0) if own is None else own
        y, slope = jnp.where(jnp.isnan(restarts), y, restarts), jnp.where(jnp.isnan(restarts), slope, 0.0)
        slope = jnp.where(y < low, by_low, jnp.where(y > high, by_high, slope))
        y = jnp.clip(y, low, high)
        return (y, slope), (y, slope)

    begin = jnp.broadcast_to(start, low.shape[1:]).astype(low.dtype)
    return jax.lax.scan(step, (begin, jnp.zeros_like(begin)), (low, high, slopes, restarts))[1]
