"""Priors of single numbers, by one compiled program for all priors of a kind."""

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.inference.compilation import compile_program
from bowdenfit.parameters.priors import Prior

FARTHEST = 6.0  # z where a solve may start: two in a thousand million draws of a prior lie beyond


def value_at(prior: Prior, z: float) -> float:
    """Return the parameter value at z: `Prior.constrain` of one number."""
    return _apply(prior, "constrain", z)


def z_at(prior: Prior, value: float) -> float:
    """Return z at a parameter value: `Prior.unconstrain` of one number."""
    return _apply(prior, "unconstrain", value)


def clipped_z(prior: Prior, value: float) -> float:
    """Return z at a parameter value, clipped to where a solve may start or a noise scale may be pinned."""
    return float(np.clip(z_at(prior, value), -FARTHEST, FARTHEST))


def _apply(prior: Prior, way: str, number: float) -> float:
    with jax.enable_x64(True):
        return float(_program(type(prior), way)({name: float(value) for name, value in vars(prior).items()}, float(number)))


@cache
def _program(kind: Any, way: str) -> Callable[..., Any]:
    number = jax.ShapeDtypeStruct((), jnp.float64)
    prior = {field.name: number for field in fields(kind)}
    return compile_program(lambda prior, x: getattr(kind(**prior), way)(x), prior, number, run_once=True)
