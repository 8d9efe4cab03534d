"""Loop tables in the likelihood: output force against input force at the preload and friction of a moving loop."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from typing_extensions import override

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.elasticity import PRELOAD as REFERENCE_PRELOAD
from bowdenfit.cable.elasticity import spread_matrix
from bowdenfit.cable.sensors import FORCE_NOISE, RUN_SCATTER, LoadCells, noise_law, scatter
from bowdenfit.kinds.candidate import Candidate, CandidateKind, Simulation, Situation, choose_loads, simulate_rows
from bowdenfit.kinds.row_angles import RowAngles, collect_row_angles, resolve_angles
from bowdenfit.kinds.shared_parameters import declare_force_noise, declare_offsets, declare_preload
from bowdenfit.kinds.tables import AngleTable, LoopTable
from bowdenfit.kinds.term import LOAD, WRAP_ANGLE, Circumstances, Term, TermKind, Truth
from bowdenfit.parameters.priors import Normal
from bowdenfit.parameters.space import Parameter
from bowdenfit.physics.loop import (
    free_motion_loss,
    loop_output_force,
    loop_response,
    loop_response_from,
    moving_preload,
)
from bowdenfit.types import DataArray

LOOP_FORCE = "loop_output_force"
LOOP_MOUNTING = "loop_mounting"


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LoopData:
    """Arrays of a loop table.

    Args:
        angles: Wrap angles of the rows.
        input_force, output_force: Forces [N], (rows).
        stroke: +1 pulling, -1 return, (rows).
        preload: Preload of the row's own [N], (rows); 0 without one.
        has_preload: Whether a row has one, (rows).
        cases: The different wrap angles of rows [rad], (cases, contacts); None where they are not known exactly.
        spread: Matrix that gives each row its case, (cases, rows).
    """

    angles: RowAngles
    input_force: DataArray
    output_force: DataArray
    stroke: DataArray
    preload: DataArray
    has_preload: DataArray
    cases: DataArray = None
    spread: DataArray = None


@dataclass(frozen=True)
class LoopTerm:
    r"""Likelihood of a loop table.

    .. math:: F_{\text{out},i} \sim \text{Normal}\left(f(F_{\text{in},i}),\ \sqrt{\sigma_F^2 (1 + f'^2)
              + f_\Lambda^2 \textstyle\sum_k \mu_k^2 \sigma_{\theta,ik}^2}\right)

    with f the loop's output force at the preload of the row, or the cable's at the row's wrap angle; both load cells read
    with noise, and the row's own measured angles have errors. All rows are of one mounting: its effect on the friction
    exponent is a parameter where single ropes tell how mountings scatter, and else belongs to the coefficient found.

    With Student noise the same mean and scale are a Student-t's, row by row; that parameter of the one mounting stays normal.

    Args:
        cable: The cable.
        data: Its arrays.
        labels: Each row in words.
    """

    cable: CableContacts = field(repr=False)
    data: LoopData = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    name: str = LOOP_FORCE
    unit: str = "N"
    noise: str = FORCE_NOISE
    depends_on_conditions: ClassVar[bool] = False  # see `Term`

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """One block: all rows scatter alike."""
        return ((len(self.labels), len(self.labels)),)

    def _response(
        self, values: Mapping[str, Array], data: LoopData
    ) -> tuple[Array, Array, Array, Array | float]:
        """Return output force, its derivatives, and the variance of the friction exponent from errors of the wrap angles."""
        mounting = values[RUN_SCATTER] * values[LOOP_MOUNTING] if LOOP_MOUNTING in values else 0.0
        force, elastic = LoadCells.of(values).true_input(data.input_force), self.cable.elasticity
        rope = elastic.loop_rope(values)
        if data.cases is not None:
            exponent = self.cable.friction_exponent(values, data.cases) + mounting
            preload = elastic.preload(values, jnp.sum(data.cases, axis=-1))[0]
            per_case = jnp.stack([exponent, preload, jnp.exp(-exponent), jnp.exp(exponent)])
            exponent, preload, less, more = per_case @ data.spread
            preload = moving_preload(data.stroke * force, preload, exponent, rope)
            return *loop_response_from(force, 2 * preload * exponent, 2 * preload, less, more, data.stroke), 0.0
        angles, variance = resolve_angles(self.cable, values, data.angles)
        exponent = self.cable.friction_exponent(values, angles) + mounting
        of_cable = elastic.preload(values, jnp.sum(angles, axis=-1))[0]
        preload = jnp.where(data.has_preload, data.preload, of_cable)
        response = loop_response(force, preload, exponent, data.stroke, rope)
        return *response, self.cable.exponent_variance(values, angles, variance)

    def _mean_and_sd(
        self, values: Mapping[str, Array], data: LoopData, weights: Mapping[str, Array]
    ) -> tuple[Float[Array, " rows"], Float[Array, " rows"]]:
        output, by_force, by_exponent, angle_variance = self._response(values, data)
        if weights is not values:
            _, by_force, by_exponent, angle_variance = self._response(weights, data)
        noise_ratio = self.cable.description.sensors.noise_ratio
        variance = weights[FORCE_NOISE] ** 2 * (1 + (noise_ratio * by_force) ** 2)
        return LoadCells.of(values).shown_output(output), jnp.sqrt(variance + by_exponent**2 * angle_variance)

    def expected(self, values: Mapping[str, Array], data: LoopData) -> Float[Array, " rows"]:
        """Expected output forces [N]."""
        return self._mean_and_sd(values, data, values)[0]

    def log_likelihood(self, values: Mapping[str, Array], data: LoopData) -> Float[Array, " rows"]:
        """Log likelihood of each row."""
        law = noise_law(self.cable.description)
        return law.log_density(data.output_force, *self._mean_and_sd(values, data, values))

    def residuals(self, values: Mapping[str, Array], data: LoopData) -> Float[Array, " rows"]:
        """Standardized residuals; the weights follow the parameters but are not differentiated."""
        mean, sd = self._mean_and_sd(values, data, jax.lax.stop_gradient(dict(values)))
        return noise_law(self.cable.description).residual((data.output_force - mean) / jax.lax.stop_gradient(sd))

    def simulate(self, values: Mapping[str, Array], data: LoopData, key: Array) -> Float[Array, " rows"]:
        """Output forces as the bench would give them [N]."""
        mean, sd = self._mean_and_sd(values, data, values)
        return mean + sd * scatter(key, mean.shape, self.cable.description)

    def observed(self) -> np.ndarray:
        """Measured output forces [N]."""
        return self.data.output_force


def make_loop_term(cable: CableContacts, table: LoopTable, angles: AngleTable | None) -> LoopTerm:
    """Return the term of a loop table."""
    rows = collect_row_angles(cable.description, table, angles)
    has_preload = np.isfinite(table.preload)
    forces = table.input_force, table.output_force, table.stroke.astype(float)
    data = LoopData(rows, *forces, np.nan_to_num(table.preload), has_preload)
    if rows.is_own.all() and rows.is_exact and not has_preload.any():
        # Friction and preload are worked out once for every different case.
        cases, case = np.unique(rows.own, axis=0, return_inverse=True)
        data = replace(data, cases=cases, spread=spread_matrix(case.ravel()))
    return LoopTerm(cable, data, tuple(table.origin.describe_row(i) for i in range(len(table.stroke))))


class LoopCandidates(CandidateKind):
    """An output force of a loop under load."""

    name = "loop"
    noun = "loop under load"
    order = 5
    needs = (FORCE_NOISE, REFERENCE_PRELOAD)
    unknown = "only a pull-pull loop with a table of its forces, and a preload of its own, has such readings."
    along_route = True
    loaded = True

    @override
    def is_possible(self, at: Situation) -> bool:
        return at.cable.is_loop

    @override
    def describe_measurement(self, cable: CableContacts) -> str:
        return "the loop's output force"

    @override
    def candidates(self, at: Situation) -> list[Candidate]:
        """Return every input force along the cable."""
        table = at.measurements.table(LoopTable)
        if table is None:
            return []
        loads = choose_loads(np.abs(table.input_force))
        return [replace(case, load=load) for case in at.along_cable(self.name, table.own) for load in loads]

    @override
    def simulation(self, at: Situation, candidates: Sequence[Candidate]) -> Simulation:
        (route, own_angles, origin), load = at.rows(candidates), np.array([c.load for c in candidates])
        forward, nothing = np.ones(len(candidates), dtype=int), np.full(len(candidates), np.nan)
        table = LoopTable(route, load, 0.8 * load, forward, nothing, own_angles, origin)
        return simulate_rows(make_loop_term(at.cable, table, at.angles))


class LoopTerms(TermKind[LoopTable]):
    """Loop tables in the likelihood."""

    name = "loop"
    candidate = LoopCandidates()

    @override
    def terms(self, cable: CableContacts, table: LoopTable, angles: AngleTable | None) -> tuple[LoopTerm]:
        return (make_loop_term(cable, table, angles),)

    @override
    def parameters(self, table: LoopTable, at: Circumstances) -> list[Parameter]:
        """Return preload, noise and offsets; and its mounting effect, if other readings show how mountings scatter."""
        meaning = "effect of the loop's mounting on the friction exponent, in units of tau"
        mounting = Parameter(LOOP_MOUNTING, "$m$", meaning, "sensor", Normal(0.0, 1.0))
        noise = declare_force_noise(at, at.noise.meaning("standard deviation of a force reading"))
        return [*declare_preload(at), *([mounting] if at.mountings_scatter else []), noise, *declare_offsets(at)]

    @override
    def draw(self, table: LoopTable, truth: Truth) -> dict[str, Array]:
        """Draw forces with noise in both cells; rows without an input force are of free motion."""
        cable, values, scale = truth.cable, truth.values, truth.scale
        key = jax.random.split(jax.random.fold_in(truth.key, 3), 3)[2]
        of_input, of_output = jax.random.split(key)
        bends, variance = truth.wrap_angles(table)
        own = cable.elasticity.preload(values, jnp.sum(bends, axis=-1))[0]
        preload = jnp.where(jnp.isnan(table.preload), own, jnp.nan_to_num(table.preload))
        bends = bends + scale * jnp.sqrt(variance) * jax.random.normal(jax.random.fold_in(key, 2), bends.shape)
        mounting = values[RUN_SCATTER] * values[LOOP_MOUNTING] if LOOP_MOUNTING in values else 0.0
        exponent, stroke = cable.friction_exponent(values, bends) + mounting, jnp.asarray(table.stroke, dtype=float)
        free = stroke * free_motion_loss(preload, exponent)
        force = jnp.where(jnp.isnan(table.input_force), free, jnp.nan_to_num(table.input_force))
        output = loop_output_force(force, preload, exponent, stroke, cable.elasticity.loop_rope(values))
        cells, noise = LoadCells.of(values), scale * values[FORCE_NOISE]
        of_input_cell = noise * cable.description.sensors.noise_ratio
        return {
            "input_force": cells.shown_input(force) + of_input_cell * jax.random.normal(of_input, force.shape),
            "output_force": cells.shown_output(output) + noise * truth.scatter(of_output, force.shape),
        }

    @override
    def covariates(self, table: LoopTable, term: Term) -> Mapping[str, np.ndarray]:
        return {LOAD: table.input_force, WRAP_ANGLE: np.rad2deg(np.nansum(table.own.angle, axis=1))}

    @override
    def on_way_back(self, table: LoopTable) -> np.ndarray:
        return table.stroke < 0
