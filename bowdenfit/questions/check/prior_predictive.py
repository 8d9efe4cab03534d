"""Prior predictive check: readings that the priors alone allow beside the measured ones, before any fit; and in sentences."""

from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.dataset import Dataset
from bowdenfit.inference.draws import for_each_draw
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds import find_readings
from bowdenfit.kinds.covariates import collect_covariates
from bowdenfit.kinds.term import Term
from bowdenfit.models import Model, build_model
from bowdenfit.questions.check import prior_figure
from bowdenfit.questions.check.answer import collect_readings
from bowdenfit.questions.check.prior_figure import PriorPredictive, PriorTable
from bowdenfit.questions.figure_files import write_figure
from bowdenfit.results.along_route import route_grid
from bowdenfit.results.answer_cache import copy_captions
from bowdenfit.results.folder import fill_folder_atomically
from bowdenfit.words import counted, few, filled, significant

FIGURE = "prior_predictive"
QUANTILES = (0.005, 0.05, 0.5, 0.95, 0.995)
_DRAWS = 4096  # so that 20 of them lie beyond each of the outer quantiles
WORTH_WARNING = (
    0.2  # share of readings outside the central 99 %: by Markov's inequality in at most 1 of 20 good data sets
)
_MAX_NAMED_OUTSIDE = 3  # readings outside that are named; the others are counted


def predict_from_priors(dataset: Dataset, seed: int = 0) -> PriorPredictive:
    """Draw readings and efficiencies from the priors of a data set, without a fit.

    Needs 64-bit floats: `jax.enable_x64(True)`.

    Args:
        dataset: The data set.
        seed: Seed of the draws from the priors.
    """
    model = build_model(dataset)
    draws = _draw_from_priors(model, np.random.default_rng(seed).standard_normal((_DRAWS, model.space.size)), seed)
    tables = tuple(_prior_table(dataset, term, draws["readings"][term.name]) for term in model.terms if term.labels)
    name, route = dataset.description.name, dataset.description.route
    if route is None:
        return PriorPredictive(name, tables)
    return PriorPredictive(name, tables, route.label, route_grid(model), 100 * _quantiles(draws["efficiency"]))


def check_priors(dataset: Dataset) -> None:
    """Build the model of a data set, which refuses names and priors that the description alone cannot judge.

    Raises:
        DescriptionError: There is such a name or prior.
    """
    with jax.enable_x64(True):
        build_model(dataset)


def show_priors(dataset: Dataset, folder: str | Path, seed: int = 0) -> PriorPredictive:
    """Draw the readings that the priors alone allow beside the measured ones, as PNG, SVG and PDF; fit nothing.

    Args:
        dataset: The data set.
        folder: Where the figure goes; made if missing.
        seed: Seed of the draws from the priors.

    Returns:
        What the figure shows.

    Raises:
        StoreError: The folder cannot be written.
    """
    with jax.enable_x64(True):
        predictive = predict_from_priors(dataset, seed)
    with fill_folder_atomically(Path(folder)) as place:
        copy_captions(Path(folder), place)
        write_figure(prior_figure, predictive, place, FIGURE, predictive.name)
    return predictive


def _draw_from_priors(model: Model, z: np.ndarray, seed: int) -> dict[str, Any]:
    """Return readings of every table, and efficiencies along the route, of every draw (rows)."""
    key, data = jax.random.key(seed), LogDensity(model).data
    route = None if model.description.route is None else jnp.asarray(route_grid(model))

    def implied(z_and_number: Array, data: Any, key: Array) -> dict[str, Any]:
        values = model.space.constrain(z_and_number[:-1])
        keys = jax.random.split(jax.random.fold_in(key, z_and_number[-1].astype(jnp.uint32)), max(len(data), 1))
        terms = zip(model.terms, data, keys, strict=False)
        readings = {t.name: t.simulate(values, d, k) for t, d, k in terms}
        return {"readings": readings} | (
            {} if route is None else {"efficiency": model.cable.efficiency_at(values, route)}
        )

    program = for_each_draw(implied, model.space.size + 1, data, key, run_once=True)
    return program(np.column_stack([z, np.arange(len(z), dtype=float)]))


def _quantiles(draws: np.ndarray) -> np.ndarray:
    """Return the quantiles of draws over the first axis."""
    return np.nanquantile(np.where(np.isfinite(draws), draws, np.nan), QUANTILES, axis=0)


def _prior_table(dataset: Dataset, term: Term, draws: np.ndarray) -> PriorTable:
    """Return the readings of a table beside their quantiles; a reading that is only a bound is outside if it is too low."""
    naming = find_readings(term.name)
    scale, (reading, at_most) = naming.shown_scale, collect_readings(term)
    quantiles, reading = scale * _quantiles(draws), scale * reading
    outside = (reading < quantiles[0]) | (~at_most & (reading > quantiles[-1]))
    positions = collect_covariates(dataset.description, dataset.measurements, term)
    label, numbers = next(iter(positions.numbers.items()))
    return PriorTable(
        naming.words, naming.axis, numbers, label, positions.group,
        term.labels, np.where(at_most, np.nan, reading), quantiles, outside,
    )  # fmt: skip


def describe_prior_predictive(predictive: PriorPredictive) -> str:
    """Name the readings outside what the priors allow, and what to do about them.

    Args:
        predictive: The prior predictive draws beside the readings.
    """
    lines = [line for table in predictive.tables if (line := _describe_table(table))]
    if not lines:
        n = sum(len(table.outside) for table in predictive.tables)
        lie = "The reading lies" if n == 1 else f"All {n} readings lie"
        lines = [f"{lie} inside the central 99 % of what the priors alone allow."]
    return "\n".join(filled(line) for line in lines) + "\n"


def _describe_table(table: PriorTable) -> str:
    """Describe a table; by Markov's inequality, a fifth of its readings lies outside 1 % in at most 1 of 20 cases."""
    n, outside = len(table.outside), [i for i, out in enumerate(table.outside) if out]
    if not outside:
        return ""
    lie = "lies" if len(outside) == 1 else "lie"
    statement = (
        f"{len(outside)} of {counted(n, 'reading')} ({table.name}: {_name_readings(table, outside)}) {lie} outside "
        "the central 99 % of what the priors allow"
    )
    if len(outside) < WORTH_WARNING * n:
        return f"{statement}; a few may by chance, but look at {'it' if len(outside) == 1 else 'them'}."
    return (
        f"Warning: {statement}. The usual cause is a wrong unit: check those of the table, then those of the wrap angles. "
        "Otherwise the priors are too narrow for this cable, and [friction] and [prior] in cable.toml can widen them."
    )


def _name_readings(table: PriorTable, outside: list[int]) -> str:
    """Name the first few readings, with what was read and what the priors allow."""
    return few((f"{table.labels[i]}{_reading_and_range(table, i)}" for i in outside), _MAX_NAMED_OUTSIDE)


def _reading_and_range(table: PriorTable, i: int) -> str:
    """Return a reading and the range that the priors allow it, in words."""
    low, high = table.quantiles[0][i], table.quantiles[-1][i]
    read = f"{significant(table.reading[i])}, " if table.reading[i] == table.reading[i] else ""
    return f" [{read}priors {significant(low)} to {significant(high)}]"
