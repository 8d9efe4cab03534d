"""Stretch and preload tables: normal readings around what the elastic side of a cable says."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jax import Array
from jax.scipy.stats import norm
from jaxtyping import Float

from bowdenfit.measurements.tables import PreloadTable, StretchTable
from bowdenfit.models.cable import Cable
from bowdenfit.models.elasticity import PRELOAD_NOISE, STRETCH_NOISE

Expected = Callable[[Cable, Mapping[str, Array], Mapping[str, Any]], Array]


@dataclass(frozen=True)
class ElasticTerm:
    r"""Likelihood of a table of stretch, or of preload.

    .. math:: \Delta L_i \sim \text{Normal}(e(\bar T_i) + g \theta_i - \Delta L_0,\ \sigma_L), \qquad
              P_i \sim \text{Normal}(P(\theta_i),\ \sigma_P)

    Args:
        cable: The cable.
        data: Arrays, one entry a row.
        labels: Each row in words.
        name: "stretch" or "preload".
        unit: Unit of its readings.
        noise: Its noise scale.
        law: What is expected of the rows.
    """

    cable: Cable
    data: dict[str, Any]
    labels: tuple[str, ...]
    name: str
    unit: str
    noise: str
    law: Expected

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """All rows scatter alike."""
        return ((len(self.labels), len(self.labels)),)

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Expected readings [mm] or [N]."""
        return self.law(self.cable, values, data)

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Log likelihood of each row."""
        return norm.logpdf(data["reading"], self.expected(values, data), values[self.noise])

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Standardized residuals."""
        return (data["reading"] - self.expected(values, data)) / jax.lax.stop_gradient(values[self.noise])

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " rows"]:
        """Readings drawn at given parameters [mm] or [N]."""
        expected = self.expected(values, data)
        return expected + values[self.noise] * jax.random.normal(key, expected.shape)

    def observed(self) -> np.ndarray:
        """Readings [mm] or [N]."""
        return self.data["reading"]


def stretch_term(cable: Cable, table: StretchTable) -> ElasticTerm:
    """The term of a table of stretch."""
    data = {
        "reading": table.stretch,
        "load": table.load,
        "wrap_angle": table.wrap_angle,
        # A row read while the load grew comes down from no larger one: the two branches meet there.
        "peak": np.where(table.unloading, table.peak, table.load),
    }
    branch = np.where(table.unloading, ", unloading", "")
    labels = tuple(
        f"{load:.4g} N at {np.rad2deg(angle):.4g} deg{way}"
        for load, angle, way in zip(table.load, table.wrap_angle, branch, strict=True)
    )
    return ElasticTerm(cable, data, labels, "stretch", "mm", STRETCH_NOISE, _stretch)


def _stretch(cable: Cable, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
    return cable.elasticity.stretch(values, data["load"], data["wrap_angle"], data["peak"])


def preload_term(cable: Cable, table: PreloadTable) -> ElasticTerm:
    """The term of a table of preload."""
    data = {"reading": table.preload, "wrap_angle": table.wrap_angle}
    labels = tuple(f"{np.rad2deg(angle):.4g} deg" for angle in table.wrap_angle)
    return ElasticTerm(cable, data, labels, "preload", "N", PRELOAD_NOISE, _preload)


def _preload(cable: Cable, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
    return cable.elasticity.preload(values, data["wrap_angle"])[0]
