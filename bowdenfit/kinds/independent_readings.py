"""Terms of readings that scatter alike, each by itself, about what the model expects: the simplest kind of term."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.noise import noise_law, scatter


@dataclass(frozen=True)
class IndependentReadings(ABC):
    r"""Likelihood of readings that scatter alike about what the model expects of them.

    .. math:: y_i \sim \text{Normal}(f_i, \sigma)

    With Student noise the same mean and scale are a Student-t's. A subclass gives `name`, `unit`, `noise` (see `Term`) and
    `expected`, which is f.

    Args:
        cable: The cable.
        data: Arrays; "reading" holds the readings, and `expected` takes the others.
        labels: Each reading in words.
    """

    cable: Cable = field(repr=False)
    data: dict[str, Any] = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of its readings in results."""

    @property
    @abstractmethod
    def unit(self) -> str:
        """Unit of its readings."""

    @property
    @abstractmethod
    def noise(self) -> str:
        """Parameter that is the standard deviation of a reading."""

    @abstractmethod
    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Expected readings in the term's unit."""

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """All readings scatter alike."""
        return ((len(self.labels), len(self.labels)),)

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Log likelihood of each reading."""
        deviation = (data["reading"] - self.expected(values, data)) / values[self.noise]
        return noise_law(self.cable.description).log_density(deviation) - jnp.log(values[self.noise])

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Standardized residuals; the noise follows the parameters but is not differentiated."""
        noise = jax.lax.stop_gradient(values[self.noise])
        return noise_law(self.cable.description).residual((data["reading"] - self.expected(values, data)) / noise)

    def simulate(
        self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array, scale: float = 1.0
    ) -> Float[Array, " rows"]:
        """Readings drawn at given parameters, with their noise times `scale`."""
        expected = self.expected(values, data)
        return expected + scale * values[self.noise] * scatter(key, expected.shape, self.cable.description)

    def observed(self) -> np.ndarray:
        """Readings in the term's unit."""
        return self.data["reading"]
