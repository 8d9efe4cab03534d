"""The preloaded pull-pull loop: two ropes between two pulleys, one pulling while the other returns.

Forces are differences of the two sides' tensions, positive where they pull the load side forward; Euler friction in full
slip, a linear elastic rope, and a loop of fixed length, so that the mean tensions of both sides add up to twice the preload.
"""

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from bowdenfit.physics.stretch import mean_tension


def loop_output_force(
    input_force: Float[Array, "..."],
    preload: Float[Array, "..."],
    friction_exponent: Float[Array, "..."],
    stroke: Float[Array, "..."],
) -> Float[Array, "..."]:
    r"""Return the output force of a loop while it moves.

    .. math:: F_\text{out} = \min\left(F_\text{in} - 2 P \Lambda,\ F_\text{in} e^{-\Lambda}\right)

    while the motor drives forward: the first branch while the return side is taut, the second once it is slack. The load
    driving the motor (F_in < 0) and the way back follow by exchanging the sides and the ends:
    :math:`F_\text{out} = s \min(s F_\text{in} - 2 P \Lambda,\ s F_\text{in} e^{-\Lambda},\ s F_\text{in} e^{\Lambda})`.

    Not valid while nothing moves (see `bowdenfit.cable.drive.Loop`), and inaccurate for a rope much stiffer at high than at low
    load, where mean tensions do not quite add up to 2P.

    Args:
        input_force: F_in, of either sign [N].
        preload: P, tension of both sides at rest [N].
        friction_exponent: Lambda of one side [1].
        stroke: s, +1 moving forward, -1 back [1].

    Returns:
        Output force [N].

    References:
        The actuator of the haptic paper (section 3.1), with its equation 1 along both sides.
    """
    return loop_response(input_force, preload, friction_exponent, stroke)[0]


def loop_input_force(
    output_force: Float[Array, "..."],
    preload: Float[Array, "..."],
    friction_exponent: Float[Array, "..."],
    stroke: Float[Array, "..."],
) -> Float[Array, "..."]:
    r"""Return the input force [N] that gives an output force while the loop moves: the inverse of `loop_output_force`.

    .. math:: F_\text{in} = s \max(s F_\text{out} + 2 P \Lambda,\ s F_\text{out} e^{\Lambda},\ s F_\text{out} e^{-\Lambda})

    Args:
        output_force: F_out, of either sign [N].
        preload: P, tension of both sides at rest [N].
        friction_exponent: Lambda of one side [1].
        stroke: s, +1 moving forward, -1 back [1].
    """
    along = stroke * output_force
    slack = along * jnp.where(along > 0, jnp.exp(friction_exponent), jnp.exp(-friction_exponent))
    return stroke * jnp.maximum(along + 2 * preload * friction_exponent, slack)


def loop_band(
    input_force: Float[Array, "..."], preload: Float[Array, "..."], friction_exponent: Float[Array, "..."]
) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """Return the output force [N] while moving forward and while moving back; at rest it lies between the two."""
    lower, upper = (
        loop_output_force(input_force, preload, friction_exponent, jnp.asarray(stroke)) for stroke in (1.0, -1.0)
    )
    return lower, upper


def loop_response(
    input_force: Float[Array, "..."],
    preload: Float[Array, "..."],
    friction_exponent: Float[Array, "..."],
    stroke: Float[Array, "..."],
) -> tuple[Float[Array, "..."], Float[Array, "..."], Float[Array, "..."]]:
    """Return `loop_output_force` [N] and its derivatives by the input force [1] and by the friction exponent [N]."""
    shares = jnp.exp(-friction_exponent), jnp.exp(friction_exponent)
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
    return stroke * jnp.minimum(taut, slack), jnp.where(is_taut, 1.0, growth), -stroke * by_exponent


def free_motion_loss(
    preload: Float[Array, "*batch"], friction_exponent: Float[Array, "*#batch"]
) -> Float[Array, "*batch"]:
    r"""Return the force [N] needed to move the unloaded loop, :math:`2 P \Lambda`."""
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


def slack_load(preload: Float[Array, "*batch"], friction_exponent: Float[Array, "*#batch"]) -> Float[Array, "*batch"]:
    r"""Return the input force at which the return side goes slack [N], :math:`2 P \Lambda/(1 - e^{-\Lambda})`.

    This holds while moving forward; for the way back use the negative exponent.
    """
    return 2 * preload / mean_tension(jnp.ones_like(friction_exponent), friction_exponent)


def side_tensions(
    input_force: Float[Array, "*batch"],
    preload: Float[Array, "*#batch"],
    friction_exponent: Float[Array, "*#batch"],
    stroke: Float[Array, "*#batch"],
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
    """
    one = jnp.ones_like(input_force * stroke * friction_exponent)
    a, b = mean_tension(one, stroke * friction_exponent), mean_tension(one, -stroke * friction_exponent)
    taut = a * (2 * preload + b * input_force) / (a + b)
    slack = taut > 2 * preload
    return jnp.where(slack, a * input_force, taut), jnp.where(slack, 0.0, 2 * preload - taut)
