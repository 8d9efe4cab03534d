"""Wrap angle against cable length: curves in well-identified coordinates, and in the coordinates that papers print."""

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float


def gaussian_wrap_angle(
    length: Float[Array, "*batch"], A: Float[Array, "*#batch"], B: Float[Array, "*#batch"], C: Float[Array, "*#batch"]
) -> Float[Array, "*batch"]:
    r"""Return the wrap angle of the Gaussian curve as papers print it.

    .. math:: \theta(l) = A \exp\left(-\left(\frac{l - B}{C}\right)^2\right)

    For comparison with printed coefficients only: on data that never reach the peak (A, B, C) is a ridge with
    condition number near 3e4; fit with `log_quadratic_wrap_angle` instead.

    Args:
        length: Cable length [mm].
        A: Wrap angle at the peak [rad].
        B: Length at the peak [mm].
        C: Length over which the angle falls to 1/e of the peak [mm].

    Returns:
        Wrap angle [rad].

    References:
        On-body paper, equation 8.
    """
    return A * jnp.exp(-(((length - B) / C) ** 2))


def log_quadratic_wrap_angle(
    z: Float[Array, "*batch"], a: Float[Array, "*#batch"], b: Float[Array, "*#batch"], c: Float[Array, "*#batch"]
) -> Float[Array, "*batch"]:
    r"""Return the wrap angle of the same Gaussian, centered on the measured range, with nearly uncorrelated coefficients.

    .. math:: \log \theta = a + b z - c z^2, \quad z = \frac{l - l_\text{mid}}{l_\text{half}}, \quad c \ge 0

    At c = 0 the curve is an exponential of the length, which is where data far from the peak may send it.

    Args:
        z: Cable length, 0 in the middle of the measured range and +-1 at its ends [1].
        a: Logarithm of the wrap angle in the middle [log rad].
        b: Slope of that logarithm [1].
        c: Curvature of that logarithm [1].

    Returns:
        Wrap angle [rad].

    References:
        On-body paper, equation 8, in other coordinates.
    """
    return jnp.exp(a + b * z - c * z**2)


def gaussian_coefficients(
    a: Float[Array, "*batch"],
    b: Float[Array, "*batch"],
    c: Float[Array, "*batch"],
    middle: float,
    half_width: float,
) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"], Float[Array, "*batch"]]:
    r"""Return A, B and C of the printed curve from the log-quadratic coefficients.

    .. math::
        C = \frac{l_\text{half}}{\sqrt{c}}, \quad B = l_\text{mid} + l_\text{half}\frac{b}{2c}, \quad
        \log A = a + \frac{b^2}{4c}

    All three go to infinity as c goes to 0; callers must say so instead of printing the number.

    Args:
        a: Logarithm of the wrap angle in the middle [log rad].
        b: Slope [1].
        c: Curvature [1].
        middle: Middle of the measured range [mm].
        half_width: Half the measured range [mm].

    Returns:
        A [rad], B [mm], C [mm].
    """
    return jnp.exp(a + b**2 / (4 * c)), middle + half_width * b / (2 * c), half_width / jnp.sqrt(c)


def log_quadratic_coefficients(
    A: Float[Array, "*batch"],
    B: Float[Array, "*batch"],
    C: Float[Array, "*batch"],
    middle: float,
    half_width: float,
) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"], Float[Array, "*batch"]]:
    """Return a, b and c from printed A [rad], B [mm], C [mm]: the inverse of `gaussian_coefficients`."""
    c = (half_width / C) ** 2
    b = 2 * c * (B - middle) / half_width
    return jnp.log(A) - b**2 / (4 * c), b, c


def line_wrap_angle(
    z: Float[Array, "*batch"], start: Float[Array, "*#batch"], end: Float[Array, "*#batch"]
) -> Float[Array, "*batch"]:
    r"""Return the wrap angle on a straight line between the ends of the measured range; at least 0.

    .. math:: \theta = \frac{1 - z}{2} \theta_\text{start} + \frac{1 + z}{2} \theta_\text{end}

    Args:
        z: Cable length, -1 and +1 at the ends of the measured range [1].
        start: Wrap angle at z = -1, not negative [rad].
        end: Wrap angle at z = +1, not negative [rad].

    Returns:
        Wrap angle [rad].
    """
    return jnp.maximum((1 - z) / 2 * start + (1 + z) / 2 * end, 0.0)


def logistic_wrap_angle(
    z: Float[Array, "*batch"], a: Float[Array, "*#batch"], k: Float[Array, "*#batch"], s: Float[Array, "*#batch"]
) -> Float[Array, "*batch"]:
    r"""Return the wrap angle of a rise (with k < 0, a fall) between 0 and a plateau.

    .. math:: \theta = \frac{e^a}{s + (1 - s) e^{-k z}}

    At s = 0 the curve is an exponential of the length, at s = 1 or k = 0 constant. It stays finite however steep it is.

    Args:
        z: Cable length, 0 in the middle of the measured range and +-1 at its ends [1].
        a: Logarithm of the wrap angle in the middle [log rad].
        k: Steepness: slope of the logarithm of the angle far from the plateau [1].
        s: Share of the plateau that is reached in the middle, 0 to 1 [1].

    Returns:
        Wrap angle [rad].

    References:
        P. F. Verhulst, Notice sur la loi que la population suit dans son accroissement (1838), in other coordinates.
    """
    return jnp.exp(a) / (s + (1 - s) * jnp.exp(-k * z))


def logistic_coefficients(
    a: Float[Array, "*batch"],
    k: Float[Array, "*batch"],
    s: Float[Array, "*batch"],
    middle: float,
    half_width: float,
) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"], Float[Array, "*batch"]]:
    r"""Return A, B and C of :math:`A / (1 + e^{-(l - B)/C})` from the coefficients of `logistic_wrap_angle`.

    .. math::
        A = \frac{e^a}{s}, \quad B = l_\text{mid} + \frac{l_\text{half}}{k} \log\frac{1 - s}{s}, \quad
        C = \frac{l_\text{half}}{k}

    A and B go to infinity as s goes to 0; callers must say so instead of printing the number.

    Args:
        a: Logarithm of the wrap angle in the middle [log rad].
        k: Steepness [1].
        s: Share of the plateau that is reached in the middle [1].
        middle: Middle of the measured range [mm].
        half_width: Half the measured range [mm].

    Returns:
        A [rad], B [mm], C [mm].
    """
    return jnp.exp(a) / s, middle + half_width / k * jnp.log((1 - s) / s), half_width / k
