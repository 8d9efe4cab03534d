"""Efficiency tables whose rows carry their own wrap angles: the friction exponent is linear in the coefficients."""

from typing import Any

import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.kinds.efficiencies.kind import EfficiencyTable
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.kinds.tables import Measurements


def of_rows(loss: np.ndarray, angle: np.ndarray, angle_sd: float | np.ndarray = 0.0, **more: Any) -> Dataset:
    """A cable of as many contacts as there are columns of angles, none of which has a curve.

    Args:
        loss: Minus the log of each row's efficiency [1].
        angle: Wrap angle of each row and contact [rad].
        angle_sd: Its standard deviation [rad].
        more: Other sections of the description.
    """
    n, k = angle.shape
    contacts = [
        {
            "name": f"contact {i + 1}",
            "friction": f"mu{i + 1}",
            "wrap_angle": {"column": f"angle_{i + 1}", "nominal": {"value": 60, "unit": "deg"}},
        }
        for i in range(k)
    ]
    tables = {"efficiencies": {"file": "efficiencies.csv"}}
    description = parse_description({"name": "rows", "contact": contacts, "tables": tables} | more)
    own_angles = OwnAngles(tuple(f"angle_{i + 1}" for i in range(k)), angle, np.broadcast_to(angle_sd, angle.shape).copy())
    origin = RowOrigin(("efficiencies.csv",), np.zeros(n, dtype=int), np.arange(2, n + 2))
    table = EfficiencyTable(np.full(n, np.nan), np.exp(-loss), np.zeros(n), own_angles, origin)
    return Dataset(description, Measurements((table,)), {})
