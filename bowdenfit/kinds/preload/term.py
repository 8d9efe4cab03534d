"""Preload tables: the tension between fixed ends, at wrap angles."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import jax
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.kinds.angles.table import AngleTable
from bowdenfit.kinds.bench import Remeasurement, drawn_by_term
from bowdenfit.kinds.candidate import (
    UNKNOWN_SCATTER,
    Candidate,
    CandidateKind,
    Simulation,
    Situation,
    one_reading_each,
    some_bends,
)
from bowdenfit.kinds.elastic_term import ElasticTerm
from bowdenfit.kinds.preload.table import PreloadTable
from bowdenfit.kinds.shared_parameters import preload, preload_scale
from bowdenfit.kinds.term import WRAP_ANGLE, Circumstances, TermKind
from bowdenfit.parameters.priors import HalfCauchy
from bowdenfit.parameters.space import Parameter

MEASURED_PRELOAD = "measured_preload"  # not the name of the parameter
PRELOAD_NOISE = "sigma_P"


def preload_term(cable: Cable, table: PreloadTable) -> ElasticTerm:
    """The term of a table of preload; rows that read 0 come last."""
    slack = table.preload == 0
    angles = np.concatenate([table.wrap_angle[~slack], table.wrap_angle[slack]])
    data = {"reading": table.preload[~slack], "at_most": table.preload[slack], "wrap_angle": angles}
    labels = tuple(f"{np.rad2deg(angle):.4g} deg" for angle in angles)
    return ElasticTerm(cable, data, labels, MEASURED_PRELOAD, "N", PRELOAD_NOISE, _preload, 0.0)


def _preload(cable: Cable, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " rows"]:
    return cable.elasticity.preload(values, data["wrap_angle"])[0]


def _parameters(_: PreloadTable, at: Circumstances) -> list[Parameter]:
    """The preload, and how readings scatter."""
    part, by = at.defaults.preload_noise_share, preload_scale(at)
    noise = Parameter(
        PRELOAD_NOISE, r"$\sigma_P$", at.noise.meaning("standard deviation of a preload reading"), "noise",
        HalfCauchy(part * by.value), "N", scaled_by=by.share(part),
    )  # fmt: skip
    return [*preload(at), noise]


def _unread(cable: Cable, table: PreloadTable, _: AngleTable | None) -> ElasticTerm:
    """The term of a table yet to be read, of which nobody knows which rows will be slack."""
    return preload_term(cable, replace(table, preload=np.ones(len(table.preload))))


def _offered(at: Situation) -> list[Candidate]:
    table = at.measurements.table(PreloadTable)
    return [Candidate("preload", angles=(bend,)) for bend in some_bends(table.wrap_angle)] if table is not None else []


def _simulation(at: Situation, wanted: Sequence[Candidate]) -> Simulation:
    bend, (_, _, origin) = np.array([sum(c.angles) for c in wanted]), at.rows(wanted)
    return one_reading_each(preload_term(at.cable, PreloadTable(bend, np.full(len(wanted), 20.0), origin)))


PRELOAD = TermKind(
    "preload",
    lambda cable, table, _: (preload_term(cable, table),),
    _parameters,
    Remeasurement(drawn_by_term(_unread, "preload", lambda key: jax.random.split(jax.random.fold_in(key, 3), 3)[1])),
    CandidateKind(
        name="preload",
        order=4,
        needs=(PRELOAD_NOISE,),
        unknown=f"{UNKNOWN_SCATTER}; fit with a table of preload.",
        offered=_offered,
        simulation=_simulation,
        angles="total",
    ),
    where=lambda _, term: {WRAP_ANGLE: np.rad2deg(term.data["wrap_angle"])},
)
