"""Pieces of a fleet's work: what a worker does with some of its data sets."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.dataset import DESCRIPTION_FILE, Dataset
from bowdenfit.inference.batch.fitting import BatchFit, fit_batch
from bowdenfit.inference.batch.programs import BatchPrograms, BatchSettings
from bowdenfit.inference.batch.shaped_data import digest, drop_irrelevant_keys, shape_dataset
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.draws import derived_units, shown_values
from bowdenfit.inference.engines import refuse_other_versions

DRAWS = 2048  # draws of each data set, of equal weight
_SHUFFLE_STREAM = 3  # stream of random numbers that shuffles draws


def input_hash(dataset: Dataset) -> str:
    """Return a digest of what was measured and how it is described, independent of its name and folder.

    Args:
        dataset: A data set read from files.
    """
    read = [checksum for name, checksum in dataset.sha256.items() if name != DESCRIPTION_FILE]
    return digest(f"{drop_irrelevant_keys(dataset.description.to_json())} {read}")


@dataclass(frozen=True)
class Example:
    """A data set that a program can be compiled for; any data set of one key will do.

    Args:
        key: See `ShapedDataset`.
        dataset: One of the data sets with this key.
    """

    key: str
    dataset: Dataset = field(compare=False)


@dataclass(frozen=True)
class Piece:
    """Data sets of one shape, a unit of work.

    Args:
        example: Data set that the program is compiled for.
        settings: Sampler settings and targets.
        names: Name of each data set.
        data: Data of each, see `ShapedDataset`.
        seeds: Seed of each.
        versions: Versions of the libraries where the work comes from.
    """

    example: Example
    settings: BatchSettings
    names: tuple[str, ...]
    data: tuple[Any, ...]
    seeds: tuple[int, ...]
    versions: dict[str, str]


@dataclass(frozen=True)
class PieceFit:
    """The fit of one data set of a piece.

    Args:
        name: Name of the data set.
        values: Shuffled draws of equal weight by quantity in shown units, (quantity, draw); empty where nothing can be
            computed.
        engine: "laplace", "ensembles" or "nuts".
        pareto_k: See `BatchFit`.
        n_effective: Effective sample size of the worst parameter.
        reasons: Why the draws should not be trusted; empty if they can be.
    """

    name: str
    values: np.ndarray
    engine: str
    pareto_k: float
    n_effective: float
    reasons: tuple[str, ...]


def fit_piece(piece: Piece) -> list[PieceFit]:
    """Fit each data set of a piece; each fit depends on its own data, its seed and the settings alone.

    Args:
        piece: The data sets.

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
    """Compile the programs that serve all pieces of one shape."""
    posterior = shape_dataset(example.dataset).posterior
    model = posterior.model

    def stack_shown_values(z: Array, data: Any) -> Array:
        values = shown_values(model, posterior.values(z, data))
        names = [*(p.name for p in model.space.free), *derived_units(model)]
        return jnp.stack([values[name] for name in names])

    rows = jax.ShapeDtypeStruct((DRAWS, model.space.size), jnp.float64)
    return BatchPrograms(posterior, settings), compile_program(jax.vmap(stack_shown_values, (0, None), 1), rows, posterior.data)


def _make_piece_fit(name: str, data: Any, seed: int, fit: BatchFit, values_of: Callable[..., Any]) -> PieceFit:
    """Return a fit as named values of a fixed number of draws."""
    n_effective = min((min(d.ess_bulk, d.ess_tail) for d in fit.diagnostics.values()), default=0.0)
    if not len(fit.z):
        return PieceFit(name, np.zeros((0, 0)), fit.engine, fit.pareto_k, n_effective, fit.reasons)
    order = np.random.default_rng([seed, _SHUFFLE_STREAM]).permutation(len(fit.z))
    z = fit.z[np.resize(order, DRAWS)]
    return PieceFit(name, np.asarray(values_of(z, data)), fit.engine, fit.pareto_k, float(n_effective), fit.reasons)
