"""Angle tables measured again on the computer."""

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.cable.cable import ANGLE_NOISE
from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.angles.table import AngleSettings, AngleTable
from bowdenfit.kinds.bench import Truth


def drawn_angles(table: AngleTable, truth: Truth, everywhere: bool = False) -> dict[str, jax.Array]:
    """Wrap angles and detection limits of an angle table [rad].

    Args:
        table: The table.
        truth: What it is measured with.
        everywhere: Whether rows outside the range of the curves are drawn too; else they are kept.
    """
    cable, key, route = truth.cable, jax.random.split(truth.key, 3)[0], jnp.asarray(table.route)
    theta = jnp.stack([curve.wrap_angle(truth.values, route) for curve in cable.curves.values()], axis=-1)
    reading = theta + truth.scale * truth.values[ANGLE_NOISE] * truth.scatter(key, theta.shape)
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
