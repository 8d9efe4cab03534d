"""Preload tables in the likelihood: the tension between fixed ends, at wrap angles."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from typing_extensions import override

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.sensors import noise_law
from bowdenfit.kinds.candidate import (
    UNKNOWN_SCATTER,
    Candidate,
    CandidateKind,
    Simulation,
    Situation,
    choose_wrap_angles,
    simulate_rows,
)
from bowdenfit.kinds.shared_parameters import declare_preload, preload_scale
from bowdenfit.kinds.tables import AngleTable, PreloadTable
from bowdenfit.kinds.term import (
    WRAP_ANGLE,
    Circumstances,
    IndependentReadings,
    Term,
    TermKind,
    Truth,
    deviations_of_bounds,
    deviations_of_readings,
    join_contributions,
)
from bowdenfit.parameters.priors import HalfCauchy
from bowdenfit.parameters.space import Parameter
from bowdenfit.types import DataArray

MEASURED_PRELOAD = "measured_preload"  # not the name of the parameter
PRELOAD_NOISE = "sigma_P"


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PreloadData:
    """Arrays of a table of preload.

    Args:
        reading: Preload of taut rows [N], (read); NaN where there is none.
        at_most: Zeros of slack rows [N], (bounds); NaN where there is none.
        wrap_angle: Total wrap angle of the taut rows, then of the slack ones [rad], (rows).
    """

    reading: DataArray
    at_most: DataArray
    wrap_angle: DataArray


class PreloadTerm(IndependentReadings):
    r"""Likelihood of a table of preload.

    .. math:: P_i \sim \text{Normal}(P(\theta_i),\ \sigma_P)

    A preload of 0 is what a load cell says of a slack rope whatever its noise: such a row is known to be at most 0, and
    contributes :math:`\Phi(-P(\theta)/\sigma_P)`. These rows come last; `at_most` of the data holds their zeros.
    """

    name = MEASURED_PRELOAD
    unit = "N"
    noise = PRELOAD_NOISE
    depends_on_conditions = False  # see `Term`

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """A block of readings that scatter alike, and one of bounds, which have no scatter."""
        read = len(self.data.reading)
        return ((read, read), (len(self.labels) - read, 0))

    @property
    def padded(self) -> PreloadData:
        """See `LogDensity.padded`: every row as one that was read and as one that is known to be at most 0."""
        data: PreloadData = self.data
        none_read, none_bound = np.full(len(data.at_most), np.nan), np.full(len(data.reading), np.nan)
        reading, at_most = np.concatenate([data.reading, none_read]), np.concatenate([none_bound, data.at_most])
        return replace(data, reading=reading, at_most=at_most)

    @override
    def expected(self, values: Mapping[str, Array], data: PreloadData) -> Float[Array, " rows"]:
        return self.cable.elasticity.preload(values, data.wrap_angle)[0]

    def _deviations(
        self, values: Mapping[str, Array], data: PreloadData, noise: Array
    ) -> tuple[Float[Array, " read"], Float[Array, " at_most"]]:
        """Return standardized deviations of the readings, and of those that are only known to be at most 0."""
        expected = self.expected(values, data)
        return deviations_of_readings(data.reading, expected) / noise, deviations_of_bounds(
            data.at_most, expected
        ) / noise

    @override
    def log_likelihood(self, values: Mapping[str, Array], data: PreloadData) -> Float[Array, " rows"]:
        deviation, u = self._deviations(values, data, values[self.noise])
        law = noise_law(self.cable.description)
        read = law.log_density(deviation) - jnp.log(values[self.noise])
        return join_contributions((data.reading, read), (data.at_most, law.log_cdf(u)))

    @override
    def residuals(self, values: Mapping[str, Array], data: PreloadData) -> Float[Array, " rows"]:
        """Standardized residuals; sqrt(-2 log likelihood) for rows known to be at most 0."""
        deviation, u = self._deviations(values, data, jax.lax.stop_gradient(values[self.noise]))
        law = noise_law(self.cable.description)
        return join_contributions((data.reading, law.residual(deviation)), (data.at_most, law.bound_residual(u)))

    @override
    def simulate(
        self, values: Mapping[str, Array], data: PreloadData, key: Array, scale: float = 1.0
    ) -> Float[Array, " rows"]:
        return jnp.maximum(super().simulate(values, data, key, scale), 0.0)

    @override
    def observed(self) -> np.ndarray:
        return np.concatenate([self.data.reading, self.data.at_most])


def make_preload_term(cable: CableContacts, table: PreloadTable) -> PreloadTerm:
    """Return the term of a table of preload; rows that read 0 come last."""
    slack = table.preload == 0
    angles = np.concatenate([table.wrap_angle[~slack], table.wrap_angle[slack]])
    labels = tuple(f"{np.rad2deg(angle):.4g} deg" for angle in angles)
    return PreloadTerm(cable, PreloadData(table.preload[~slack], table.preload[slack], angles), labels)


class PreloadCandidates(CandidateKind):
    """A reading of preload at a total wrap angle."""

    name = "preload"
    order = 4
    needs = (PRELOAD_NOISE,)
    unknown = f"{UNKNOWN_SCATTER}; fit with a table of preload."
    angles = "total"

    @override
    def candidates(self, at: Situation) -> list[Candidate]:
        table = at.measurements.table(PreloadTable)
        return (
            [Candidate(self.name, angles=(bend,)) for bend in choose_wrap_angles(table.wrap_angle)] if table is not None else []
        )

    @override
    def simulation(self, at: Situation, candidates: Sequence[Candidate]) -> Simulation:
        bend, (_, _, origin) = np.array([sum(c.angles) for c in candidates]), at.rows(candidates)
        return simulate_rows(make_preload_term(at.cable, PreloadTable(bend, np.full(len(candidates), 20.0), origin)))


class PreloadTerms(TermKind[PreloadTable]):
    """Preload tables in the likelihood."""

    name = "preload"
    candidate = PreloadCandidates()

    @override
    def terms(self, cable: CableContacts, table: PreloadTable, angles: AngleTable | None) -> tuple[PreloadTerm]:
        return (make_preload_term(cable, table),)

    @override
    def parameters(self, table: PreloadTable, at: Circumstances) -> list[Parameter]:
        """Return the preload and the noise of its readings."""
        part, by = at.defaults.preload_noise_share, preload_scale(at)
        noise = Parameter(
            PRELOAD_NOISE, r"$\sigma_P$", at.noise.meaning("standard deviation of a preload reading"), "noise",
            HalfCauchy(part * by.value), "N", scaled_by=by.describe_share(part),
        )  # fmt: skip
        return [*declare_preload(at), noise]

    @override
    def draw(self, table: PreloadTable, truth: Truth) -> dict[str, Array]:
        """Draw readings as if every row were taut; those below 0 read 0."""
        taut = replace(table, preload=np.ones(len(table.preload)))
        own_key = jax.random.split(jax.random.fold_in(truth.key, 3), 3)[1]
        return {"preload": truth.simulate(make_preload_term(truth.cable, taut), own_key)}

    @override
    def covariates(self, table: PreloadTable, term: Term) -> Mapping[str, np.ndarray]:
        return {WRAP_ANGLE: np.rad2deg(term.data.wrap_angle)}
