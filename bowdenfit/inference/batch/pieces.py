"""A piece of a fleet's work: some data sets of one shape with their seeds, whoever fits them and wherever."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.dataset import Dataset
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.batch.programs import BatchPrograms, BatchSettings
from bowdenfit.inference.batch.shapes import shape_dataset
from bowdenfit.inference.batch.stages import BatchFit
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.draws import derived_units, shown_values
from bowdenfit.inference.versions import refuse_other_versions

DRAWS = 2048  # of each data set, of equal weight
_SHUFFLE_STREAM = 3  # stream of random numbers that puts draws in no order


@dataclass(frozen=True)
class Example:
    """A data set that a program can be compiled for; any of one key will do.

    Args:
        key: See `Shaped`.
        dataset: One of those of this key.
    """

    key: str
    dataset: Dataset = field(compare=False)


@dataclass(frozen=True)
class Piece:
    """Data sets of one shape.

    Args:
        example: What is compiled for.
        settings: How carefully they are fitted.
        names: Of each.
        data: Of each, see `Shaped`.
        seeds: Of each.
        versions: Where the work comes from.
    """

    example: Example
    settings: BatchSettings
    names: tuple[str, ...]
    data: tuple[Any, ...]
    seeds: tuple[int, ...]
    versions: dict[str, str]


@dataclass(frozen=True)
class PieceFit:
    """What came of one data set.

    Args:
        name: Of it.
        values: Draws of equal weight in no order by quantity in shown units, (quantity, draw); none where nothing can be
            computed.
        engine: "laplace", "ensembles" or "nuts".
        pareto_k: See `BatchFit`.
        n_effective: Effective number of the draws, of the worst parameter.
        reasons: Why the draws should not be trusted; empty if they may.
    """

    name: str
    values: np.ndarray
    engine: str
    pareto_k: float
    n_effective: float
    reasons: tuple[str, ...]


def fit_piece(piece: Piece) -> list[PieceFit]:
    """What comes of each data set; depends on its own data, its seed and the settings alone.

    Args:
        piece: The work.

    Raises:
        UsageError: The work comes from a program of other versions.
    """
    refuse_other_versions(piece.versions)
    with jax.enable_x64(True):
        programs, values_of = _compile(piece.example, piece.settings)
        fits = fit_batch(programs.posterior, piece.data, piece.seeds, programs=programs)
        every = zip(piece.names, piece.data, piece.seeds, fits, strict=True)
        return [_make_piece_fit(name, data, seed, fit, values_of) for name, data, seed, fit in every]


@lru_cache(maxsize=8)
def _compile(example: Example, settings: BatchSettings) -> tuple[BatchPrograms, Callable[..., Any]]:
    """What serves all pieces of one shape."""
    posterior = shape_dataset(example.dataset).posterior
    model = posterior.model

    def shown(z: Array, data: Any) -> Array:
        values = shown_values(model, posterior.values(z, data))
        names = [*(p.name for p in model.space.free), *derived_units(model)]
        return jnp.stack([values[name] for name in names])

    rows = jax.ShapeDtypeStruct((DRAWS, model.space.size), jnp.float64)
    return BatchPrograms(posterior, settings), compile_program(jax.vmap(shown, (0, None), 1), rows, posterior.data)


def _make_piece_fit(name: str, data: Any, seed: int, fit: BatchFit, values_of: Callable[..., Any]) -> PieceFit:
    """A fit as the named values of as many draws as every data set has."""
    known = min((min(d.ess_bulk, d.ess_tail) for d in fit.diagnostics.values()), default=0.0)
    if not len(fit.z):
        return PieceFit(name, np.zeros((0, 0)), fit.engine, fit.pareto_k, known, fit.reasons)
    order = np.random.default_rng([seed, _SHUFFLE_STREAM]).permutation(len(fit.z))
    z = fit.z[np.resize(order, DRAWS)]
    return PieceFit(name, np.asarray(values_of(z, data)), fit.engine, fit.pareto_k, float(known), fit.reasons)
