"""Tables of forces at both ends of a pull-pull loop while it moves."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.stats import norm
from jaxtyping import Float

from bowdenfit.measurements.tables import AngleTable, LoopTable
from bowdenfit.models.cable import Cable, resolve_angles, row_angles
from bowdenfit.models.elasticity import LOOP_MOUNTING
from bowdenfit.models.scatter import FORCE_NOISE, GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET, RUN_SCATTER
from bowdenfit.physics.loop import loop_output_force, loop_slopes

LOOP = "loop_output_force"


@dataclass(frozen=True)
class LoopTerm:
    r"""Likelihood of a loop table.

    .. math:: F_{\text{out},i} \sim \text{Normal}\left(f(F_{\text{in},i}),\ \sqrt{\sigma_F^2 (1 + f'^2)
              + f_\Lambda^2 \textstyle\sum_k \mu_k^2 \sigma_{\theta,ik}^2}\right)

    with f the loop's output force at the preload of the row, or the cable's at the row's wrap angle; both load cells read
    with noise, and the row's own measured angles have errors. All rows are of one mounting: its effect on the friction
    exponent is a parameter where single ropes tell how mountings scatter, and else belongs to the coefficient found.

    Args:
        cable: The cable.
        data: Arrays, one entry a row.
        labels: Each row in words.
    """

    cable: Cable
    data: dict[str, Any]
    labels: tuple[str, ...]
    name: str = LOOP
    unit: str = "N"
    noise: str = FORCE_NOISE

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """All rows scatter alike."""
        return ((len(self.labels), len(self.labels)),)

    def _state(
        self, values: Mapping[str, Array], data: Mapping[str, Any]
    ) -> tuple[Array, Array, Array, Float[Array, "rows contacts"], Float[Array, "rows contacts"]]:
        """True input force, preload, friction exponent, wrap angles and their variances."""
        angles, variance = resolve_angles(self.cable, values, data)
        mounting = values[RUN_SCATTER] * values[LOOP_MOUNTING] if LOOP_MOUNTING in values else 0.0
        exponent = self.cable.friction_exponent(values, angles) + mounting
        bends = data["bends"] if "bends" in data else jnp.sum(angles, axis=-1)
        of_cable = self.cable.elasticity.preload(values, bends)[0]
        of_cable = of_cable[data["bend"]] if "bends" in data else of_cable
        preload = jnp.where(data["has_preload"], data["preload"], of_cable)
        return data["input_force"] - values.get(INPUT_OFFSET, 0.0), preload, exponent, angles, variance

    def _shown(self, values: Mapping[str, Array], output_force: Array) -> Array:
        """What the output's load cell reads."""
        return output_force * jnp.exp(-values.get(GAIN_ERROR, 0.0)) + values.get(OUTPUT_OFFSET, 0.0)

    def _mean_and_sd(
        self, values: Mapping[str, Array], data: Mapping[str, Any], weights: Mapping[str, Array]
    ) -> tuple[Float[Array, " rows"], Float[Array, " rows"]]:
        force, preload, exponent, _, _ = self._state(values, data)
        output = loop_output_force(force, preload, exponent, data["stroke"])
        force, preload, exponent, angles, variance = self._state(weights, data)
        by_force, by_exponent = loop_slopes(force, preload, exponent, data["stroke"])
        from_angles = by_exponent**2 * self.cable.exponent_variance(weights, angles, variance)
        return self._shown(values, output), jnp.sqrt(weights[FORCE_NOISE] ** 2 * (1 + by_force**2) + from_angles)

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Expected output forces [N]."""
        return self._mean_and_sd(values, data, values)[0]

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Log likelihood of each row."""
        return norm.logpdf(data["output_force"], *self._mean_and_sd(values, data, values))

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Standardized residuals; the weights follow the parameters but are not differentiated."""
        mean, sd = self._mean_and_sd(values, data, jax.lax.stop_gradient(dict(values)))
        return (data["output_force"] - mean) / jax.lax.stop_gradient(sd)

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " rows"]:
        """Output forces as the bench would give them [N]."""
        mean, sd = self._mean_and_sd(values, data, values)
        return mean + sd * jax.random.normal(key, mean.shape)

    def observed(self) -> np.ndarray:
        """Measured output forces [N]."""
        return self.data["output_force"]


def loop_term(cable: Cable, table: LoopTable, angles: AngleTable | None) -> LoopTerm:
    """The term of a loop table."""
    rows = row_angles(cable, table, angles)
    data = rows.data | {
        "input_force": table.input_force,
        "output_force": table.output_force,
        "stroke": table.stroke.astype(float),
        "preload": np.nan_to_num(table.preload),
        "has_preload": np.isfinite(table.preload),
    }
    if rows.is_own.all():  # the root behind the preload is found once for every different bend
        data["bends"], data["bend"] = np.unique(np.sum(rows.own, axis=1), return_inverse=True)
    return LoopTerm(cable, data, tuple(table.origin.place(i) for i in range(len(table.stroke))))
