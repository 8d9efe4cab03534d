"""Cables for tests: described in code, measured on the computer."""

from typing import Any

import jax
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.description import Description
from bowdenfit.kinds.descriptions import make_design, parse_description
from bowdenfit.kinds.kind import Design
from bowdenfit.models import build_model
from bowdenfit.questions.simulate.tables import draw_true_values, empty_tables, simulate_design

ROUTE = {"variable": "cable_length", "unit": "mm", "range": [400, 600]}


def _bell(column: str) -> dict[str, str]:
    """Where the angle of a contact comes from that follows a bell exactly, without a departure."""
    return {"curve": "gaussian", "column": column, "departure": "none"}


CONTACTS: tuple[dict[str, Any], ...] = (
    {"name": "free", "friction": "mu_free", "wrap_angle": _bell("free_angle")},
    {"name": "squeezed", "friction": "mu_squeezed", "wrap_angle": _bell("squeezed_angle")},
    {"name": "edge", "friction": "mu_edge", "wrap_angle": {"value": 45, "unit": "deg"}},
    {"name": "second free", "friction": "mu_free", "wrap_angle": _bell("second_angle")},
    {
        "name": "clamp",
        "friction": "mu_clamp",
        "wrap_angle": {"column": "clamp_angle", "nominal": {"value": 30, "unit": "deg"}},
    },
)
# True values [shown units]: one angle rises with the length, one falls, one hardly changes.
TRUTH = {
    "mu_free": 0.09, "mu_squeezed": 0.14, "mu_edge": 0.17, "mu_clamp": 0.12,
    "free_angle_a": -0.7, "free_angle_b": 1.3, "free_angle_c": 0.25,
    "squeezed_angle_a": -0.9, "squeezed_angle_b": -1.4, "squeezed_angle_c": 0.2,
    "second_angle_a": -0.4, "second_angle_b": 0.4, "second_angle_c": 0.6,
    "sigma_theta": 2.0, "tau": 0.01, "sigma_F": 0.4,
}  # fmt: skip
LENGTHS = tuple(np.linspace(400.0, 600.0, 11))
RUN_LENGTHS = (400.0, 430.0, 460.0, 490.0, 520.0, 550.0, 580.0, 600.0)
DESIGN = make_design(
    angles=LENGTHS,
    efficiencies=(410.0, 450.0, 490.0, 530.0, 570.0),
    runs=RUN_LENGTHS,
    input_forces=(20.0, 40.0, 60.0, 80.0),
    own_angles={"clamp_angle": (10.0, 60.0, 25.0, 80.0, 5.0, 45.0, 70.0, 20.0)},
)


def other_design(**measured_otherwise: Any) -> Design:
    """The usual design, but for what is said."""
    return make_design(**dict(DESIGN) | measured_otherwise)


def cable(n_contacts: int, tables: tuple[str, ...] | dict[str, Any] = ("angles", "forces"), **more: Any) -> Description:
    """A cable of 1 to 5 contacts; from the fourth on two of them share a coefficient."""
    raw = {
        "name": f"cable of {n_contacts} contacts",
        "route": ROUTE,
        "contact": list(CONTACTS[:n_contacts]),
        "tables": tables if isinstance(tables, dict) else {name: {"file": f"{name}.csv"} for name in tables},
    }
    return parse_description(raw | more)


def measured(
    description: Description, seed: int = 0, *, design: Design = DESIGN, noise: bool = True, once: bool = False, **truth: float
) -> tuple[Dataset, dict[str, float]]:
    """What a bench reads on a cable, and the true values of its parameters [internal units]; `once` is that of `simulate`."""
    tables = empty_tables(description, design)
    names = {p.name for p in build_model(Dataset(description, tables, {})).space.parameters}
    of_truth, of_readings = jax.random.split(jax.random.key(seed))
    wanted = {name: value for name, value in (TRUTH | truth).items() if name in names}
    values = draw_true_values(description, tables, wanted, of_truth, once)
    return simulate_design(description, design, values, of_readings, noise, once), values
