r"""Normal and Student t distribution functions that are safe to differentiate far out in the tails.

For Student's t an even number :math:`\nu = 2m` makes the distribution function elementary. With :math:`q = -x/\sqrt{\nu +
x^2}`,

.. math:: T(x) = \frac{(1 - q)^m S(q)}{2 S(0)}, \qquad
          S(q) = \sum_{k=0}^{m-1} \frac{(1 + q)^{m-1-k} (1 - q)^k}{(m-1-k)!\,(m+k)!}

which is :math:`\int_q^1 (1 - t^2)^{m-1} dt` by parts, up to its constant. Every term is positive, so that no digits cancel.
The incomplete beta function, of which this is a case, costs a hundred times as much.
"""

from math import factorial, lgamma, log, pi

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

_SMALL = 1e-3  # below, five terms of the series of log(1 + s)/s are exact to double precision
_NEGLIGIBLE = -40.0  # log of a probability too small to change 1 in double precision
_FAR = -30.0  # below, five terms of the series of the tail are exact to 2e-12, of a logarithm that is -450
_NEAR_1 = 3.0  # above, six terms of the series of log(1 - p) are exact, and 1 - p is not


def log_student_density(x: Float[Array, "*batch"], freedom: int) -> Float[Array, "*batch"]:
    r"""Return the log of the standard t density, :math:`-\frac{\nu+1}{2}\log(1 + x^2/\nu)` plus its constant.

    Args:
        x: Standardized deviation [1].
        freedom: Degrees of freedom nu.
    """
    constant = lgamma((freedom + 1) / 2) - lgamma(freedom / 2) - log(freedom * pi) / 2
    return constant - (freedom + 1) / 2 * jnp.log1p(x**2 / freedom)


def log_student_cdf(x: Float[Array, "*batch"], freedom: int) -> Float[Array, "*batch"]:
    """Return the log of the standard t distribution function, to full precision in both tails.

    Args:
        x: Standardized deviation [1].
        freedom: Degrees of freedom, even.

    Returns:
        Logarithm of the probability of a smaller deviation.
    """
    above = x > 0
    beyond = _log_lower_tail(jnp.where(above, -x, -1.0), freedom)
    return jnp.where(above, jnp.log1p(-jnp.exp(beyond)), _log_lower_tail(jnp.where(above, 0.0, x), freedom))


def _log_lower_tail(x: Float[Array, "*batch"], freedom: int) -> Float[Array, "*batch"]:
    """Return the log of the distribution function where x is not positive."""
    m = freedom // 2
    coefficients = [1 / (factorial(m - 1 - k) * factorial(m + k)) for k in reversed(range(m))]
    square = freedom + x**2
    q = -x / jnp.sqrt(square)
    less = freedom / square / (1 + q)  # 1 - q
    series = jnp.polyval(jnp.array([c / sum(coefficients) for c in coefficients]), less / (1 + q))
    return -m * jnp.log1p(x**2 / freedom) - jnp.log1p(q) + jnp.log(series) - log(2)


def student_residual(x: Float[Array, "*batch"], freedom: int) -> Float[Array, "*batch"]:
    r"""Return the residual whose half square is minus the log density, up to a constant.

    .. math:: r = x \sqrt{(\nu + 1) \frac{\log(1 + x^2/\nu)}{x^2}}

    Args:
        x: Standardized deviation [1].
        freedom: Degrees of freedom nu.
    """
    s = x**2 / freedom
    small = s < _SMALL
    series = 1 - s * (1 / 2 - s * (1 / 3 - s * (1 / 4 - s * (1 / 5 - s / 6))))
    large = jnp.where(small, 1.0, s)
    return x * jnp.sqrt((freedom + 1) / freedom * jnp.where(small, series, jnp.log1p(large) / large))


def student_bound_residual(x: Float[Array, "*batch"], freedom: int) -> Float[Array, "*batch"]:
    r"""Return the residual :math:`\sqrt{-2 \log T(x)}` of a reading of which only an upper limit is known.

    Args:
        x: Standardized limit [1].
        freedom: Degrees of freedom nu, even.
    """
    beyond = _log_lower_tail(-jnp.maximum(x, 1.0), freedom)
    negligible = (x > 1) & (beyond < _NEGLIGIBLE)
    plain = jnp.sqrt(-2 * log_student_cdf(jnp.where(negligible, 0.0, x), freedom))
    return jnp.where(negligible, jnp.exp((log(2) + beyond) / 2), plain)


def log_normal_cdf(x: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    r"""Return the log of the standard normal distribution function.

    .. math:: \log\Phi(x) \to -\frac{x^2}{2} - \log(-x) - \frac{1}{2}\log 2\pi
       + \log\left(1 - \frac{1}{x^2} + \frac{3}{x^4} - \frac{15}{x^6} + \frac{105}{x^8}\right)
       \quad \text{as } x \to -\infty

    Only one logarithm is taken, of the applicable branch: JAX's own `log_ndtr` takes twice as long or more, and has
    the derivative :math:`\exp(\log\phi - \log\Phi)`, in which two numbers of size x^2/2 cancel: below x = -1e6 few of its
    digits are right, below -1e8 none.

    Args:
        x: Standardized deviation [1].

    Returns:
        Logarithm of the probability of a smaller deviation.

    References:
        Abramowitz and Stegun, Handbook of Mathematical Functions (1964), 26.2.12, for the series.
    """
    far = x < _FAR
    p = jax.lax.erfc(jnp.abs(jnp.where(far, 0.0, x)) * np.sqrt(0.5)) / 2
    tail = jnp.where(far, x, _FAR)
    s = 1 / tail**2
    series = (1 - s * (1 - s * (3 - s * (15 - s * 105)))) / (-tail * np.sqrt(2 * np.pi))
    near_1 = -p * (1 + p * (1 / 2 + p * (1 / 3 + p * (1 / 4 + p * (1 / 5 + p / 6)))))
    logarithm = jnp.log(jnp.where(far, series, jnp.where(x < 0, p, 1 - p)))
    return jnp.where(x > _NEAR_1, near_1, logarithm - jnp.where(far, tail**2 / 2, 0.0))
