"""The normal distribution function, safe to differentiate far out in its lower tail."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

_FAR = -30.0  # below, five terms of the series of the tail are exact to 2e-12, of a logarithm that is -450
_NEAR_1 = 3.0  # above, six terms of the series of log(1 - p) are exact, and 1 - p is not


def log_normal_cdf(x: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    r"""Logarithm of the standard normal distribution function.

    .. math:: \log\Phi(x) \to -\frac{x^2}{2} - \log(-x) - \frac{1}{2}\log 2\pi
       + \log\left(1 - \frac{1}{x^2} + \frac{3}{x^4} - \frac{15}{x^6} + \frac{105}{x^8}\right)
       \quad \text{as } x \to -\infty

    One logarithm is taken, of whichever of these holds: JAX's own `log_ndtr` takes twice as long or more, and has
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
