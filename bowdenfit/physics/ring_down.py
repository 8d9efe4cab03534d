"""A bar on a spring, with damping and dry friction, released from rest: its free vibration, exactly."""

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float, Int

_LEAST = 1e-12  # of |1 - zeta^2|, where damping is nearly critical: a swing there leaves exp(-pi/1e-6), which is 0


def compute_peaks(
    amplitude: Float[Array, "*runs"],
    decay: Float[Array, "*runs"],
    held: Float[Array, "*runs"],
    number: int,
) -> Float[Array, "swings *runs"]:
    r"""Return the starts of half swings, measured from the rest position of the spring.

    .. math:: |x_{n + 1}| = \rho (|x_n| - f) - f

    on the other side, while :math:`|x_n| > f`; else the bar stays. Without damping (rho = 1) each half swing loses 2 f.

    Args:
        amplitude: x_0, where it is released, of either sign [rad].
        decay: rho, of a half swing by damping alone [1].
        held: f = F/K, how far dry friction can hold the bar from the rest position [rad].
        number: Number of half swings.

    Returns:
        x_0 and the positions after each half swing but the last [rad].
    """

    def swing(x: Array, _: None) -> tuple[Array, Array]:
        other = -jnp.sign(x) * (decay * (jnp.abs(x) - held) - held)
        return jnp.where(jnp.abs(x) > held, other, x), x

    start = jnp.broadcast_to(amplitude, jnp.broadcast_shapes(amplitude.shape, decay.shape, held.shape))
    return jax.lax.scan(swing, start, None, number)[1]


def ring_down(
    time: Float[Array, " rows"],
    run: Int[Array, " rows"],
    amplitude: Float[Array, " runs"],
    inertia: Float[Array, " runs"],
    stiffness: Float[Array, ""],
    damping: Float[Array, ""],
    friction: Float[Array, ""],
    swings: int,
) -> tuple[Float[Array, " rows"], Float[Array, " rows"]]:
    r"""Return angle and speed of a bar after its release.

    .. math:: J \ddot x + b \dot x + K x + F \operatorname{sign} \dot x = 0, \qquad x(0) = x_0,\ \dot x(0) = 0

    From one reversal to the next friction is constant and shifts the rest position by F/K against the motion: half a period of
    a damped oscillation about that position. The motion ends where the spring cannot overcome friction any more.

    Args:
        time: Since the release; before it the bar stands still [s].
        run: Number of the run of each row.
        amplitude: x_0 of each run [rad].
        inertia: J of each run [kg m^2].
        stiffness: K [N m/rad].
        damping: b [N m s/rad].
        friction: F [N m].
        swings: Half swings that are followed; the bar stays where it is after the last.

    Returns:
        Angle from where the spring is at rest [rad], and speed [rad/s].

    References:
        Den Hartog, Mechanical Vibrations, section 8.3 (2 F/k a half swing); haptic paper, section 2 (torque, inertia and
        stiffness of the device).
    """
    omega = jnp.sqrt(stiffness / inertia)
    zeta = damping / (2 * jnp.sqrt(stiffness * inertia))
    left = 1 - zeta**2
    root = jnp.sqrt(jnp.maximum(jnp.abs(left), _LEAST))
    swinging = left > _LEAST
    half = jnp.where(swinging, jnp.pi / (omega * root), jnp.inf)
    decay = jnp.where(swinging, jnp.exp(-jnp.pi * zeta / root), 0.0)
    held = friction / stiffness
    peak_angles = compute_peaks(amplitude, decay, held * jnp.ones_like(decay), swings + 1)
    since = jnp.maximum(time, 0.0)
    passed = jnp.where(jnp.isinf(half[run]), 0.0, since / jnp.where(jnp.isinf(half[run]), 1.0, half[run]))
    number = jnp.minimum(jnp.floor(passed), swings).astype(int)
    peak = peak_angles[number, run]
    moves = (jnp.abs(peak) > held) & (number < swings)
    center = jnp.sign(peak) * held
    y = jnp.where(moves, peak - center, 0.0)
    within = since - jnp.where(jnp.isinf(half[run]), 0.0, number * jnp.where(jnp.isinf(half[run]), 0.0, half[run]))
    fade, phase = jnp.exp(-zeta[run] * omega[run] * within), omega[run] * root[run] * within
    grow = jnp.minimum(phase, 300.0)  # of the branch beyond critical damping, whose product with the fading is small
    wave = jnp.where(swinging[run], jnp.cos(phase), jnp.cosh(grow)), jnp.where(swinging[run], jnp.sin(phase), jnp.sinh(grow))
    moved = y * fade * (wave[0] + zeta[run] / root[run] * wave[1])
    speed = -y * fade * omega[run] / root[run] * wave[1]
    return jnp.where(moves, center + moved, peak), speed
