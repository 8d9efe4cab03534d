"""Readings around what the elastic side of a cable says, of stretch or of preload."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.noise import noise_law, scatter
from bowdenfit.kinds.bounds import first_less, joined, last_less

Expected = Callable[[Cable, Mapping[str, Array], Mapping[str, Any]], Array]


@dataclass(frozen=True)
class ElasticTerm:
    r"""Likelihood of a table of stretch, or of preload.

    .. math:: \Delta L_i \sim \text{Normal}(e(\bar T_i) + g \theta_i - \Delta L_0,\ \sigma_L), \qquad
              P_i \sim \text{Normal}(P(\theta_i),\ \sigma_P)

    A preload of 0 is what a load cell says of a slack rope whatever its noise: such a row is known to be at most 0, and
    contributes :math:`\Phi(-P(\theta)/\sigma_P)`. With Student noise the same scales are a Student-t's.

    Args:
        cable: The cable.
        data: Arrays, one entry a row.
        labels: Each row in words.
        name: Name of its readings in results.
        unit: Unit of its readings.
        noise: Its noise scale.
        law: What is expected of the rows.
        lowest: Lowest reading that there can be; None without one.
    """

    cable: Cable = field(repr=False)
    data: dict[str, Any] = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    name: str
    unit: str
    noise: str
    law: Expected
    lowest: float | None = None
    depends_on_conditions: ClassVar[bool] = False  # see `Term`

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """All readings scatter alike; a bound has no scatter."""
        read = len(self.data["reading"])
        return ((read, read), (len(self.labels) - read, 0))

    @property
    def padded(self) -> dict[str, Any]:
        """See `LogDensity.padded`: every row as one that was read and as one that is known to be at most so."""
        if self.lowest is None:
            return self.data
        none_read, none_bound = (np.full(len(self.data[name]), np.nan) for name in ("at_most", "reading"))
        reading, at_most = [self.data["reading"], none_read], [none_bound, self.data["at_most"]]
        return self.data | {"reading": np.concatenate(reading), "at_most": np.concatenate(at_most)}

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Expected readings [mm] or [N]."""
        return self.law(self.cable, values, data)

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Log likelihood of each row."""
        deviation, u = self._deviations(values, data, values[self.noise])
        law = noise_law(self.cable.description)
        read = law.log_density(deviation) - jnp.log(values[self.noise])
        return joined((data["reading"], read), (data["at_most"], law.log_cdf(u)))

    def _deviations(
        self, values: Mapping[str, Array], data: Mapping[str, Any], noise: Array
    ) -> tuple[Float[Array, " read"], Float[Array, " at_most"]]:
        """Standardized deviations: of the readings, and of those that are only known to be at most so."""
        expected = self.expected(values, data)
        return first_less(data["reading"], expected) / noise, last_less(data["at_most"], expected) / noise

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Standardized residuals; sqrt(-2 log likelihood) for rows known to be at most their reading."""
        deviation, u = self._deviations(values, data, jax.lax.stop_gradient(values[self.noise]))
        law = noise_law(self.cable.description)
        return joined((data["reading"], law.residual(deviation)), (data["at_most"], law.bound_residual(u)))

    def simulate(
        self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array, scale: float = 1.0
    ) -> Float[Array, " rows"]:
        """Readings drawn at given parameters [mm] or [N], with their noise times `scale`."""
        expected = self.expected(values, data)
        drawn = expected + scale * values[self.noise] * scatter(key, expected.shape, self.cable.description)
        return drawn if self.lowest is None else jnp.maximum(drawn, self.lowest)

    def observed(self) -> np.ndarray:
        """Readings [mm] or [N]."""
        return np.concatenate([self.data["reading"], self.data["at_most"]])
