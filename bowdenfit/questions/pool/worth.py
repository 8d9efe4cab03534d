"""How much single fits know of where the population puts their inspections, and their readings where that is too little."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bowdenfit.errors import StoreError
from bowdenfit.inference.population.likelihoods import JointReadings
from bowdenfit.inference.population.sampling import PopulationDraws
from bowdenfit.questions.pool.inspected import PoolingData
from bowdenfit.reading import Reading
from bowdenfit.words import few

LEAST_EFFECTIVE_DRAWS = (
    100.0  # effective draws of a single fit, below which it is not known what its readings say there
)


def count_effective_draws(data: PoolingData, population: PopulationDraws) -> np.ndarray:
    """Effective number of each inspection's draws where the pooled ones are, (inspection,).

    Args:
        known: What is pooled.
        population: What was drawn of it.
    """
    inspected, count = data.inspected, len(data.coefficients)
    columns = (
        np.stack([*inspected.effects.values()], axis=1) if inspected.effects else np.zeros((len(inspected.cable), 0))
    )
    n_effective = np.zeros(len(inspected.cable))
    for j, cable in enumerate(inspected.cable):
        has = inspected.known[j]
        logs = population.cables[:, cable, :count] + (population.effects @ columns[j])[:, None]
        if inspected.cycles is not None:
            logs = logs + inspected.cycles[j] * population.cables[:, cable, count:]
        center, covariance = logs[:, has].mean(axis=0), np.atleast_2d(np.cov(logs[:, has].T))
        own, scale = inspected.summaries.center[j][has], inspected.summaries.scale[j][np.ix_(has, has)]
        at = data.logs[j][:, has]
        log = _squared_distances(at, center, covariance) - (inspected.summaries.freedom[j] + has.sum()) * np.log1p(
            _squared_distances(at, own, scale) / inspected.summaries.freedom[j]
        )
        weights = np.exp((log.min() - log) / 2)
        n_effective[j] = weights.sum() ** 2 / np.sum(weights**2)
    return n_effective


def _squared_distances(values: np.ndarray, center: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    return np.sum(np.linalg.solve(np.linalg.cholesky(covariance), (values - center).T) ** 2, axis=0)


def load_readings(data: PoolingData, rows: Sequence[int], folder: Path) -> tuple[JointReadings, ...]:
    """Readings of some inspections, by the model that they were fitted with.

    Args:
        known: What is pooled.
        rows: Numbers of the inspections.
        folder: Of the fleet's measurements.

    Raises:
        StoreError: The folder does not hold what the inspections were fitted from.
        DatasetError, DescriptionError, UsageError: It holds no fleet.
    """
    from bowdenfit.questions.fleet.cases import Case, read_cases
    from bowdenfit.questions.fleet.inspections import read_inspections

    wanted = {data.inputs[j]: j for j in rows}
    labels = {data.labels[j] for j in rows}
    inspections = [inspection for inspection in read_inspections(folder) if inspection.label in labels]
    cases = [
        inspection
        for inspection in read_cases(folder, inspections, Reading())
        if isinstance(inspection, Case) and inspection.hash in wanted
    ]
    missing = sorted(labels - {data.labels[wanted[inspection.hash]] for inspection in cases})
    if missing:
        raise StoreError(
            f"{folder} does not hold what {few(missing)} was fitted from: the readings or the description are missing or "
            "others. Name the folder as it was when the fleet was fitted, or fit the fleet again."
        )
    shapes: dict[str, list[Case]] = defaultdict(list)
    for case in cases:
        shapes[case.shaped.key].append(case)
    readings = []
    for members in shapes.values():
        numbers = tuple(wanted[case.hash] for case in members)
        pooled = {data.own_names[k]: int(k) for k in np.flatnonzero(data.inspected.known[numbers[0]])}
        readings.append(
            JointReadings(members[0].shaped.posterior, pooled, numbers, tuple(case.shaped.data for case in members))
        )
    return tuple(readings)
