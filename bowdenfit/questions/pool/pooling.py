"""A fleet's cables looked at together: from draws of single fits to the answer."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from bowdenfit.inference.interval import Interval
from bowdenfit.inference.population.model import REFERENCE_TEMPERATURE, Inspections
from bowdenfit.inference.population.sampling import PopulationDraws, draw_population, draw_unpooled
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


@dataclass(frozen=True)
class _Looked:
    """What a look at all cables gave.

    Args:
        every: The population of all cables.
        shown: The population without cables that are unlike the rest, and these by their own inspections alone.
        chance: Probability that a cable of this population is as far from the others, (cable,).
        unlike: How it differs from the rest by the number of each that does, in words.
        told: Those of them whose own inspections tell their wear.
        worth: How much single fits know of each inspection where it is said to be, (inspection,).
        rows: Inspections of which the readings were looked at.
    """

    every: PopulationDraws
    shown: PopulationDraws
    chance: np.ndarray
    unlike: dict[int, str]
    told: tuple[int, ...]
    worth: np.ndarray
    rows: tuple[int, ...]


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
    looked = _looked(known, seed, measurements)
    population = looked.shown
    count, alone = len(known.coefficients), len(known.cables) == 1
    generator = np.random.default_rng([seed, 13])
    mean, spread = (np.repeat(each, _NEW, axis=0) for each in (population.mean, population.spread))
    new = mean + spread * generator.standard_normal(mean.shape)
    wears = known.inspected.cycles is not None
    asked = asked if wears else None
    names = (*known.coefficients, *((_WEAR,) if wears else ()))
    return Pool(
        str(drawn.about.get("name", "")),
        _cables(known, looked, asked),
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
        {} if alone else mixed(known.inspected, looked.shown, names, looked.unlike),
        curves_of(known, population, asked, new) if wears else None,
        next_inspections(known, population, asked, seed),
        (*known.notes, *_more_notes(known, drawn)),
        (*dict.fromkeys((*population.reasons, *looked.every.reasons)), *_poorly_known(known, looked)),
        seed,
    )


def _looked(known: Given, seed: int, measurements: Path | None) -> _Looked:
    """At all cables, and again with readings of those of which single fits tell too little."""
    inspected, rows = known.inspected, tuple[int, ...]()
    while True:
        readings = readings_of(known, rows, measurements) if measurements is not None and rows else ()
        draw = partial(draw_population, inspected, seed, coefficient_names=known.coefficients, readings=readings)
        every = draw()
        core, chance = (every, np.ones(1)) if inspected.cables == 1 else judged(inspected, every, draw, seed)
        named = [int(i) for i in np.flatnonzero(chance < FALSE_ALARM)]
        shown, told = _with_unpooled(inspected, core, named, seed)
        found = worth(known, shown)
        more = tuple(int(j) for j in np.flatnonzero(found < LEAST) if j not in rows and inspected.cable[j] not in named)
        if measurements is None or not more:
            unlike = {i: _departure(known, departure(inspected, core, i, seed)) for i in named}
            return _Looked(every, shown, chance, unlike, told, found, rows)
        rows = (*rows, *more)


def _with_unpooled(
    inspected: Inspections, core: PopulationDraws, named: list[int], seed: int
) -> tuple[PopulationDraws, tuple[int, ...]]:
    """Draws with some cables by their own inspections alone, and which of these tell their wear."""
    cables, told = core.cables.copy(), []
    for i in named:
        cables[:, i], tells = draw_unpooled(inspected, core, i, seed)
        told += [i] * tells
    return replace(core, cables=cables), tuple(told)


def _poorly_known(known: Given, looked: _Looked) -> list[str]:
    """Why the answer must not be trusted where single fits know too little; empty where they know enough."""
    of, reasons = known.inspected.cable, []
    low = [j for j in np.flatnonzero(looked.worth < LEAST) if j not in looked.rows or of[j] in looked.unlike]
    pulled = [known.cables[of[j]] for j in low if of[j] not in looked.unlike]
    torn = [known.cables[of[j]] for j in low if of[j] in looked.unlike]
    if pulled:
        reasons.append(
            f"what was drawn from the inspections of {few(list(dict.fromkeys(pulled)))} by themselves hardly reaches where the "
            "other cables put them, so that what is said of them may be off by half its uncertainty; name the folder of the "
            "fleet's measurements with --measurements, and their readings are looked at again"
        )
    if torn:
        reasons.append(
            f"inspections of {few(list(dict.fromkeys(torn)))} contradict each other, so that what is said of it lies where "
            "hardly one of them puts it; look for a wrong reading, a wrong row of fleet.csv or a cable that was changed, and "
            "leave that inspection out"
        )
    return reasons


def _named(names: tuple[str, ...], draws: np.ndarray) -> dict[str, Interval]:
    return {name: Interval.of(draws[:, i]) for i, name in enumerate(names)}


def _effect(name: str, logs: np.ndarray) -> Effect:
    above = float(np.mean(logs > 0))
    return Effect(name, Interval.of(np.expm1(logs)), max(above, 1 - above))


def _life(known: Given, asked: Asked, values: np.ndarray) -> Life:
    """Of draws of log coefficients and wear."""
    cycles = cycles_until(asked, values[:, :-1], values[:, -1], known.reference_cycles)
    return life_of(asked, cycles, known.reference_cycles)


def _cables(known: Given, looked: _Looked, asked: Asked | None) -> tuple[PooledCable, ...]:
    """What is known of each cable."""
    inspected, population, count = known.inspected, looked.shown, len(known.coefficients)
    again = np.isin(np.arange(len(inspected.cable)), looked.rows)
    found = []
    for i, name in enumerate(known.cables):
        mine, values = inspected.cable == i, population.cables[:, i]
        has = inspected.known[mine].any(axis=0)
        named = [known.coefficients[k] for k in np.flatnonzero(has)]
        wear = [_WEAR] if inspected.cycles is not None else []
        found.append(
            PooledCable(
                name,
                int(mine.sum()),
                float(known.cycles[mine].max()),
                {c: Interval.of(np.exp(values[:, k])) for k, c in enumerate(known.coefficients) if has[k]},
                _by_itself(known, population, mine, has),
                Interval.of(np.expm1(values[:, count])) if wear else None,
                _life(known, asked, values) if asked is not None else None,
                float(looked.chance[i]),
                looked.unlike.get(i, ""),
                tuple(wear if i not in looked.told else []) if i in looked.unlike else (*named, *wear),
                float(looked.worth[mine].min()),
                0 if i in looked.unlike else int(again[mine].sum()),
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
