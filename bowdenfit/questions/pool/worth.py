"""How much single fits know of where the population puts their inspections, and their readings where that is too little."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bowdenfit.errors import StoreError
from bowdenfit.inference.population.likelihoods import JointReadings
from bowdenfit.inference.population.sampling import PopulationDraws
from bowdenfit.questions.pool.inspected import Given
from bowdenfit.reading import Reading
from bowdenfit.words import few

LEAST = 100.0  # effective draws of a single fit, below which it is not known what its readings say there


def worth(known: Given, population: PopulationDraws) -> np.ndarray:
    """Effective number of each inspection's draws where the pooled ones are, (inspection,).

    Args:
        known: What is pooled.
        population: What was drawn of it.
    """
    inspected, count = known.inspected, len(known.coefficients)
    columns = np.stack([*inspected.effects.values()], axis=1) if inspected.effects else np.zeros((len(inspected.cable), 0))
    found = np.zeros(len(inspected.cable))
    for j, cable in enumerate(inspected.cable):
        has = inspected.known[j]
        logs = population.cables[:, cable, :count] + (population.effects @ columns[j])[:, None]
        if inspected.cycles is not None:
            logs = logs + inspected.cycles[j] * population.cables[:, cable, count:]
        center, covariance = logs[:, has].mean(axis=0), np.atleast_2d(np.cov(logs[:, has].T))
        own, scale = inspected.summaries.center[j][has], inspected.summaries.scale[j][np.ix_(has, has)]
        there = known.logs[j][:, has]
        log = _squares(there, center, covariance) - (inspected.summaries.freedom[j] + has.sum()) * np.log1p(
            _squares(there, own, scale) / inspected.summaries.freedom[j]
        )
        weights = np.exp((log.min() - log) / 2)
        found[j] = weights.sum() ** 2 / np.sum(weights**2)
    return found


def _squares(values: np.ndarray, center: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    return np.sum(np.linalg.solve(np.linalg.cholesky(covariance), (values - center).T) ** 2, axis=0)


def readings_of(known: Given, rows: Sequence[int], folder: Path) -> tuple[JointReadings, ...]:
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

    wanted = {known.inputs[j]: j for j in rows}
    labels = {known.labels[j] for j in rows}
    inspections = [each for each in read_inspections(folder) if each.label in labels]
    cases = [each for each in read_cases(folder, inspections, Reading()) if isinstance(each, Case) and each.hash in wanted]
    missing = sorted(labels - {known.labels[wanted[each.hash]] for each in cases})
    if missing:
        raise StoreError(
            f"{folder} does not hold what {few(missing)} was fitted from: the readings or the description are missing or "
            "others. Name the folder as it was when the fleet was fitted, or fit the fleet again."
        )
    shapes: dict[str, list[Case]] = defaultdict(list)
    for case in cases:
        shapes[case.shaped.key].append(case)
    found = []
    for members in shapes.values():
        numbers = tuple(wanted[case.hash] for case in members)
        pooled = {known.own_names[k]: int(k) for k in np.flatnonzero(known.inspected.known[numbers[0]])}
        found.append(JointReadings(members[0].shaped.posterior, pooled, numbers, tuple(case.shaped.data for case in members)))
    return tuple(found)
