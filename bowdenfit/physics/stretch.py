"""How a rope stretches under load, and what bending its sheath does to its preload."""

from typing import Any

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

_SMALL_EXPONENT = 1e-4  # below this the mean tension is better computed from its series
_NOTHING_LEFT = 1e-30  # a share of the peak load, and a friction exponent, that are as good as none
_ITERATIONS = 8  # of Newton's method; six give all digits over the whole range
_POLISHES = 2


def extension(
    tension: Float[Array, "*batch"],
    stiffness: Float[Array, "*#batch"],
    bedding_stretch: Float[Array, "*#batch"],
    bedding_load: Float[Array, "*#batch"],
) -> Float[Array, "*batch"]:
    r"""Extension of a rope: linear, and at low load the strands bedding in.

    .. math:: e(T) = \frac{T}{k} + d \left(1 - e^{-T/T_c}\right)

    Not for a rope that has not been loaded before, whose first bedding-in does not come back.

    Args:
        tension: T [N].
        stiffness: k, stiffness once the rope has bedded in [N/mm].
        bedding_stretch: d, what bedding in takes up [mm].
        bedding_load: T_c, the load over which it does [N].

    Returns:
        Extension [mm].

    References:
        Haptic paper, section 2.2 and figure 4 (stiffness is low at low load).
    """
    return tension / stiffness - bedding_stretch * jnp.expm1(-tension / bedding_load)


def compliance(
    tension: Float[Array, "*batch"],
    stiffness: Float[Array, "*#batch"],
    bedding_stretch: Float[Array, "*#batch"],
    bedding_load: Float[Array, "*#batch"],
) -> Float[Array, "*batch"]:
    r"""Derivative of `extension` by the tension [mm/N], :math:`1/k + (d/T_c) e^{-T/T_c}`."""
    return 1 / stiffness + bedding_stretch / bedding_load * jnp.exp(-tension / bedding_load)


@jax.custom_jvp
def tension_from_extension(
    extended: Float[Array, "*batch"],
    stiffness: Float[Array, "*#batch"],
    bedding_stretch: Float[Array, "*#batch"],
    bedding_load: Float[Array, "*#batch"],
) -> Float[Array, "*batch"]:
    r"""Inverse of `extension`: the tension of a rope that is extended so far; 0 where it is not extended, but slack.

    With :math:`a = k(e - d)/T_c` and :math:`L = \log(kd/T_c) - a` the root is :math:`T = T_c (a + w)`,
    :math:`w + \log w = L` (Lambert's function), found by Newton's method on that and polished on e(T) itself.
    Derivatives are those of the implicit function, not of the iterations.

    Args:
        extended: e [mm].
        stiffness: k [N/mm].
        bedding_stretch: d [mm].
        bedding_load: T_c [N].

    Returns:
        Tension [N].
    """
    e = jnp.maximum(extended, 0.0)
    ratio = stiffness / bedding_load
    a = ratio * (e - bedding_stretch)
    log_w = jnp.log(jnp.maximum(ratio * bedding_stretch, 1e-300)) - a
    large = log_w > 1.0
    w = jnp.where(large, log_w - jnp.log(jnp.where(large, log_w, 2.0)), jnp.exp(jnp.minimum(log_w, 1.0)))
    w = jnp.maximum(w, 1e-300)
    for _ in range(_ITERATIONS):
        w = jnp.maximum(w * (1 + log_w - jnp.log(w)) / (1 + w), 1e-300)
    tension = jnp.clip(bedding_load * (a + w), 0.0, stiffness * e)
    for _ in range(_POLISHES):
        missing = e - extension(tension, stiffness, bedding_stretch, bedding_load)
        tension = tension + missing / compliance(tension, stiffness, bedding_stretch, bedding_load)
    return jnp.maximum(tension, 0.0)


@tension_from_extension.defjvp
def _implicit(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Array, Array]:
    """The implicit function's derivative: what e(T; k, d, T_c) lacks of the wanted extension, over its slope."""
    extended, *rope = primals
    tension = tension_from_extension(extended, *rope)
    _, by_rope = jax.jvp(lambda *at: extension(tension, *at), tuple(rope), tuple(tangents[1:]))
    step = (tangents[0] - by_rope) / compliance(tension, *rope)
    return tension, jnp.where(jnp.broadcast_to(extended > 0, tension.shape), step, 0.0)


def mean_tension(force: Float[Array, "*batch"], friction_exponent: Float[Array, "*#batch"]) -> Float[Array, "*batch"]:
    r"""Tension averaged along a rope that slides toward the force on its end.

    .. math:: \bar T = F \frac{1 - e^{-\Lambda}}{\Lambda}

    A negative exponent is a rope that slides the other way, along which tension grows with the distance from this end.

    Args:
        force: F, tension at the end [N].
        friction_exponent: Lambda [1].

    Returns:
        Mean tension [N].

    References:
        Haptic paper, equation 1, integrated along the wrap angle.
    """
    x = friction_exponent
    small = jnp.abs(x) < _SMALL_EXPONENT
    safe = jnp.where(small, 1.0, x)
    return force * jnp.where(small, 1 - x / 2 * (1 - x / 3 * (1 - x / 4)), -jnp.expm1(-safe) / safe)


def mean_tension_unloading(
    force: Float[Array, "*batch"], peak_force: Float[Array, "*#batch"], friction_exponent: Float[Array, "*#batch"]
) -> Float[Array, "*batch"]:
    r"""Mean tension of a rope, fixed at its far end, whose load was once larger and comes down.

    From the loaded end on the rope slides back, and tension grows along it as :math:`F e^{\Lambda x}`, until it meets the
    tension :math:`F_\text{peak} e^{-\Lambda x}` that friction still holds from the peak, at
    :math:`x^* = \log(F_\text{peak}/F)/(2\Lambda)`:

    .. math:: \bar T = \frac{2\sqrt{F F_\text{peak}} - F - F_\text{peak} e^{-\Lambda}}{\Lambda} \quad (x^* < 1),
              \qquad \bar T = F \frac{e^\Lambda - 1}{\Lambda} \quad (x^* \ge 1)

    Args:
        force: F, load now [N].
        peak_force: F_peak, the largest load before [N].
        friction_exponent: Lambda of the whole rope [1].

    Returns:
        Mean tension [N].
    """
    peak = jnp.maximum(peak_force, force)
    some = force > _NOTHING_LEFT * peak
    reach = 0.5 * jnp.log(jnp.where(some, peak / jnp.where(some, force, 1.0), 1 / _NOTHING_LEFT))
    # In terms of the share of the rope that has slid back nothing cancels where friction is small.
    share = jnp.minimum(reach / jnp.maximum(friction_exponent, _NOTHING_LEFT), 1.0)
    slid = friction_exponent * share
    held = mean_tension(peak * jnp.exp(-slid), friction_exponent - slid)
    return share * mean_tension(force, -slid) + (1 - share) * held


def preload_at(
    wrap_angle: Float[Array, "*batch"],
    reference_preload: Float[Array, "*#batch"],
    reference_angle: Float[Array, "*#batch"],
    lengthening: Float[Array, "*#batch"],
    stiffness: Float[Array, "*#batch"],
    bedding_stretch: Float[Array, "*#batch"],
    bedding_load: Float[Array, "*#batch"],
) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"]]:
    r"""Preload between fixed ends when bending lengthens the sheath's center line, and the slack where there is none.

    .. math:: e(P(\theta)) = e(P_0) + g (\theta - \theta_0)

    and where the right side is negative P = 0 and its size is the slack.

    With preload springs the preload is constant, and this does not apply.

    Args:
        wrap_angle: theta [rad].
        reference_preload: P_0, the preload at theta_0 [N].
        reference_angle: theta_0 [rad].
        lengthening: g, by how much a radian lengthens the center line [mm/rad].
        stiffness: k [N/mm].
        bedding_stretch: d [mm].
        bedding_load: T_c [N].

    Returns:
        Preload [N], and slack [mm].

    References:
        Haptic paper, section 2.2 and figure 4 (its negative stretch is slack).
    """
    rope = (stiffness, bedding_stretch, bedding_load)
    reference = jnp.broadcast_to(reference_preload, wrap_angle.shape)
    extended = extension(reference, *rope) + lengthening * (wrap_angle - reference_angle)
    return tension_from_extension(extended, *rope), jnp.maximum(-extended, 0.0)
