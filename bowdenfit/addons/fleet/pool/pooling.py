"""Pool the cables of a fleet: from the draws of single fits to the answer."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import jax
import numpy as np

import bowdenfit.addons.fleet.pool.words  # noqa: F401  registers the text of the answer
from bowdenfit.addons.fleet.folder import FleetDraws, read_fleet_draws
from bowdenfit.addons.fleet.inspections import read_inspections
from bowdenfit.addons.fleet.pool.answer import Effect, Life, Pool, PooledCable, ServiceLimit
from bowdenfit.addons.fleet.pool.lifetime import (
    compute_curves,
    cycles_to_failure,
    parse_service_limit,
    rank_next_inspections,
    summarize_life,
)
from bowdenfit.addons.fleet.pool.outlier_cables import FALSE_ALARM, find_departure, find_mixtures, separate_outliers
from bowdenfit.addons.fleet.pool.pooled_data import (
    LEAST_EFFECTIVE_DRAWS,
    PoolingData,
    count_effective_draws,
    load_readings,
    select_inspections,
)
from bowdenfit.addons.fleet.population.model import REFERENCE_TEMPERATURE, Inspections
from bowdenfit.addons.fleet.population.sampling import PopulationDraws, draw_population, draw_unpooled
from bowdenfit.arguments import NumberWithUnit
from bowdenfit.inference.interval import Interval
from bowdenfit.stages import announce_stage
from bowdenfit.words import few

_NEW = 25  # new cables of each draw of the population, so that which are drawn does not matter to the early ones
_WEAR = "wear"


@dataclass(frozen=True)
class _PooledDraws:
    """Draws of the population, with and without outliers, and what was found about its cables.

    Args:
        full_population: The population of all cables.
        population: The population without cables that are outliers, and these by their own inspections alone.
        p_values: Probability that a cable of this population is as far from the others, (cable,).
        departures: How it differs from the rest by the number of each that does, in words.
        wear_identified: Those of them whose own inspections tell their wear.
        n_effective: How much single fits know of each inspection where it is said to be, (inspection,).
        reread: Inspections of which the readings were looked at.
    """

    full_population: PopulationDraws
    population: PopulationDraws
    p_values: np.ndarray
    departures: dict[int, str]
    wear_identified: tuple[int, ...]
    n_effective: np.ndarray
    reread: tuple[int, ...]


def pool_results(
    results: Path,
    until: NumberWithUnit | None,
    wrap_angles: Sequence[str],
    cycles: int | None,
    measurements: Path | None,
    seed: int | None,
) -> Pool:
    """Read the results of a fleet, and pool its cables.

    Args:
        results: Results folder of the fleet.
        until: Efficiency until which a cable serves; None if its life is not wanted.
        wrap_angles: Options such as mu_sheath=180deg, one for each coefficient.
        cycles: Number of cycles before which the probability of failure is wanted.
        measurements: Folder of the fleet's measurements.
        seed: Random seed; that of the fleet if None.
    """
    announce_stage(f"reading {results.name}")
    draws = read_fleet_draws(results)
    if measurements is not None:
        read_inspections(measurements)  # refuses a wrong folder before anything is drawn
    coefficients = [name for name, about in draws.attributes.items() if about.get("role") == "friction"]
    limit = parse_service_limit(until, wrap_angles, cycles, coefficients)
    return pool_cables(draws, limit, int(draws.about.get("seed", 0)) if seed is None else seed, measurements)


def pool_cables(fleet: FleetDraws, limit: ServiceLimit | None, seed: int, measurements: Path | None = None) -> Pool:
    """Pool the cables of a fleet.

    Args:
        fleet: Draws of all inspections.
        limit: Limit that ends the life of a cable; None if not asked for.
        seed: Random seed.
        measurements: Folder of the fleet's measurements, for inspections of which single fits tell too little.

    Raises:
        StoreError: Nothing can be pooled, or the measurements are others.
        DatasetError, DescriptionError, UsageError: There are no such measurements.
    """
    with jax.enable_x64(True):
        return _pool_cables(fleet, limit, seed, measurements)


def _pool_cables(fleet: FleetDraws, limit: ServiceLimit | None, seed: int, measurements: Path | None) -> Pool:
    data = select_inspections(fleet)
    announce_stage("sampling the population")
    result = _draw_with_readings(data, seed, measurements)
    announce_stage("summarizing the cables")
    population = result.population
    count, single = len(data.coefficients), len(data.cables) == 1
    generator = np.random.default_rng([seed, 13])
    mean, spread = (np.repeat(draws, _NEW, axis=0) for draws in (population.mean, population.spread))
    new = mean + spread * generator.standard_normal(mean.shape)
    wears = data.inspected.cycles is not None
    limit = limit if wears else None
    names = (*data.coefficients, *((_WEAR,) if wears else ()))
    return Pool(
        str(fleet.about.get("name", "")),
        _summarize_cables(data, result, limit),
        len(data.labels),
        data.left_out,
        {} if single else _intervals_by_name(data.coefficients, np.exp(new)),
        _intervals_by_name(data.coefficients, np.exp(population.mean)),
        {} if single else _intervals_by_name(names, population.spread),
        _summarize_effect(_WEAR, population.mean[:, count]) if wears else None,
        tuple(_summarize_effect(name, population.effects[:, i]) for i, name in enumerate(data.inspected.effects)),
        data.reference_cycles,
        REFERENCE_TEMPERATURE,
        limit,
        None if limit is None or single else _estimate_life(data, limit, new),
        {} if single else find_mixtures(data.inspected, result.population, names, result.departures),
        compute_curves(data, population, limit, new) if wears else None,
        rank_next_inspections(data, population, limit, seed),
        (*data.notes, *_general_notes(data, fleet)),
        (*dict.fromkeys((*population.reasons, *result.full_population.reasons)), *_find_too_few_draws(data, result)),
        seed,
    )


def _draw_with_readings(data: PoolingData, seed: int, measurements: Path | None) -> _PooledDraws:
    """Draw the population, and again with the readings of inspections with too few effective draws."""
    inspected, reread = data.inspected, tuple[int, ...]()
    while True:
        readings = load_readings(data, reread, measurements) if measurements is not None and reread else ()
        draw = partial(draw_population, inspected, seed, coefficient_names=data.coefficients, readings=readings)
        full_population = draw()
        core, p_values = (
            (full_population, np.ones(1))
            if inspected.cables == 1
            else separate_outliers(inspected, full_population, draw, seed)
        )
        outliers = [int(i) for i in np.flatnonzero(p_values < FALSE_ALARM)]
        population, wear_identified = _replace_outliers(inspected, core, outliers, seed)
        n_effective = count_effective_draws(data, population)
        more = tuple(
            int(j)
            for j in np.flatnonzero(n_effective < LEAST_EFFECTIVE_DRAWS)
            if j not in reread and inspected.cable[j] not in outliers
        )
        if measurements is None or not more:
            departures = {i: _describe_departure(data, find_departure(inspected, core, i, seed)) for i in outliers}
            return _PooledDraws(full_population, population, p_values, departures, wear_identified, n_effective, reread)
        reread = (*reread, *more)


def _replace_outliers(
    inspected: Inspections, core: PopulationDraws, outliers: list[int], seed: int
) -> tuple[PopulationDraws, tuple[int, ...]]:
    """Replace the draws of outliers by those from their own inspections; return also which of these identify their wear."""
    cables, wear_identified = core.cables.copy(), []
    for i in outliers:
        cables[:, i], has_wear = draw_unpooled(inspected, core, i, seed)
        wear_identified += [i] * has_wear
    return replace(core, cables=cables), tuple(wear_identified)


def _find_too_few_draws(data: PoolingData, result: _PooledDraws) -> list[str]:
    """Return reasons for distrust where single fits have too few effective draws."""
    cable_numbers, reasons = data.inspected.cable, []
    low = [
        j
        for j in np.flatnonzero(result.n_effective < LEAST_EFFECTIVE_DRAWS)
        if j not in result.reread or cable_numbers[j] in result.departures
    ]
    pulled = [data.cables[cable_numbers[j]] for j in low if cable_numbers[j] not in result.departures]
    contradictory = [data.cables[cable_numbers[j]] for j in low if cable_numbers[j] in result.departures]
    if pulled:
        reasons.append(
            f"what was drawn from the inspections of {few(list(dict.fromkeys(pulled)))} alone barely reaches where the "
            "other cables put them, so that their answers may be off by half their uncertainty; name the folder of the "
            "fleet's measurements with --measurements, and their readings are looked at again"
        )
    if contradictory:
        reasons.append(
            f"inspections of {few(list(dict.fromkeys(contradictory)))} contradict each other, so that the estimate lies "
            "where almost none of them puts it; look for a wrong reading, a wrong row of fleet.csv or a cable that was "
            "changed, and leave that inspection out"
        )
    return reasons


def _intervals_by_name(names: tuple[str, ...], draws: np.ndarray) -> dict[str, Interval]:
    return {name: Interval.of(draws[:, i]) for i, name in enumerate(names)}


def _summarize_effect(name: str, logs: np.ndarray) -> Effect:
    above = float(np.mean(logs > 0))
    return Effect(name, Interval.of(np.expm1(logs)), max(above, 1 - above))


def _estimate_life(data: PoolingData, limit: ServiceLimit, values: np.ndarray) -> Life:
    """Estimate a life from draws of log coefficients and wear."""
    cycles = cycles_to_failure(limit, values[:, :-1], values[:, -1], data.reference_cycles)
    return summarize_life(limit, cycles, data.reference_cycles)


def _summarize_cables(data: PoolingData, result: _PooledDraws, limit: ServiceLimit | None) -> tuple[PooledCable, ...]:
    """Summarize every cable."""
    inspected, population, count = data.inspected, result.population, len(data.coefficients)
    is_reread = np.isin(np.arange(len(inspected.cable)), result.reread)
    cables = []
    for i, name in enumerate(data.cables):
        row_mask, values = inspected.cable == i, population.cables[:, i]
        has = inspected.known[row_mask].any(axis=0)
        named = [data.coefficients[k] for k in np.flatnonzero(has)]
        wear = [_WEAR] if inspected.cycles is not None else []
        cables.append(
            PooledCable(
                name,
                int(row_mask.sum()),
                float(data.cycles[row_mask].max()),
                {c: Interval.of(np.exp(values[:, k])) for k, c in enumerate(data.coefficients) if has[k]},
                _estimate_unpooled(data, population, row_mask, has),
                Interval.of(np.expm1(values[:, count])) if wear else None,
                _estimate_life(data, limit, values) if limit is not None else None,
                float(result.p_values[i]),
                result.departures.get(i, ""),
                tuple(wear if i not in result.wear_identified else []) if i in result.departures else (*named, *wear),
                float(result.n_effective[row_mask].min()),
                0 if i in result.departures else int(is_reread[row_mask].sum()),
            )
        )
    return tuple(cables)


def _estimate_unpooled(
    data: PoolingData, population: PopulationDraws, row_mask: np.ndarray, has: np.ndarray
) -> dict[str, Interval | None]:
    """Estimate coefficients when new from the first inspection of a cable alone; covariate effects are those of the fleet."""
    row = int(np.flatnonzero(row_mask)[np.argmin(np.nan_to_num(data.cycles[row_mask]))])
    new = data.inspected.cycles is None or data.inspected.cycles[row] == 0
    shift = sum(
        (
            float(np.median(population.effects[:, i])) * column[row]
            for i, column in enumerate(data.inspected.effects.values())
        ),
        0.0,
    )
    logs = data.logs[row] - shift
    return {
        name: Interval.of(np.exp(logs[:, k])) if new and np.isfinite(logs[:, k]).all() else None
        for k, name in enumerate(data.coefficients)
        if has[k]
    }


def _describe_departure(data: PoolingData, departure: tuple[int, float] | None) -> str:
    """Describe in words how an outlier differs by its own inspections."""
    if departure is None:
        return "its inspections do not lie on one line of wear, or one of them disagrees with the others"
    number, distance = departure
    name, way = (*data.coefficients, _WEAR)[number], "above" if distance > 0 else "below"
    return f"{name} lies {abs(distance):.1f} times the usual spread {way} that of the others"


def _general_notes(data: PoolingData, fleet: FleetDraws) -> list[str]:
    """Return notes that do not depend on the estimates."""
    notes = []
    if len(data.cables) == 1:
        notes.append("It is one cable only: there is no population that it could be compared with or shrunk toward.")
    unpooled = [
        name for name, about in fleet.attributes.items() if about.get("role") not in ("friction", "noise", None)
    ]
    if unpooled:
        notes.append(f"Only friction coefficients are pooled; {', '.join(unpooled[:4])} stay as single fits give them.")
    return notes
