"""What checks of a fit need of its draws, as plain arrays, and what follows: worked out without JAX, in another process too."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bowdenfit.inference.predictive_checks import (
    LooPredictive,
    Uniformity,
    check_uniformity,
    draw_randomized_pit,
    predict_left_out,
)
from bowdenfit.inference.prior_sensitivity import RescaledPrior, Sensitivity, compute_sensitivities

_LEAST_READINGS = 8  # of a table, below which its distribution cannot be judged
_STREAM = 5  # of the fit's random numbers


@dataclass(frozen=True)
class TableDraws:
    """Readings of one table, with what the draws say of them.

    Args:
        log_likelihood: Of every reading at every draw, (draw, reading).
        replicated: Readings drawn anew, (draw, reading).
        reading, at_most: The readings, and which of them are only known to be at most so; see `readings_of`.
    """

    log_likelihood: np.ndarray
    replicated: np.ndarray
    reading: np.ndarray
    at_most: np.ndarray


@dataclass(frozen=True)
class Evidence:
    """What checks are worked out from.

    Args:
        tables: By table.
        n_effective: Effective number of the draws.
        probability: That the distribution of healthy readings of a table stays in its band.
        seed: Seed of the fit.
        quantities: Draws that sensitivities are asked of, by name, (chain, draw).
        z: Those of each parameter in z.
        total: Log likelihood of all readings.
        priors: Of each parameter.
    """

    tables: Sequence[TableDraws]
    n_effective: float
    probability: float
    seed: int
    quantities: Mapping[str, np.ndarray]
    z: Mapping[str, np.ndarray]
    total: np.ndarray
    priors: Mapping[str, RescaledPrior]


@dataclass(frozen=True)
class TableWithoutEach:
    """Readings of one table, each predicted from everything else.

    Args:
        predicted: The predictions.
        placed: Where each reading lies in its own, uniform between 0 and 1 if all is right.
        uniform: Whether these are uniform; None of few readings.
    """

    predicted: LooPredictive
    placed: np.ndarray
    uniform: Uniformity | None


@dataclass(frozen=True)
class Findings:
    """What was worked out.

    Args:
        tables: By table.
        sensitivities: Of quantities that vary.
    """

    tables: tuple[TableWithoutEach, ...]
    sensitivities: tuple[Sensitivity, ...]


def work_out(evidence: Evidence) -> Findings:
    """Predictions of readings without themselves, and weight of the priors."""
    generator = np.random.default_rng([evidence.seed, _STREAM])
    tables = tuple(_without_each(table, evidence, generator) for table in evidence.tables)
    varying = {
        name: draws for name, draws in evidence.quantities.items() if np.ptp(draws) > 0
    }  # or an end in all of them
    found = compute_sensitivities(varying, evidence.z, evidence.total, evidence.priors) if varying else ()
    return Findings(tables, found)


def _without_each(table: TableDraws, evidence: Evidence, generator: np.random.Generator) -> TableWithoutEach:
    drawn, readings = (table.log_likelihood, table.replicated), (table.reading, table.at_most)
    predicted = predict_left_out(*drawn, *readings, evidence.n_effective)
    placed = draw_randomized_pit(predicted, generator)
    judged = len(table.reading) >= _LEAST_READINGS
    return TableWithoutEach(predicted, placed, check_uniformity(placed, evidence.probability) if judged else None)
