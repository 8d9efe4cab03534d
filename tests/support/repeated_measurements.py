"""A data set's tables measured again and again with stated true values."""

import json
from collections.abc import Iterator
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.dataset import Dataset, load_dataset
from bowdenfit.kinds.tables import Measurements
from bowdenfit.kinds.terms import draw_readings, iterate_replaced_tables
from bowdenfit.models import build_model


def measured_again(folder: Path, count: int, changes: list[str] | None = None, **values: float) -> Iterator[Dataset]:
    """The data set `count` times, with the readings of other draws of all that is random.

    Args:
        folder: A data set whose true values stand in its truth.json [shown units].
        count: How many; seeds are 0 to count - 1.
        changes: To its description.
        values: True values instead of those of the file, or of parameters that it does not have [internal units].
    """
    with jax.enable_x64(True):
        dataset = load_dataset(folder, changes or [])
        model, tables = build_model(dataset), dataset.measurements
        stated_truth = json.loads((folder / "truth.json").read_text())["truth"]
        truth = {p.name: stated_truth.get(p.name, 0.0) / p.shown_scale for p in model.space.parameters} | values
        named = {name: jnp.asarray(value) for name, value in truth.items()}
        draw = jax.jit(lambda key: draw_readings(model.cable, tables, named, key))
        for seed in range(count):
            draws = jax.tree.map(np.asarray, draw(jax.random.key(seed)))
            again = Measurements(tuple(iterate_replaced_tables(dataset.description, tables, draws)))
            yield Dataset(dataset.description, again, {})
