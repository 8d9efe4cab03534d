"""Efficiency tables in the likelihood: the logarithm of each efficiency about the friction exponent at its length."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from typing_extensions import override

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.sensors import RUN_SCATTER, LoadCells, noise_law, scatter
from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds.candidate import UNKNOWN_SCATTER, Candidate, CandidateKind, Simulation, Situation, simulate_rows
from bowdenfit.kinds.efficiencies.kind import EfficiencyTable
from bowdenfit.kinds.plausibility import choose_unused_columns
from bowdenfit.kinds.row_angles import RowAngles, collect_row_angles, resolve_angles
from bowdenfit.kinds.rows import UnusedColumn
from bowdenfit.kinds.shared_parameters import declare_run_scatter
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.kinds.term import Circumstances, Term, TermKind, Truth, repeat_rows, spare_count
from bowdenfit.parameters.space import Parameter, ParameterSpace
from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.types import DataArray


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class EfficienciesData:
    """Arrays of an efficiency table.

    Args:
        angles: Wrap angles of the rows.
        loss: Minus log efficiency of each row [1], (rows).
        log_sd: Stated standard deviation of that [1], (rows).
        counts: Whether a row counts, (rows); None where all do.
    """

    angles: RowAngles
    loss: DataArray
    log_sd: DataArray
    counts: DataArray | None = None


@dataclass(frozen=True)
class EfficienciesTerm:
    r"""Likelihood of an efficiency table.

    .. math:: -\log\eta_i \sim \text{Normal}\left(-\log\eta(\Lambda_i) + g,\ \sqrt{\tau^2 + (s_i/\eta_i)^2
              + \textstyle\sum_k \mu_k^2 \sigma_{\theta,ik}^2}\right)

    with the stated standard deviation s of a row, the error of its own measured angles, and the gain error g of the
    load cells where the description has one. A row does not say at what load and speed it was measured: where friction
    depends on them, it is taken to hold at the reference force and speed. With Student noise the same mean and scale are a
    Student-t's.

    Args:
        cable: The cable.
        data: Its arrays.
        labels: Each row in words.
    """

    cable: CableContacts = field(repr=False)
    data: EfficienciesData = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    name: str = "efficiency"
    unit: str = "1"
    noise: str = RUN_SCATTER

    @property
    def depends_on_conditions(self) -> bool:
        """See `Term`: rows are taken to hold at the reference force and speed."""
        return bool(self.cable.friction.options)

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """One block: all rows scatter alike."""
        return ((len(self.labels), len(self.labels)),)

    @property
    def with_spare_rows(self) -> EfficienciesData:
        """See `LogDensity.with_spare_rows`: the rows followed by copies of them that do not count."""
        return repeat_rows(self.data, len(self.labels), spare_count(len(self.labels)))

    def _mean_and_sd(
        self, values: Mapping[str, Array], data: EfficienciesData, weights: Mapping[str, Array]
    ) -> tuple[Float[Array, " rows"], Float[Array, " rows"]]:
        angles, variance = resolve_angles(self.cable, values, data.angles)
        exponent = self.cable.friction_exponent(values, angles, route=data.angles.route)
        mean = LoadCells.of(values).gain_error + (
            -jnp.log(self.cable.friction.efficiency(values, exponent)) if self.cable.friction.options else exponent
        )
        from_angles = self.cable.exponent_variance(weights, angles, variance)
        return mean, jnp.sqrt(weights[RUN_SCATTER] ** 2 + data.log_sd ** 2 + from_angles)

    def log_likelihood(self, values: Mapping[str, Array], data: EfficienciesData) -> Float[Array, " rows"]:
        """Log likelihood of each row."""
        return noise_law(self.cable.description).log_density(data.loss, *self._mean_and_sd(values, data, values))

    def residuals(self, values: Mapping[str, Array], data: EfficienciesData) -> Float[Array, " rows"]:
        """Standardized residuals; the weights follow the parameters but are not differentiated."""
        mean, sd = self._mean_and_sd(values, data, jax.lax.stop_gradient(dict(values)))
        return noise_law(self.cable.description).residual((data.loss - mean) / jax.lax.stop_gradient(sd))

    def expected(self, values: Mapping[str, Array], data: EfficienciesData) -> Float[Array, " rows"]:
        """Expected efficiencies [1]."""
        return transmission_efficiency(self._mean_and_sd(values, data, values)[0])

    def simulate(
        self, values: Mapping[str, Array], data: EfficienciesData, key: Array, scale: float = 1.0
    ) -> Float[Array, " rows"]:
        """Efficiencies as the bench would give them [1], with all that makes them scatter times `scale`."""
        mean, sd = self._mean_and_sd(values, data, values)
        return transmission_efficiency(mean + scale * sd * scatter(key, mean.shape, self.cable.description))

    def observed(self) -> np.ndarray:
        """Measured efficiencies [1]."""
        return np.exp(-self.data.loss)


def make_efficiencies_term(cable: CableContacts, table: EfficiencyTable, angles: AngleTable | None) -> EfficienciesTerm:
    """Return the term of an efficiency table."""
    rows = collect_row_angles(cable.description, table, angles)
    data = EfficienciesData(rows, -np.log(table.efficiency), table.sd / table.efficiency)
    route = cable.description.route
    labels = tuple(
        f"{length:g} {route.unit}" if route else table.origin.describe_row(i) for i, length in enumerate(table.route)
    )
    return EfficienciesTerm(cable, data, labels)


class EfficiencyCandidates(CandidateKind):
    """An efficiency at a length, or at the wrap angles of a mounting."""

    name = "efficiency"
    order = 2
    needs = (RUN_SCATTER,)
    unknown = f"{UNKNOWN_SCATTER}; fit with a table of efficiencies or forces."
    along_route = True
    mounted_anew = True

    @override
    def candidates(self, at: Situation) -> list[Candidate]:
        table = at.measurements.table(EfficiencyTable)
        return at.along_cable(self.name, table.own) if table is not None else []

    @override
    def simulation(self, at: Situation, candidates: Sequence[Candidate]) -> Simulation:
        route, own_angles, origin = at.rows(candidates)
        table = EfficiencyTable(route, np.full(len(candidates), 0.8), np.zeros(len(candidates)), own_angles, origin)
        return simulate_rows(make_efficiencies_term(at.cable, table, at.angles))


class EfficiencyTerms(TermKind[EfficiencyTable]):
    """Efficiency tables in the likelihood."""

    name = "efficiencies"
    candidate = EfficiencyCandidates()
    shows_mounting_scatter = True

    @override
    def terms(self, cable: CableContacts, table: EfficiencyTable, angles: AngleTable | None) -> tuple[EfficienciesTerm]:
        return (make_efficiencies_term(cable, table, angles),)

    @override
    def parameters(self, table: EfficiencyTable, at: Circumstances) -> list[Parameter]:
        return [declare_run_scatter(at)]

    @override
    def draw(self, table: EfficiencyTable, truth: Truth) -> dict[str, Array]:
        term = make_efficiencies_term(truth.cable, table, truth.angles)
        return {"efficiency": truth.simulate(term, jax.random.split(truth.key, 3)[1])}

    @override
    def with_readings(
        self, description: Description, table: EfficiencyTable, readings: Mapping[str, np.ndarray]
    ) -> EfficiencyTable:
        """Return the table with new efficiencies, and stated standard deviations in proportion to them."""
        efficiency = readings["efficiency"]
        return replace(table, efficiency=efficiency, sd=table.sd / table.efficiency * efficiency)

    @override
    def unused_columns(self, table: EfficiencyTable, term: Term) -> Mapping[str, UnusedColumn]:
        """Return those that were not calculated from the efficiencies."""
        efficiency = table.efficiency
        return choose_unused_columns(table.unused, efficiency, 1 - efficiency, 1 / efficiency, np.log(efficiency))

    @override
    def check(self, table: EfficiencyTable, space: ParameterSpace) -> None:
        """Refuse tau = 0 where a row has no standard deviation of its own, because nothing would make it scatter."""
        if any(p.name == RUN_SCATTER and p.fixed == 0 for p in space.fixed) and not np.all(table.sd > 0):
            row = table.origin.describe_row(int(np.argmin(table.sd > 0)))
            raise DescriptionError(
                f"cable.toml: {RUN_SCATTER} is fixed at 0, but {row} has no standard deviation of its own, so that "
                "nothing would make it scatter and no model could be right; state the sd of every efficiency, or leave "
                f"{RUN_SCATTER} free."
            )
