"""Friction along a Bowden cable: how force is lost, and how the output stands still when the motor reverses."""

from typing import Any

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

_SMALL_EXPONENT = 1e-6  # below, three terms of the series in p are exact to the last digit
_NOTHING_LEFT = 1e-9  # least u^p that is left where friction would hold more than the whole force; keeps its log finite


def friction_exponent(
    friction_coefficient: Float[Array, "*batch contacts"], wrap_angle: Float[Array, "*batch contacts"]
) -> Float[Array, "*batch"]:
    r"""Return the sum of friction coefficient times wrap angle over the contacts in series.

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
    r"""Return the output force over input force while the rope slides toward the motor.

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
    r"""Return the output force by the capstan equation, for both directions of sliding.

    .. math:: F_\text{out} = F_\text{in} \exp(-s \Lambda)

    Not valid while nothing slides (the force then lies anywhere between the two strokes), nor for a loop with
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


def force_scale(
    force: Float[Array, "*batch"],
    load_exponent: Float[Array, ""],
    drag: Float[Array, ""],
    reference_force: float,
) -> Float[Array, "*batch"]:
    r"""Transform force to a scale on which friction is a shift by :math:`\Lambda`, whatever the load.

    .. math:: g(F) = \frac{u^p - 1}{p}, \quad u = \frac{F + D}{F_\text{ref}}, \quad g \to \log u \text{ as } p \to 0

    p = 0 and D = 0 is the capstan equation; p = 1 a constant friction force; D > 0 a part of the tension that the load
    cells do not show (adhesion, seals, bending stiffness, or a preload tared away).

    Args:
        force: Force at one end [N].
        load_exponent: p, how friction falls with the load, mu(F) = mu (F/F_ref)^-p, from 0 to 1 [1].
        drag: D [N].
        reference_force: F_ref, the force at which mu has its stated value [N].

    Returns:
        g(F) [1].
    """
    log_u = jnp.log((force + drag) / reference_force)
    small = load_exponent < _SMALL_EXPONENT
    p = jnp.where(small, 1.0, load_exponent)
    series = log_u * (1 + load_exponent * log_u / 2 * (1 + load_exponent * log_u / 3))
    return jnp.where(small, series, jnp.expm1(p * log_u) / p)


def force_from_scale(
    scaled: Float[Array, "*batch"],
    load_exponent: Float[Array, ""],
    drag: Float[Array, ""],
    reference_force: float,
) -> Float[Array, "*batch"]:
    """Return the force [N] at a value of g: the inverse of `force_scale`.

    Where friction would hold more than the whole force, the result is nearly zero minus the drag.
    """
    small = load_exponent < _SMALL_EXPONENT
    p = jnp.where(small, 1.0, load_exponent)
    series = scaled * (1 - load_exponent * scaled * (1 / 2 - load_exponent * scaled / 3))
    log_u = jnp.where(small, series, jnp.log1p(jnp.maximum(p * scaled, _NOTHING_LEFT - 1)) / p)
    return reference_force * jnp.exp(log_u) - drag


def force_scale_slope(
    force: Float[Array, "*batch"],
    load_exponent: Float[Array, ""],
    drag: Float[Array, ""],
    reference_force: float,
) -> Float[Array, "*batch"]:
    r"""Return the derivative of `force_scale` by the force [1/N], :math:`u^{p - 1}/F_\text{ref}`."""
    u = (force + drag) / reference_force
    return u ** (load_exponent - 1) / reference_force


def rate_factor(
    speed: Float[Array, "*batch"],
    stribeck: Float[Array, ""],
    stribeck_speed: Float[Array, ""],
    viscous: Float[Array, ""],
) -> Float[Array, "*batch"]:
    r"""Return the speed dependence of friction: more at low speed (Stribeck), and a part proportional to speed.

    .. math:: \frac{\mu(v)}{\mu} = 1 + a \exp\left(-\left(\frac{v}{v_s}\right)^2\right) + c |v|

    Args:
        speed: v, of either sign, in any unit.
        stribeck: a [1].
        stribeck_speed: v_s, in the unit of v.
        viscous: c, in one over the unit of v.

    Returns:
        Factor on every friction coefficient [1].
    """
    return 1 + stribeck * jnp.exp(-((speed / stribeck_speed) ** 2)) + viscous * jnp.abs(speed)


def rate_slope(
    speed: Float[Array, "*batch"],
    stribeck: Float[Array, ""],
    stribeck_speed: Float[Array, ""],
    viscous: Float[Array, ""],
) -> Float[Array, "*batch"]:
    r"""Return the derivative of `rate_factor` by the speed; where it is negative, a rope pulling a spring sticks and slips.

    .. math:: \frac{1}{\mu} \frac{d\mu}{dv} = -\frac{2 a v}{v_s^2} \exp\left(-\left(\frac{v}{v_s}\right)^2\right) + c

    Args:
        speed: v, above 0, in any unit.
        stribeck: a [1].
        stribeck_speed: v_s, in the unit of v.
        viscous: c, in one over the unit of v.

    Returns:
        Slope, in one over the unit of v.
    """
    u = speed / stribeck_speed
    return -2 * stribeck * u / stribeck_speed * jnp.exp(-(u**2)) + viscous


def play_operator(
    low: Float[Array, "time *batch"],
    high: Float[Array, "time *batch"],
    start: Float[Array, "*batch"],
    slopes: tuple[Float[Array, "time *batch"], Float[Array, "time *batch"]] | None = None,
    restart: Float[Array, "time *batch"] | None = None,
) -> tuple[Float[Array, "time *batch"], Float[Array, "time *batch"]]:
    r"""Return the output of a quasi-static rope that stands still between two limits, and its derivative by Lambda.

    .. math:: y_t = \text{clip}(y_{t-1},\ f_-(x_t),\ f_+(x_t))

    For a single rope the limits are :math:`x \mp \Lambda` on the scale g on which friction is a shift, x = g(F_in) and
    y = g(F_out): while pulling the output follows at :math:`x - \Lambda`, on the return at :math:`x + \Lambda`, and in
    between it stands still, however the input moves inside the band. It remembers noise peaks of the input as if the rope
    had moved: average recordings down to the mechanical bandwidth first, and smooth the input as in
    `bowdenfit.recordings.preparation.hysteresis`.

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
