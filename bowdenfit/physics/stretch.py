"""How a rope stretches under load, and what bending its sheath does to its preload."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

_SMALL_EXPONENT = 1e-4  # below, four terms of the series of the mean tension leave x^4/120, less than double precision
_NOTHING_LEFT = 1e-30  # least share of the peak load, and least friction exponent; keeps logarithms and ratios finite
_ITERATIONS = 2  # of Fritsch's method, which is of fourth order: each has four times the digits of the one before
# Places and weights of Gauss's quadrature along a rope. At an exponent of 1.5 it is off by 2e-6 of the bedding-in stretch, and
# the extension under the mean tension by 5 % of it (calculation: tests/physics/test_stretch.py).
_PLACES, _WEIGHTS = ((x + shift) / 2 for x, shift in zip(np.polynomial.legendre.leggauss(4), (1.0, 0.0), strict=True))
_POLISHES = 2  # Newton steps, each with twice the digits; they take back what cancels in a + w


def extension(
    tension: Float[Array, "*batch"],
    stiffness: Float[Array, "*#batch"],
    bedding_stretch: Float[Array, "*#batch"],
    bedding_load: Float[Array, "*#batch"],
) -> Float[Array, "*batch"]:
    r"""Return the extension of a rope: linear, and at low load the strands bedding in.

    .. math:: e(T) = \frac{T}{k} + d \left(1 - e^{-T/T_c}\right)

    Not valid for a rope that has not been loaded before, whose first bedding-in is not reversible.

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
    r"""Return the derivative of `extension` by the tension [mm/N], :math:`1/k + (d/T_c) e^{-T/T_c}`."""
    return 1 / stiffness + bedding_stretch / bedding_load * jnp.exp(-tension / bedding_load)


def extension_along(
    mean: Float[Array, "*batch"], friction_exponent: Float[Array, "*#batch"], rope: tuple[Array, Array, Array]
) -> Float[Array, "*batch"]:
    r"""Return the extension of a rope that slides, along which tension changes exponentially, by its mean tension.

    .. math:: \int_0^1 e\left(F e^{-\Lambda s}\right) ds , \qquad F = \bar T \frac{\Lambda}{1 - e^{-\Lambda}}

    which is below :math:`e(\bar T)` of a rope that beds in, and the same of a linear one.

    Args:
        mean: Mean tension [N]; that at the end is `mean` over `mean_tension` of 1 N.
        friction_exponent: Lambda; either sign gives the same [1].
        rope: Stiffness [N/mm], bedding-in stretch [mm] and bedding-in load [N], as of `extension`.

    Returns:
        Extension [mm].
    """
    stiffness, stretch, load = rope
    bedded = sum(w * jnp.expm1(-mean * share / load) for w, share in _shares_along(friction_exponent))
    return mean / stiffness - stretch * bedded


def compliance_along(
    mean: Float[Array, "*batch"], friction_exponent: Float[Array, "*#batch"], rope: tuple[Array, Array, Array]
) -> Float[Array, "*batch"]:
    """Return the derivative of `extension_along` by the mean tension [mm/N]."""
    stiffness, stretch, load = rope
    softer = sum(w * share * jnp.exp(-mean * share / load) for w, share in _shares_along(friction_exponent))
    return 1 / stiffness + stretch / load * softer


def _shares_along(friction_exponent: Array) -> list[tuple[float, Array]]:
    """Return weights of places along a rope, and the tension there over the mean."""
    of_end = mean_tension(jnp.ones_like(friction_exponent), friction_exponent)
    return [(float(w), jnp.exp(-friction_exponent * s) / of_end) for w, s in zip(_WEIGHTS, _PLACES, strict=True)]


def bedded_share(
    force: Float[Array, "*batch"],
    peak_force: Float[Array, "*#batch"],
    friction_exponent: Float[Array, "*#batch"],
    bedding_load: Float[Array, "*#batch"],
) -> Float[Array, "*batch"]:
    r"""Return which share of its bedding-in stretch a rope with `mean_tension_unloading` has taken up, averaged along it [1].

    Up to :math:`x^*` tension grows from the loaded end, and beyond it falls: each part is integrated by itself.

    Args:
        force: F, load now [N].
        peak_force: F_peak, the largest load before [N].
        friction_exponent: Lambda of the whole rope [1].
        bedding_load: T_c [N].
    """
    peak = jnp.maximum(peak_force, force)
    ratio = jnp.where(force > 0, peak / jnp.where(force > 0, force, 1.0), 1e30)
    safe = jnp.where(friction_exponent > 0, friction_exponent, 1.0)
    turned = jnp.clip(0.5 * jnp.log(jnp.minimum(ratio, 1e30)) / safe, 0.0, 1.0)
    share = jnp.zeros_like(peak * friction_exponent)
    for w, s in zip(_WEIGHTS, _PLACES, strict=True):
        released = force * jnp.exp(friction_exponent * turned * s)
        held = peak * jnp.exp(-friction_exponent * (turned + (1 - turned) * s))
        share -= w * (turned * jnp.expm1(-released / bedding_load) + (1 - turned) * jnp.expm1(-held / bedding_load))
    return share


@jax.custom_jvp
def tension_from_extension(
    extended: Float[Array, "*batch"],
    stiffness: Float[Array, "*#batch"],
    bedding_stretch: Float[Array, "*#batch"],
    bedding_load: Float[Array, "*#batch"],
) -> Float[Array, "*batch"]:
    r"""Return the tension of an extended rope, the inverse of `extension`; 0 where the rope is slack.

    With :math:`a = k(e - d)/T_c` and :math:`L = \log(kd/T_c) - a` the root is :math:`T = T_c (a + w)`,
    :math:`w + \log w = L` (Lambert's function), found by Fritsch's iteration of fourth order and polished on e(T) itself.
    Derivatives are those of the implicit function, not of the iterations.

    Args:
        extended: e [mm].
        stiffness: k [N/mm].
        bedding_stretch: d [mm].
        bedding_load: T_c [N].

    Returns:
        Tension [N].

    References:
        Fritsch, Shafer and Crowley, Algorithm 443, Communications of the ACM 16 (1973), 123.
    """
    e = jnp.maximum(extended, 0.0)
    ratio = stiffness / bedding_load
    a = ratio * (e - bedding_stretch)
    log_w = jnp.log(jnp.maximum(ratio * bedding_stretch, 1e-300)) - a
    large = log_w > 1.0
    small = jnp.exp(jnp.minimum(log_w, 1.0))
    w = jnp.where(large, log_w - jnp.log(jnp.where(large, log_w, 2.0)), small / (1 + 0.63 * small))
    w = jnp.maximum(w, 1e-300)
    for _ in range(_ITERATIONS):
        residual = log_w - jnp.log(w) - w
        q = 2 * (1 + w) * (1 + w + 2 * residual / 3)
        w = jnp.maximum(w * (1 + residual / (1 + w) * (q - residual) / (q - 2 * residual)), 1e-300)
    tension = jnp.clip(bedding_load * (a + w), 0.0, stiffness * e)
    for _ in range(_POLISHES):
        missing = e - extension(tension, stiffness, bedding_stretch, bedding_load)
        tension = tension + missing / compliance(tension, stiffness, bedding_stretch, bedding_load)
    return jnp.maximum(tension, 0.0)


@tension_from_extension.defjvp
def _implicit(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Array, Array]:
    """Return the implicit function's derivative: what e(T; k, d, T_c) lacks of the wanted extension, over its slope."""
    extended, *rope = primals
    tension = tension_from_extension(extended, *rope)
    _, by_rope = jax.jvp(lambda *at: extension(tension, *at), tuple(rope), tuple(tangents[1:]))
    step = (tangents[0] - by_rope) / compliance(tension, *rope)
    return tension, jnp.where(jnp.broadcast_to(extended > 0, tension.shape), step, 0.0)


def stiffness_with_springs(
    stiffness: Float[Array, "*batch"], spring: Float[Array, "*#batch"], sides: int
) -> Float[Array, "*batch"]:
    r"""Return the stiffness of a cable whose ropes each have a spring in series.

    .. math:: \frac 1 K = \frac 1{K_\text{cable}} + \frac 1{n k_\text{spring}}

    with the n = 2 ropes of a taut loop side by side, which both give; in torques, both sides times :math:`r^2`.

    Args:
        stiffness: Stiffness of the cable, all ropes together [N/mm].
        spring: k_spring, of each of the springs [N/mm].
        sides: n, ropes that are taut, 1 or 2.

    Returns:
        Stiffness [N/mm].

    References:
        Haptic paper, section 5 (springs that keep the preload lower the stiffness).
    """
    return 1 / (1 / stiffness + 1 / (sides * spring))


def mean_tension(force: Float[Array, "*batch"], friction_exponent: Float[Array, "*#batch"]) -> Float[Array, "*batch"]:
    r"""Return the tension averaged along a rope that slides toward the force on its end.

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
    r"""Return the mean tension of a rope, fixed at its far end, whose load was once larger and now decreases.

    From the loaded end on the rope slides back, and tension grows along it as :math:`F e^{\Lambda x}`, until it meets the
    tension :math:`F_\text{peak} e^{-\Lambda x}` that friction still holds from the peak, at
    :math:`x^* = \log(F_\text{peak}/F)/(2\Lambda)`:

    .. math:: \bar T = F_\text{peak} \frac{1 - e^{-\Lambda}}{\Lambda}
              - \frac{(\sqrt{F_\text{peak}} - \sqrt F)^2}{\Lambda} \quad (x^* < 1),
              \qquad \bar T = F \frac{e^\Lambda - 1}{\Lambda} \quad (x^* \ge 1)

    Args:
        force: F, load now [N].
        peak_force: F_peak, the largest load before [N]; with the load itself it is `mean_tension`.
        friction_exponent: Lambda of the whole rope [1].

    Returns:
        Mean tension [N].
    """
    unit = jnp.ones_like(friction_exponent)
    shares = mean_tension(unit, friction_exponent), mean_tension(unit, -friction_exponent)
    return mean_tension_from_shares(force, peak_force, friction_exponent, *shares)


def mean_tension_from_shares(
    force: Float[Array, "*batch"],
    peak_force: Float[Array, "*#batch"],
    friction_exponent: Float[Array, "*#batch"],
    loading_share: Float[Array, "*#batch"],
    unloading_share: Float[Array, "*#batch"],
) -> Float[Array, "*batch"]:
    """Return `mean_tension_unloading` from the mean tension per end tension for both ways of sliding.

    Args:
        force: Load now [N].
        peak_force: The largest load before [N].
        friction_exponent: Lambda of the whole rope [1].
        loading_share: Mean tension under 1 N while the load grows [1].
        unloading_share: Mean tension under 1 N once all of the rope slides back [1].
    """
    peak = jnp.maximum(peak_force, force)
    ratio = jnp.where(force > 0, peak / jnp.where(force > 0, force, 1.0), jnp.inf)
    partly = 0.5 * jnp.log(jnp.minimum(ratio, 1e30)) <= friction_exponent
    # A load of 0 is never in this part; 1 in its place keeps the derivative of its root finite.
    held, now = jnp.sqrt(jnp.where(peak > 0, peak, 1.0)), jnp.sqrt(jnp.where(force > 0, force, 1.0))
    released = (held - now) ** 2 / jnp.where(friction_exponent > 0, friction_exponent, 1.0)
    return jnp.where(partly, peak * loading_share - released, force * unloading_share)


def preload_at(
    wrap_angle: Float[Array, "*batch"],
    reference_preload: Float[Array, "*#batch"],
    reference_angle: Float[Array, "*#batch"],
    lengthening: Float[Array, "*#batch"],
    stiffness: Float[Array, "*#batch"],
    bedding_stretch: Float[Array, "*#batch"],
    bedding_load: Float[Array, "*#batch"],
) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"]]:
    r"""Return the preload between fixed ends when bending lengthens the sheath's center line, and the slack if there is any.

    .. math:: e(P(\theta)) = e(P_0) + g (\theta - \theta_0)

    and where the right side is negative P = 0 and its size is the slack.

    With preload springs the preload is constant and this does not apply.

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
