"""Which cable to inspect next: the one whose next inspection is expected to tell most.

Draws stand for what an inspection may read: each with the scatter of a typical inspection added. What it tells of a target is
the variance of the target between groups of draws that would have been read alike.
"""

import numpy as np

from bowdenfit.inference.population.sampling import PopulationDraws
from bowdenfit.questions.pool.answer import Asked, NextInspection
from bowdenfit.questions.pool.inspected import Given
from bowdenfit.questions.pool.life import cycles_until, margin

MOST = 5  # that are named
_GROUPS = 20
_LEAST = 1e-3  # share of a variance below which nothing is told


def next_inspections(
    given: Given, drawn: PopulationDraws, asked: Asked | None, seed: int
) -> tuple[NextInspection, ...]:
    """Those that tell most, the best first; none where nothing is told of wear.

    Args:
        given: What is pooled.
        drawn: Of the population and its cables.
        asked: What life is until.
        seed: Of everything random.
    """
    if given.inspected.cycles is None:
        return ()
    generator, summaries = np.random.default_rng([seed, 11]), given.inspected.summaries
    known = given.inspected.known.all(axis=1)
    if not known.any():
        return ()
    noise = np.linalg.cholesky(np.median(summaries.scale[known], axis=0))
    freedom, count = float(np.median(summaries.freedom[known])), drawn.cables.shape[2] - 1
    last = [float(given.cycles[given.inspected.cable == i].max()) for i in range(len(given.cables))]
    gaps = [gap for i in range(len(last)) for gap in np.diff(np.sort(given.cycles[given.inspected.cable == i])) if gap > 0]
    interval = float(np.median(gaps)) if gaps else given.reference_cycles
    found = []
    for i, cable in enumerate(given.cables):
        logs, wear = drawn.cables[:, i, :count], drawn.cables[:, i, count]
        at = last[i] + interval
        scatter = generator.standard_normal(logs.shape) @ noise.T
        scatter *= np.sqrt(freedom / generator.chisquare(freedom, len(logs)))[:, None]
        read = logs + wear[:, None] * at / given.reference_cycles + scatter
        if asked is not None and asked.cycles is not None:
            fails = (cycles_until(asked, logs, wear, given.reference_cycles) < asked.cycles).astype(float)
            near = margin(asked, logs) - wear * asked.cycles / given.reference_cycles
            told = NextInspection(cable, at, "failing", *_told(fails, near, read), float(fails.mean()))
        else:
            told = NextInspection(cable, at, "wear", *_told(wear, wear, read), None)
        found.append(told)
    best = sorted(found, key=lambda each: each.after**2 - each.before**2)[:MOST]
    return tuple(each for each in best if each.before**2 - each.after**2 > _LEAST * each.before**2)


def _told(target: np.ndarray, near: np.ndarray, read: np.ndarray) -> tuple[float, float]:
    """Standard deviation of a target before and after.

    Args:
        target: Draws of it.
        near: What it depends on, about which readings tell in proportion.
        read: What may be read, (draw, coefficient).
    """
    centered = read - read.mean(axis=0)
    slope, *_ = np.linalg.lstsq(centered, near - near.mean(), rcond=None)
    groups = np.array_split(target[np.argsort(centered @ slope, kind="stable")], _GROUPS)
    inside = float(np.mean([group.var(ddof=1) for group in groups]))
    before = float(target.var(ddof=1))
    return float(np.sqrt(before)), float(np.sqrt(min(inside, before)))
