r"""Friction that builds up while the rope creeps: Dahl's and the LuGre model of a rope that pulls a load.

After a turn of the motion a play operator stands still until all of its band is crossed, and slips at once. A real rope creeps:
asperities (bristles) bend first. With s = +1 pulling and -1 returning, Dahl's equation for the friction f on the scale g is

.. math:: df = \sigma\,\Lambda_0\,|dy| \left(s - \frac{f}{\Lambda(v)}\right), \qquad x = y + f + \tau \frac{df}{dt}

where x and y are the input and the output on g, and :math:`\sigma` is the presliding stiffness: friction is built up by 63 %
when the output has changed by :math:`1/\sigma` on g, which is relative to the force. The motion that bends the bristles is
thus that of the load end, where the force follows the motion. :math:`\Lambda_0` is the friction exponent at the reference
speed, :math:`\Lambda(v)` that in steady sliding, and :math:`\tau` the damping of the bristles over their stiffness. The steady
state is :math:`y = x - s \Lambda(v)`, as without presliding, and infinite stiffness is the play operator.

References:
    Dahl, A solid friction model, Aerospace Corporation, TOR-0158(3107-18)-1 (1968).
    Canudas de Wit, Olsson, Astrom and Lischinsky, A new model for control of systems with friction, IEEE Transactions on
    Automatic Control 40 (1995), 419.
"""

from typing import Any

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

_NEWTON_STEPS = 5  # to the last digit from any argument (tests/physics/test_presliding.py)
_LEAST = 1e-300  # keeps the logarithm of no friction left to build up finite


@jax.custom_jvp
def creep(
    change: Float[Array, "*batch"], build_up: Float[Array, "*batch"], stiffness: Float[Array, "*batch"]
) -> Float[Array, "*batch"]:
    r"""Return how far the output moves while the input moves on by a change, friction building up exponentially.

    .. math:: d + A (1 - e^{-\sigma d}) = D, \qquad d = D - A + W(\sigma A\, e^{\sigma (A - D)})/\sigma

    with Lambert's function W, so that no step of the input is too long: between d = 0 and d = D whatever the arguments.

    Args:
        change: D, at least 0.
        build_up: A, what friction has yet to grow by until the rope slides, at least 0.
        stiffness: sigma, above 0.

    Returns:
        d.
    """
    log_argument = jnp.log(jnp.maximum(stiffness * build_up, _LEAST)) + stiffness * (build_up - change)
    log_w = jnp.where(log_argument > 1, jnp.log(jnp.maximum(log_argument, 1.0)), log_argument)
    for _ in range(_NEWTON_STEPS):
        w = jnp.exp(log_w)
        log_w = log_w - (w + log_w - log_argument) / (w + 1)
    return jnp.clip(change - build_up + jnp.exp(log_w) / stiffness, 0.0, change)


@creep.defjvp
def _creep_jvp(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Array, Array]:
    (change, build_up, stiffness), (by_change, by_build_up, by_stiffness) = primals, tangents
    d = creep(change, build_up, stiffness)
    left = jnp.exp(-stiffness * d)
    moved = by_change - (1 - left) * by_build_up - build_up * d * left * by_stiffness
    return d, moved / (1 + build_up * stiffness * left)


def presliding_operator(
    scaled_input: Float[Array, "time *batch"],
    limits: tuple[Float[Array, "time *batch"], Float[Array, "time *batch"]],
    stiffness: Float[Array, "time *batch"],
    start: Float[Array, "*batch"],
    restart: Float[Array, "time *batch"] | None = None,
    damping: Array | float = 0.0,
) -> Float[Array, "time *batch"]:
    """Return the output of a rope whose friction builds up as Dahl's and the LuGre model have it, on the scale g.

    Each step is exact for an input that moves one way during it, with the speed that it ends with, and the rate of the damping
    is taken over the whole step; so it is stable however coarse the samples are. Where friction in steady sliding falls by more
    than the motion could relax, what the bristles hold beyond it is let go at once, as nothing else has mass.

    Args:
        scaled_input: x, time first.
        limits: Friction exponent in steady sliding while pulling and while returning.
        stiffness: sigma Lambda_0/Lambda(v): of friction over its steady value.
        start: Output before the first sample; what is left of the input there is friction, as far as there is so much.
        restart: Output where it must be set anew, because the input before was not known; NaN elsewhere.
        damping: tau over the time since the sample before [1].

    Returns:
        y.
    """
    pulling, returning = limits
    half, middle = (pulling + returning) / 2, (pulling - returning) / 2
    first = jnp.broadcast_to(start, scaled_input.shape[1:]).astype(scaled_input.dtype)
    anew = jnp.full(scaled_input.shape, jnp.nan) if restart is None else restart
    anew = anew.at[0].set(jnp.where(jnp.isnan(anew[0]), first, anew[0]))
    damped = jnp.broadcast_to(jnp.asarray(damping), scaled_input.shape)

    def step(carry: tuple[Array, Array], now: tuple[Array, ...]) -> tuple[tuple[Array, Array], Array]:
        (y, friction), (x, half, sigma, lag, anew) = carry, now
        is_new = ~jnp.isnan(anew)
        y = jnp.where(is_new, anew, y)
        friction = jnp.clip(jnp.where(is_new, x - y, friction), -half, half)
        lead = x - y - friction
        sign = jnp.where(lead < 0, -1.0, 1.0)
        build_up = half - sign * friction
        moved = creep(jnp.abs(lead), build_up * (1 + lag), sigma)
        y = y + sign * moved
        return (y, sign * (half - build_up * jnp.exp(-sigma * moved))), y

    values = (scaled_input - middle, half, jnp.broadcast_to(stiffness, scaled_input.shape), damped, anew)
    return jax.lax.scan(step, (first, jnp.zeros_like(first)), values)[1]
