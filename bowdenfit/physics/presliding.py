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
_SMALL, _LARGE = 1e-3, 500.0  # below which two terms of the series are as good, and short of where exp overflows
# Friction that is let go, times the stiffness: at 1 it falls as fast as the output moves, and a rope without mass would jump.
MOST_LET_GO = 0.9


@jax.custom_jvp
def creep(
    change: Float[Array, "*batch"], build_up: Float[Array, "*batch"], stiffness: Float[Array, "*batch"]
) -> Float[Array, "*batch"]:
    r"""Return how far the output moves while the input moves on by a change, friction building up exponentially.

    .. math:: d + A (1 - e^{-\sigma d}) = D, \qquad d = D - A + W(\sigma A\, e^{\sigma (A - D)})/\sigma

    with Lambert's function W, so that no step of the input is too long: for A above 0 between d = 0 and d = D. For A below 0
    friction is let go and d is above D; Newton's method then finds it from the first terms of the exponential series.

    Args:
        change: D, at least 0.
        build_up: A, what friction has yet to grow by until the rope slides; below 0 by at most `MOST_LET_GO` over sigma.
        stiffness: sigma, above 0.

    Returns:
        d.
    """
    log_argument = jnp.log(jnp.maximum(stiffness * build_up, _LEAST)) + stiffness * (build_up - change)
    log_w = jnp.where(log_argument > 1, jnp.log(jnp.maximum(log_argument, 1.0)), log_argument)
    let_go, reach = jnp.clip(-stiffness * build_up, 0.0, MOST_LET_GO), stiffness * change
    moved = 2 * reach / (jnp.sqrt((1 - let_go) ** 2 + 2 * let_go * reach) + 1 - let_go)  # by the first terms of the series
    for _ in range(_NEWTON_STEPS):
        w = jnp.exp(log_w)
        log_w = log_w - (w + log_w - log_argument) / (w + 1)
        left = let_go * jnp.exp(-moved)
        moved = moved - (moved - let_go + left - reach) / (1 - left)
    built = jnp.clip(change - build_up + jnp.exp(log_w) / stiffness, 0.0, change)
    return jnp.where(build_up < 0, moved / stiffness, built)


@creep.defjvp
def _creep_jvp(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Array, Array]:
    (change, build_up, stiffness), (by_change, by_build_up, by_stiffness) = primals, tangents
    d = creep(change, build_up, stiffness)
    left = jnp.exp(-stiffness * d)
    moved = by_change - (1 - left) * by_build_up - build_up * d * left * by_stiffness
    return d, moved / (1 + build_up * stiffness * left)


def share_left_behind(motion: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    r"""Return what friction has yet to follow of a change of its limit, which changes in proportion to the motion [1].

    .. math:: \psi(u) = \frac{1}{u} - \frac{1}{e^u - 1}

    Args:
        motion: u, over that in which friction builds up by 63 %, at least 0.
    """
    u = jnp.clip(motion, _SMALL, _LARGE)
    return jnp.where(motion < _SMALL, 0.5 - motion / 12, 1 / jnp.maximum(motion, _SMALL) - 1 / jnp.expm1(u))


def share_at_end(motion: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    """Return how fast friction builds up at the end of a motion, over its mean rate, u/(exp(u) - 1) [1].

    Args:
        motion: u, as for `share_left_behind`.
    """
    return jnp.where(motion < _SMALL, 1 - motion / 2, motion / jnp.expm1(jnp.clip(motion, _SMALL, _LARGE)))


def presliding_operator(
    scaled_input: Float[Array, "time *batch"],
    limits: tuple[Float[Array, "time *batch"], Float[Array, "time *batch"]],
    stiffness: Float[Array, "time *batch"],
    start: Float[Array, "*batch"],
    restart: Float[Array, "time *batch"] | None = None,
    damping: Array | float | None = None,
) -> Float[Array, "time *batch"]:
    """Return the output of a rope whose friction builds up as Dahl's and the LuGre model have it, on the scale g.

    Each step is exact for an input that moves one way during it, at a constant speed. Where the speed changes, the friction in
    steady sliding changes in proportion to the motion of the step, and the bristles are damped by how fast they bend at its
    end; so it is stable however coarse the samples are. Friction beyond that of steady sliding is let go as the rope moves on;
    what would be let go faster than the output moves goes at once, as nothing has mass.

    Args:
        scaled_input: x, time first.
        limits: Friction exponent in steady sliding while pulling and while returning.
        stiffness: sigma Lambda_0/Lambda(v): of friction over its steady value.
        start: Output before the first sample; what is left of the input there is friction, as far as there is so much.
        restart: Output where it must be set anew, because the input before was not known; NaN elsewhere.
        damping: tau over the time since the sample before [1]; None without any.

    Returns:
        y.
    """
    pulling, returning = limits
    half, middle = (pulling + returning) / 2, (pulling - returning) / 2
    first = jnp.broadcast_to(start, scaled_input.shape[1:]).astype(scaled_input.dtype)
    anew = jnp.full(scaled_input.shape, jnp.nan) if restart is None else restart
    anew = anew.at[0].set(jnp.where(jnp.isnan(anew[0]), first, anew[0]))
    damped = jnp.broadcast_to(jnp.asarray(0.0 if damping is None else damping), scaled_input.shape)

    def step(carry: tuple[Array, Array], now: tuple[Array, ...]) -> tuple[tuple[Array, Array], Array]:
        (y, friction), (x, half, before, sigma, lag, anew) = carry, now
        is_new = ~jnp.isnan(anew)
        y = jnp.where(is_new, anew, y)
        friction = jnp.where(is_new, jnp.clip(x - y, -half, half), friction)
        limit = half + share_left_behind(sigma * jnp.abs(x - y - friction)) * (before - half)
        most = jnp.minimum(limit, half) + MOST_LET_GO / (sigma * (1 + lag))
        friction = jnp.clip(friction, -most, most)
        lead = x - y - friction
        sign = jnp.where(lead < 0, -1.0, 1.0)
        build_up = limit - sign * friction
        if damping is not None:
            lag = lag * share_at_end(sigma * creep(jnp.abs(lead), build_up * (1 + lag), sigma))
        moved = creep(jnp.abs(lead), build_up * (1 + lag), sigma)
        y = y + sign * moved
        return (y, sign * (limit - build_up * jnp.exp(-sigma * moved))), y

    stiff = jnp.broadcast_to(stiffness, scaled_input.shape)
    values = (scaled_input - middle, half, _before(half), (stiff + _before(stiff)) / 2, damped, anew)
    return jax.lax.scan(step, (first, jnp.zeros_like(first)), values)[1]


def _before(values: Array) -> Array:
    """Return at each time the values of the time before; the first as they are."""
    return jnp.concatenate([values[:1], values[:-1]])
