"""Stretch and preload tables: readings around what the elastic side of a cable says."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.elasticity import PRELOAD_NOISE, STRETCH_NOISE, spread_matrix
from bowdenfit.cable.noise import noise_law, scatter
from bowdenfit.kinds.tables import PreloadTable, StretchTable

MEASURED_PRELOAD = "measured_preload"  # not the name of the parameter
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

    cable: Cable
    data: dict[str, Any]
    labels: tuple[str, ...]
    name: str
    unit: str
    noise: str
    law: Expected
    lowest: float | None = None

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """All readings scatter alike; a bound has no scatter."""
        read = len(self.data["reading"])
        return ((read, read), (len(self.labels) - read, 0))

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Expected readings [mm] or [N]."""
        return self.law(self.cable, values, data)

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Log likelihood of each row."""
        deviation, u = self._deviations(values, data, values[self.noise])
        law = noise_law(self.cable.description)
        return jnp.concatenate([law.log_density(deviation) - jnp.log(values[self.noise]), law.log_cdf(u)])

    def _deviations(
        self, values: Mapping[str, Array], data: Mapping[str, Any], noise: Array
    ) -> tuple[Float[Array, " read"], Float[Array, " at_most"]]:
        """Standardized deviations: of the readings, and of those that are only known to be at most so."""
        expected, n = self.expected(values, data), data["reading"].shape[0]
        return (data["reading"] - expected[:n]) / noise, (data["at_most"] - expected[n:]) / noise

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Standardized residuals; sqrt(-2 log likelihood) for rows known to be at most their reading."""
        deviation, u = self._deviations(values, data, jax.lax.stop_gradient(values[self.noise]))
        law = noise_law(self.cable.description)
        return jnp.concatenate([law.residual(deviation), law.bound_residual(u)])

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " rows"]:
        """Readings drawn at given parameters [mm] or [N]."""
        expected = self.expected(values, data)
        drawn = expected + values[self.noise] * scatter(key, expected.shape, self.cable.description)
        return drawn if self.lowest is None else jnp.maximum(drawn, self.lowest)

    def observed(self) -> np.ndarray:
        """Readings [mm] or [N]."""
        return np.concatenate([self.data["reading"], self.data["at_most"]])


def stretch_term(cable: Cable, table: StretchTable) -> ElasticTerm:
    """The term of a table of stretch."""
    angles, at = np.unique(table.wrap_angle, return_inverse=True)
    data = {
        "reading": table.stretch,
        "load": table.load,
        "wrap_angles": angles,
        "spread": spread_matrix(at),
        # A row read while the load grew comes down from no larger one: the two branches meet there.
        "at_most": np.zeros(0),
        "peak": np.where(table.unloading, table.peak, table.load),
    }
    branch = np.where(table.unloading, ", unloading", "")
    labels = tuple(
        f"{load:.4g} N at {np.rad2deg(angle):.4g} deg{way}"
        for load, angle, way in zip(table.load, table.wrap_angle, branch, strict=True)
    )
    return ElasticTerm(cable, data, labels, "stretch", "mm", STRETCH_NOISE, _stretch)


def _stretch(cable: Cable, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
    return cable.elasticity.stretch_of_rows(values, data)


def preload_term(cable: Cable, table: PreloadTable) -> ElasticTerm:
    """The term of a table of preload; rows that read 0 come last."""
    slack = table.preload == 0
    angles = np.concatenate([table.wrap_angle[~slack], table.wrap_angle[slack]])
    data = {"reading": table.preload[~slack], "at_most": table.preload[slack], "wrap_angle": angles}
    labels = tuple(f"{np.rad2deg(angle):.4g} deg" for angle in angles)
    return ElasticTerm(cable, data, labels, MEASURED_PRELOAD, "N", PRELOAD_NOISE, _preload, 0.0)


def _preload(cable: Cable, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
    return cable.elasticity.preload(values, data["wrap_angle"])[0]
