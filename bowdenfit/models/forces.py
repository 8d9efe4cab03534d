"""Force tables: four numbers a run, the effect of its mounting integrated out; held readings as intervals."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.stats import norm
from jaxtyping import Float

from bowdenfit.measurements.tables import AngleTable, ForceTable
from bowdenfit.models.cable import Cable, resolve_angles, row_angles
from bowdenfit.models.scatter import FORCE_NOISE, GAIN_ERROR, RUN_SCATTER
from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.physics.normal_tail import log_normal_cdf

_ROW_ARRAYS = ("route", "own", "is_own", "known_variance", "noisy")


@dataclass(frozen=True)
class SlidingForcesTerm:
    r"""Likelihood of the sliding rows of a force table, one value a run.

    With the log ratio :math:`r = s \log(F_\text{in}/F_\text{out})`, s = +1 pulling and -1 return,

    .. math:: r_{ij} = \Lambda_{ij} + s_{ij} g + m_i + e_{ij}, \quad m_i \sim \text{Normal}(0, \tau), \quad
              e_{ij} \sim \text{Normal}(0, \sigma_F / \sqrt{w_{ij}}), \quad
              w = 1 / (F_\text{in}^{-2} + F_\text{out}^{-2})

    and m integrated out in closed form. Rows of one run at the same angles and stroke are one cell, so that the cost
    does not grow with the length of a recording.

    Args:
        cable: The cable.
        data: Arrays over cells (wrap angles, stroke, weight, mean log ratio) and over runs (n, sums).
        labels: Each run in words.
    """

    cable: Cable
    data: dict[str, Any]
    labels: tuple[str, ...]
    name: str = "run_efficiency"
    unit: str = "1"
    noise: str = RUN_SCATTER

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Runs scatter by their mounting; the cells of a run about its mean by the load cells."""
        runs, cells = len(self.labels), len(self.data["mean"])
        return ((runs, runs), (cells, cells - runs))

    def _deviations(
        self, values: Mapping[str, Array], data: Mapping[str, Any], weights: Mapping[str, Array]
    ) -> tuple[Float[Array, " cells"], Float[Array, " runs"], Float[Array, " runs"]]:
        """Deviation of each cell from its run's mean, mean deviation of each run, and the sd of the latter."""
        angles, variance = resolve_angles(self.cable, values, data)
        exponent = self.cable.friction_exponent(values, angles) + data["stroke"] * values.get(GAIN_ERROR, 0.0)
        deviation, total = data["mean"] - exponent, data["run_weight"]
        run_mean = self._per_run(data, deviation) / total
        from_angles = self._per_run(data, self.cable.exponent_variance(weights, angles, variance)) / total
        run_sd = jnp.sqrt(weights[RUN_SCATTER] ** 2 + from_angles + weights[FORCE_NOISE] ** 2 / total)
        return deviation - run_mean[data["run"]], run_mean, run_sd

    def _per_run(self, data: Mapping[str, Any], cells: Float[Array, " cells"]) -> Float[Array, " runs"]:
        """Weighted sum over the cells of each run."""
        return jnp.zeros_like(data["run_weight"]).at[data["run"]].add(data["weight"] * cells)

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs"]:
        """Log likelihood of each run, all samples together."""
        within, run_mean, run_sd = self._deviations(values, data, values)
        noise, n = values[FORCE_NOISE], data["n"]
        scatter = data["scatter"] + self._per_run(data, within**2)
        constant = (data["log_weights"] - jnp.log(data["run_weight"]) - (n - 1) * jnp.log(2 * jnp.pi)) / 2
        inside = constant - (n - 1) * jnp.log(noise) - scatter / (2 * noise**2)
        return inside + norm.logpdf(run_mean, 0.0, run_sd)

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " cells_and_runs"]:
        """Standardized residuals: between runs, and between the cells of a run."""
        within, run_mean, run_sd = self._deviations(values, data, jax.lax.stop_gradient(dict(values)))
        inside = jnp.sqrt(data["weight"]) * within / jax.lax.stop_gradient(values[FORCE_NOISE])
        return jnp.concatenate([run_mean / jax.lax.stop_gradient(run_sd), inside])

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs"]:
        """Expected efficiency of each run, the effect of its mounting left out [1]."""
        _, run_mean, _ = self._deviations(values, data, values)
        return transmission_efficiency(data["run_mean"] - run_mean)

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " runs"]:
        """Efficiency of each run as the bench would give it [1]."""
        _, run_mean, run_sd = self._deviations(values, data, values)
        return transmission_efficiency(data["run_mean"] - run_mean + run_sd * jax.random.normal(key, run_sd.shape))

    def observed(self) -> np.ndarray:
        """Mean efficiency of each run [1]."""
        return np.exp(-self.data["run_mean"])


@dataclass(frozen=True)
class HeldForcesTerm:
    r"""Likelihood of forces read while nothing slides: inside the friction band, nothing more.

    .. math:: \log\left[\Phi\left(\frac{\Lambda - r}{s}\right) - \Phi\left(\frac{-\Lambda - r}{s}\right)\right],
              \quad r = \log(F_\text{in}/F_\text{out}), \quad s^2 = \tau^2 + \sigma_F^2 / w

    Args:
        cable: The cable.
        data: Arrays, one entry a row.
        labels: Each row in words.
    """

    cable: Cable
    data: dict[str, Any]
    labels: tuple[str, ...]
    name: str = "held_ratio"
    unit: str = "1"
    noise: str = RUN_SCATTER

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """An interval has no scatter."""
        return ((len(self.labels), 0),)

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Log likelihood of each row."""
        angles, variance = resolve_angles(self.cable, values, data)
        exponent = self.cable.friction_exponent(values, angles)
        from_angles = self.cable.exponent_variance(values, angles, variance)
        sd = jnp.sqrt(values[RUN_SCATTER] ** 2 + from_angles + values[FORCE_NOISE] ** 2 / data["weight"])
        ratio = jnp.abs(data["mean"] - values.get(GAIN_ERROR, 0.0))  # the band is symmetric
        upper, lower = log_normal_cdf((exponent - ratio) / sd), log_normal_cdf((-exponent - ratio) / sd)
        # A band of no width at all holds no reading; the floor keeps its logarithm finite.
        return upper + jnp.log1p(-jnp.exp(jnp.minimum(lower - upper, -1e-12)))

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """sqrt(-2 log likelihood), zero well inside the band."""
        return jnp.sqrt(jnp.maximum(-2 * self.log_likelihood(values, data), 1e-30))

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Largest ratio of input to output force that friction can hold [1]."""
        angles, _ = resolve_angles(self.cable, values, data)
        return jnp.exp(self.cable.friction_exponent(values, angles))

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " rows"]:
        """A ratio of input to output force anywhere in the band, with noise [1]."""
        band, noise = jax.random.split(key)
        limit = jnp.log(self.expected(values, data))
        sd = jnp.sqrt(values[RUN_SCATTER] ** 2 + values[FORCE_NOISE] ** 2 / data["weight"])
        inside = limit * jax.random.uniform(band, limit.shape, minval=-1.0, maxval=1.0)
        return jnp.exp(inside + sd * jax.random.normal(noise, limit.shape))

    def observed(self) -> np.ndarray:
        """Ratio of input to output force [1]."""
        return np.exp(self.data["mean"])


def force_terms(
    cable: Cable, table: ForceTable, angles: AngleTable | None
) -> tuple[SlidingForcesTerm | HeldForcesTerm, ...]:
    """The terms of a force table: sliding rows by run, held rows one by one."""
    rows = row_angles(cable, table, angles).data
    ratio = np.log(table.input_force / table.output_force)
    weight = 1 / (1 / table.input_force**2 + 1 / table.output_force**2)
    terms: list[SlidingForcesTerm | HeldForcesTerm] = []
    sliding, held = np.flatnonzero(table.stroke != 0), np.flatnonzero(table.stroke == 0)
    if len(sliding):
        terms.append(_sliding(cable, table, rows, ratio * table.stroke, weight, sliding))
    if len(held):
        data = {name: rows[name][held] for name in _ROW_ARRAYS} | {"mean": ratio[held], "weight": weight[held]}
        terms.append(HeldForcesTerm(cable, data, tuple(table.origin.place(int(i)) for i in held)))
    return tuple(terms)


def _sliding(
    cable: Cable,
    table: ForceTable,
    rows: Mapping[str, np.ndarray],
    ratio: np.ndarray,
    weight: np.ndarray,
    used: np.ndarray,
) -> SlidingForcesTerm:
    """Rows reduced to cells, cells to runs."""
    keys = [table.run, table.stroke, *(rows[name] for name in _ROW_ARRAYS)]
    design = np.column_stack(keys)[used]
    _, first, cell = np.unique(design, axis=0, return_index=True, return_inverse=True)
    cell, ratio, weight, run_of_row = cell.ravel(), ratio[used], weight[used], table.run[used]
    cell_weight = np.bincount(cell, weight)
    cell_mean = np.bincount(cell, weight * ratio) / cell_weight
    within = np.bincount(cell, weight * (ratio - cell_mean[cell]) ** 2)
    runs, run = np.unique(run_of_row[first], return_inverse=True)
    row_run = np.searchsorted(runs, run_of_row)
    data = {name: rows[name][used][first] for name in _ROW_ARRAYS} | {
        "stroke": table.stroke[used][first].astype(float),
        "run": run,
        "weight": cell_weight,
        "mean": cell_mean,
        "n": np.bincount(row_run).astype(float),
        "run_weight": np.bincount(run, cell_weight),
        "run_mean": np.bincount(run, cell_weight * cell_mean) / np.bincount(run, cell_weight),
        "scatter": np.bincount(run, within),
        "log_weights": np.bincount(row_run, np.log(weight)),
    }
    return SlidingForcesTerm(cable, data, tuple(_run_label(cable, table, int(run)) for run in runs))


def _run_label(cable: Cable, table: ForceTable, run: int) -> str:
    """Name of a run, with its route value where it has just one."""
    route, at = cable.description.route, np.unique(table.route[table.run == run])
    where = f" ({at[0]:g} {route.unit})" if route is not None and len(at) == 1 else ""
    return f"{table.run_names[run]}{where}"
