"""Likelihood of runs: all readings of one mounting share its effect, which is integrated out in closed form."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.sensors import FORCE_NOISE, OUTPUT_OFFSET, RUN_SCATTER, LoadCells, noise_law, scatter
from bowdenfit.kinds.row_angles import RowAngles, resolve_angles
from bowdenfit.kinds.sliding_rows import InsideRuns, SlidingRows, list_readings_inside_runs
from bowdenfit.kinds.term import repeat_rows, round_up_count, spare_count
from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.types import DataArray, Labels, Vector

_WEIGHTS = ("weight", "load_squares", "load_products", "drift_squares", "drift_products", "drift_loads")
# Cells of each stroke of a run where load, speed or a delay matters. Judgements: few suffice, because what varies inside a cell
# enters to first order (`RunsTerm._deviations`).
_LOAD_BINS, _SPEED_BINS, _DELAY_BINS = 24, 24, 8
_GEAR_BINS = 96  # where the friction of a gear takes most of a small load, so that the loss bends inside a cell. A judgement
_ALIKE = 0.05  # relative difference of speeds that count as one; a judgement
_FEWEST = 6  # single-reading runs from which their scatter is split: two parameters and some freedom. A judgement
_LEAST_SHARE = 1e-3  # end of the grid of noise variance over that of mountings, at which one of them is as good as 0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RunCells:
    """Cells of runs: sums over readings of one run at the same angles and stroke (and load and speed, where they matter).

    They are ordered by run, equally many for each; those that a run lacks have no weight. Every array is (cells).

    Args:
        angles: Wrap angles.
        stroke: +1 pulling, -1 return.
        run: Number of the run.
        weight: Information on the log ratio at unit noise [N^2].
        mean: Mean log ratio [1].
        input_force, output_force: Mean forces [N].
        velocity: Mean velocity.
        drift: Mean change of the log ratio by a delay [1/s].
        load_squares, load_products: Weighted sums of squares of log load inside the cell, and of its products with log ratios.
        drift_squares, drift_products, drift_loads: The same of the drift, with log ratios and with log load.
    """

    angles: RowAngles
    stroke: DataArray
    run: DataArray
    weight: DataArray
    mean: DataArray
    input_force: DataArray
    output_force: DataArray
    velocity: DataArray
    drift: DataArray
    load_squares: DataArray
    load_products: DataArray
    drift_squares: DataArray
    drift_products: DataArray
    drift_loads: DataArray

    def select(self, cells: np.ndarray) -> "RunCells":
        """Return some cells."""
        chosen: RunCells = jax.tree.map(lambda values: values[cells], self)
        return chosen

    def without_weight(self, cells: np.ndarray) -> "RunCells":
        """Return the same with no weight in some cells."""
        weights: dict[str, Any] = {name: np.where(cells, 0.0, getattr(self, name)) for name in _WEIGHTS}
        return replace(self, **weights)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RunSums:
    """Sums over the readings of each run; every array is (runs).

    Args:
        n: How many independent readings it counts for [1].
        run_weight: Information on its log ratio at unit noise [N^2].
        run_mean: Mean log ratio [1].
        scatter: Weighted sum of squares about the means of cells [N^2].
        log_weights: Sum of the logarithms of weights.
        counts: Whether it counts; None where all do.
    """

    n: DataArray
    run_weight: DataArray
    run_mean: DataArray
    scatter: DataArray
    log_weights: DataArray
    counts: DataArray | None = None


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RunsData(RunSums):
    """Sums over the readings of runs, and of their cells.

    Args:
        cells: The cells.
    """

    cells: RunCells = field(kw_only=True)


@dataclass(frozen=True)
class RunsTerm:
    r"""Likelihood of sliding readings, one value a run.

    With the log ratio :math:`r = s \log(F_\text{in}/F_\text{out})`, s = +1 pulling and -1 return,

    .. math:: r_{ij} = \rho_{ij}(\Lambda_{ij} + m_i), \quad m_i \sim \text{Normal}(0, \tau), \quad
              e_{ij} \sim \text{Normal}(0, \sigma_F / \sqrt{w_{ij}}), \quad
              w = 1 / (\rho^2 F_\text{in}^{-2} + F_\text{out}^{-2})

    where rho_ij is the log ratio that the load cells show at a friction exponent: the exponent itself, the gain error and what
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
        data: Sums over runs and their cells.
        labels: Each run in words.
        name: Name of the readings in results.
        reading_noise: Parameter that is the standard deviation of one reading.
        rows: The readings that the arrays sum up; None where nobody asks for them one by one.
        cell_rows: Readings by which they were sorted into cells; None where these are `rows` themselves.
    """

    cable: CableContacts = field(repr=False)
    data: RunsData = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    name: str = "run_efficiency"
    reading_noise: str = FORCE_NOISE
    unit: str = "1"
    noise: str = RUN_SCATTER
    rows: SlidingRows | None = field(default=None, repr=False)
    cell_rows: SlidingRows | None = field(default=None, repr=False)

    def with_rows(self, rows: SlidingRows) -> "RunsTerm":
        """Return the term of the same readings with other forces or angles, in the same cells and with the same weights."""
        assert self.rows is not None
        weight, n_effective = self.rows.weight(self.cable.description.sensors.noise_ratio), self.rows.n_effective
        rows = replace(rows, n_effective=n_effective, information=weight / n_effective)
        return replace(self, data=sum_runs(self.cable, rows, self.rows), rows=rows, cell_rows=self.rows)

    @property
    def depends_on_conditions(self) -> bool:
        """See `Term`: the capstan equation without offsets knows ratios of forces alone."""
        return bool(self.cable.friction.options) or self.cable.description.shifts_forces

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Runs, which scatter by their mounting, and cells, which scatter about their run by the load cells."""
        weight = self.data.cells.weight
        runs, cells, filled = len(self.labels), len(weight), int(np.sum(weight > 0))
        return ((runs, runs), (cells, filled - runs))

    @property
    def padded(self) -> RunsData:
        """See `LogDensity.padded`: each run's cells followed by weightless copies of its first."""
        runs = len(self.labels)
        return pad_cells(self.data, runs, round_up_count(len(self.data.cells.mean) // runs))

    @property
    def with_spare_rows(self) -> RunsData:
        """See `LogDensity.with_spare_rows`: padded runs followed by copies of them that do not count."""
        runs, data = len(self.labels), self.padded
        spare = spare_count(runs)
        source = np.arange(len(data.cells.mean)).reshape(runs, -1)[np.arange(spare) % runs].ravel()
        sums = repeat_rows(RunSums(data.n, data.run_weight, data.run_mean, data.scatter, data.log_weights), runs, spare)
        return RunsData(**vars(sums), cells=data.cells.select(source))

    @property
    def inside(self) -> InsideRuns | None:
        """Single readings, with the cell of each among the residuals inside runs."""
        if self.rows is None:
            return None
        cell, first = _assign_cells(self.cable, self.cell_rows or self.rows)
        runs, run = np.unique(self.rows.run, return_inverse=True)
        of_cell = np.searchsorted(runs, self.rows.run[first])
        position = np.arange(len(first)) - np.searchsorted(of_cell, of_cell)
        most = len(self.data.cells.mean) // len(runs)
        ratio = self.cable.description.sensors.noise_ratio
        return list_readings_inside_runs((of_cell * most + position)[cell], run, self.rows, ratio)

    def _shown_log_ratio(
        self, values: Mapping[str, Array], data: RunCells, exponent: Float[Array, " cells"]
    ) -> tuple[Float[Array, " cells"], Float[Array, " cells"], Float[Array, " cells"]]:
        """Return the log ratio that the load cells show, and its derivatives by friction exponent and log load."""
        friction, stroke, cells = self.cable.friction, data.stroke, LoadCells.of(values)
        from_delay = cells.late(data.drift)
        is_shift = not (friction.depends_on_load or friction.depends_on_stroke or OUTPUT_OFFSET in values)
        if is_shift and cells.gear is None:
            return exponent + stroke * cells.gain_error + from_delay, jnp.ones_like(exponent), jnp.zeros_like(exponent)

        least = friction.conditions.least_force

        def ratio(more: Array, load: Array) -> Array:
            read = data.input_force * jnp.exp(load)
            input_force = cells.true_input(read, least, stroke)
            output_force = friction.output_force(values, input_force, exponent + more, stroke)
            return stroke * jnp.log(read / cells.shown_output(output_force, least))

        zero, unit = jnp.zeros_like(exponent), jnp.ones_like(exponent)
        shown, slope = jax.jvp(ratio, (zero, zero), (unit, zero))
        _, by_load = jax.jvp(ratio, (zero, zero), (zero, unit))
        return shown + from_delay, slope, by_load

    def _deviations(
        self, values: Mapping[str, Array], data: RunsData, weights: Mapping[str, Array]
    ) -> "_Deviations":
        cells, rows = data.cells, data.cells.angles
        angles, variance = resolve_angles(self.cable, values, rows)
        friction = self.cable.friction_exponent(values, angles, rows.group, rows.route)
        exponent = friction * self.cable.friction.rate(values, cells.velocity)
        shown, slope, by_load = self._shown_log_ratio(values, cells, exponent)
        if weights is not values:  # else a drag that makes mountings count for less would seem to fit better
            slope = jax.lax.stop_gradient(slope)
        deviation = cells.mean - shown
        total = self._per_run(data, slope**2)
        mounting = self._per_run(data, slope * deviation) / total
        angle_variance = self.cable.exponent_variance(weights, angles, variance, rows.group)
        from_angles = self._per_run(data, slope**2 * angle_variance) / total
        sd = jnp.sqrt(weights[RUN_SCATTER] ** 2 + from_angles + weights[self.reading_noise] ** 2 / total)
        plain = self._per_run(data, deviation) / data.run_weight
        inside = cells.load_squares * by_load**2 - 2 * cells.load_products * by_load
        late = LoadCells.of(values).delay_error
        inside += late * (late * cells.drift_squares - 2 * cells.drift_products + 2 * by_load * cells.drift_loads)
        by_run = jnp.sum(inside.reshape(len(data.n), -1), axis=1)
        # Cells are equally many for each run: repeating is quicker than indexing.
        of_cell = jnp.repeat(mounting, deviation.shape[0] // len(data.n))
        return _Deviations(deviation - slope * of_cell, mounting, sd, total, plain, by_run)

    def _per_run(self, data: RunsData, cells: Float[Array, " cells"]) -> Float[Array, " runs"]:
        """Return the weighted sum over the cells of each run."""
        return jnp.sum((data.cells.weight * cells).reshape(len(data.n), -1), axis=1)

    def scatter_of_single_readings(self, values: Mapping[str, Array]) -> dict[str, float]:
        """Split the scatter of single-reading runs into that of mountings [1] and the noise of the load cells [N].

        By maximum likelihood about given values; empty where runs have more readings, which show the noise, or are few.
        """
        if np.any(self.data.n > 1) or len(self.labels) < _FEWEST or self.cable.description.noise != "normal":
            return {}
        deviations = jax.jit(lambda v, data: self._deviations(v, data, v))(dict(values), self.data)
        squares, per_noise = np.asarray(deviations.mounting) ** 2, 1 / np.asarray(deviations.total)
        shares = np.concatenate([[0.0], np.geomspace(_LEAST_SHARE, 1 / _LEAST_SHARE, 49)]) / np.median(per_noise)
        variance = 1 + shares[:, None] * per_noise
        tau_squared = np.mean(squares / variance, axis=1)
        best = int(
            np.argmax(-len(squares) * np.log(np.maximum(tau_squared, 1e-300)) - np.sum(np.log(variance), axis=1))
        )
        tau = float(np.sqrt(tau_squared[best]))
        return {RUN_SCATTER: tau, self.reading_noise: tau * float(np.sqrt(max(shares[best], _LEAST_SHARE * shares[1])))}

    def log_likelihood(self, values: Mapping[str, Array], data: RunsData) -> Float[Array, " runs"]:
        """Log likelihood of each run, all samples together."""
        deviations = self._deviations(values, data, values)
        noise, n = values[self.reading_noise], data.n
        squares = data.scatter + deviations.inside + self._per_run(data, deviations.within**2)
        constant = (data.log_weights - jnp.log(deviations.total) - (n - 1) * jnp.log(2 * jnp.pi)) / 2
        inside = constant - (n - 1) * jnp.log(noise) - squares / (2 * noise**2)
        return inside + noise_law(self.cable.description).log_density(deviations.mounting, 0.0, deviations.sd)

    def residuals(self, values: Mapping[str, Array], data: RunsData) -> Float[Array, " cells_and_runs"]:
        """Standardized residuals: between runs, and between the cells of a run."""
        deviations = self._deviations(values, data, jax.lax.stop_gradient(dict(values)))
        inside = jnp.sqrt(data.cells.weight) * deviations.within / jax.lax.stop_gradient(values[self.reading_noise])
        between = noise_law(self.cable.description).residual(deviations.mounting / jax.lax.stop_gradient(deviations.sd))
        return jnp.concatenate([between, inside])

    def expected(self, values: Mapping[str, Array], data: RunsData) -> Float[Array, " runs"]:
        """Expected efficiency of each run, the effect of its mounting left out [1]."""
        return transmission_efficiency(data.run_mean - self._deviations(values, data, values).plain)

    def simulate(self, values: Mapping[str, Array], data: RunsData, key: Array) -> Float[Array, " runs"]:
        """Efficiency of each run as the bench would give it [1]."""
        deviations = self._deviations(values, data, values)
        mounting = deviations.sd * scatter(key, deviations.sd.shape, self.cable.description)
        return transmission_efficiency(data.run_mean - deviations.plain + mounting)

    def observed(self) -> np.ndarray:
        """Mean efficiency of each run [1]."""
        return np.exp(-self.data.run_mean)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class _Deviations:
    """Deviations of cells from what the model expects, with the mounting effects of their runs.

    Args:
        within: Deviation of each cell from its run's mounting effect [1].
        mounting: Mounting effect of each run [1].
        sd: Standard deviation of that effect as observed, with the noise of the run's mean [1].
        total: Information of a run's readings on its mounting effect, at unit noise [N^2].
        plain: Weighted mean deviation of each run [1].
        inside: What changes of friction and delay inside cells take off, or add to, their sum of squares [N^2].
    """

    within: Array
    mounting: Array
    sd: Array
    total: Array
    plain: Array
    inside: Array


def sum_runs(cable: CableContacts, rows: SlidingRows, cell_rows: SlidingRows | None = None) -> RunsData:
    """Reduce readings to cells and cells to runs: all that the likelihood needs, whatever the number of readings.

    Args:
        cable: The cable.
        rows: The readings.
        cell_rows: The same readings as they are sorted into cells; `rows` themselves if omitted.
    """
    cell, first = _assign_cells(cable, cell_rows or rows)
    weight = rows.weight(cable.description.sensors.noise_ratio)
    cell_weight = np.bincount(cell, weight)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(cell, weight * values) / cell_weight

    def apart(values: np.ndarray) -> np.ndarray:
        return values - mean(values)[cell]

    cell_mean, log_load = mean(rows.log_ratio), np.log(rows.input_force)
    ratio, load, drift = apart(rows.log_ratio), apart(log_load), apart(rows.drift)
    runs, run = np.unique(rows.run[first], return_inverse=True)
    row_run = np.searchsorted(runs, rows.run)
    run_weight = np.bincount(run, cell_weight)
    cells = RunCells(
        angles=rows.angles.select(first),
        stroke=rows.stroke[first].astype(float),
        run=run,
        weight=cell_weight,
        mean=cell_mean,
        input_force=np.exp(mean(log_load)),
        output_force=np.exp(mean(np.log(rows.output_force))),
        velocity=mean(rows.velocity),
        drift=mean(rows.drift),
        load_squares=np.bincount(cell, weight * load**2),
        load_products=np.bincount(cell, weight * load * ratio),
        drift_squares=np.bincount(cell, weight * drift**2),
        drift_products=np.bincount(cell, weight * drift * ratio),
        drift_loads=np.bincount(cell, weight * drift * load),
    )
    return RunsData(
        n=np.bincount(row_run, rows.n_effective),
        run_weight=run_weight,
        run_mean=np.bincount(run, cell_weight * cell_mean) / run_weight,
        scatter=np.bincount(row_run, weight * ratio**2),
        log_weights=np.bincount(row_run, rows.n_effective * np.log(weight / rows.n_effective)),
        cells=_pad_runs(cells),
    )


def pad_cells(data: RunsData, runs: int, cells_per_run: int) -> RunsData:
    """Return the same sums with more cells for each run, which have no weight.

    Args:
        data: Sums made by `sum_runs`.
        runs: Number of runs.
        cells_per_run: Number of cells for each.
    """
    cells = len(data.cells.mean)
    now = cells // runs
    position = np.arange(cells_per_run)
    source = (np.arange(0, cells, now)[:, None] + np.where(position < now, position, 0)).ravel()
    return replace(data, cells=data.cells.select(source).without_weight(np.tile(position >= now, runs)))


def _pad_runs(cells: RunCells) -> RunCells:
    """Pad cells, in order of their runs, to equally many a run, with weightless copies of the run's first."""
    run = cells.run
    starts, counts = np.searchsorted(run, np.arange(run[-1] + 1)), np.bincount(run)
    position = np.arange(np.max(counts))[None, :]
    source = np.where(position < counts[:, None], starts[:, None] + position, starts[:, None]).ravel()
    return cells.select(source).without_weight((position >= counts[:, None]).ravel())


def _assign_cells(cable: CableContacts, rows: SlidingRows) -> tuple[np.ndarray, np.ndarray]:
    """Return the cell of each reading, and the first reading of each cell."""
    keys = [rows.run, rows.stroke, *jax.tree.leaves(rows.angles)]
    if cable.friction.depends_on_rate:
        keys.append(_bin_values(_round_speeds(rows.velocity), rows.run * 2 + (rows.stroke > 0), _SPEED_BINS))
    on_load = cable.friction.depends_on_load or cable.description.shifts_forces
    if on_load or np.any(rows.drift):
        bins = _GEAR_BINS if cable.description.motor else _LOAD_BINS if on_load else _DELAY_BINS
        keys.append(_bin_values(rows.input_force + rows.output_force, rows.run * 2 + (rows.stroke > 0), bins))
    design = np.column_stack([np.nan_to_num(key) for key in keys])
    _, first, cell = np.unique(design, axis=0, return_index=True, return_inverse=True)
    return cell.ravel(), first


def _round_speeds(velocity: Vector) -> Vector:
    """Round speeds to steps of a few percent; NaN where they are not known."""
    speed = np.abs(velocity)
    return np.exp(_ALIKE * np.round(np.log(np.where(speed > 0, speed, np.nan)) / _ALIKE))


def _bin_values(values: Vector, group: Labels, most: int) -> Labels:
    """Return bins of equal counts within each group; few or equal values keep to themselves."""
    bins = np.zeros(len(values), dtype=int)
    for name in np.unique(group):
        rows = group == name
        distinct, positions = np.unique(values[rows], return_inverse=True)
        if len(distinct) > most:
            edges = np.quantile(values[rows], np.linspace(0, 1, most + 1)[1:-1])
            positions = np.searchsorted(edges, values[rows])
        bins[rows] = positions
    return bins
