"""Leave-one-out predictions and prior sensitivities from plain arrays of draws, without JAX."""

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

_MIN_READINGS = 8  # readings of a table from which on the uniformity of their PIT is tested; fewer have no power
_STREAM = 5  # number of this stream of random numbers, beside the seed of the fit


@dataclass(frozen=True)
class TableDraws:
    """Draws for the readings of one table.

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
class CheckInputs:
    """Arrays that the checks of a fit are computed from.

    Args:
        tables: By table.
        n_effective: Effective number of the draws.
        probability: That the distribution of healthy readings of a table stays in its band.
        seed: Seed of the fit.
        quantities: Draws of the quantities whose sensitivity is computed, by name, (chain, draw).
        z: Draws of each parameter in z, by name, (chain, draw).
        total: Log likelihood of all readings, (chain, draw).
        priors: Effect of other scales of each prior, by name.
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
class TableLoo:
    """Leave-one-out predictions of the readings of one table.

    Args:
        predicted: The predictions.
        pit: Probability integral transform of each reading, uniform between 0 and 1 if the model is right.
        uniformity: Test of the uniformity of `pit`; None for few readings.
    """

    predicted: LooPredictive
    pit: np.ndarray
    uniformity: Uniformity | None


@dataclass(frozen=True)
class CheckFindings:
    """Leave-one-out predictions of every table, and prior sensitivities.

    Args:
        tables: Predictions by table.
        sensitivities: Prior sensitivities of the quantities that vary.
    """

    tables: tuple[TableLoo, ...]
    sensitivities: tuple[Sensitivity, ...]


def compute_findings(inputs: CheckInputs) -> CheckFindings:
    """Compute leave-one-out predictions of every table, and prior sensitivities."""
    generator = np.random.default_rng([inputs.seed, _STREAM])
    tables = tuple(_leave_one_out(table, inputs, generator) for table in inputs.tables)
    varying = {
        name: draws for name, draws in inputs.quantities.items() if np.ptp(draws) > 0
    }  # or an end in all of them
    prior_sensitivities = compute_sensitivities(varying, inputs.z, inputs.total, inputs.priors) if varying else ()
    return CheckFindings(tables, prior_sensitivities)


def _leave_one_out(table: TableDraws, inputs: CheckInputs, generator: np.random.Generator) -> TableLoo:
    draws, readings = (table.log_likelihood, table.replicated), (table.reading, table.at_most)
    predicted = predict_left_out(*draws, *readings, inputs.n_effective)
    pit = draw_randomized_pit(predicted, generator)
    enough = len(table.reading) >= _MIN_READINGS
    return TableLoo(predicted, pit, check_uniformity(pit, inputs.probability) if enough else None)
