"""The normal distribution function, safe to differentiate far out in its lower tail."""

import jax.numpy as jnp
from jax import Array
from jax.scipy.special import log_ndtr
from jaxtyping import Float

_FAR = -1e4  # below, the leading terms of the tail are exact to 1e-8, of a logarithm that is -5e7


def log_normal_cdf(x: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    r"""Logarithm of the standard normal distribution function.

    .. math:: \log\Phi(x) \to -\frac{x^2}{2} - \log(-x) - \frac{1}{2}\log 2\pi \quad \text{as } x \to -\infty

    JAX's own `log_ndtr` has the derivative :math:`\exp(\log\phi - \log\Phi)`, in which two numbers of size x^2/2 cancel:
    below x = -1e6 few of its digits are right, below -1e8 none.

    Args:
        x: Standardized deviation [1].

    Returns:
        Logarithm of the probability of a smaller deviation.
    """
    far = x < _FAR
    near_value = log_ndtr(jnp.where(far, 0.0, x))
    tail = jnp.where(far, x, _FAR)
    return jnp.where(far, -(tail**2) / 2 - jnp.log(-tail) - jnp.log(2 * jnp.pi) / 2, near_value)
