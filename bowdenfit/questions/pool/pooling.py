"""A fleet's cables looked at together: from draws of single fits to the answer."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from bowdenfit.inference.interval import Interval
from bowdenfit.inference.population.model import REFERENCE_TEMPERATURE
from bowdenfit.inference.population.sampling import PopulationDraws, draw_population
from bowdenfit.questions.pool.answer import Asked, Effect, Life, Pool, PooledCable
from bowdenfit.questions.pool.curves import curves_of
from bowdenfit.questions.pool.inspected import Given, given
from bowdenfit.questions.pool.life import cycles_until, life_of
from bowdenfit.questions.pool.next import next_inspections
from bowdenfit.questions.pool.unlike import FALSE_ALARM, departures, judged, mixed
from bowdenfit.results.fleet_folder import FleetDraws

_NEW = 25  # new cables of each draw of the population, so that which are drawn does not matter to the early ones
_FAR = 2.0  # spreads from the middle from which a number is named as what is off
_WEAR = "wear"


def pooled(drawn: FleetDraws, asked: Asked | None, seed: int) -> Pool:
    """The answer.

    Args:
        drawn: Draws of all inspections.
        asked: What life is until; None where it is not asked for.
        seed: Of everything random.
    """
    known = given(drawn)
    population = draw_population(known.inspected, seed, called=known.coefficients)
    count, alone = len(known.coefficients), len(known.cables) == 1
    generator = np.random.default_rng([seed, 13])
    mean, spread = (np.repeat(each, _NEW, axis=0) for each in (population.mean, population.spread))
    new = mean + spread * generator.standard_normal(mean.shape)
    wears = known.inspected.cycles is not None
    asked = asked if wears else None
    names = (*known.coefficients, *((_WEAR,) if wears else ()))
    return Pool(
        str(drawn.about.get("name", "")),
        _cables(known, population, asked, seed),
        len(known.labels),
        known.left_out,
        {} if alone else _named(known.coefficients, np.exp(new)),
        _named(known.coefficients, np.exp(population.mean)),
        {} if alone else _named(names, population.spread),
        _effect(_WEAR, population.mean[:, count]) if wears else None,
        tuple(_effect(name, population.effects[:, i]) for i, name in enumerate(known.inspected.effects)),
        known.reference_cycles,
        REFERENCE_TEMPERATURE,
        asked,
        None if asked is None or alone else _life(known, asked, new),
        {} if alone else mixed(known.inspected, population, names),
        curves_of(known, population, asked, new) if wears else None,
        next_inspections(known, population, asked, seed),
        (*known.notes, *_more_notes(known, drawn)),
        population.reasons,
        seed,
    )


def _named(names: tuple[str, ...], draws: np.ndarray) -> dict[str, Interval]:
    return {name: Interval.of(draws[:, i]) for i, name in enumerate(names)}


def _effect(name: str, logs: np.ndarray) -> Effect:
    above = float(np.mean(logs > 0))
    return Effect(name, Interval.of(np.expm1(logs)), max(above, 1 - above))


def _life(known: Given, asked: Asked, values: np.ndarray) -> Life:
    """Of draws of log coefficients and wear."""
    cycles = cycles_until(asked, values[:, :-1], values[:, -1], known.reference_cycles)
    return life_of(asked, cycles, known.reference_cycles)


def _cables(known: Given, population: PopulationDraws, asked: Asked | None, seed: int) -> tuple[PooledCable, ...]:
    """What is known of each cable."""
    inspected, count = known.inspected, len(known.coefficients)
    alone = len(known.cables) == 1
    core, adjusted = population, np.ones(1)
    if not alone:
        core, adjusted = judged(inspected, population, partial(draw_population, inspected, seed), seed)
    away = departures(population, core)
    worth = _worth(known, population)
    found = []
    for i, name in enumerate(known.cables):
        mine, values = inspected.cable == i, population.cables[:, i]
        has = inspected.known[mine].any(axis=0)
        words = _departure(known, away[i], has) if adjusted[i] < FALSE_ALARM and not alone else ""
        found.append(
            PooledCable(
                name,
                int(mine.sum()),
                float(known.cycles[mine].max()),
                {c: Interval.of(np.exp(values[:, k])) for k, c in enumerate(known.coefficients) if has[k]},
                _by_itself(known, population, mine, has),
                Interval.of(np.expm1(values[:, count])) if inspected.cycles is not None else None,
                _life(known, asked, values) if asked is not None else None,
                float(adjusted[i]),
                words,
                float(worth[mine].min()),
            )
        )
    return tuple(found)


def _by_itself(known: Given, population: PopulationDraws, mine: np.ndarray, has: np.ndarray) -> dict[str, Interval | None]:
    """Coefficients of a cable when new from its own first inspection, if that was then; effects are those of the fleet."""
    row = int(np.flatnonzero(mine)[np.argmin(np.nan_to_num(known.cycles[mine]))])
    new = known.inspected.cycles is None or known.inspected.cycles[row] == 0
    shift = sum(
        (float(np.median(population.effects[:, i])) * column[row] for i, column in enumerate(known.inspected.effects.values())),
        0.0,
    )
    logs = known.logs[row] - shift
    return {
        name: Interval.of(np.exp(logs[:, k])) if new and np.isfinite(logs[:, k]).all() else None
        for k, name in enumerate(known.coefficients)
        if has[k]
    }


def _worth(known: Given, population: PopulationDraws) -> np.ndarray:
    """Effective number of each inspection's draws where the pooled ones are, (inspection,)."""
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


def _departure(known: Given, away: np.ndarray, has: np.ndarray) -> str:
    """What is off with a cable that is unlike the rest."""
    named: Mapping[str, float] = {
        name: float(away[k]) for k, name in enumerate((*known.coefficients, _WEAR)[: len(away)]) if name == _WEAR or has[k]
    }
    name = max(named, key=lambda each: abs(named[each]))
    if abs(named[name]) < _FAR:
        return "its inspections do not lie on one line of wear, or one of them disagrees with the others"
    way = "above" if named[name] > 0 else "below"
    return f"{name} lies {abs(named[name]):.1f} times the usual spread {way} that of the others"


def _more_notes(known: Given, drawn: FleetDraws) -> list[str]:
    """What is said of every fleet."""
    notes = []
    if len(known.cables) == 1:
        notes.append("It is one cable only: there is no population that it could be compared with or drawn toward.")
    unpooled = [name for name, about in drawn.attributes.items() if about.get("role") not in ("friction", "noise", None)]
    if unpooled:
        notes.append(f"Only friction coefficients are pooled; {', '.join(unpooled[:4])} stay as single fits give them.")
    return notes
