"""Select what is pooled of a fleet, count effective draws by inspection, and reload readings where those are too few."""

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.addons.fleet.folder import FleetDraws
from bowdenfit.addons.fleet.inspections import Case, read_cases, read_inspections
from bowdenfit.addons.fleet.pool.answer import ExcludedFit
from bowdenfit.addons.fleet.population.likelihoods import JointReadings, Summaries, summarize_likelihoods
from bowdenfit.addons.fleet.population.model import REFERENCE_TEMPERATURE, Inspections
from bowdenfit.addons.fleet.population.sampling import PopulationDraws
from bowdenfit.errors import StoreError
from bowdenfit.reading import Reading
from bowdenfit.words import counted, few, listed

FRICTION = "friction"  # the role of what is pooled
_OWN_NAME = "own_name"  # of a coefficient in single fits, where some of that name mean something else
_SMALLEST = 1e-12  # that a coefficient may be drawn as, so that its logarithm is finite
# Effective draws of a single fit, below which it is not known what its readings say there: means are then known to a tenth of
# a standard deviation.
LEAST_EFFECTIVE_DRAWS = 100.0


@dataclass(frozen=True)
class PoolingData:
    """Data of a fleet that are pooled.

    Args:
        cables: Names, in the order of their numbers.
        coefficients: Names.
        symbols: Symbols of the coefficients, for axes.
        inspected: Draws and circumstances of all inspections.
        logs: Draws of their log coefficients, (inspection, draw, coefficient).
        labels: Labels of the inspections.
        cycles: Cycles of the inspections; NaN where nobody says.
        reference_cycles: That wear is stated for.
        left_out: Inspections that are not pooled.
        notes: What is not estimated and why, a sentence each.
        inputs: Inputs of the inspections, what they were fitted from.
        own_names: Names of the coefficients in single fits.
    """

    cables: tuple[str, ...]
    coefficients: tuple[str, ...]
    symbols: dict[str, str]
    inspected: Inspections
    logs: np.ndarray
    labels: tuple[str, ...]
    cycles: np.ndarray
    reference_cycles: float
    left_out: tuple[ExcludedFit, ...]
    notes: tuple[str, ...]
    inputs: tuple[str, ...]
    own_names: tuple[str, ...]


def select_inspections(fleet: FleetDraws) -> PoolingData:
    """Select the inspections and coefficients of a fleet that are pooled.

    Args:
        fleet: Draws of all inspections.

    Raises:
        StoreError: Nothing can be pooled.
    """
    notes: list[str] = []
    values, about = _split_by_meaning(fleet, notes)
    if not values:
        raise StoreError(
            "no friction coefficient of this fleet can be pooled; only coefficients that were fitted under a prior on their "
            "logarithm (LogNormal, or a value with its uncertainty) are."
        )
    kept, left_out = _select_usable(fleet, values, notes)
    if not kept.any():
        raise StoreError(f"none of {len(kept)} inspections can be pooled. {left_out[0].inspection}: {left_out[0].why}.")
    cycles = fleet.cycles[kept]
    cables = tuple(dict.fromkeys(name for name, keep in zip(fleet.cable, kept, strict=True) if keep))
    number = np.array([cables.index(name) for name, keep in zip(fleet.cable, kept, strict=True) if keep])
    logs = np.log(np.maximum(np.stack([draws[kept] for draws in values.values()], axis=2), _SMALLEST))
    priors = [_parse_log_prior(about[name]) for name in values]
    mean, sd = (np.array([prior[i] for prior in priors]) for i in (0, 1))
    known = np.isfinite(logs).all(axis=1)
    reference = float(np.nanmax(cycles)) if np.isfinite(cycles).any() else 0.0
    relative_cycles = cycles / reference if _wear_is_identifiable(cycles, notes) else None
    effects = _select_covariates(fleet, kept, notes)
    inspected = Inspections(
        number, relative_cycles, effects, known, _summarize_by_pattern(logs, known, mean, sd), mean, sd
    )
    symbols = {name: about[name].get("symbol", name) for name in values}
    labels = tuple(name for name, keep in zip(fleet.label, kept, strict=True) if keep)
    own_names = tuple(about[name][_OWN_NAME] for name in values)
    inputs = fleet.stats.get("input", np.full(len(kept), ""))[kept]
    return PoolingData(
        cables, tuple(values), symbols, inspected, logs, labels, cycles, reference, left_out, tuple(notes),
        tuple(map(_decode_text, inputs)), own_names,
    )  # fmt: skip


def _summarize_by_pattern(logs: np.ndarray, known: np.ndarray, mean: np.ndarray, sd: np.ndarray) -> Summaries:
    """Summarize likelihoods of all inspections, those with the same coefficients together."""
    count, coefficients = known.shape
    center, scale, freedom = (
        np.zeros((count, coefficients)),
        np.zeros((count, coefficients, coefficients)),
        np.ones(count),
    )
    for pattern in np.unique(known, axis=0):
        rows, columns = np.flatnonzero((known == pattern).all(axis=1)), np.flatnonzero(pattern)
        summary = summarize_likelihoods(logs[rows][:, :, columns], mean[columns], sd[columns])
        center[np.ix_(rows, columns)], freedom[rows] = summary.center, summary.freedom
        scale[np.ix_(rows, columns, columns)] = summary.scale
    return Summaries(center, scale, freedom)


def _split_by_meaning(
    fleet: FleetDraws, notes: list[str]
) -> tuple[dict[str, np.ndarray], dict[str, Mapping[str, str]]]:
    """Return draws and attributes of coefficients; one name with several meanings is split into several."""
    shapes = [_decode_text(key) for key in fleet.stats["shape"]]
    meanings: Mapping[str, Mapping[str, str]] = fleet.about.get("meanings", {})
    values: dict[str, np.ndarray] = {}
    about: dict[str, Mapping[str, str]] = {}
    no_prior: list[str] = []
    for name, draws in fleet.values.items():
        if fleet.attributes[name].get("role") != FRICTION:
            continue
        if _parse_log_prior(fleet.attributes[name]) is None:
            no_prior.append(name)
            continue
        row_meanings = [meanings.get(key, {}).get(name, "") for key in shapes]
        distinct = list(
            dict.fromkeys(text for text, row in zip(row_meanings, draws, strict=True) if np.isfinite(row).all())
        )
        for i, text in enumerate(distinct):
            row_mask = np.array([meaning == text for meaning in row_meanings])
            label = name if len(distinct) == 1 else f"{name} ({i + 1})"
            values[label] = np.where(row_mask[:, None], draws, np.nan)
            about[label] = {**fleet.attributes[name], _OWN_NAME: name}
        if len(distinct) > 1:
            meant = listed([f"{name} ({i + 1}) is {text}" for i, text in enumerate(distinct)])
            notes.append(f"{name} does not mean the same for all cables, so it is pooled by what it means: {meant}.")
    if no_prior:
        notes.append(f"{listed(no_prior)} cannot be pooled, because no prior on the logarithm says where to begin.")
    return values, about


def _parse_log_prior(about: Mapping[str, str]) -> Any:
    """Return mean and standard deviation of the prior of a log coefficient in single fits; None if it has none."""
    try:
        prior = json.loads(about["prior"])
        if prior["kind"] == "LogNormal":
            return float(np.log(prior["median"])), float(prior["log_sd"])
        if prior["kind"] == "TruncatedNormal" and prior["mean"] > 0:
            return float(np.log(prior["mean"])), float(prior["sd"] / prior["mean"])
    except (KeyError, ValueError, TypeError):
        return None
    return None


def _select_usable(
    fleet: FleetDraws, values: Mapping[str, np.ndarray], notes: list[str]
) -> tuple[np.ndarray, tuple[ExcludedFit, ...]]:
    """Return a mask of the inspections that are pooled, and why the others are not."""
    trusted = fleet.stats["trusted"].astype(bool)
    has = np.any([np.isfinite(draws).all(axis=1) for draws in values.values()], axis=0)
    some, dated = np.isfinite(fleet.cycles).any(), np.isfinite(fleet.cycles)
    left = []
    for i, label in enumerate(fleet.label):
        if not trusted[i]:
            left.append(ExcludedFit(label, "its fit must not be trusted"))
        elif not has[i]:
            left.append(ExcludedFit(label, "it has none of the coefficients that are pooled"))
        elif some and not dated[i]:
            left.append(ExcludedFit(label, "its number of cycles is not stated"))
    kept = trusted & has & (dated if some else np.ones(len(has), dtype=bool))
    if left:
        named = few([inspection.inspection for inspection in left])
        notes.append(f"{counted(len(left), 'inspection')} could not be pooled ({named}); the reason is in the JSON.")
    return kept, tuple(left)


def _wear_is_identifiable(cycles: np.ndarray, notes: list[str]) -> bool:
    """Return whether inspections at different numbers of cycles are there."""
    if not np.isfinite(cycles).any():
        notes.append("The numbers of cycles at the inspections are not given, so wear and life cannot be estimated.")
        return False
    if np.ptp(cycles) == 0:
        every = f"{cycles[0]:,.15g} cycles"
        notes.append(f"All inspections were made after {every}, so wear and life cannot be estimated.")
        return False
    return True


def _select_covariates(fleet: FleetDraws, kept: np.ndarray, notes: list[str]) -> dict[str, np.ndarray]:
    """Return columns of covariates that are known for every inspection and vary."""
    columns = {"lubrication": fleet.lubricated[kept], "per_degree": fleet.temperature[kept] - REFERENCE_TEMPERATURE}
    words = {"lubrication": "whether the cable was lubricated", "per_degree": "the temperature"}
    covariates = {}
    for name, column in columns.items():
        missing = int(np.isnan(column).sum())
        if missing and missing < len(column):
            some = counted(missing, "inspection does", "inspections do")
            notes.append(f"{some} not say {words[name]}, so it is not allowed for; what it does counts as scatter.")
        elif not missing and np.ptp(column) > 0:
            covariates[name] = column
        elif not missing and column[0] != 0:
            at = "lubricated" if name == "lubrication" else f"at {fleet.temperature[kept][0]:g} °C"
            notes.append(f"Every inspection was made {at}, so all answers hold {at}.")
    return covariates


def _decode_text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def count_effective_draws(data: PoolingData, population: PopulationDraws) -> np.ndarray:
    """Return the effective number of draws of each single fit under the pooled posterior, (inspection,).

    Args:
        data: Pooled draws of all inspections.
        population: Draws of the population.
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
    """Load the readings of some inspections, grouped by the model that fitted them.

    Args:
        data: Pooled draws of all inspections.
        rows: Numbers of the inspections.
        folder: Folder of the fleet's measurements.

    Raises:
        StoreError: The folder does not hold what the inspections were fitted from.
        DatasetError, DescriptionError, UsageError: It holds no fleet.
    """
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
