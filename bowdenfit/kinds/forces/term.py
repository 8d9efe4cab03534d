"""Force tables in the likelihood: sliding readings as runs, held readings as intervals."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from typing_extensions import override

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.sensors import FORCE_NOISE, RUN_SCATTER, LoadCells, noise_law, scatter
from bowdenfit.description import Description
from bowdenfit.kinds.forces.mountings import group_numbers
from bowdenfit.kinds.forces.next_run import ForceRunCandidates
from bowdenfit.kinds.forces.stated_noise import STATED_NOISE, log_ratio_variance
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.plausibility import choose_unused_columns
from bowdenfit.kinds.row_angles import RowAngles, collect_row_angles, resolve_angles
from bowdenfit.kinds.rows import UnusedColumn
from bowdenfit.kinds.runs import RunsTerm, sum_runs
from bowdenfit.kinds.shared_parameters import declare_force_noise, declare_gear, declare_offsets, declare_run_scatter
from bowdenfit.kinds.sliding_rows import ONE_LOAD, ExpectedForces, SlidingRows, expected_forces, range_by_group
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.kinds.term import GROUP, LOAD, Circumstances, Term, TermKind, Truth, repeat_rows, spare_count
from bowdenfit.parameters.priors import HalfCauchy
from bowdenfit.parameters.space import Parameter
from bowdenfit.types import DataArray, Labels, Vector


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HeldForcesData:
    """Arrays of held readings.

    Args:
        angles: Wrap angles of the rows.
        input_force, output_force: Forces [N], (rows).
        input_noise, output_noise: Noise of each in units of the noise parameter, (rows).
        counts: Whether a row counts, (rows); None where all do.
    """

    angles: RowAngles
    input_force: DataArray
    output_force: DataArray
    input_noise: DataArray
    output_noise: DataArray
    counts: DataArray | None = None


@dataclass(frozen=True)
class HeldForcesTerm:
    r"""Likelihood of forces read while nothing slides: inside the friction band, nothing more.

    .. math:: \log\left[\Phi\left(\frac{\Lambda - r}{s}\right) - \Phi\left(\frac{-\Lambda - r}{s}\right)\right],
              \quad r = g(F_\text{in}) - g(F_\text{out}), \quad
              s^2 = \tau^2 + \sigma_F^2 (\rho^2 g'(F_\text{in})^2 + g'(F_\text{out})^2)

    with g the scale on which friction is a shift, log F for the capstan equation, and rho the noise of the input over that of
    the output; standard deviations that are stated stand in the place of :math:`\rho \sigma_F` and :math:`\sigma_F`. It is a
    bound, not a measurement: where inside the band a force comes to rest is not modeled, so a coefficient that rests on held
    readings alone has a posterior that is its prior above the largest of them, and its intervals must not be read as those of a
    measured value.

    With Student noise Phi is the distribution function of a Student-t: one wrong reading far outside the band then hardly
    moves the bound.

    Args:
        cable: The cable.
        data: Its arrays.
        labels: Each row in words.
        reading_noise: Parameter in units of which the noise of each reading is given.
    """

    cable: CableContacts = field(repr=False)
    data: HeldForcesData = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    name: str = "held_ratio"
    unit: str = "1"
    noise: str = RUN_SCATTER
    reading_noise: str = FORCE_NOISE

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """One block without degrees of freedom, because an interval has no scatter."""
        return ((len(self.labels), 0),)

    @property
    def with_spare_rows(self) -> HeldForcesData:
        """See `LogDensity.with_spare_rows`: the rows followed by copies of them that do not count."""
        return repeat_rows(self.data, len(self.labels), spare_count(len(self.labels)))

    def _difference(
        self, values: Mapping[str, Array], data: HeldForcesData
    ) -> tuple[Float[Array, " rows"], Float[Array, " rows"]]:
        """Return input less output force on the scale on which friction is a shift, and its variance from the load cells."""
        friction, cells, least = self.cable.friction, LoadCells.of(values), self.cable.friction.conditions.least_force
        input_force = cells.true_input(data.input_force, least)
        output_force = cells.true_output(data.output_force, least)
        of_input = data.input_noise * friction.slope(values, input_force)
        slopes = of_input**2 + (data.output_noise * friction.slope(values, output_force)) ** 2
        difference = friction.scaled(values, input_force) - friction.scaled(values, output_force)
        return difference, slopes * values[self.reading_noise] ** 2

    def log_likelihood(self, values: Mapping[str, Array], data: HeldForcesData) -> Float[Array, " rows"]:
        """Log likelihood of each row."""
        angles, variance = resolve_angles(self.cable, values, data.angles)
        exponent = self.cable.friction_exponent(values, angles, data.angles.group, data.angles.route)
        difference, from_cells = self._difference(values, data)
        from_angles = self.cable.exponent_variance(values, angles, variance, data.angles.group)
        sd = jnp.sqrt(values[RUN_SCATTER] ** 2 + from_angles + from_cells)
        pulling, returning = self.cable.friction.shifts(values, exponent)
        beyond = jnp.abs(difference - (pulling - returning) / 2)  # about its middle the band is symmetric
        law = noise_law(self.cable.description)
        upper, lower = law.log_cdf((exponent - beyond) / sd), law.log_cdf((-exponent - beyond) / sd)
        # A band of no width at all holds no reading; the floor keeps its logarithm finite.
        return upper + jnp.log1p(-jnp.exp(jnp.minimum(lower - upper, -1e-12)))

    def residuals(self, values: Mapping[str, Array], data: HeldForcesData) -> Float[Array, " rows"]:
        """sqrt(-2 log likelihood), zero well inside the band."""
        return jnp.sqrt(jnp.maximum(-2 * self.log_likelihood(values, data), 1e-30))

    def expected(self, values: Mapping[str, Array], data: HeldForcesData) -> Float[Array, " rows"]:
        """Largest ratio of input to output force that friction can hold at the row's input force [1]."""
        angles, _ = resolve_angles(self.cable, values, data.angles)
        exponent = self.cable.friction_exponent(values, angles, data.angles.group, data.angles.route)
        return data.input_force / self._output_force(values, data, exponent)

    def _output_force(
        self, values: Mapping[str, Array], data: HeldForcesData, shift: Float[Array, " rows"]
    ) -> Float[Array, " rows"]:
        """Return the output force that the load cell shows at a shift on the scale g [N]; it stays positive."""
        cells, least = LoadCells.of(values), self.cable.friction.conditions.least_force
        input_force = cells.true_input(data.input_force, least)
        output = self.cable.friction.output_force(values, input_force, shift, jnp.ones(()))
        return cells.shown_output(output, least)

    def simulate(self, values: Mapping[str, Array], data: HeldForcesData, key: Array) -> Float[Array, " rows"]:
        """A ratio of input to output force anywhere in the band, with noise [1]."""
        band, noise = jax.random.split(key)
        angles, _ = resolve_angles(self.cable, values, data.angles)
        limit = self.cable.friction_exponent(values, angles, data.angles.group, data.angles.route)
        _, from_cells = self._difference(values, data)
        inside = limit * jax.random.uniform(band, limit.shape, minval=-1.0, maxval=1.0)
        sd = jnp.sqrt(values[RUN_SCATTER] ** 2 + from_cells)
        shift = inside + sd * scatter(noise, limit.shape, self.cable.description)
        return data.input_force / self._output_force(values, data, shift)

    def observed(self) -> np.ndarray:
        """Ratio of input to output force [1]."""
        ratio: np.ndarray = self.data.input_force / self.data.output_force
        return ratio


def _number_groups(cable: CableContacts, table: ForceTable) -> Labels:
    """Return the number of each row's group."""
    return group_numbers(cable.friction.groups, table.group, len(table.run))


def name_noise(table: ForceTable) -> str:
    """Return the parameter that the noise of each reading of a table is in proportion to."""
    return FORCE_NOISE if table.sd is None else STATED_NOISE


def _declare_noise_factor() -> Parameter:
    """Return the factor on standard deviations that each reading states: it is known."""
    meaning = "factor on the standard deviations that are stated with each force"
    return Parameter(STATED_NOISE, "$f$", meaning, "noise", HalfCauchy(1.0), fixed=1.0, prior_words="fixed (as stated)")


def make_sliding_rows(
    description: Description, table: ForceTable, rows: RowAngles, used: np.ndarray
) -> SlidingRows:
    """Return some rows of a table, with the forces that the readings of each run together estimate.

    Args:
        description: Parsed cable.toml.
        table: The table.
        rows: Wrap angles of all its rows.
        used: Numbers of the rows.
    """
    stroke, force_in, force_out = table.stroke[used], table.input_force[used], table.output_force[used]
    angles = rows.select(used)
    keys = np.column_stack([table.run[used], stroke, *jax.tree.leaves(angles)])
    expected, weight = _expect_forces(description, table, used, keys)
    return SlidingRows(
        expected.input_force,
        expected.output_force,
        (np.log(force_in / force_out) - expected.log_ratio_error) * stroke,
        stroke,
        table.run[used],
        table.velocity[used],
        np.zeros(len(used)),
        np.ones(len(used)),
        angles,
        weight,
        _unused_columns(table, used),
    )


def _expect_forces(
    description: Description, table: ForceTable, used: np.ndarray, keys: np.ndarray
) -> tuple[ExpectedForces, Vector]:
    """Return the forces that readings of a run together estimate, and the information of each on its log ratio [N^2].

    A reading that is alone in its run is taken as it is, because a mounting of its own moves the forces themselves; but it is
    weighed by what all such readings say, so that one whose output noise makes larger does not count for more.

    Args:
        description: Parsed cable.toml.
        table: The table.
        used: Numbers of its rows.
        keys: Run of each reading, then whatever is the same for readings that are taken together.
    """
    sensors, runs = description.sensors, table.run[used]
    single = np.bincount(runs)[runs] == 1
    named = (
        np.unique(np.array(table.group)[used], return_inverse=True)[1]
        if table.group
        else np.zeros(len(used), dtype=int)
    )
    keys = np.column_stack([np.where(single, -1 - named, runs), keys[:, 1:]])
    stated = None if sensors.force_noise is None else sensors.force_noise.to("force")
    noises = table.noises(sensors.noise_ratio)[used]
    expected = ExpectedForces(table.input_force[used].copy(), table.output_force[used].copy(), np.zeros(len(used)))
    weight = np.zeros(len(used))
    for rows, noise in ((~single, stated), (single, stated or 0.0)):
        if not rows.any():
            continue
        together = np.unique(keys[rows], axis=0, return_inverse=True)[1].ravel()
        forces = table.input_force[used][rows], table.output_force[used][rows]
        sd = None if table.sd is None else table.sd[used][rows]
        part = expected_forces(*forces, together, sensors.noise_ratio, noise, description.shifts_forces, sd)
        weight[rows] = 1 / log_ratio_variance(noises[rows], part.input_force, part.output_force)
        for name, values in vars(part).items():
            if not single[rows].any() or name == "log_ratio_error":
                getattr(expected, name)[rows] = values
    return expected, weight


def _unused_columns(table: ForceTable, used: np.ndarray) -> dict[str, UnusedColumn]:
    """Return the columns of some rows that the fit does not use and that were not calculated from their forces."""
    force_in, force_out = table.input_force[used], table.output_force[used]
    efficiency, lost = force_out / force_in, force_in - force_out
    calculated = (force_in, force_out, lost, efficiency, 1 - efficiency, 1 / efficiency, np.log(efficiency))
    return choose_unused_columns({heading: x[used] for heading, x in table.unused.items()}, *calculated)


def _run_label(cable: CableContacts, table: ForceTable, run: int) -> str:
    """Return the name of a run, with its route value where it has just one."""
    route = cable.description.route
    if route is None:
        return table.run_names[run]
    at = np.unique(table.route[table.run == run])
    name, place = table.run_names[run], f"{at[0]:g} {route.unit}" if len(at) == 1 else ""
    return name if name.startswith(place) or name.endswith(f"({place})") else f"{name} ({place})"


class ForceTerms(TermKind[ForceTable]):
    """Force tables in the likelihood."""

    name = "forces"
    candidate = ForceRunCandidates()
    shows_mounting_scatter = True

    @override
    def terms(
        self, cable: CableContacts, table: ForceTable, angles: AngleTable | None
    ) -> tuple[RunsTerm | HeldForcesTerm, ...]:
        """Return a term of the sliding rows by run, and one of the held rows one by one."""
        rows = replace(collect_row_angles(cable.description, table, angles), group=_number_groups(cable, table))
        terms: list[RunsTerm | HeldForcesTerm] = []
        noises = table.noises(cable.description.sensors.noise_ratio)
        sliding, held = np.flatnonzero(table.stroke != 0), np.flatnonzero(table.stroke == 0)
        if len(sliding):
            readings = make_sliding_rows(cable.description, table, rows, sliding)
            labels = tuple(_run_label(cable, table, int(run)) for run in np.unique(readings.run))
            noise = name_noise(table)
            terms.append(RunsTerm(cable, sum_runs(cable, readings), labels, reading_noise=noise, rows=readings))
        if len(held):
            forces = table.input_force[held], table.output_force[held]
            data = HeldForcesData(rows.select(held), *forces, noises[held, 0], noises[held, 1])
            words = tuple(table.origin.describe_row(int(i)) for i in held)
            terms.append(HeldForcesTerm(cable, data, words, reading_noise=name_noise(table)))
        return tuple(terms)

    @override
    def parameters(self, table: ForceTable, at: Circumstances) -> list[Parameter]:
        """Return scatter, noise, offsets and a gear; inside a run readings are normal, whatever the noise of mountings."""
        noise = declare_force_noise(at) if table.sd is None else _declare_noise_factor()
        return [declare_run_scatter(at), noise, *declare_offsets(at), *declare_gear(at)]

    @override
    def draw(self, table: ForceTable, truth: Truth) -> dict[str, Array]:
        """Draw forces of sliding rows with noise in both cells; all rows of a run share its mounting and angles."""
        cable, values, scale, key = truth.cable, truth.values, truth.scale, jax.random.split(truth.key, 3)[2]
        of_run, of_input, of_output = jax.random.split(key, 3)
        runs, run = len(table.run_names), jnp.asarray(table.run)
        bends, variance = truth.wrap_angles(table)
        of_angles = jax.random.normal(jax.random.fold_in(key, 3), (runs, bends.shape[1]))
        bends = bends + scale * jnp.sqrt(variance) * of_angles[run]
        mounting = scale * values[RUN_SCATTER] * truth.scatter(of_run, (runs,))
        groups, route = jnp.asarray(_number_groups(cable, table)), jnp.asarray(table.route)
        friction = cable.friction_exponent(values, bends, groups, route)
        exponent = friction * cable.friction.rate(values, jnp.asarray(table.velocity))
        stroke, force = jnp.asarray(table.stroke, dtype=float), jnp.asarray(table.input_force)
        output = cable.friction.output_force(values, force, exponent + mounting[run], stroke)
        cells, slides = LoadCells.of(values), table.stroke != 0
        noises = scale * values[name_noise(table)] * table.noises(cable.description.sensors.noise_ratio).T
        read = cells.shown_input(force, stroke) + noises[0] * jax.random.normal(of_input, force.shape)
        return {
            "input_force": jnp.where(slides, read, force),
            "output_force": jnp.where(
                slides,
                cells.shown_output(output) + noises[1] * jax.random.normal(of_output, force.shape),
                table.output_force,
            ),
            "slipped": self._draw_slips(table, truth, jax.random.fold_in(truth.key, 5)),
        }

    def _draw_slips(self, table: ForceTable, truth: Truth, key: Array) -> Array:
        """Draw which held readings would have slipped: their likelihood is the probability that friction holds them."""
        held = [t for t in self.terms(truth.cable, table, truth.angles) if isinstance(t, HeldForcesTerm)]
        log_probability = [term.log_likelihood(truth.values, jax.tree.map(jnp.asarray, term.data)) for term in held]
        slipped = [jnp.log(jax.random.uniform(key, p.shape)) > p for p in log_probability]
        return jnp.concatenate([*slipped, jnp.zeros(0, dtype=bool)])

    @override
    def with_readings(self, description: Description, table: ForceTable, readings: Mapping[str, np.ndarray]) -> ForceTable:
        return replace(table, input_force=readings["input_force"], output_force=readings["output_force"])

    @override
    def covariates(self, table: ForceTable, term: Term) -> Mapping[str, np.ndarray]:
        """Return the load of each run, where each was made at one load and these differ; its group, numbered from 1.

        Loads differ where both forces do: against one hung weight, the input force differs by friction and noise alone.
        """
        if not isinstance(term, RunsTerm) or term.rows is None:
            return {}
        runs, run = np.unique(term.rows.run, return_inverse=True)
        covariates = dict[str, np.ndarray]()
        low, high = range_by_group(term.rows.input_force, run)
        ends = (low, high), range_by_group(term.rows.output_force, run)
        if np.all(high <= ONE_LOAD * low) and all(most.max() > ONE_LOAD**2 * least.min() for least, most in ends):
            covariates[LOAD] = (low + high) / 2
        if table.group:
            names = term.cable.friction.conditions.groups
            of_run = [table.group[int(np.argmax((table.run == number) & (table.stroke != 0)))] for number in runs]
            covariates[GROUP] = np.array([1.0 + names.index(name) for name in of_run])
        return covariates

    @override
    def unused_columns(self, table: ForceTable, term: Term) -> Mapping[str, UnusedColumn]:
        """Return the mean of each run."""
        if not isinstance(term, RunsTerm) or term.rows is None:
            return {}
        run = np.unique(term.rows.run, return_inverse=True)[1]
        return {
            heading: replace(column, numbers=np.bincount(run, column.numbers) / np.bincount(run))
            for heading, column in term.rows.unused.items()
        }
