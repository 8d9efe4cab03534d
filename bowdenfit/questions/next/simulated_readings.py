"""Readings that could be taken next: what each draw of the posterior would give as the reading of each candidate."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.draws import for_each_draw
from bowdenfit.kinds.candidate import Candidate
from bowdenfit.kinds.tables import Measurements
from bowdenfit.kinds.terms import candidate_kinds
from bowdenfit.model import Model
from bowdenfit.questions.next.candidates import build_situation


def simulate_readings(
    model: Model,
    measurements: Measurements,
    candidates: Sequence[Candidate],
    z: np.ndarray,
    seed: int,
    repeats: int = 1,
) -> list[np.ndarray]:
    """The reading of each candidate as each draw would give it: arrays over draws, repeats and columns.

    Args:
        model: The fitted model; its parameters stay as they are.
        measurements: What was measured so far, whose angles hold outside the range of the curves.
        candidates: The candidates.
        z: Draws of the posterior, one a row.
        seed: Seed of the noise.
        repeats: How often each reading is taken, each time with a new mounting where it has one.
    """
    by_kind: dict[str, list[Candidate]] = {}
    for candidate in candidates:
        by_kind.setdefault(candidate.kind, []).append(candidate)
    situation, kinds = build_situation(model, measurements), candidate_kinds()
    parts = {name: kinds[name].simulation(situation, of_kind) for name, of_kind in by_kind.items()}
    data, key = {name: part.data for name, part in parts.items()}, jax.random.key(seed)

    def readings(z_and_number: Array, data: Any, key: Array) -> dict[str, Array]:
        values, number = model.space.constrain(z_and_number[:-1]), z_and_number[-1].astype(jnp.uint32)
        keys = jax.random.split(jax.random.fold_in(key, number), (len(parts), repeats))
        return {
            name: jax.vmap(lambda k, part=part, name=name: part.simulate(values, data[name], k))(keys[i])
            for i, (name, part) in enumerate(parts.items())
        }

    program = for_each_draw(readings, model.space.size + 1, data, key, run_once=True)
    simulated = program(np.column_stack([z, np.arange(len(z), dtype=float)]))
    columns = {name: iter(part.columns) for name, part in parts.items()}
    return [np.maximum(simulated[c.kind][:, :, list(next(columns[c.kind]))], parts[c.kind].lowest) for c in candidates]
