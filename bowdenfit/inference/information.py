"""Fisher information of measurements that were not made: what readings without noise would tell at known values."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import noise_scales


def predict_posterior(posterior: LogDensity, z: np.ndarray) -> MaximumPosterior:
    """True values z, and the covariance that readings without noise would leave there, at the noise scales of that point."""

    def residuals(at: Array, data: Any) -> Array:
        return jnp.concatenate(list(posterior.residuals(at, data).values()))

    jacobian = compile_program(
        jax.jacfwd(residuals), jax.ShapeDtypeStruct(z.shape, jnp.float64), posterior.data, run_once=True
    )
    slopes = np.where(noise_scales(posterior), 0.0, np.asarray(jacobian(z, posterior.data)))
    return MaximumPosterior(z, np.linalg.inv(slopes.T @ slopes + np.eye(len(z))))
