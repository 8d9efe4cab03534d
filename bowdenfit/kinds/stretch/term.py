"""Stretch tables in the likelihood: how far the rope gives at its loaded end, under loads and at wrap angles."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jax
import numpy as np
from jax import Array
from jaxtyping import Float
from typing_extensions import override

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.elasticity import STRETCH_FRICTION, STRETCH_ZERO, StretchRows, spread_matrix
from bowdenfit.kinds.candidate import (
    UNKNOWN_SCATTER,
    Candidate,
    CandidateKind,
    Simulation,
    Situation,
    choose_loads,
    choose_wrap_angles,
    simulate_rows,
)
from bowdenfit.kinds.shared_parameters import declare_rope
from bowdenfit.kinds.tables import AngleTable, StretchTable
from bowdenfit.kinds.term import LOAD, WRAP_ANGLE, Circumstances, IndependentReadings, Term, TermKind, Truth
from bowdenfit.parameters.priors import HalfCauchy, LogNormal, Normal
from bowdenfit.parameters.space import Parameter, Scale
from bowdenfit.types import DataArray
from bowdenfit.words import significant

STRETCH_NOISE = "sigma_L"


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StretchData(StretchRows):
    """Arrays of a table of stretch.

    Args:
        reading: Stretch of each row [mm], (rows).
    """

    reading: DataArray


class StretchTerm(IndependentReadings):
    r"""Likelihood of a table of stretch.

    .. math:: \Delta L_i \sim \text{Normal}(e(\bar T_i) + g \theta_i - \Delta L_0,\ \sigma_L)
    """

    name = "stretch"
    unit = "mm"
    noise = STRETCH_NOISE
    depends_on_conditions = False  # see `Term`

    @override
    def expected(self, values: Mapping[str, Array], data: StretchData) -> Float[Array, " rows"]:
        return self.cable.elasticity.stretch_of_rows(values, data)


def make_stretch_term(cable: CableContacts, table: StretchTable) -> StretchTerm:
    """Return the term of a table of stretch."""
    angles, at = np.unique(table.wrap_angle, return_inverse=True)
    # A row read while the load grew comes down from no larger one: the two branches meet there.
    peak = np.where(table.unloading, table.peak, table.load)
    data = StretchData(table.load, peak, angles, spread_matrix(at), table.stretch)
    branch = np.where(table.unloading, ", unloading", "")
    labels = tuple(
        f"{significant(load, 4)} N at {np.rad2deg(angle):.4g} deg{way}"
        for load, angle, way in zip(table.load, table.wrap_angle, branch, strict=True)
    )
    return StretchTerm(cable, data, labels)


class StretchCandidates(CandidateKind):
    """A reading of stretch under a load, at a total wrap angle."""

    name = "stretch"
    order = 3
    needs = (STRETCH_NOISE,)
    unknown = f"{UNKNOWN_SCATTER}; fit with a table of stretch."
    angles = "total"
    loaded = True

    @override
    def candidates(self, at: Situation) -> list[Candidate]:
        """Return every load at every wrap angle."""
        table = at.measurements.table(StretchTable)
        if table is None:
            return []
        bends, loads = choose_wrap_angles(table.wrap_angle), choose_loads(table.load)
        return [Candidate(self.name, angles=(bend,), load=load) for bend in bends for load in loads]

    @override
    def simulation(self, at: Situation, candidates: Sequence[Candidate]) -> Simulation:
        load, bend = (np.array(v) for v in ([c.load for c in candidates], [sum(c.angles) for c in candidates]))
        up, cycle, (_, _, origin) = (
            np.zeros(len(candidates), dtype=bool),
            np.arange(len(candidates)),
            at.rows(candidates),
        )
        table = StretchTable(load, bend, 0.01 * load, up, load, cycle, tuple(str(i) for i in cycle), origin)
        return simulate_rows(make_stretch_term(at.cable, table))


class StretchTerms(TermKind[StretchTable]):
    """Stretch tables in the likelihood."""

    name = "stretch"
    candidate = StretchCandidates()

    @override
    def terms(self, cable: CableContacts, table: StretchTable, angles: AngleTable | None) -> tuple[StretchTerm]:
        return (make_stretch_term(cable, table),)

    @override
    def parameters(self, table: StretchTable, at: Circumstances) -> list[Parameter]:
        """Return the rope, the zero and noise of a reading, and friction where it is not a contact's."""
        zero, noise, prior = at.defaults.stretch_zero_share, at.defaults.stretch_noise_share, at.defaults.friction
        usual = at.defaults.stretch_mm_without_data
        largest = Scale(float(np.max(np.abs(table.stretch))) or usual, "largest stretch", "mm")
        spread = Scale(float(np.ptp(table.stretch)) or usual, "range of stretch", "mm")
        own_friction = Parameter(
            STRETCH_FRICTION, r"$\mu$ stretch", "friction coefficient while the rope is stretched", "friction",
            LogNormal(prior.median, prior.log_sd),
        )  # fmt: skip
        return [
            *declare_rope(at),
            Parameter(
                STRETCH_ZERO, r"$\Delta L_0$", "stretch that the reading calls zero", "elastic",
                Normal(0.0, zero * largest.value), "mm", scaled_by=largest.describe_share(zero),
            ),
            *([own_friction] if at.description.stretch.friction is None else []),
            Parameter(
                STRETCH_NOISE, r"$\sigma_L$", at.noise.meaning("standard deviation of a stretch reading"), "noise",
                HalfCauchy(noise * spread.value), "mm", scaled_by=spread.describe_share(noise),
            ),
        ]  # fmt: skip

    @override
    def draw(self, table: StretchTable, truth: Truth) -> dict[str, Array]:
        own_key = jax.random.split(jax.random.fold_in(truth.key, 3), 3)[0]
        return {"stretch": truth.simulate(make_stretch_term(truth.cable, table), own_key)}

    @override
    def covariates(self, table: StretchTable, term: Term) -> Mapping[str, np.ndarray]:
        return {LOAD: table.load, WRAP_ANGLE: np.rad2deg(table.wrap_angle)}

    @override
    def on_way_back(self, table: StretchTable) -> np.ndarray:
        return table.unloading
