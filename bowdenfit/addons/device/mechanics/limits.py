r"""Limits of friction compensation: the largest torque fed forward, and the largest stable and passive feedback gain.

While the rope slides, friction is a constant and the plant is linear: motor and joint on the stiffness K and the damping b_c
of the rope. The controller commands :math:`-K_f T_j - K_i \int T_j` a sample late. NumPy alone, vectorized over draws.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

Number = float | np.ndarray


def moves_by_itself(feed_forward: Number, friction: Number, damping: Number, dead_zone: Number) -> np.ndarray:
    r"""Return whether feeding forward keeps the device going: :math:`F_\text{cst} > T_f + F_m + b\,\delta v`.

    Args:
        feed_forward: F_cst [N m].
        friction: T_f + F_m, dry friction of loop and motor [N m].
        damping: b_m + b_j, with the hand's where it is on [N m s/rad].
        dead_zone: dv [rad/s].
    """
    return np.asarray(feed_forward > friction + damping * dead_zone)


def largest_safe_share(margin: np.ndarray, nominal: np.ndarray, risk: float) -> float:
    """Return the largest c with P(at any bend: c F > T_f + F_m + b dv) of at most a risk.

    Args:
        margin: T_f + F_m + b dv, draws by bends [N m].
        nominal: F that is fed forward at each bend, before the share [N m].
        risk: Such as 0.05.
    """
    return float(np.quantile(np.min(safe_shares(margin, nominal), axis=1), risk, method="lower"))


def safe_shares(margin: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """Return the share of F that each draw tolerates at each bend; infinite where nothing is fed forward."""
    return np.where(nominal > 0, margin / np.maximum(nominal, 1e-300), np.inf)


LARGEST_GAIN, LEAST_GAIN = 1e4, 1e-4  # gains that are looked for: with these, all or none of the friction is left; judgements
_HALVINGS = 17  # of a range of eight decades: to a part in 7000
_ROUNDING = 1e-6  # of a spectral radius: free motion of the whole device is a double 1, which rounding moves by 1.5e-8
_FREQUENCIES = 240  # from 0.001 to 1 of the Nyquist frequency, 80 a decade; a judgement
_IMPEDANCE_ROUNDING = 1e-9  # of an impedance, far more than rounding may take from it; a judgement


DrawNumbers: TypeAlias = float | np.ndarray


@dataclass(frozen=True)
class LinearDevice:
    """The device while the rope slides; numbers or arrays over draws.

    Args:
        stiffness: K [N m/rad].
        rope_damping: b_c [N m s/rad].
        motor_inertia, joint_inertia: J_m and J_j, with the hand's [kg m^2].
        motor_damping, joint_damping: b_m and b_j, with the hand's [N m s/rad].
        hand_stiffness: k_h toward its path [N m/rad].
        sample: T_s [s].
        integral_gain: K_i, which is set [1/s].
    """

    stiffness: DrawNumbers
    rope_damping: DrawNumbers
    motor_inertia: DrawNumbers
    joint_inertia: DrawNumbers
    motor_damping: DrawNumbers
    joint_damping: DrawNumbers
    hand_stiffness: DrawNumbers
    sample: DrawNumbers
    integral_gain: DrawNumbers = 0.0

    def arrays(self) -> tuple[np.ndarray, ...]:
        """Return all quantities, broadcast to one length."""
        return tuple(np.atleast_1d(part) for part in np.broadcast_arrays(*vars(self).values()))


def discretize(device: LinearDevice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A, B and C of the sampled plant: transition of motor and joint angle and speed, input, and T_j."""
    k, c, j_m, j_j, b_m, b_j, k_h, sample, _ = device.arrays()
    zero, one = np.zeros_like(k), np.ones_like(k)
    rows = [
        [zero, one, zero, zero, zero],
        [-k / j_m, -(c + b_m) / j_m, k / j_m, c / j_m, 1 / j_m],
        [zero, zero, zero, one, zero],
        [k / j_j, c / j_j, -(k + k_h) / j_j, -(c + b_j) / j_j, zero],
        [zero] * 5,
    ]
    transition = matrix_exponential(np.stack([np.stack(row, axis=-1) for row in rows], axis=-2) * sample[:, None, None])
    return transition[:, :4, :4], transition[:, :4, 4:], np.stack([k, c, -k, -c], axis=-1)[:, None, :]


def matrix_exponential(matrices: np.ndarray) -> np.ndarray:
    """Return matrix exponentials, by scaling, a Taylor series and squaring."""
    norm = float(np.max(np.abs(matrices).sum(axis=-1), initial=1e-9))
    halvings = max(0, int(np.ceil(np.log2(norm))) + 4)
    scaled = matrices / 2.0**halvings
    term = total = np.broadcast_to(np.eye(matrices.shape[-1]), matrices.shape)
    for order in range(1, 13):
        term = term @ scaled / order
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


def spectral_radius(
    parts: tuple[np.ndarray, np.ndarray, np.ndarray], gain: np.ndarray, integral: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return the spectral radius of the sampled loop: below 1 every oscillation decays.

    Of [[A, B], [-K_f C, 0]] without integral; with it, what adds up is one more state.

    Args:
        parts: A, B and C.
        gain: K_f.
        integral: K_i T_s.
    """
    a, b, c = parts
    n, has_integral = len(a), bool(np.any(integral))
    closed = np.zeros((n, 5 + has_integral, 5 + has_integral))
    closed[:, :4, :4], closed[:, :4, 4:5] = a, b
    closed[:, 4, :4] = -np.reshape(gain + integral, (-1, 1)) * c[:, 0]
    if has_integral:
        closed[:, 4, 5], closed[:, 5, 5], closed[:, 5, :4] = -np.asarray(integral), 1.0, c[:, 0]
    radius: np.ndarray = np.max(np.abs(np.linalg.eigvals(closed)), axis=1)
    return radius


def stable_gain(device: LinearDevice) -> np.ndarray:
    """Return the largest K_f without self-excited oscillation, by draw; `LARGEST_GAIN` if none oscillates."""
    parts, integral = discretize(device), (device.arrays()[8] * device.arrays()[7])
    return _largest_gain(lambda gain: spectral_radius(parts, gain, integral) <= 1 + _ROUNDING, len(parts[0]))


def passive_gain(device: LinearDevice, stable: np.ndarray) -> np.ndarray:
    r"""Largest K_f up to which :math:`\min_\omega \text{Re}\,Z(j\omega) \ge 0`: no passive hand can make it oscillate.

    .. math:: Z = J_j s + b_j + \frac{1}{s} \frac{K + b_c s}{1 + (K + b_c s)(1 + G e^{-1.5 T_s s})/(J_m s^2 + b_m s)},
              \quad G = K_f + \frac{K_i T_s}{1 - e^{-T_s s}}

    The delay is a sample, and half of one for the held command. Dry friction, which only helps, is left out.

    Args:
        device: The device, without a hand.
        stable: Of `stable_gain`; no gain above that is passive.
    """
    k, c, j_m, _, b_m, b_j, _, sample, k_i = (part[:, None] for part in device.arrays())
    s = 1j * np.geomspace(1e-3, 1.0, _FREQUENCIES) * np.pi / sample
    rope, motor = k + c * s, j_m * s**2 + b_m * s
    rope_impedance, fed_back = rope / s, rope / motor * np.exp(-1.5 * sample * s)
    without_gain = 1 + rope / motor + fed_back * k_i * sample / (1 - np.exp(-sample * s))
    # Re Z >= 0 is a quadratic inequality in K_f at each frequency: square K_f^2 + slope K_f + margin >= 0.
    square = b_j * np.abs(fed_back) ** 2
    slope = 2 * b_j * (without_gain * fed_back.conj()).real + (rope_impedance * fed_back.conj()).real
    margin = b_j * np.abs(without_gain) ** 2 + (rope_impedance * without_gain.conj()).real
    margin = margin + _IMPEDANCE_ROUNDING * np.abs(rope_impedance * without_gain)
    discriminant = slope**2 - 4 * square * margin
    crosses = (slope < 0) & (discriminant >= 0)
    root = 2 * margin / np.where(crosses, np.sqrt(np.maximum(discriminant, 0.0)) - slope, 1.0)
    return np.minimum(np.min(np.where(margin < 0, 0.0, np.where(crosses, root, np.inf)), axis=1), stable)


def _largest_gain(holds: Callable[[np.ndarray], np.ndarray], draws: int) -> np.ndarray:
    """Return the largest gain for which a condition holds, by draw, by bisection; 0 if for none, `LARGEST_GAIN` if for all."""
    low, high = np.full(draws, LEAST_GAIN), np.full(draws, LARGEST_GAIN)
    always, never = holds(high), ~holds(low)
    for _ in range(_HALVINGS):
        middle = np.sqrt(low * high)
        good = holds(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return np.where(never, 0.0, np.where(always, high, low))
