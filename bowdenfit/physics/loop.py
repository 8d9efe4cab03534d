"""The preloaded pull-pull loop: two ropes between two pulleys, one pulling while the other returns.

Forces are differences of the two sides' tensions, positive where they pull the load side forward; Euler friction in full
slip, and a loop of fixed length. The mean tensions of both sides add up to twice the preload where the rope is linear. A rope
that is softer at low load than at high makes the sum larger, and friction with it: `moving_preload`.
"""

from typing import Any

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from bowdenfit.physics.stretch import (
    compliance,
    compliance_along,
    extension,
    extension_along,
    mean_tension,
    tension_from_extension,
)

# Stiffness k [N/mm], bedding-in stretch d [mm] and load T_c [N] of `bowdenfit.physics.stretch.extension`; None if linear.
Rope = tuple[Array, Array, Array] | None

_ITERATIONS = 8  # of Newton's method, after which no loop is off by more than rounding; tests/physics/test_loop.py


def loop_output_force(
    input_force: Float[Array, "..."],
    preload: Float[Array, "..."],
    friction_exponent: Float[Array, "..."],
    stroke: Float[Array, "..."],
    rope: Rope = None,
) -> Float[Array, "..."]:
    r"""Return the output force of a loop while it moves.

    .. math:: F_\text{out} = \min\left(F_\text{in} - 2 P \Lambda,\ F_\text{in} e^{-\Lambda}\right)

    while the motor drives forward: the first branch while the return side is taut, the second once it is slack. The load
    driving the motor (F_in < 0) and the way back follow by exchanging the sides and the ends:
    :math:`F_\text{out} = s \min(s F_\text{in} - 2 P \Lambda,\ s F_\text{in} e^{-\Lambda},\ s F_\text{in} e^{\Lambda})`.

    For a rope that beds in P is that of `moving_preload`. Not valid while nothing moves: see `bowdenfit.cable.drive.LoopDrive`.

    Args:
        input_force: F_in, of either sign [N].
        preload: P, tension of both sides at rest [N].
        friction_exponent: Lambda of one side [1].
        stroke: s, +1 moving forward, -1 back [1].
        rope: How the rope stretches.

    Returns:
        Output force [N].

    References:
        The actuator of the haptic paper (section 3.1), with its equation 1 along both sides.
    """
    return loop_response(input_force, preload, friction_exponent, stroke, rope)[0]


def loop_input_force(
    output_force: Float[Array, "..."],
    preload: Float[Array, "..."],
    friction_exponent: Float[Array, "..."],
    stroke: Float[Array, "..."],
    rope: Rope = None,
) -> Float[Array, "..."]:
    r"""Return the input force [N] that gives an output force while the loop moves: the inverse of `loop_output_force`.

    .. math:: F_\text{in} = s \max(s F_\text{out} + 2 P \Lambda,\ s F_\text{out} e^{\Lambda},\ s F_\text{out} e^{-\Lambda})

    Args:
        output_force: F_out, of either sign [N].
        preload: P, tension of both sides at rest [N].
        friction_exponent: Lambda of one side [1].
        stroke: s, +1 moving forward, -1 back [1].
        rope: How the rope stretches.
    """
    along = stroke * output_force
    preload = moving_preload(along, preload, -friction_exponent, rope)  # as seen from the load side
    slack = along * jnp.where(along > 0, jnp.exp(friction_exponent), jnp.exp(-friction_exponent))
    taut = along + 2 * preload * friction_exponent
    return stroke * jnp.where(taut > slack, taut, slack)  # see `loop_response_from`


def loop_band(
    input_force: Float[Array, "..."],
    preload: Float[Array, "..."],
    friction_exponent: Float[Array, "..."],
    rope: Rope = None,
) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """Return the output force [N] while moving forward and while moving back; at rest it lies between the two."""
    lower, upper = (
        loop_output_force(input_force, preload, friction_exponent, jnp.asarray(stroke), rope) for stroke in (1.0, -1.0)
    )
    return lower, upper


def moving_preload(
    along: Float[Array, "..."], preload: Float[Array, "..."], friction_exponent: Float[Array, "..."], rope: Rope
) -> Float[Array, "..."]:
    r"""Return half the sum of both sides' mean tensions while the loop moves [N]; P itself where the rope is linear.

    A moving loop is as long as it was at rest:

    .. math:: \overline{e(T_1)} + \overline{e(T_2)} = 2 e(P)

    with the extension e of `bowdenfit.physics.stretch.extension`, averaged along each side. That is concave, so that the
    tensions of a loaded loop add up to more than 2 P. Continued on as a straight line below T = 0, it says that a side is slack
    where that is so.

    Args:
        along: Force at the end that friction is counted from, the motor, in the direction of motion [N].
        preload: P [N].
        friction_exponent: Lambda of one side; -Lambda where `along` is the force at the load [1].
        rope: How the rope stretches.
    """
    return preload if rope is None else _moving_preload(along, preload, friction_exponent, *rope)


def _mean_tensions(along: Array, mean: Array, friction_exponent: Array) -> tuple[Array, Array, Array]:
    """Return the mean tensions of the pulling and of the returning side [N], and the ratio of their changes with `mean`."""
    unit = jnp.ones_like(friction_exponent)
    a, b = mean_tension(unit, friction_exponent), mean_tension(unit, -friction_exponent)
    pulling = a * (2 * mean + b * along) / (a + b)
    return pulling, 2 * mean - pulling, b / a


def _lengths(
    pulling: Array, returning: Array, preload: Array, friction_exponent: Array, rope: tuple[Array, Array, Array]
) -> Array:
    """Return by how much both sides are shorter than at rest [mm]."""
    pulled, returned = (
        extension_along(jnp.maximum(tension, 0.0), friction_exponent, rope)
        + jnp.minimum(tension, 0.0) * compliance(jnp.zeros_like(tension), *rope)
        for tension in (pulling, returning)
    )  # each side of 0 by itself: exponentials far below it would be infinite, and gradients no numbers
    return 2 * extension(preload, *rope) - pulled - returned


@jax.custom_jvp
def _moving_preload(along: Any, preload: Any, friction_exponent: Any, *rope: Any) -> Array:
    """Return `moving_preload` of a rope that beds in, by Newton's method, which comes from below all the way."""
    mean = preload * jnp.ones_like(along * friction_exponent)
    for _ in range(_ITERATIONS):
        pulling, returning, ratio = _mean_tensions(along, mean, friction_exponent)
        slopes = [compliance_along(jnp.maximum(tension, 0.0), friction_exponent, rope) for tension in (pulling, returning)]
        shorter = _lengths(pulling, returning, preload, friction_exponent, rope)
        mean += shorter * (1 + ratio) / (2 * (slopes[0] + ratio * slopes[1]))
    return mean


@_moving_preload.defjvp
def _implicit(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Array, Array]:
    """Return the implicit function's derivative: the change of the lengths with all else, over that with the mean."""
    mean = _moving_preload(*primals)

    def lengths(mean: Any, along: Any, preload: Any, friction_exponent: Any, *rope: Any) -> Array:
        return _lengths(*_mean_tensions(along, mean, friction_exponent)[:2], preload, friction_exponent, rope)

    _, by_others = jax.jvp(lambda *others: lengths(mean, *others), primals, tangents)
    _, by_mean = jax.jvp(lambda mean: lengths(mean, *primals), (mean,), (jnp.ones_like(mean),))
    return mean, -by_others / by_mean


def loop_response(
    input_force: Float[Array, "..."],
    preload: Float[Array, "..."],
    friction_exponent: Float[Array, "..."],
    stroke: Float[Array, "..."],
    rope: Rope = None,
) -> tuple[Float[Array, "..."], Float[Array, "..."], Float[Array, "..."]]:
    """Return `loop_output_force` [N] and its derivatives by the input force [1] and by the friction exponent [N].

    The derivatives, which weights need, take the sum of the mean tensions for constant.
    """
    shares = jnp.exp(-friction_exponent), jnp.exp(friction_exponent)
    preload = moving_preload(stroke * input_force, preload, friction_exponent, rope)
    return loop_response_from(input_force, 2 * preload * friction_exponent, 2 * preload, *shares, stroke)


def loop_response_from(
    input_force: Float[Array, "..."],
    taut_loss: Float[Array, "..."],
    twice_preload: Float[Array, "..."],
    less: Float[Array, "..."],
    more: Float[Array, "..."],
    stroke: Float[Array, "..."],
) -> tuple[Float[Array, "..."], Float[Array, "..."], Float[Array, "..."]]:
    """Return `loop_response` from precomputed functions of preload and friction.

    Args:
        input_force: F_in [N].
        taut_loss: 2 P Lambda [N].
        twice_preload: 2 P [N].
        less, more: exp(-Lambda) and exp(Lambda) [1].
        stroke: +1 moving forward, -1 back [1].
    """
    along = stroke * input_force
    growth = jnp.where(along > 0, less, more)
    taut, slack = along - taut_loss, along * growth
    is_taut = taut < slack
    by_exponent = jnp.where(is_taut, twice_preload, jnp.abs(slack))
    # The derivative of jnp.minimum asks which argument equals it, and compiled code that rounds the two otherwise finds none.
    return stroke * jnp.where(is_taut, taut, slack), jnp.where(is_taut, 1.0, growth), -stroke * by_exponent


def free_motion_loss(
    preload: Float[Array, "*batch"], friction_exponent: Float[Array, "*#batch"]
) -> Float[Array, "*batch"]:
    r"""Return the force [N] needed to move the unloaded loop, :math:`2 P \Lambda`, whose tensions differ little."""
    return 2 * preload * friction_exponent


def dynamic_range(
    largest_force: Float[Array, "*#batch"], preload: Float[Array, "*batch"], friction_exponent: Float[Array, "*#batch"]
) -> Float[Array, "*batch"]:
    r"""Return the largest force, or torque, over that needed to move the unloaded loop, :math:`F_\text{max}/(2 P \Lambda)` [1].

    Args:
        largest_force: F_max, of which the device is capable [N].
        preload: P [N].
        friction_exponent: Lambda of one side [1].

    References:
        Haptic paper, section 2 (torque dynamic range); radii of the pulleys cancel.
    """
    return largest_force / free_motion_loss(preload, friction_exponent)


def slack_load(
    preload: Float[Array, "*batch"], friction_exponent: Float[Array, "*#batch"], rope: Rope = None
) -> Float[Array, "*batch"]:
    r"""Return the input force at which the return side goes slack [N], :math:`2 P \Lambda/(1 - e^{-\Lambda})`.

    A rope that beds in takes the mean tension at which its extension is 2 e(P) in place of 2 P. This holds while moving
    forward; for the way back use the negative exponent.
    """
    alone = 2 * preload if rope is None else _mean_tension_alone(2 * extension(preload, *rope), friction_exponent, rope)
    return alone / mean_tension(jnp.ones_like(friction_exponent), friction_exponent)


def _mean_tension_alone(extended: Array, friction_exponent: Array, rope: tuple[Array, Array, Array]) -> Array:
    """Return the mean tension of one sliding side with an extension, by Newton's method from that without friction [N]."""
    mean = tension_from_extension(extended, *rope) * jnp.ones_like(friction_exponent)
    for _ in range(_ITERATIONS):
        missing = extended - extension_along(mean, friction_exponent, rope)
        mean += missing / compliance_along(mean, friction_exponent, rope)
    return mean


def side_tensions(
    input_force: Float[Array, "*batch"],
    preload: Float[Array, "*#batch"],
    friction_exponent: Float[Array, "*#batch"],
    stroke: Float[Array, "*#batch"],
    rope: Rope = None,
) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"]]:
    r"""Return the mean tensions of the pulling and of the returning side [N] under an input force of at least 0.

    With :math:`a = (1 - e^{-s\Lambda})/(s\Lambda)` for the pulling side and b, the same of :math:`-s`, for the other:
    :math:`\bar T_1 = a (2 P + b F_\text{in})/(a + b)` and :math:`\bar T_2 = 2 P - \bar T_1` while that is positive;
    else :math:`\bar T_1 = a F_\text{in}` and the returning side is slack.

    Args:
        input_force: F_in, at least 0 [N].
        preload: P [N].
        friction_exponent: Lambda of one side [1].
        stroke: +1 moving forward, -1 back [1].
        rope: How the rope stretches; P is then that of `moving_preload`.
    """
    exponent = stroke * friction_exponent * jnp.ones_like(input_force)
    mean = moving_preload(input_force, preload, exponent, rope)
    pulling, returning, _ = _mean_tensions(input_force, mean, exponent)
    slack = returning < 0
    return jnp.where(slack, mean_tension(input_force, exponent), pulling), jnp.where(slack, 0.0, returning)
