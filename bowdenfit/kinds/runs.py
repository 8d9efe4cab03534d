"""Readings of runs: all samples of one mounting share what the mounting did, which integrates out in closed form."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.load_cells import FORCE_NOISE, LEAST_FORCE, OUTPUT_OFFSET, RUN_SCATTER, LoadCells
from bowdenfit.cable.noise import noise_law, scatter
from bowdenfit.kinds.padding import rounded_up
from bowdenfit.kinds.resolve_angles import resolve_angles
from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.types import Labels, Vector

_WEIGHTS = ("weight", "load_squares", "load_products")
ROW_ARRAYS = ("route", "own", "is_own", "known_variance", "noisy")
_LOAD_BINS, _SPEED_BINS, _DELAY_BINS = 24, 24, 8  # of each stroke of a run, where load, speed or a delay matters
_ALIKE = 0.05  # speeds that differ by less than this fraction are one


@dataclass(frozen=True)
class RunsTerm:
    r"""Likelihood of sliding readings, one value a run.

    With the log ratio :math:`r = s \log(F_\text{in}/F_\text{out})`, s = +1 pulling and -1 return,

    .. math:: r_{ij} = \rho_{ij}(\Lambda_{ij} + m_i), \quad m_i \sim \text{Normal}(0, \tau), \quad
              e_{ij} \sim \text{Normal}(0, \sigma_F / \sqrt{w_{ij}}), \quad
              w = 1 / (F_\text{in}^{-2} + F_\text{out}^{-2})

    where rho is the log ratio that the load cells show at a friction exponent: the exponent itself, the gain error and what
    a delay between the two adds, for the capstan equation and exact zeros; else a function of the load, taken to first
    order in m. The mounting effect m is
    integrated out. Readings of one run at the same angles and stroke (and, where it matters, the same load and speed) are
    one cell, so that the cost does not grow with the length of a recording. Load matters wherever readings have a clock: a
    delay between the load cells adds more where the force changes fast for its size.

    With Student noise it is the run that may be an outlier, as one that was mounted badly is: its mean deviation, m and the
    noise of its mean together, is a Student-t of scale :math:`\sqrt{\tau^2 + \sigma_F^2 / \sum w}`, the standard deviation that
    it has else. Within a run readings scatter normally in either case.

    Args:
        cable: The cable.
        data: Arrays over cells (wrap angles, stroke, weight, mean log ratio and forces) and over runs (n, sums). Cells are
            ordered by run, equally many for each: those that a run lacks have no weight.
        labels: Each run in words.
        name: Name of the readings in results.
        reading_noise: Parameter that is the standard deviation of one reading.
    """

    cable: Cable
    data: dict[str, Any]
    labels: tuple[str, ...]
    name: str = "run_efficiency"
    reading_noise: str = FORCE_NOISE
    unit: str = "1"
    noise: str = RUN_SCATTER

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Runs scatter by their mounting; the cells of a run about its mean by the load cells."""
        runs, cells, filled = len(self.labels), len(self.data["mean"]), int(np.sum(self.data["weight"] > 0))
        return ((runs, runs), (cells, filled - runs))

    @property
    def padded(self) -> dict[str, Any]:
        """See `LogDensity.padded`: each run's cells followed by weightless copies of its first."""
        cells, each = len(self.data["mean"]), len(self.data["mean"]) // len(self.labels)
        starts = np.arange(0, cells, each)[:, None]
        place = np.arange(rounded_up(each))
        source = (starts + np.where(place < each, place, 0)).ravel()
        filled = np.tile(place < each, len(self.labels))
        long = {name: values[source] for name, values in self.data.items() if len(values) == cells != len(starts)}
        return self.data | long | {name: np.where(filled, long[name], 0.0) for name in _WEIGHTS if name in long}

    def _shown(
        self, values: Mapping[str, Array], data: Mapping[str, Any], exponent: Float[Array, " cells"]
    ) -> tuple[Float[Array, " cells"], Float[Array, " cells"], Float[Array, " cells"]]:
        """Log ratio that the load cells show, and its derivatives by the friction exponent and by the log of the load."""
        friction, stroke, cells = self.cable.friction, data["stroke"], LoadCells.of(values)
        from_delay = cells.late(data["drift"])
        if not (friction.depends_on_load or OUTPUT_OFFSET in values):
            return exponent + stroke * cells.gain_error + from_delay, jnp.ones_like(exponent), jnp.zeros_like(exponent)

        def ratio(more: Array, load: Array) -> Array:
            read = data["input_force"] * jnp.exp(load)
            input_force = cells.true_input(read, LEAST_FORCE)
            output_force = friction.output_force(values, input_force, exponent + more, stroke)
            return stroke * jnp.log(read / cells.shown_output(output_force, LEAST_FORCE))

        zero, one = jnp.zeros_like(exponent), jnp.ones_like(exponent)
        shown, slope = jax.jvp(ratio, (zero, zero), (one, zero))
        _, by_load = jax.jvp(ratio, (zero, zero), (zero, one))
        return shown + from_delay, slope, by_load

    def _deviations(
        self, values: Mapping[str, Array], data: Mapping[str, Any], weights: Mapping[str, Array]
    ) -> "_Deviations":
        angles, variance = resolve_angles(self.cable, values, data)
        exponent = self.cable.friction_exponent(values, angles) * self.cable.friction.rate(values, data["velocity"])
        shown, slope, by_load = self._shown(values, data, exponent)
        deviation = data["mean"] - shown
        total = self._per_run(data, slope**2)
        mounting = self._per_run(data, slope * deviation) / total
        from_angles = self._per_run(data, slope**2 * self.cable.exponent_variance(weights, angles, variance)) / total
        sd = jnp.sqrt(weights[RUN_SCATTER] ** 2 + from_angles + weights[self.reading_noise] ** 2 / total)
        plain = self._per_run(data, deviation) / data["run_weight"]
        inside = data["load_squares"] * by_load**2 - 2 * data["load_products"] * by_load
        by_run = jnp.sum(inside.reshape(len(self.labels), -1), axis=1)
        # Cells are equally many for each run: repeating is quicker than indexing.
        of_cell = jnp.repeat(mounting, deviation.shape[0] // len(self.labels))
        return _Deviations(deviation - slope * of_cell, mounting, sd, total, plain, by_run)

    def _per_run(self, data: Mapping[str, Any], cells: Float[Array, " cells"]) -> Float[Array, " runs"]:
        """Weighted sum over the cells of each run."""
        return jnp.sum((data["weight"] * cells).reshape(len(self.labels), -1), axis=1)

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs"]:
        """Log likelihood of each run, all samples together."""
        found = self._deviations(values, data, values)
        noise, n = values[self.reading_noise], data["n"]
        squares = data["scatter"] + found.inside + self._per_run(data, found.within**2)
        constant = (data["log_weights"] - jnp.log(found.total) - (n - 1) * jnp.log(2 * jnp.pi)) / 2
        inside = constant - (n - 1) * jnp.log(noise) - squares / (2 * noise**2)
        return inside + noise_law(self.cable.description).log_density(found.mounting, 0.0, found.sd)

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " cells_and_runs"]:
        """Standardized residuals: between runs, and between the cells of a run."""
        found = self._deviations(values, data, jax.lax.stop_gradient(dict(values)))
        inside = jnp.sqrt(data["weight"]) * found.within / jax.lax.stop_gradient(values[self.reading_noise])
        between = noise_law(self.cable.description).residual(found.mounting / jax.lax.stop_gradient(found.sd))
        return jnp.concatenate([between, inside])

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs"]:
        """Expected efficiency of each run, the effect of its mounting left out [1]."""
        return transmission_efficiency(data["run_mean"] - self._deviations(values, data, values).plain)

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " runs"]:
        """Efficiency of each run as the bench would give it [1]."""
        found = self._deviations(values, data, values)
        mounting = found.sd * scatter(key, found.sd.shape, self.cable.description)
        return transmission_efficiency(data["run_mean"] - found.plain + mounting)

    def observed(self) -> np.ndarray:
        """Mean efficiency of each run [1]."""
        return np.exp(-self.data["run_mean"])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class _Deviations:
    """Of cells from their run's mounting effect; of each run: mounting effect, its sd, information, mean deviation, and
    what the change of friction inside its cells takes off (or adds to) their scatter.
    """

    within: Array
    mounting: Array
    sd: Array
    total: Array
    plain: Array
    inside: Array


@dataclass(frozen=True)
class SlidingRows:
    """Readings taken while the rope slides, in the order of the table.

    Args:
        input_force, output_force: Forces [N].
        log_ratio: s log(F_in/F_out) [1].
        stroke: +1 pulling, -1 return.
        run: Number of the run.
        velocity: Velocity; NaN where it is not known.
        drift: s d(log F_out)/dt, by which a delay of the output channel shifts the log ratio [1/s]; 0 without a clock.
        worth: How many independent readings each counts for [1].
        angles: `ROW_ARRAYS` of every row.
    """

    input_force: Vector
    output_force: Vector
    log_ratio: Vector
    stroke: Labels
    run: Labels
    velocity: Vector
    drift: Vector
    worth: Vector
    angles: Mapping[str, np.ndarray]


def run_sums(cable: Cable, rows: SlidingRows) -> dict[str, Any]:
    """Readings reduced to cells, cells to runs: all that the likelihood needs, whatever the number of readings."""
    cell, first = _cells(cable, rows)
    weight = rows.worth / (1 / rows.input_force**2 + 1 / rows.output_force**2)
    cell_weight = np.bincount(cell, weight)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(cell, weight * values) / cell_weight

    cell_mean, load = mean(rows.log_ratio), np.log(rows.input_force)
    cell_load = mean(load)
    within = np.bincount(cell, weight * (rows.log_ratio - cell_mean[cell]) ** 2)
    runs, run = np.unique(rows.run[first], return_inverse=True)
    row_run = np.searchsorted(runs, rows.run)
    run_weight = np.bincount(run, cell_weight)
    cells = {name: rows.angles[name][first] for name in ROW_ARRAYS} | {
        "stroke": rows.stroke[first].astype(float),
        "run": run,
        "weight": cell_weight,
        "mean": cell_mean,
        "input_force": np.exp(cell_load),
        "load_squares": np.bincount(cell, weight * (load - cell_load[cell]) ** 2),
        "load_products": np.bincount(cell, weight * (load - cell_load[cell]) * (rows.log_ratio - cell_mean[cell])),
        "output_force": np.exp(mean(np.log(rows.output_force))),
        "velocity": mean(rows.velocity),
        "drift": mean(rows.drift),
    }
    return _rectangular(cells, run) | {
        "n": np.bincount(row_run, rows.worth),
        "run_weight": run_weight,
        "run_mean": np.bincount(run, cell_weight * cell_mean) / run_weight,
        "scatter": np.bincount(run, within),
        "log_weights": np.bincount(row_run, rows.worth * np.log(weight / rows.worth)),
    }


def _rectangular(cells: dict[str, np.ndarray], run: np.ndarray) -> dict[str, np.ndarray]:
    """Cells, in order of their runs, padded to equally many a run with weightless copies of the run's first."""
    starts, counts = np.searchsorted(run, np.arange(run[-1] + 1)), np.bincount(run)
    place = np.arange(np.max(counts))[None, :]
    source = np.where(place < counts[:, None], starts[:, None] + place, starts[:, None]).ravel()
    padded = {name: values[source] for name, values in cells.items()}
    filled = (place < counts[:, None]).ravel()
    return padded | {name: np.where(filled, padded[name], 0.0) for name in _WEIGHTS}


def _cells(cable: Cable, rows: SlidingRows) -> tuple[np.ndarray, np.ndarray]:
    """The cell of each reading, and the first reading of each cell."""
    keys = [rows.run, rows.stroke, *(rows.angles[name] for name in ROW_ARRAYS)]
    if cable.friction.depends_on_rate:
        keys.append(_bins(_steps(rows.velocity), rows.run * 2 + (rows.stroke > 0), _SPEED_BINS))
    on_load = cable.friction.depends_on_load or cable.description.fits_offsets
    if on_load or np.any(rows.drift):
        bins = _LOAD_BINS if on_load else _DELAY_BINS
        keys.append(_bins(rows.input_force + rows.output_force, rows.run * 2 + (rows.stroke > 0), bins))
    design = np.column_stack([np.nan_to_num(key) for key in keys])
    _, first, cell = np.unique(design, axis=0, return_index=True, return_inverse=True)
    return cell.ravel(), first


def _steps(velocity: Vector) -> Vector:
    """Speeds in steps of a few percent; NaN where they are not known."""
    speed = np.abs(velocity)
    return np.exp(_ALIKE * np.round(np.log(np.where(speed > 0, speed, np.nan)) / _ALIKE))


def _bins(values: Vector, group: Labels, most: int) -> Labels:
    """Bins of equal counts within each group; values that are few or all alike keep to themselves."""
    bins = np.zeros(len(values), dtype=int)
    for name in np.unique(group):
        mine = group == name
        distinct, where = np.unique(values[mine], return_inverse=True)
        if len(distinct) > most:
            edges = np.quantile(values[mine], np.linspace(0, 1, most + 1)[1:-1])
            where = np.searchsorted(edges, values[mine])
        bins[mine] = where
    return bins
