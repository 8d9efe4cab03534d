"""Densities at many draws of the parameters at once."""

import jax
import numpy as np

from bowdenfit.inference.compilation import compile_program
from bowdenfit.models import Model


def over_rows(function, z: np.ndarray, data):
    """A function of one z, for every row of many; compiled in haste, because it runs once."""
    program = compile_program(jax.vmap(function, in_axes=(0, None)), z, data, run_once=True)
    return jax.tree.map(np.asarray, program(z, data))


def draws(model: Model, n: int, seed: int, scale: float = 1.0) -> np.ndarray:
    return scale * np.random.default_rng(seed).standard_normal((n, model.space.size))
