"""Wrap angles of the rows of a table: measured ones and their errors, and values at given parameters."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import ANGLE_NOISE, CableContacts
from bowdenfit.description import Description
from bowdenfit.kinds.rows import ForceRows
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.types import DataArray

ROUNDING = 1e-9  # share of a route value by which another may differ and be the same, above rounding of units


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RowAngles:
    """Wrap angle of each row of a table: the curve's, or its own measured one with its error.

    Args:
        route: Route variable of each row, (rows); 0 without one.
        own: Own angle of each row and contact [rad], (rows, contacts); 0 without one.
        is_own: Whether a row has an angle of its own there, (rows, contacts).
        known_variance: Its stated variance [rad^2], (rows, contacts); 0 without one.
        noisy: Whether the noise of the angle table applies to it, (rows, contacts).
        group: Number of each row's group, (rows); 0 without groups.
    """

    route: DataArray
    own: DataArray
    is_own: DataArray
    known_variance: DataArray
    noisy: DataArray
    group: DataArray

    @property
    def is_exact(self) -> bool:
        """Whether no own angle has an error."""
        return not (self.known_variance.any() or self.noisy.any())

    def select(self, rows: Any) -> "RowAngles":
        """Return the angles of some rows."""
        angles: RowAngles = jax.tree.map(lambda values: values[rows], self)
        return angles


def collect_row_angles(description: Description, table: ForceRows, angles: AngleTable | None) -> RowAngles:
    """Return what is known of the wrap angles of a table's rows before any parameter is.

    A row's own angle comes first; then, outside the range of the curves, the angle table's row at the same length;
    else the curve. An own angle without a stated sd has the angle table's noise where its contact has a curve, and is
    exact otherwise. An angle too small to detect outside the range counts as half the limit, sd limit/sqrt(12).
    """
    contacts, n = description.contact, len(table.route)
    own, sd, noisy = (
        np.zeros((n, len(contacts))),
        np.zeros((n, len(contacts))),
        np.zeros((n, len(contacts)), dtype=bool),
    )
    is_own = np.zeros((n, len(contacts)), dtype=bool)
    for k, contact in enumerate(contacts):
        if contact.wrap_angle.column is None:
            continue
        angle, angle_sd = table.own.column(contact.wrap_angle.column)
        if contact.wrap_angle.curve and angles is not None:
            angle, angle_sd = _complete_outside_curves(
                description, contact.wrap_angle.column, table.route, angle, angle_sd, angles
            )
        has = ~np.isnan(angle)
        own[has, k], is_own[has, k] = angle[has], True
        sd[has, k] = np.nan_to_num(angle_sd[has])
        noisy[has, k] = np.isnan(angle_sd[has]) & bool(contact.wrap_angle.curve)
    return RowAngles(np.nan_to_num(table.route), own, is_own, sd**2, noisy, np.zeros(n, dtype=int))


def _complete_outside_curves(
    description: Description, column: str, route: np.ndarray, angle: np.ndarray, sd: np.ndarray, angles: AngleTable
) -> tuple[np.ndarray, np.ndarray]:
    """Complete own angles from the angle table for rows outside the range of the curves."""
    limits = description.route
    angle, sd = angle.copy(), sd.copy()
    for i in np.flatnonzero(np.isnan(angle)):
        if limits is None or limits.range[0] <= route[i] <= limits.range[1]:
            continue
        measured = find_measured_angle(angles, column, float(route[i]))
        if measured is not None:
            angle[i], sd[i] = measured[0], sd[i] if np.isnan(measured[1]) else measured[1]
    return angle, sd


def find_measured_angle(angles: AngleTable, column: str, at: float) -> tuple[float, float] | None:
    """Return the wrap angle that the angle table has at a route value, and its standard deviation [rad]; None without a row.

    The standard deviation is NaN, for that of the angle table's noise, unless the angle was too small to detect there.
    """
    measured, detection_limit = angles.column(column)
    mask = np.isclose(angles.route, at, rtol=ROUNDING, atol=0.0)
    if not mask.any():
        return None
    undetected = np.isnan(measured[mask])
    readings = np.where(undetected, detection_limit[mask] / 2, measured[mask])
    sd = float(np.nanmax(detection_limit[mask])) / np.sqrt(12) if undetected.any() else np.nan
    return float(readings.mean()), sd


def resolve_angles(
    cable: CableContacts, values: Mapping[str, Array], rows: RowAngles
) -> tuple[Float[Array, "rows contacts"], Float[Array, "rows contacts"]]:
    """Return wrap angle [rad] and its variance [rad^2] for each row and contact, at given parameters."""
    angles = jnp.where(rows.is_own, rows.own, cable.wrap_angles(values, rows.route))
    variance = rows.known_variance
    if ANGLE_NOISE in values:
        variance = variance + jnp.where(rows.noisy, values[ANGLE_NOISE] ** 2, 0.0)
    return angles, jnp.asarray(variance)
