"""Prior predictive check: readings that the priors alone allow beside those that were measured, before any fit."""

from dataclasses import dataclass
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
from bowdenfit.model import Model, build_model
from bowdenfit.questions.check.answer import readings_of
from bowdenfit.results.along_route import route_grid

QUANTILES = (0.005, 0.05, 0.5, 0.95, 0.995)
_DRAWS = 4096


@dataclass(frozen=True)
class PriorTable:
    """Readings of one table beside their prior predictive quantiles.

    Args:
        name: What they are, in words.
        label: Axis label of the readings.
        numbers: Where they were taken, the first that varies.
        place: Its axis label.
        group: Contact or the like of each reading.
        labels: Each reading in words.
        reading: As measured; NaN of readings that are only a bound.
        quantiles: 0.5 %, 5 %, 50 %, 95 % and 99.5 % quantiles (first axis) of readings by the priors.
        outside: Whether each reading lies outside the widest of these intervals.
    """

    name: str
    label: str
    numbers: np.ndarray
    place: str
    group: tuple[str, ...]
    labels: tuple[str, ...]
    reading: np.ndarray
    quantiles: np.ndarray
    outside: np.ndarray


@dataclass(frozen=True)
class PriorPredictive:
    """Prior predictive readings and efficiencies of a cable.

    Args:
        name: Name of the cable.
        tables: By table.
        route_label: Axis label of the route; empty without one.
        route: Route values of the curve.
        efficiency: Quantiles (first axis, as in `PriorTable`) of the efficiency there; empty without a route.
    """

    name: str
    tables: tuple[PriorTable, ...]
    route_label: str = ""
    route: np.ndarray | None = None
    efficiency: np.ndarray | None = None


def prior_predictive(dataset: Dataset, seed: int = 0) -> PriorPredictive:
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


def _draw_from_priors(model: Model, z: np.ndarray, seed: int) -> dict[str, Any]:
    """Readings of every table, and efficiencies along the route, of every draw (rows)."""
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
    return np.nanquantile(np.where(np.isfinite(draws), draws, np.nan), QUANTILES, axis=0)


def _prior_table(dataset: Dataset, term: Term, draws: np.ndarray) -> PriorTable:
    """One table's readings beside their quantiles; a reading that is only a bound is outside where it is too low for them."""
    naming = find_readings(term.name)
    scale, (reading, at_most) = naming.shown_scale, readings_of(term)
    quantiles, reading = scale * _quantiles(draws), scale * reading
    outside = (reading < quantiles[0]) | (~at_most & (reading > quantiles[-1]))
    positions = collect_covariates(dataset.description, dataset.measurements, term)
    label, numbers = next(iter(positions.numbers.items()))
    return PriorTable(
        naming.words, naming.axis, numbers, label, positions.group,
        term.labels, np.where(at_most, np.nan, reading), quantiles, outside,
    )  # fmt: skip
