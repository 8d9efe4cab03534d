"""The normal distribution far out in its tail, where undetected angles and held forces may lie while a solver searches."""

import jax.numpy as jnp
from jax import Array
from jax.scipy.special import log_ndtr
from jaxtyping import Float

_FAR = -1e4


def log_normal_cdf(u: Float[Array, "*any"]) -> Float[Array, "*any"]:
    r"""Logarithm of the standard normal distribution function, with a derivative that holds however far out.

    .. math:: \log\Phi(u) \to -\frac{u^2}{2} - \log(-u \sqrt{2\pi}) - \frac{1}{u^2}, \quad u \to -\infty

    JAX's own `log_ndtr` takes its derivative from a difference of two numbers near u^2/2, of which nothing is left beyond
    u = -1e8.
    """
    far = jnp.minimum(u, _FAR)
    return jnp.where(
        u > _FAR, log_ndtr(jnp.maximum(u, _FAR)), -(far**2) / 2 - jnp.log(-far * jnp.sqrt(2 * jnp.pi)) - 1 / far**2
    )
