"""Angle tables: each reading against its curve; what was too small to detect enters as exactly that."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import ANGLE_NOISE, Cable
from bowdenfit.cable.noise import noise_law, scatter
from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.angles.table import AngleSettings
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.kinds.term import Bench, Circumstances, TermKind
from bowdenfit.parameters.priors import HalfNormal
from bowdenfit.parameters.space import Parameter


@dataclass(frozen=True)
class AnglesTerm:
    r"""Likelihood of an angle table.

    Detected angles are :math:`\text{Normal}(\theta(l), \sigma_\theta)`; one below the detection limit L contributes
    :math:`\Phi((L - \theta(l)) / \sigma_\theta)`. With Student noise both are a Student-t's of the same scale. Readings
    outside the range of the curves do not enter.

    Args:
        cable: The cable.
        data: Route values of each curve's readings; the order that puts detected readings first; detected angles and
            the limits of undetected ones [rad].
        labels: Each reading in words, detected ones first.
    """

    cable: Cable
    data: dict[str, Any]
    labels: tuple[str, ...]
    name: str = "wrap_angle"
    unit: str = "deg"
    noise: str = ANGLE_NOISE

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """All readings scatter alike."""
        return ((len(self.labels), len(self.labels)),)

    def _expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " readings"]:
        curves = self.cable.curves
        parts = [curve.wrap_angle(values, data["route"][column]) for column, curve in curves.items()]
        return jnp.concatenate(parts)[data["order"]]

    def _split(
        self, values: Mapping[str, Array], data: Mapping[str, Any]
    ) -> tuple[Float[Array, " detected"], Float[Array, " undetected"]]:
        """Standardized deviations: of the detected readings, and of the limits of the undetected ones."""
        theta, sigma, n = self._expected(values, data), values[ANGLE_NOISE], data["angle"].shape[0]
        return (data["angle"] - theta[:n]) / sigma, (data["limit"] - theta[n:]) / sigma

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " readings"]:
        """Log likelihood of each reading."""
        (deviation, u), law = self._split(values, data), noise_law(self.cable.description)
        return jnp.concatenate([law.log_density(deviation) - jnp.log(values[ANGLE_NOISE]), law.log_cdf(u)])

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " readings"]:
        """Standardized residuals; sqrt(-2 log likelihood) for undetected angles."""
        (deviation, u), law = self._split(values, data), noise_law(self.cable.description)
        return jnp.concatenate([law.residual(deviation), law.bound_residual(u)])

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " readings"]:
        """Expected readings [deg]."""
        return jnp.rad2deg(self._expected(values, data))

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " readings"]:
        """Readings as the bench would give them, undetected ones included [deg]."""
        theta = self._expected(values, data)
        return jnp.rad2deg(theta + values[ANGLE_NOISE] * scatter(key, theta.shape, self.cable.description))

    def observed(self) -> np.ndarray:
        """Readings [deg]; NaN where undetected."""
        return np.rad2deg(np.concatenate([self.data["angle"], np.full(len(self.data["limit"]), np.nan)]))


def angles_term(cable: Cable, table: AngleTable) -> AnglesTerm:
    """The term of an angle table, with undetected angles entering as the description says."""
    description = cable.description
    settings, route, published = (
        description.table(AngleSettings),
        description.route,
        description.geometry == "published",
    )
    assert settings is not None and route is not None  # an angle table is read only with both
    readings: list[tuple[float, float, str]] = []
    routes: dict[str, np.ndarray] = {}
    for contact in description.curved:
        column = contact.wrap_angle.column or ""
        low, high = (contact.wrap_angle.published_range if published else None) or route.range
        how = "zero" if published else settings.undetected
        angle, limit = table.column(column)
        used = (table.route >= low) & (table.route <= high) & ((how != "dropped") | np.isfinite(angle))
        routes[column] = table.route[used]
        for length, reading, at_most in zip(table.route[used], angle[used], limit[used], strict=True):
            shown = 0.0 if how == "zero" and np.isnan(reading) else reading
            readings.append((shown, at_most, f"{column} at {length:g} {route.unit}"))
    detected = np.array([np.isfinite(reading) for reading, _, _ in readings], dtype=bool)
    order = np.concatenate([np.flatnonzero(detected), np.flatnonzero(~detected)])
    data = {
        "route": routes,
        "order": order,
        "angle": np.array([readings[i][0] for i in order[: detected.sum()]]),
        "limit": np.array([readings[i][1] for i in order[detected.sum() :]]),
    }
    return AnglesTerm(cable, data, tuple(readings[i][2] for i in order))


def _parameters(table: AngleTable, at: Circumstances) -> list[Parameter]:
    """Those of every curve, with priors by the angles inside its range, and how angles scatter."""
    route, degree, sd = at.description.route, float(np.rad2deg(1.0)), at.defaults.angle_noise_degrees
    assert route is not None  # an angle table is read only with one
    inside = (table.route >= route.range[0]) & (table.route <= route.range[1])
    read = {column: table.column(column)[0] for column in at.cable.curves}
    curves = [
        parameter
        for column, curve in at.cable.curves.items()
        for parameter in curve.parameters(read[column][np.isfinite(read[column]) & inside], at.defaults)
    ]
    noise = Parameter(
        ANGLE_NOISE, r"$\sigma_\theta$", at.noise.meaning("standard deviation of an angle reading"), "noise",
        HalfNormal(sd / degree), "deg", degree,
    )  # fmt: skip
    return [*curves, noise]


def drawn_angles(
    cable: Cable,
    table: AngleTable,
    angles: AngleTable | None,
    values: Mapping[str, jax.Array],
    key: jax.Array,
    scale: float,
    everywhere: bool = False,
) -> dict[str, jax.Array]:
    """Wrap angles and detection limits of an angle table [rad].

    Args:
        cable: The cable.
        table: The table.
        angles: The same.
        values: True values [internal units].
        key: Random key of the bench.
        scale: Factor on all noise.
        everywhere: Whether rows outside the range of the curves are drawn too; else they are kept.
    """
    del angles
    key, route = jax.random.split(key, 3)[0], jnp.asarray(table.route)
    theta = jnp.stack([curve.wrap_angle(values, route) for curve in cable.curves.values()], axis=-1)
    reading = theta + scale * values[ANGLE_NOISE] * scatter(key, theta.shape, cable.description)
    limit = detection_limit(cable.description, table)
    low, high = cable.description.route.range if cable.description.route else (-np.inf, np.inf)
    kept = np.zeros(len(table.route), dtype=bool) if everywhere else (table.route < low) | (table.route > high)
    undetected = reading < limit
    angle = jnp.where(undetected, jnp.nan, jnp.maximum(reading, 0.0))
    return {
        "angle": jnp.where(kept[:, None], table.angle, angle),
        "limit": jnp.where(kept[:, None], table.limit, jnp.where(undetected, limit, jnp.nan)),
    }


def detection_limit(description: Description, table: AngleTable) -> float:
    """The angle below which nothing is detected [rad]: that of the description, or the one in the table's cells.

    Raises:
        DatasetError: The cells name several, so that it is not known which one holds where an angle was detected.
    """
    settings = description.table(AngleSettings)
    if settings is not None and settings.detection_limit is not None:
        return settings.detection_limit.to("angle")
    limits = np.unique(table.limit[np.isfinite(table.limit)])
    if len(limits) > 1:
        shown = " and ".join(f"<{limit:.3g}" for limit in np.rad2deg(limits[:2]))
        raise DatasetError(
            f"{table.origin.files[0]} has cells with different detection limits ({shown} deg), so that it is not known what "
            "would be detected in the other cells; state detection_limit for the table in cable.toml."
        )
    return float(limits[0]) if len(limits) else -np.inf


ANGLES = TermKind(
    "angles",
    lambda cable, table, _: (angles_term(cable, table),),
    _parameters,
    Bench(drawn_angles, check=detection_limit),
)
