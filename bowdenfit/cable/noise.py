"""How readings scatter about what is expected of them: normally, or with the heavy tails that make a fit robust."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.stats import norm
from jaxtyping import Float

from bowdenfit.description import Description
from bowdenfit.physics.distributions import (
    log_normal_cdf,
    log_student_cdf,
    log_student_density,
    student_bound_residual,
    student_residual,
)


@runtime_checkable
class NoiseLaw(Protocol):
    """Distribution of a reading's standardized deviation from what is expected of it."""

    def log_density(
        self, x: Float[Array, "*batch"], mean: Array | float = 0.0, scale: Array | float = 1.0
    ) -> Float[Array, "*batch"]:
        """Logarithm of the density of readings with a mean and a scale."""
        ...

    def log_cdf(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Logarithm of the probability of a smaller standardized deviation."""
        ...

    def residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Residual of a standardized deviation; half its square is minus the log density, up to a constant."""
        ...

    def bound_residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Residual sqrt(-2 log_cdf(u)) of a reading of which only an upper limit is known."""
        ...

    def draw(self, key: Array, shape: tuple[int, ...]) -> Array:
        """Standardized deviations."""
        ...

    def draw_with(self, generator: np.random.Generator, shape: int | tuple[int, ...]) -> np.ndarray:
        """Standardized deviations, by NumPy."""
        ...

    def meaning(self, plain: str) -> str:
        """What a scale of this law means, from what it means when readings scatter normally."""
        ...


@dataclass(frozen=True)
class NormalNoise:
    """Readings scatter normally; their scale is their standard deviation."""

    def log_density(
        self, x: Float[Array, "*batch"], mean: Array | float = 0.0, scale: Array | float = 1.0
    ) -> Float[Array, "*batch"]:
        """Logarithm of the normal density."""
        return norm.logpdf(x, mean, scale)

    def log_cdf(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Logarithm of the normal distribution function."""
        return log_normal_cdf(u)

    def residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """The standardized deviation itself."""
        return u

    def bound_residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Residual sqrt(-2 log Phi(u))."""
        # Beyond 30 sd the root is 0 to the last digit, and its derivative would be 0 times infinity.
        return jnp.where(u < 30.0, jnp.sqrt(-2 * log_normal_cdf(jnp.minimum(u, 29.0))), 0.0)

    def draw(self, key: Array, shape: tuple[int, ...]) -> Array:
        """Standard normal draws."""
        return jax.random.normal(key, shape)

    def draw_with(self, generator: np.random.Generator, shape: int | tuple[int, ...]) -> np.ndarray:
        """Standard normal draws, by NumPy."""
        return generator.standard_normal(shape)

    def meaning(self, plain: str) -> str:
        """The meaning itself."""
        return plain


@dataclass(frozen=True)
class StudentNoise:
    """Readings scatter with a Student-t of few degrees of freedom, so that a few bad ones hardly pull the fit.

    A scale s is not a standard deviation, which is s sqrt(nu / (nu - 2)): 1.41 s with 4 degrees of freedom, and infinite
    with 2. Half of all readings lie within 0.74 s of what is expected (4 degrees of freedom), within 0.67 s if normal.

    Args:
        freedom: Degrees of freedom nu, even.

    References:
        Lange, Little & Taylor, Robust statistical modeling using the t distribution, J. Am. Stat. Assoc. 84 (1989), 881.
    """

    freedom: int

    def log_density(
        self, x: Float[Array, "*batch"], mean: Array | float = 0.0, scale: Array | float = 1.0
    ) -> Float[Array, "*batch"]:
        """Logarithm of the Student-t density."""
        return log_student_density((x - mean) / scale, self.freedom) - jnp.log(scale)

    def log_cdf(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Logarithm of the Student-t distribution function."""
        return log_student_cdf(u, self.freedom)

    def residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Residual that grows with the root of the logarithm of a large deviation."""
        return student_residual(u, self.freedom)

    def bound_residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Residual sqrt(-2 log T(u))."""
        return student_bound_residual(u, self.freedom)

    def draw(self, key: Array, shape: tuple[int, ...]) -> Array:
        """Draws of the standard Student-t."""
        return jax.random.t(key, self.freedom, shape)

    def draw_with(self, generator: np.random.Generator, shape: int | tuple[int, ...]) -> np.ndarray:
        """Draws of the standard Student-t, by NumPy."""
        return np.asarray(generator.standard_t(self.freedom, shape))

    def meaning(self, plain: str) -> str:
        """The meaning, said of a scale that is not a standard deviation."""
        scale = plain.replace("standard deviation of", "scale of").replace("scatter of", "scale of the scatter of")
        return f"{scale}, Student-t with {self.freedom} degrees of freedom"


def noise_law(description: Description) -> NoiseLaw:
    """How the readings of a cable's tables scatter, as its description says."""
    return StudentNoise(description.student_degrees_of_freedom) if description.noise == "student" else NormalNoise()


def scatter(key: Array, shape: tuple[int, ...], description: Description) -> Array:
    """Deviations of simulated readings from what is expected of them, in units of their scale.

    Args:
        key: Random key.
        shape: Shape of the readings.
        description: The cable, which says how its readings scatter.
    """
    return noise_law(description).draw(key, shape)
