"""Force tables: four numbers a run, the effect of its mounting integrated out; held readings as intervals."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.load_cells import FORCE_NOISE, LEAST_FORCE, RUN_SCATTER, LoadCells
from bowdenfit.cable.noise import noise_law, scatter
from bowdenfit.description import Description
from bowdenfit.kinds.resolve_angles import resolve_angles
from bowdenfit.kinds.row_angles import row_angles
from bowdenfit.kinds.runs import ROW_ARRAYS, RunsTerm, SlidingRows, run_sums
from bowdenfit.kinds.shared_parameters import force_noise, offsets, run_scatter
from bowdenfit.kinds.tables import AngleTable, ForceTable
from bowdenfit.kinds.term import Bench, Circumstances, TermKind
from bowdenfit.parameters.space import Parameter


@dataclass(frozen=True)
class HeldForcesTerm:
    r"""Likelihood of forces read while nothing slides: inside the friction band, nothing more.

    .. math:: \log\left[\Phi\left(\frac{\Lambda - r}{s}\right) - \Phi\left(\frac{-\Lambda - r}{s}\right)\right],
              \quad r = g(F_\text{in}) - g(F_\text{out}), \quad
              s^2 = \tau^2 + \sigma_F^2 (g'(F_\text{in})^2 + g'(F_\text{out})^2)

    with g the scale on which friction is a shift, log F for the capstan equation. It is a bound, not a measurement: where
    inside the band a force comes to rest is not modeled, so a coefficient that rests on held readings alone has a posterior
    that is its prior above the largest of them, and its intervals must not be read as those of a measured value.

    With Student noise Phi is the distribution function of a Student-t: one wrong reading far outside the band then hardly
    moves the bound.

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

    def _difference(
        self, values: Mapping[str, Array], data: Mapping[str, Any]
    ) -> tuple[Float[Array, " rows"], Float[Array, " rows"]]:
        """Difference of the forces on the scale on which friction is a shift, and its variance from the load cells."""
        friction, cells = self.cable.friction, LoadCells.of(values)
        input_force = cells.true_input(data["input_force"], LEAST_FORCE)
        output_force = cells.true_output(data["output_force"], LEAST_FORCE)
        slopes = friction.slope(values, input_force) ** 2 + friction.slope(values, output_force) ** 2
        difference = friction.scaled(values, input_force) - friction.scaled(values, output_force)
        return difference, slopes * values[FORCE_NOISE] ** 2

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Log likelihood of each row."""
        angles, variance = resolve_angles(self.cable, values, data)
        exponent = self.cable.friction_exponent(values, angles)
        difference, from_cells = self._difference(values, data)
        from_angles = self.cable.exponent_variance(values, angles, variance)
        sd = jnp.sqrt(values[RUN_SCATTER] ** 2 + from_angles + from_cells)
        beyond = jnp.abs(difference)  # the band is symmetric
        law = noise_law(self.cable.description)
        upper, lower = law.log_cdf((exponent - beyond) / sd), law.log_cdf((-exponent - beyond) / sd)
        # A band of no width at all holds no reading; the floor keeps its logarithm finite.
        return upper + jnp.log1p(-jnp.exp(jnp.minimum(lower - upper, -1e-12)))

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """sqrt(-2 log likelihood), zero well inside the band."""
        return jnp.sqrt(jnp.maximum(-2 * self.log_likelihood(values, data), 1e-30))

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
        """Largest ratio of input to output force that friction can hold at the row's input force [1]."""
        angles, _ = resolve_angles(self.cable, values, data)
        exponent = self.cable.friction_exponent(values, angles)
        return data["input_force"] / self._output_force(values, data, exponent)

    def _output_force(
        self, values: Mapping[str, Array], data: Mapping[str, Any], shift: Float[Array, " rows"]
    ) -> Float[Array, " rows"]:
        """Output force that the load cell shows at a shift on the scale g; it stays positive."""
        cells = LoadCells.of(values)
        input_force = cells.true_input(data["input_force"], LEAST_FORCE)
        output = self.cable.friction.output_force(values, input_force, shift, jnp.ones(()))
        return cells.shown_output(output, LEAST_FORCE)

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " rows"]:
        """A ratio of input to output force anywhere in the band, with noise [1]."""
        band, noise = jax.random.split(key)
        angles, _ = resolve_angles(self.cable, values, data)
        limit = self.cable.friction_exponent(values, angles)
        _, from_cells = self._difference(values, data)
        inside = limit * jax.random.uniform(band, limit.shape, minval=-1.0, maxval=1.0)
        sd = jnp.sqrt(values[RUN_SCATTER] ** 2 + from_cells)
        shift = inside + sd * scatter(noise, limit.shape, self.cable.description)
        return data["input_force"] / self._output_force(values, data, shift)

    def observed(self) -> np.ndarray:
        """Ratio of input to output force [1]."""
        return self.data["input_force"] / self.data["output_force"]


def force_terms(cable: Cable, table: ForceTable, angles: AngleTable | None) -> tuple[RunsTerm | HeldForcesTerm, ...]:
    """The terms of a force table: sliding rows by run, held rows one by one."""
    rows = row_angles(cable.description, table, angles).data
    terms: list[RunsTerm | HeldForcesTerm] = []
    sliding, held = np.flatnonzero(table.stroke != 0), np.flatnonzero(table.stroke == 0)
    if len(sliding):
        terms.append(_sliding(cable, table, rows, sliding))
    if len(held):
        data = {name: rows[name][held] for name in ROW_ARRAYS} | {
            "input_force": table.input_force[held],
            "output_force": table.output_force[held],
        }
        terms.append(HeldForcesTerm(cable, data, tuple(table.origin.place(int(i)) for i in held)))
    return tuple(terms)


def _sliding(cable: Cable, table: ForceTable, rows: Mapping[str, np.ndarray], used: np.ndarray) -> RunsTerm:
    stroke, force_in, force_out = table.stroke[used], table.input_force[used], table.output_force[used]
    readings = SlidingRows(
        force_in,
        force_out,
        np.log(force_in / force_out) * stroke,
        stroke,
        table.run[used],
        table.velocity[used],
        np.zeros(len(used)),
        np.ones(len(used)),
        {name: rows[name][used] for name in ROW_ARRAYS},
    )
    runs = np.unique(readings.run)
    return RunsTerm(cable, run_sums(cable, readings), tuple(_run_label(cable, table, int(run)) for run in runs))


def _run_label(cable: Cable, table: ForceTable, run: int) -> str:
    """Name of a run, with its route value where it has just one."""
    route = cable.description.route
    if route is None:
        return table.run_names[run]
    at = np.unique(table.route[table.run == run])
    where = f" ({at[0]:g} {route.unit})" if len(at) == 1 else ""
    return f"{table.run_names[run]}{where}"


def _parameters(_: ForceTable, at: Circumstances) -> list[Parameter]:
    """Inside a run readings are normal, whatever the noise of mountings."""
    return [run_scatter(at), force_noise(at, "standard deviation of a force reading"), *offsets(at)]


def _draw(
    cable: Cable,
    table: ForceTable,
    angles: AngleTable | None,
    values: Mapping[str, Array],
    key: Array,
    scale: float,
) -> dict[str, Array]:
    """Forces of sliding rows with noise in both cells around true ones; all rows of a run share its mounting and angles."""
    held_key, key = jax.random.fold_in(key, 5), jax.random.split(key, 3)[2]
    of_run, of_input, of_output = jax.random.split(key, 3)
    runs, run = len(table.run_names), jnp.asarray(table.run)
    rows = {name: jnp.asarray(array) for name, array in row_angles(cable.description, table, angles).data.items()}
    bends, variance = resolve_angles(cable, values, rows)
    of_angles = jax.random.normal(jax.random.fold_in(key, 3), (runs, bends.shape[1]))
    bends = bends + scale * jnp.sqrt(variance) * of_angles[run]
    mounting = scale * values[RUN_SCATTER] * scatter(of_run, (runs,), cable.description)
    exponent = cable.friction_exponent(values, bends) * cable.friction.rate(values, jnp.asarray(table.velocity))
    stroke, force = jnp.asarray(table.stroke, dtype=float), jnp.asarray(table.input_force)
    output = cable.friction.output_force(values, force, exponent + mounting[run], stroke)
    cells, noise, slides = LoadCells.of(values), scale * values[FORCE_NOISE], table.stroke != 0
    read = cells.shown_input(force) + noise * jax.random.normal(of_input, force.shape)
    return {
        "input_force": jnp.where(slides, read, force),
        "output_force": jnp.where(
            slides,
            cells.shown_output(output) + noise * jax.random.normal(of_output, force.shape),
            table.output_force,
        ),
        "slipped": _slipped(cable, table, angles, values, held_key),
    }


def _slipped(
    cable: Cable, table: ForceTable, angles: AngleTable | None, values: Mapping[str, Array], key: Array
) -> Array:
    """Which held readings would have slipped: their likelihood is the probability that friction holds their forces."""
    held = [t for t in force_terms(cable, table, angles) if isinstance(t, HeldForcesTerm)]
    log_probability = [term.log_likelihood(values, jax.tree.map(jnp.asarray, term.data)) for term in held]
    slipped = [jnp.log(jax.random.uniform(key, p.shape)) > p for p in log_probability]
    return jnp.concatenate([*slipped, jnp.zeros(0, dtype=bool)])


def _drawn_table(_: Description, table: ForceTable, drawn: Mapping[str, np.ndarray]) -> ForceTable:
    return replace(table, input_force=drawn["input_force"], output_force=drawn["output_force"])


FORCES = TermKind(
    "forces",
    force_terms,
    _parameters,
    Bench(_draw, _drawn_table),
    tells_mountings=True,
)
