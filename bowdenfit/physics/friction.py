"""How force is lost along a Bowden cable."""

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float


def friction_exponent(
    friction_coefficient: Float[Array, "*batch contacts"], wrap_angle: Float[Array, "*batch contacts"]
) -> Float[Array, "*batch"]:
    r"""Sum of friction coefficient times wrap angle over the contacts in series.

    .. math:: \Lambda = \sum_k \mu_k \theta_k

    Args:
        friction_coefficient: Coulomb coefficient of each contact [1].
        wrap_angle: Angle the rope turns through in each contact, all bends added up without sign [rad].

    Returns:
        Friction exponent [1].

    References:
        On-body paper, equation 9 (the contacts are in series, so their exponents add).
    """
    return jnp.sum(friction_coefficient * wrap_angle, axis=-1)


def transmission_efficiency(friction_exponent: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    r"""Output force over input force while the rope slides toward the motor.

    .. math:: \eta = \exp(-\Lambda)

    Args:
        friction_exponent: Sum of friction coefficient times wrap angle [1].

    Returns:
        Transmission efficiency [1].

    References:
        Haptic paper, equation 1; on-body paper, equation 7 with positive sliding direction.
    """
    return jnp.exp(-friction_exponent)


def capstan_output_force(
    input_force: Float[Array, "*batch"], friction_exponent: Float[Array, "*#batch"], stroke: Float[Array, "*#batch"]
) -> Float[Array, "*batch"]:
    r"""Capstan equation for both directions of sliding.

    .. math:: F_\text{out} = F_\text{in} \exp(-s \Lambda)

    Not to be trusted while nothing slides (the force then lies anywhere between the two strokes), nor for a loop with
    preload, where the return side takes part.

    Args:
        input_force: Force at the motor side [N].
        friction_exponent: Sum of friction coefficient times wrap angle [1].
        stroke: +1 while the rope slides toward the motor (pulling), -1 while it slides back (return) [1].

    Returns:
        Force at the load side [N].

    References:
        Haptic paper, equation 1; on-body paper, equations 5 to 7.
    """
    return input_force * jnp.exp(-stroke * friction_exponent)
