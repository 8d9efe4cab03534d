"""How readings err: systematic errors of the two load cells, and scatter, normal or with the heavy tails of a robust fit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.stats import norm
from jaxtyping import Float

from bowdenfit.description import Description
from bowdenfit.description.stated_parameters import GAIN_ERROR as GAIN_ERROR
from bowdenfit.description.stated_parameters import RUN_SCATTER as RUN_SCATTER
from bowdenfit.physics.distributions import (
    log_normal_cdf,
    log_student_cdf,
    log_student_density,
    student_bound_residual,
    student_residual,
)

FORCE_NOISE = "sigma_F"
BLOCK_NOISE = "sigma_block"
DELAY_ERROR = "delay_error"
INPUT_OFFSET, OUTPUT_OFFSET = "input_offset", "output_offset"
GEAR_LOSS, GEAR_FRICTION = "gear_loss", "gear_friction"
AnyArray = TypeVar("AnyArray", Array, np.ndarray)


@dataclass(frozen=True)
class Gear:
    r"""Gear between the motor, whose current was read, and the rope.

    Args:
        loss: Share of the torque that it loses, 1 - eta [1].
        friction: Its friction at the rope, T_g / r [N].
    """

    loss: Any
    friction: Any

    def rope_force(self, motor_force: AnyArray, stroke: AnyArray | float) -> AnyArray:
        """Return the force on the rope [N] where the motor makes a force while it pulls (1), returns (-1) or neither (0)."""
        force: AnyArray = motor_force * (1 - self.loss) ** stroke - stroke * self.friction
        return force

    def motor_force(self, rope_force: AnyArray, stroke: AnyArray | float) -> AnyArray:
        """Return the force that the motor makes [N], inverse to `rope_force`."""
        force: AnyArray = (rope_force + stroke * self.friction) * (1 - self.loss) ** -stroke
        return force


@dataclass(frozen=True)
class LoadCells:
    r"""Systematic errors of the load cells, 0 where nothing is said of them; and a motor's gear in the place of the input's.

    .. math:: F_\text{in} = F_\text{in,shown} - b_\text{in}, \quad
              F_\text{out} = (F_\text{out,shown} - b_\text{out}) e^\gamma

    Args:
        input_offset: b_in [N].
        output_offset: b_out [N].
        gain_error: gamma, relative gain error between the two [1].
        delay_error: By how much the output still comes later than it was shifted back by: its delay, less the estimate [s].
        gear: The gear of a motor that was read at the input; None of a load cell.
    """

    input_offset: Array | float
    output_offset: Array | float
    gain_error: Array | float
    delay_error: Array | float
    gear: Gear | None = None

    @classmethod
    def of(cls, values: Mapping[str, Array]) -> "LoadCells":
        """Return the load cells at given parameters."""
        offsets = values.get(INPUT_OFFSET, 0.0), values.get(OUTPUT_OFFSET, 0.0)
        gear = Gear(values[GEAR_LOSS], values[GEAR_FRICTION]) if GEAR_LOSS in values else None
        return cls(*offsets, values.get(GAIN_ERROR, 0.0), values.get(DELAY_ERROR, 0.0), gear)

    def true_input(
        self, shown: Float[Array, "*batch"], least: float = -jnp.inf, stroke: Float[Array, "*batch"] | float = 0.0
    ) -> Float[Array, "*batch"]:
        """Return the force at the input [N] where its cell, or its motor during a stroke, shows a force, at least `least`."""
        force = shown - self.input_offset
        return _at_least(force if self.gear is None else self.gear.rope_force(force, stroke), least)

    def true_output(self, shown: Float[Array, "*batch"], least: float = -jnp.inf) -> Float[Array, "*batch"]:
        """Return the force at the output [N] where its cell shows a force; its offset leaves at least `least` of that."""
        return _at_least(shown - self.output_offset, least) * jnp.exp(self.gain_error)

    def shown_input(
        self, force: Float[Array, "*batch"], stroke: Float[Array, "*batch"] | float = 0.0
    ) -> Float[Array, "*batch"]:
        """Return what the input's cell, or its motor during a stroke, shows of a force [N]."""
        return (force if self.gear is None else self.gear.motor_force(force, stroke)) + self.input_offset

    def shown_output(self, force: Float[Array, "*batch"], least: float = -jnp.inf) -> Float[Array, "*batch"]:
        """Return what the output's cell shows of a force [N], at least `least`."""
        return _at_least(self.shown_change(force) + self.output_offset, least)

    def shown_change(self, change: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return what the output's cell shows of a change of the force [N]."""
        return change * jnp.exp(-self.gain_error)

    def late(self, drift: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return what the error of the delay adds to the output, in the unit whose change in a second `drift` is."""
        return self.delay_error * drift


def _at_least(force: Float[Array, "*batch"], least: float) -> Float[Array, "*batch"]:
    return jnp.maximum(force, least) if least > -jnp.inf else force


@runtime_checkable
class NoiseLaw(Protocol):
    """Distribution of a reading's standardized deviation from what is expected of it."""

    def log_density(
        self, x: Float[Array, "*batch"], mean: Array | float = 0.0, scale: Array | float = 1.0
    ) -> Float[Array, "*batch"]:
        """Return the logarithm of the density of readings with a mean and a scale."""
        ...

    def log_cdf(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the logarithm of the probability of a smaller standardized deviation."""
        ...

    def residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the residual of a standardized deviation; half its square is minus the log density, up to a constant."""
        ...

    def bound_residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the residual sqrt(-2 log_cdf(u)) of a reading of which only an upper limit is known."""
        ...

    def draw(self, key: Array, shape: tuple[int, ...]) -> Array:
        """Return standardized deviations."""
        ...

    def draw_with(self, generator: np.random.Generator, shape: int | tuple[int, ...]) -> np.ndarray:
        """Return standardized deviations, by NumPy."""
        ...

    def meaning(self, plain: str) -> str:
        """Return what a scale of this law means, from what it means when readings scatter normally."""
        ...


@dataclass(frozen=True)
class NormalNoise:
    """Readings scatter normally; their scale is their standard deviation."""

    def log_density(
        self, x: Float[Array, "*batch"], mean: Array | float = 0.0, scale: Array | float = 1.0
    ) -> Float[Array, "*batch"]:
        """Return the logarithm of the normal density."""
        return norm.logpdf(x, mean, scale)

    def log_cdf(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the logarithm of the normal distribution function."""
        return log_normal_cdf(u)

    def residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the standardized deviation itself."""
        return u

    def bound_residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the residual sqrt(-2 log Phi(u))."""
        # Beyond 30 sd the root is 0 to the last digit, and its derivative would be 0 times infinity.
        return jnp.where(u < 30.0, jnp.sqrt(-2 * log_normal_cdf(jnp.minimum(u, 29.0))), 0.0)

    def draw(self, key: Array, shape: tuple[int, ...]) -> Array:
        """Return standard normal draws."""
        return jax.random.normal(key, shape)

    def draw_with(self, generator: np.random.Generator, shape: int | tuple[int, ...]) -> np.ndarray:
        """Return standard normal draws, by NumPy."""
        return generator.standard_normal(shape)

    def meaning(self, plain: str) -> str:
        """Return the meaning itself."""
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
        """Return the logarithm of the Student-t density."""
        return log_student_density((x - mean) / scale, self.freedom) - jnp.log(scale)

    def log_cdf(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the logarithm of the Student-t distribution function."""
        return log_student_cdf(u, self.freedom)

    def residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the residual that grows with the root of the logarithm of a large deviation."""
        return student_residual(u, self.freedom)

    def bound_residual(self, u: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the residual sqrt(-2 log T(u))."""
        return student_bound_residual(u, self.freedom)

    def draw(self, key: Array, shape: tuple[int, ...]) -> Array:
        """Return draws of the standard Student-t."""
        return jax.random.t(key, self.freedom, shape)

    def draw_with(self, generator: np.random.Generator, shape: int | tuple[int, ...]) -> np.ndarray:
        """Return draws of the standard Student-t, by NumPy."""
        return np.asarray(generator.standard_t(self.freedom, shape))

    def meaning(self, plain: str) -> str:
        """Return the meaning, said of a scale that is not a standard deviation."""
        scale = plain.replace("standard deviation of", "scale of").replace("scatter of", "scale of the scatter of")
        return f"{scale}, Student-t with {self.freedom} degrees of freedom"


def noise_law(description: Description) -> NoiseLaw:
    """Return how the readings of a cable's tables scatter, as its description says."""
    return StudentNoise(description.student_degrees_of_freedom) if description.noise == "student" else NormalNoise()


def scatter(key: Array, shape: tuple[int, ...], description: Description) -> Array:
    """Return deviations of simulated readings from what is expected of them, in units of their scale.

    Args:
        key: Random key.
        shape: Shape of the readings.
        description: The cable, which says how its readings scatter.
    """
    return noise_law(description).draw(key, shape)
