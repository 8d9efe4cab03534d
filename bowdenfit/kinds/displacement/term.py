"""Force at the motor against displacement in the likelihood: the far end, the rope, and the mounting of each run."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from typing_extensions import override

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.elasticity import BEDDING_LOAD, BEDDING_STRETCH, STIFFNESS
from bowdenfit.cable.sensors import FORCE_NOISE, INPUT_OFFSET, RUN_SCATTER, LoadCells, noise_law, scatter
from bowdenfit.kinds.displacement.table import ZERO, DisplacementSettings, DisplacementTable, Turns
from bowdenfit.kinds.row_angles import RowAngles, collect_row_angles, resolve_angles
from bowdenfit.kinds.rows import OwnAngles, RowConditions
from bowdenfit.kinds.shared_parameters import declare_force_noise, declare_offsets, declare_rope, declare_run_scatter
from bowdenfit.kinds.tables import AngleTable, StretchTable
from bowdenfit.kinds.term import WRAP_ANGLE, Circumstances, Term, TermKind, Truth
from bowdenfit.parameters.priors import HalfCauchy, LogNormal, Normal
from bowdenfit.parameters.space import Parameter, Scale
from bowdenfit.physics.tendon import RopeStretch, Tendon, Turn
from bowdenfit.types import DataArray

END_SPRING, ROPE_STIFFNESS, ROPE_GIVE, DISPLACEMENT_NOISE = "end_spring", "rope_stiffness", "rope_give", "sigma_x"
MOTOR_FORCE, AT, SINCE_TURN = "motor_force", "Displacement (mm)", "Distance from the turn (mm)"
_LEAST_GIVE = 1e-9  # give of the rope over the spring's, to keep its stiffness finite
LEAST_EXPONENT = 1e-9  # friction exponent with its mounting effect, below which friction would push
Values = Mapping[str, Array]


def rows_by_run(table: DisplacementTable) -> np.ndarray:
    """Return the numbers of the used rows, ordered by run."""
    rows = np.flatnonzero(table.used)
    return rows[np.argsort(table.run[rows], kind="stable")]


def reading_arrays(table: DisplacementTable, rows: np.ndarray) -> dict[str, Any]:
    """Return the arrays that the likelihood takes of some rows, ordered by run."""
    run, motion = table.run[rows], table.motion
    return {
        "displacement": table.displacement[rows],
        "stroke": motion.stroke[rows].astype(float),
        "after": rank_by_depth(motion.turns)[motion.after[rows]],
        "slides": motion.slides[rows],
        "run": run,
        "start": np.searchsorted(run, run),
    }


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TurnArrays:
    """Turns of the motor at one depth; every array is (turns).

    Args:
        at: Displacement [mm].
        stroke: +1 or -1, which way it went on.
        after: Rank of the turn before it among those of lower depth.
        run: Number of its run.
    """

    at: DataArray
    stroke: DataArray
    after: DataArray
    run: DataArray


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class DisplacementData:
    """Arrays of force against displacement.

    Args:
        force: Force of each reading [N], (readings), in order of their runs.
        displacement: Displacement [mm], (readings).
        stroke: +1 or -1, which way the motor went, (readings).
        after: Rank of the turn before it in order of depth, (readings).
        slides: Whether all of the rope slides, (readings).
        run: Number of the run, (readings).
        start: First reading of the run, (readings).
        turns: Turns by depth.
        run_angles: Wrap angles of the runs.
    """

    force: DataArray
    displacement: DataArray
    stroke: DataArray
    after: DataArray
    slides: DataArray
    run: DataArray
    start: DataArray
    turns: tuple[TurnArrays, ...]
    run_angles: RowAngles


def split_turns_by_depth(turns: Turns) -> tuple[TurnArrays, ...]:
    """Split the turns by depth, each with the rank of the turn before it among those of lower depth."""
    rank = rank_by_depth(turns)
    arrays = TurnArrays(turns.at, turns.stroke.astype(float), rank[turns.after], turns.run)
    by_depth = (turns.depth == depth for depth in range(int(turns.depth.max()) + 1))
    return tuple(jax.tree.map(lambda values, mask=mask: values[mask], arrays) for mask in by_depth)


def angles_of_runs(cable: CableContacts, table: DisplacementTable, angles: AngleTable | None) -> RowAngles:
    """Return the wrap angles of every run, which are those of its first row."""
    first = np.array([np.flatnonzero(table.run == run)[0] for run in range(len(table.run_names))])
    own_angles = OwnAngles(table.own.names, table.own.angle[first], table.own.sd[first])
    return collect_row_angles(cable.description, RowConditions(table.route[first], own_angles), angles)


def rank_by_depth(turns: Turns) -> np.ndarray:
    """Return the rank of each turn in order of depth."""
    rank = np.empty(len(turns.depth), dtype=int)
    rank[np.argsort(turns.depth, kind="stable")] = np.arange(len(turns.depth))
    return rank


def zero_names(table: DisplacementTable) -> tuple[str, ...]:
    """Return the names of the parameters for the displacement without force, one a run."""
    n = len(table.run_names)
    return (ZERO,) if n == 1 else tuple(f"{ZERO}_{i + 1}" for i in range(n))


@dataclass(frozen=True)
class DisplacementTerm:
    r"""Likelihood of the force at the motor against displacement, reading by reading.

    .. math:: F_{ij} = f(x_{ij}, \Lambda_i + m_i) + e_{ij}, \quad m_i \sim \text{Normal}(0, \tau), \quad
              e_{ij} \sim \text{Normal}(0, \sqrt{\sigma_F^2 + s_{ij}^2})

    with f of `bowdenfit.physics.tendon` and s what the displacement's noise makes of the force, half of the difference that it
    makes on both sides, which is finite where the force falls steeply after a turn. What a run's mounting and errors of its
    wrap angles do to the friction exponent is taken to first order and integrated out. The likelihood is said reading by
    reading, each given those before it in its run; the residuals are those in the run and those of runs, as of `RunsTerm`.

    Args:
        cable: The cable.
        data: Its arrays.
        labels: Each reading in words.
        zeros: Parameters of the displacement without force, one a run.
        stop: Whether the far end pulls against a stop.
        reading_noise: Noise scale of the second block of residuals, that of runs.
    """

    cable: CableContacts = field(repr=False)
    data: DisplacementData = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    zeros: tuple[str, ...]
    stop: bool
    name: str = MOTOR_FORCE
    unit: str = "N"
    noise: str = FORCE_NOISE
    reading_noise: str = RUN_SCATTER
    depends_on_conditions: ClassVar[bool] = False  # see `Term`

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Readings scatter alike in their runs; runs scatter by their mountings."""
        rows, runs = len(self.labels), len(self.zeros)
        return ((rows, rows - runs), (runs, runs))

    def exponents(self, values: Values, data: DisplacementData) -> tuple[Float[Array, " runs"], Float[Array, " runs"]]:
        """Return the friction exponent of each run [1], and its variance from errors of the wrap angles."""
        angles, variance = resolve_angles(self.cable, values, data.run_angles)
        exponent = self.cable.friction_exponent(values, angles)
        return exponent, self.cable.exponent_variance(values, angles, variance)

    def load_cell_force(
        self, values: Values, data: DisplacementData, exponent: Float[Array, " runs"], beside: Array | float = 0.0
    ) -> Array:
        """Return the force that the motor's load cell shows at each reading [N].

        Args:
            values: Values of the parameters.
            data: Arrays as of the term; readings may be others of the same runs.
            exponent: Friction exponent of each run [1].
            beside: Displacement beside that of the readings [mm].
        """
        exponent = jnp.maximum(exponent, LEAST_EXPONENT)
        zero = jnp.stack([values[name] for name in self.zeros])
        compliance = 0.0 if self.stop else 1 / values[END_SPRING]
        rope = _make_rope(values)

        def tendon(run: Array) -> Tendon:
            return Tendon(exponent[run], compliance, rope)

        first, *later = data.turns
        travel = first.at - zero[first.run]
        known = Turn(travel, *tendon(first.run).sliding(travel, first.stroke))
        for turns in later:
            travel = turns.at - zero[turns.run]
            force, mean = tendon(turns.run).sliding_after_turn(_select_turns(known, turns.after), travel, turns.stroke)
            parts = ((known.travel, travel), (known.force, force), (known.mean, mean))
            known = Turn(*(jnp.concatenate(part) for part in parts))
        travel, at = data.displacement + beside - zero[data.run], tendon(data.run)
        sliding = at.sliding(travel, data.stroke)[0]
        after_turn = at.sliding_after_turn(_select_turns(known, data.after), travel, data.stroke)[0]
        return LoadCells.of(values).shown_input(jnp.where(data.slides, sliding, after_turn))

    def _linearize(self, values: Values, data: DisplacementData, weights: Values) -> "_Linearization":
        exponent, angle_variance = self.exponents(values, data)
        mean, slope = jax.jvp(lambda at: self.load_cell_force(values, data, at), (exponent,), (jnp.ones_like(exponent),))
        if weights is not values:
            exponent, angle_variance = self.exponents(weights, data)
            slope = jax.jvp(lambda at: self.load_cell_force(weights, data, at), (exponent,), (jnp.ones_like(exponent),))[1]
        variance = weights[FORCE_NOISE] ** 2
        if DISPLACEMENT_NOISE in weights:
            more, less = (self.load_cell_force(weights, data, exponent, s * weights[DISPLACEMENT_NOISE]) for s in (1.0, -1.0))
            variance = variance + ((more - less) / 2) ** 2
        of_runs = weights[RUN_SCATTER] ** 2 + angle_variance
        return _Linearization(
            mean, data.force - mean, slope, jnp.broadcast_to(variance, mean.shape), of_runs, data.run
        )

    def _predict_sequentially(
        self, values: Values, data: DisplacementData
    ) -> tuple[Float[Array, " rows"], Float[Array, " rows"]]:
        """Return mean and standard deviation of each reading [N], given those before it in its run."""
        linear = self._linearize(values, data, values)
        information = _sum_before(linear.slope**2 / linear.variance, data.start)
        score = _sum_before(linear.slope * linear.deviation / linear.variance, data.start)
        of_run = linear.of_runs[data.run]
        left = of_run / (1 + of_run * information)
        return linear.mean + linear.slope * left * score, jnp.sqrt(linear.variance + linear.slope**2 * left)

    def expected(self, values: Values, data: DisplacementData) -> Float[Array, " rows"]:
        """Expected forces in the mounting of each run, as its readings together show it [N]."""
        linear = self._linearize(values, data, values)
        return linear.mean + linear.slope * linear.mounting[0][data.run]

    def log_likelihood(self, values: Values, data: DisplacementData) -> Float[Array, " rows"]:
        """Log likelihood of each reading, given those before it in its run."""
        return noise_law(self.cable.description).log_density(data.force, *self._predict_sequentially(values, data))

    def residuals(self, values: Values, data: DisplacementData) -> Float[Array, " rows_and_runs"]:
        """Standardized residuals of readings in their run, and of runs; weights follow the parameters, undifferentiated."""
        law, weights = noise_law(self.cable.description), jax.lax.stop_gradient(dict(values))
        linear = self._linearize(values, data, weights)
        mounting, variance = linear.mounting
        slope, sd = (jax.lax.stop_gradient(array) for array in (linear.slope, jnp.sqrt(linear.variance)))
        inside = (linear.deviation - slope * mounting[data.run]) / sd
        return jnp.concatenate(
            [law.residual(inside), mounting / jax.lax.stop_gradient(jnp.sqrt(linear.of_runs + variance))]
        )

    def simulate(self, values: Values, data: DisplacementData, key: Array) -> Float[Array, " rows"]:
        """Forces as the bench would give them, each after the readings before it [N]."""
        mean, sd = self._predict_sequentially(values, data)
        return mean + sd * scatter(key, mean.shape, self.cable.description)

    def mounted_exponents(self, values: Values, data: DisplacementData) -> Float[Array, " runs"]:
        """Return the friction exponent of each run [1], its mounting effect estimated from its readings."""
        linear = self._linearize(values, data, values)
        mounting, variance = linear.mounting
        return self.exponents(values, data)[0] + mounting * linear.of_runs / (linear.of_runs + variance)

    def friction_effect(self, values: Mapping[str, float]) -> np.ndarray:
        """Return the part of each force that is due to friction [N], to first order."""

        def effect(at: Values, data: DisplacementData) -> Float[Array, " rows"]:
            return self._linearize(at, data, at).slope * self.exponents(at, data)[0][data.run]

        return np.asarray(
            jax.jit(effect)(dict(values), self.data)
        )  # one program: primitive by primitive takes ten times it

    def observed(self) -> np.ndarray:
        """Measured forces [N]."""
        return self.data.force


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class _Linearization:
    """Readings linearized in the mounting effects of their runs.

    Args:
        mean: Expected force of each reading without mounting effects [N].
        deviation: Reading less that [N].
        slope: Change of the expected force with the friction exponent [N].
        variance: Variance of each reading in its run [N^2].
        of_runs: Variance of each run's friction exponent [1].
        run: Number of each reading's run.
    """

    mean: Array
    deviation: Array
    slope: Array
    variance: Array
    of_runs: Array
    run: Array

    @property
    def mounting(self) -> tuple[Array, Array]:
        """Mounting effect of each run by its own readings [1], and the variance of that estimate."""
        none = jnp.zeros_like(self.of_runs)
        information = jnp.maximum(none.at[self.run].add(self.slope**2 / self.variance), 1e-300)
        return none.at[self.run].add(self.slope * self.deviation / self.variance) / information, 1 / information


def _make_rope(values: Values) -> RopeStretch:
    """Return the rope as a table of stretch has it, or a linear one."""
    if ROPE_GIVE in values:
        return RopeStretch(values[END_SPRING] / jnp.maximum(values[ROPE_GIVE], _LEAST_GIVE))
    if ROPE_STIFFNESS in values:
        return RopeStretch(values[ROPE_STIFFNESS])
    return RopeStretch(values[STIFFNESS], (values[BEDDING_STRETCH], values[BEDDING_LOAD]))


def _select_turns(turns: Turn, which: Array) -> Turn:
    return Turn(turns.travel[which], turns.force[which], turns.mean[which])


def _sum_before(terms: Float[Array, " rows"], start: Array) -> Float[Array, " rows"]:
    """Return the sum over the readings before each in its run; `start` is the first of its run."""
    total = jnp.cumsum(terms) - terms
    return total - total[start]


def make_displacement_term(cable: CableContacts, table: DisplacementTable, angles: AngleTable | None) -> DisplacementTerm:
    """Return the term of a table of force against displacement."""
    rows = rows_by_run(table)
    settings = cable.description.table(DisplacementSettings)
    stop = settings is not None and settings.end == "stop"
    data = DisplacementData(
        force=table.force[rows],
        **reading_arrays(table, rows),
        turns=split_turns_by_depth(table.motion.turns),
        run_angles=angles_of_runs(cable, table, angles),
    )
    return DisplacementTerm(cable, data, tuple(table.origin.describe_row(int(i)) for i in rows), zero_names(table), stop)


def _force_per_displacement(table: DisplacementTable) -> Scale:
    """Return the range of forces over that of displacements [N/mm]."""
    force, x = table.force[table.used], table.displacement[table.used]
    ranges = [float(np.ptp(values)) if len(values) else 0.0 for values in (force, x)]
    together = ranges[0] / ranges[1] if min(ranges) > 0 else 1.0
    return Scale(together, "range of forces over that of displacements", "N/mm")


def _zero_parameters(table: DisplacementTable, at: Circumstances) -> list[Parameter]:
    """Return the displacement without force of each run, as parameters."""
    share, parameters = at.defaults.displacement_zero_ranges, []
    for run, name in enumerate(zero_names(table)):
        x = table.displacement[table.run == run]
        span = Scale(float(np.ptp(x)) or float(np.ptp(table.displacement)) or 1.0, "range of displacements", "mm")
        of_run = f", run {table.run_names[run]}" if len(table.run_names) > 1 else ""
        prior, symbol = Normal(float(x.min()), share * span.value), f"$x_{{0{run + 1 if of_run else ''}}}$"
        meaning = f"displacement without force{of_run}"
        parameters.append(Parameter(name, symbol, meaning, "elastic", prior, "mm", scaled_by=span.describe_share(share)))
    return parameters


def _stiffness_parameters(table: DisplacementTable, at: Circumstances) -> list[Parameter]:
    """Return spring and rope; without a table of stretch the rope's give is relative to the spring's, and may be next to 0."""
    by, settings = _force_per_displacement(table), at.description.table(DisplacementSettings)
    prior, rests = LogNormal(by.value, at.defaults.end_stiffness_log_sd), str(by)
    spring = Parameter(
        END_SPRING, r"$K$", "stiffness of the spring at the far end", "elastic", prior, "N/mm", scaled_by=rests
    )
    linear = Parameter(
        ROPE_STIFFNESS, "$k$ rope", "stiffness of rope and sheath together", "elastic", prior, "N/mm",
        scaled_by=rests,
    )  # fmt: skip
    give = Parameter(
        ROPE_GIVE, "$K/k$ rope", "give of rope and sheath over that of the spring at the far end", "elastic",
        HalfCauchy(at.defaults.rope_give),
    )  # fmt: skip
    at_stop = settings is not None and settings.end == "stop"
    if at.measurements.table(StretchTable) is not None:
        return [*declare_rope(at), *([] if at_stop else [spring])]
    if at_stop:
        return [linear]
    return [spring, linear if ROPE_STIFFNESS in at.description.prior else give]


def _offset_parameter(table: DisplacementTable, at: Circumstances) -> Parameter:
    """Return the offset of the motor's load cell, which looks like friction where it is ignored."""
    stated = [p for p in declare_offsets(at) if p.name == INPUT_OFFSET]
    if stated:
        return stated[0]
    part = at.defaults.motor_offset_share
    by = Scale(float(np.ptp(table.force)) or 1.0, "range of forces", "N")
    prior = Normal(0.0, part * by.value)
    meaning = "offset of the load cell at the motor"
    return Parameter(INPUT_OFFSET, "$b$ input", meaning, "sensor", prior, "N", scaled_by=by.describe_share(part))


class DisplacementTerms(TermKind[DisplacementTable]):
    """Force against displacement in the likelihood."""

    name = "displacement"
    shows_mounting_scatter = True

    @override
    def terms(self, cable: CableContacts, table: DisplacementTable, angles: AngleTable | None) -> tuple[DisplacementTerm]:
        return (make_displacement_term(cable, table, angles),)

    @override
    def parameters(self, table: DisplacementTable, at: Circumstances) -> list[Parameter]:
        """Return spring, rope and zero; how readings and mountings scatter; the zero of the cell where that is fitted."""
        range_x = Scale(float(np.ptp(table.displacement)) or 1.0, "range of displacements", "mm")
        part = at.defaults.displacement_noise_share
        jitter = Parameter(
            DISPLACEMENT_NOISE, r"$\sigma_x$", at.noise.meaning("standard deviation of a displacement"), "noise",
            HalfCauchy(part * range_x.value), "mm", scaled_by=range_x.describe_share(part),
        )  # fmt: skip
        return [
            *_stiffness_parameters(table, at),
            *_zero_parameters(table, at),
            declare_run_scatter(at),
            declare_force_noise(at, at.noise.meaning("standard deviation of a force reading")),
            *([] if table.sliding else [jitter]),
            _offset_parameter(table, at),
        ]

    @override
    def draw(self, table: DisplacementTable, truth: Truth) -> dict[str, Array]:
        """Draw forces of every row with noise in cell and displacement; those of a run share its mounting and angles."""
        of_run, of_force, of_x = jax.random.split(jax.random.fold_in(truth.key, 7), 3)
        term, values, scale = make_displacement_term(truth.cable, table, truth.angles), truth.values, truth.scale
        data = jax.tree.map(jnp.asarray, replace(term.data, **reading_arrays(table, np.arange(len(table.run)))))
        exponent, angle_variance = term.exponents(values, data)
        mounting = jnp.sqrt(values[RUN_SCATTER] ** 2 + angle_variance) * truth.scatter(of_run, exponent.shape)
        shape = table.force.shape
        noise = scale * values.get(DISPLACEMENT_NOISE, 0.0) * jax.random.normal(of_x, shape)
        force = term.load_cell_force(values, data, exponent + scale * mounting, noise)
        return {"force": force + scale * values[FORCE_NOISE] * truth.scatter(of_force, shape)}

    @override
    def covariates(self, table: DisplacementTable, term: Term) -> Mapping[str, np.ndarray]:
        """Return displacement, distance from the last turn, and wrap angle of each reading."""
        rows = rows_by_run(table)
        angles = np.rad2deg(np.nansum(table.own.angle[rows], axis=1))
        turns, after = table.motion.turns.at, table.motion.after[rows]
        moved = np.where(
            table.motion.slides[rows], np.ptp(table.displacement), np.abs(table.displacement[rows] - turns[after])
        )
        return {AT: table.displacement[rows], SINCE_TURN: moved, WRAP_ANGLE: angles}

    @override
    def on_way_back(self, table: DisplacementTable) -> np.ndarray:
        return table.motion.stroke[rows_by_run(table)] < 0
