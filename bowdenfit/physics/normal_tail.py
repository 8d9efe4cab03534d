"""The normal distribution function, safe to differentiate far out in its lower tail."""

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.lax import erfc
from jaxtyping import Float

_FAR = -20.0  # below, five terms of the tail's series are exact to 1e-14 of the logarithm


def log_normal_cdf(x: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    r"""Logarithm of the standard normal distribution function.

    .. math:: \log\Phi(x) \to -\frac{x^2}{2} - \log(-x) - \frac{1}{2}\log 2\pi
        + \log\left(1 - \frac{1}{x^2} + \frac{3}{x^4} - \dots\right) \quad \text{as } x \to -\infty

    JAX's own `log_ndtr` takes twice as long, and its derivative is :math:`\exp(\log\phi - \log\Phi)`, in which two numbers of
    size x^2/2 cancel: below x = -1e6 few of its digits are right, below -1e8 none.

    Args:
        x: Standardized deviation [1].

    Returns:
        Logarithm of the probability of a smaller deviation.
    """
    far, upper = x < _FAR, x >= 0
    near = jnp.where(far, 0.0, x)
    outer = erfc(jnp.where(upper, near, -near) * np.sqrt(0.5)) / 2  # of the tail on the same side
    near_value = jnp.where(upper, jnp.log1p(-jnp.where(upper, outer, 0.5)), jnp.log(outer))
    tail = jnp.where(far, x, _FAR)
    inverse = 1 / tail**2
    series = -inverse * (1 - inverse * (3 - inverse * (15 - inverse * (105 - inverse * 945))))
    far_value = -(tail**2) / 2 - jnp.log(-tail) - jnp.log(2 * jnp.pi) / 2 + jnp.log1p(series)
    return jnp.where(far, far_value, near_value)
