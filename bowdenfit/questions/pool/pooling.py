"""A fleet's cables looked at together: from draws of single fits to the answer."""

from functools import partial
from pathlib import Path

import numpy as np

from bowdenfit.inference.interval import Interval
from bowdenfit.inference.population.model import REFERENCE_TEMPERATURE
from bowdenfit.inference.population.sampling import PopulationDraws, draw_population
from bowdenfit.questions.pool.answer import Asked, Effect, Life, Pool, PooledCable
from bowdenfit.questions.pool.curves import curves_of
from bowdenfit.questions.pool.inspected import Given, given
from bowdenfit.questions.pool.life import cycles_until, life_of
from bowdenfit.questions.pool.next import next_inspections
from bowdenfit.questions.pool.unlike import FALSE_ALARM, departure, judged, mixed
from bowdenfit.questions.pool.worth import LEAST, readings_of, worth
from bowdenfit.results.fleet_folder import FleetDraws
from bowdenfit.words import few

_NEW = 25  # new cables of each draw of the population, so that which are drawn does not matter to the early ones
_WEAR = "wear"


def pooled(drawn: FleetDraws, asked: Asked | None, seed: int, measurements: Path | None = None) -> Pool:
    """The answer.

    Args:
        drawn: Draws of all inspections.
        asked: What life is until; None where it is not asked for.
        seed: Of everything random.
        measurements: Folder of the fleet's measurements, for inspections of which single fits tell too little.

    Raises:
        StoreError: Nothing can be pooled, or the measurements are others.
        DatasetError, DescriptionError, UsageError: There are no such measurements.
    """
    known = given(drawn)
    population, each_worth, measured = _drawn(known, seed, measurements)
    count, alone = len(known.coefficients), len(known.cables) == 1
    generator = np.random.default_rng([seed, 13])
    mean, spread = (np.repeat(each, _NEW, axis=0) for each in (population.mean, population.spread))
    new = mean + spread * generator.standard_normal(mean.shape)
    wears = known.inspected.cycles is not None
    asked = asked if wears else None
    names = (*known.coefficients, *((_WEAR,) if wears else ()))
    return Pool(
        str(drawn.about.get("name", "")),
        _cables(known, population, each_worth, measured, asked, seed),
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
        (*population.reasons, *_poorly_known(known, each_worth, measured)),
        seed,
    )


def _drawn(known: Given, seed: int, measurements: Path | None) -> tuple[PopulationDraws, np.ndarray, tuple[int, ...]]:
    """The population; how much single fits know of each inspection there; and those whose readings are looked at."""
    rows: tuple[int, ...] = ()
    while True:
        readings = readings_of(known, rows, measurements) if measurements is not None and rows else ()
        drawn = draw_population(known.inspected, seed, called=known.coefficients, readings=readings)
        found = worth(known, drawn)
        more = tuple(int(j) for j in np.flatnonzero(found < LEAST) if j not in rows)
        if measurements is None or not more:
            return drawn, found, rows
        rows = (*rows, *more)


def _poorly_known(known: Given, found: np.ndarray, rows: tuple[int, ...]) -> tuple[str, ...]:
    """Why the answer must not be trusted where single fits know too little; empty where they know enough."""
    numbers = [j for j in np.flatnonzero(found < LEAST) if j not in rows]
    if not numbers:
        return ()
    cables = list(dict.fromkeys(known.cables[known.inspected.cable[j]] for j in numbers))
    return (
        f"what was drawn from the inspections of {few(cables)} by themselves hardly reaches where the other cables put them, "
        "so that what is said of them may be off by half its uncertainty; name the folder of the fleet's measurements with "
        "--measurements, and their readings are looked at again",
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


def _cables(
    known: Given,
    population: PopulationDraws,
    each_worth: np.ndarray,
    measured: tuple[int, ...],
    asked: Asked | None,
    seed: int,
) -> tuple[PooledCable, ...]:
    """What is known of each cable."""
    inspected, count = known.inspected, len(known.coefficients)
    alone = len(known.cables) == 1
    core, adjusted = population, np.ones(1)
    if not alone:
        core, adjusted = judged(inspected, population, partial(draw_population, inspected, seed), seed)
    again = np.isin(np.arange(len(inspected.cable)), measured)
    found = []
    for i, name in enumerate(known.cables):
        mine, values = inspected.cable == i, population.cables[:, i]
        has = inspected.known[mine].any(axis=0)
        words = _departure(known, departure(inspected, core, i, seed)) if adjusted[i] < FALSE_ALARM and not alone else ""
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
                float(each_worth[mine].min()),
                int(again[mine].sum()),
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


def _departure(known: Given, found: tuple[int, float] | None) -> str:
    """What is off with a cable that is unlike the rest, by its own inspections."""
    if found is None:
        return "its inspections do not lie on one line of wear, or one of them disagrees with the others"
    number, off = found
    name, way = (*known.coefficients, _WEAR)[number], "above" if off > 0 else "below"
    return f"{name} lies {abs(off):.1f} times the usual spread {way} that of the others"


def _more_notes(known: Given, drawn: FleetDraws) -> list[str]:
    """What is said of every fleet."""
    notes = []
    if len(known.cables) == 1:
        notes.append("It is one cable only: there is no population that it could be compared with or drawn toward.")
    unpooled = [name for name, about in drawn.attributes.items() if about.get("role") not in ("friction", "noise", None)]
    if unpooled:
        notes.append(f"Only friction coefficients are pooled; {', '.join(unpooled[:4])} stay as single fits give them.")
    return notes
