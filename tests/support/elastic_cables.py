"""Cables that stretch, and pull-pull loops, for tests: described in code, measured on the computer."""

from typing import Any

import jax

from bowdenfit.dataset import Dataset
from bowdenfit.description import Description
from bowdenfit.kinds.descriptions import make_design, parse_description
from bowdenfit.models import build_model
from bowdenfit.questions.simulate.tables import draw_true_values, empty_tables, simulate_design

HOUSING: dict[str, Any] = {
    "name": "housing",
    "friction": "mu",
    "wrap_angle": {"column": "wrap_angle", "nominal": {"value": 90, "unit": "deg"}},
}
FOLLOWS = {"model": "stretch", "wrap_angle": {"value": 90, "unit": "deg"}}
CONSTANT = {"model": "constant"}
TABLES = ("stretch", "preload", "loop")
# The synthetic haptic loop [shown units].
TRUTH = {
    "mu": 0.07, "stiffness": 35.0, "bedding_stretch": 0.4, "bedding_load": 15.0, "lengthening": 0.0061,
    "stretch_zero": 0.3, "preload": 10.0, "sigma_L": 0.02, "sigma_P": 0.3, "sigma_F": 0.3, "mu_stretch": 0.1,
}  # fmt: skip


Parts = dict[str, dict[str, Any]]
ELASTIC: Parts = {
    "stretch": {
        "loads": (1.0, 3.0, 6.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0, 80.0, 100.0),
        "wrap_angles": (0, 45, 90, 135, 180),
        "unloading": True,
    },
    "preload": {"wrap_angles": (0, 15, 30, 60, 90, 120, 150, 180)},
    "loop": {
        "wrap_angles": (45, 90, 135, 180),
        "input_forces": (5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0),
        "strokes": ("pull", "return"),
        "free_motion": (45, 90, 135, 180),
    },
}


def changed(design: Parts, **parts: dict[str, Any]) -> Parts:
    """A design with some of its parts measured otherwise."""
    return {name: part | parts.get(name, {}) for name, part in design.items()}


def elastic_cable(
    tables: tuple[str, ...] = TABLES, *, kind: str = "loop", stretch: dict[str, Any] | None = None, **more: Any
) -> Description:
    """A cable of one contact whose wrap angle is measured; by default a loop whose preload follows the stretch."""
    raw = {
        "name": "elastic cable",
        "cable": {"kind": kind},
        "contact": [HOUSING],
        "stretch": {"friction": "mu"} if stretch is None else stretch,
        "preload": FOLLOWS,
        "tables": {name: {"file": f"{name}.csv"} for name in tables},
    }
    return parse_description(raw | more)


def bench(
    description: Description, truth: dict[str, float], seed: int = 0, *, noise: bool = True, design=ELASTIC, once: bool = False
) -> tuple[Dataset, dict[str, float]]:
    """What a bench reads, and the true values [internal units]; those that are not stated are drawn from their priors.

    Of the stated ones only those count that the cable has and that are not fixed. `once` is that of `simulate`.
    """
    of_truth, of_readings = jax.random.split(jax.random.key(seed))
    measured = make_design(**design)
    empty = empty_tables(description, measured)
    free = {p.name for p in build_model(Dataset(description, empty, {})).space.free}
    wanted = {name: value for name, value in truth.items() if name in free}
    values = draw_true_values(description, empty, wanted, of_truth, once)
    return simulate_design(description, measured, values, of_readings, noise, once), values
