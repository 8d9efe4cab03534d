"""Forces read while nothing slides, as intervals."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.load_cells import FORCE_NOISE, RUN_SCATTER, LoadCells
from bowdenfit.cable.noise import noise_law, scatter
from bowdenfit.kinds.resolve_angles import resolve_angles


@dataclass(frozen=True)
class HeldForcesTerm:
    r"""Likelihood of forces read while nothing slides: inside the friction band, nothing more.

    .. math:: \log\left[\Phi\left(\frac{\Lambda - r}{s}\right) - \Phi\left(\frac{-\Lambda - r}{s}\right)\right],
              \quad r = g(F_\text{in}) - g(F_\text{out}), \quad
              s^2 = \tau^2 + \sigma_F^2 (\rho^2 g'(F_\text{in})^2 + g'(F_\text{out})^2)

    with g the scale on which friction is a shift, log F for the capstan equation, and rho the noise of the input over that of
    the output. It is a bound, not a measurement: where
    inside the band a force comes to rest is not modeled, so a coefficient that rests on held readings alone has a posterior
    that is its prior above the largest of them, and its intervals must not be read as those of a measured value.

    With Student noise Phi is the distribution function of a Student-t: one wrong reading far outside the band then hardly
    moves the bound.

    Args:
        cable: The cable.
        data: Arrays, one entry a row.
        labels: Each row in words.
    """

    cable: Cable = field(repr=False)
    data: dict[str, Any] = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    name: str = "held_ratio"
    unit: str = "1"
    noise: str = RUN_SCATTER

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """An interval has no scatter."""
        return ((len(self.labels), 0),)

    def _difference(
        self, values: Mapping[str, Array], data: Mapping[str, Any]
    ) -> tuple[Float[Array, " rows"], Float[Array, " rows"]]:
        """Difference of the forces on the scale on which friction is a shift, and its variance from the load cells."""
        friction, cells, least = self.cable.friction, LoadCells.of(values), self.cable.friction.conditions.least_force
        input_force = cells.true_input(data["input_force"], least)
        output_force = cells.true_output(data["output_force"], least)
        of_input = self.cable.description.sensors.noise_ratio * friction.slope(values, input_force)
        slopes = of_input**2 + friction.slope(values, output_force) ** 2
        difference = friction.scaled(values, input_force) - friction.scaled(values, output_force)
        return difference, slopes * values[FORCE_NOISE] ** 2

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Log likelihood of each row."""
        angles, variance = resolve_angles(self.cable, values, data)
        exponent = self.cable.friction_exponent(values, angles, data["group"])
        difference, from_cells = self._difference(values, data)
        from_angles = self.cable.exponent_variance(values, angles, variance, data["group"])
        sd = jnp.sqrt(values[RUN_SCATTER] ** 2 + from_angles + from_cells)
        pulling, returning = self.cable.friction.shifts(values, exponent)
        beyond = jnp.abs(difference - (pulling - returning) / 2)  # about its middle the band is symmetric
        law = noise_law(self.cable.description)
        upper, lower = law.log_cdf((exponent - beyond) / sd), law.log_cdf((-exponent - beyond) / sd)
        # A band of no width at all holds no reading; the floor keeps its logarithm finite.
        return upper + jnp.log1p(-jnp.exp(jnp.minimum(lower - upper, -1e-12)))

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """sqrt(-2 log likelihood), zero well inside the band."""
        return jnp.sqrt(jnp.maximum(-2 * self.log_likelihood(values, data), 1e-30))

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Largest ratio of input to output force that friction can hold at the row's input force [1]."""
        angles, _ = resolve_angles(self.cable, values, data)
        exponent = self.cable.friction_exponent(values, angles, data["group"])
        return data["input_force"] / self._output_force(values, data, exponent)

    def _output_force(
        self, values: Mapping[str, Array], data: Mapping[str, Any], shift: Float[Array, " rows"]
    ) -> Float[Array, " rows"]:
        """Output force that the load cell shows at a shift on the scale g; it stays positive."""
        cells, least = LoadCells.of(values), self.cable.friction.conditions.least_force
        input_force = cells.true_input(data["input_force"], least)
        output = self.cable.friction.output_force(values, input_force, shift, jnp.ones(()))
        return cells.shown_output(output, least)

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " rows"]:
        """A ratio of input to output force anywhere in the band, with noise [1]."""
        band, noise = jax.random.split(key)
        angles, _ = resolve_angles(self.cable, values, data)
        limit = self.cable.friction_exponent(values, angles, data["group"])
        _, from_cells = self._difference(values, data)
        inside = limit * jax.random.uniform(band, limit.shape, minval=-1.0, maxval=1.0)
        sd = jnp.sqrt(values[RUN_SCATTER] ** 2 + from_cells)
        shift = inside + sd * scatter(noise, limit.shape, self.cable.description)
        return data["input_force"] / self._output_force(values, data, shift)

    def observed(self) -> np.ndarray:
        """Ratio of input to output force [1]."""
        return self.data["input_force"] / self.data["output_force"]
