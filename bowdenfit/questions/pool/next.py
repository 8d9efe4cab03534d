"""Which cable to inspect next: the one whose next inspection is expected to tell most.

Draws stand for what an inspection may read: each with the scatter of a typical inspection added. What it tells of a target is
the variance of the target between groups of draws that would have been read alike.
"""

import numpy as np

from bowdenfit.inference.population.sampling import PopulationDraws
from bowdenfit.questions.pool.answer import NextInspection, ServiceLimit
from bowdenfit.questions.pool.inspected import PoolingData
from bowdenfit.questions.pool.life import cycles_to_failure, friction_log_margin

MOST_INSPECTIONS = 5  # that are named
_GROUPS = 20
_LEAST = 1e-3  # share of a variance below which nothing is told


def rank_next_inspections(
    data: PoolingData, draws: PopulationDraws, limit: ServiceLimit | None, seed: int
) -> tuple[NextInspection, ...]:
    """Those that tell most, the best first; none where nothing is told of wear.

    Args:
        given: What is pooled.
        drawn: Of the population and its cables.
        asked: What life is until.
        seed: Of everything random.
    """
    if data.inspected.cycles is None:
        return ()
    generator, summaries = np.random.default_rng([seed, 11]), data.inspected.summaries
    known = data.inspected.known.all(axis=1)
    if not known.any():
        return ()
    noise = np.linalg.cholesky(np.median(summaries.scale[known], axis=0))
    freedom, count = float(np.median(summaries.freedom[known])), draws.cables.shape[2] - 1
    last = [float(data.cycles[data.inspected.cable == i].max()) for i in range(len(data.cables))]
    gaps = [
        gap for i in range(len(last)) for gap in np.diff(np.sort(data.cycles[data.inspected.cable == i])) if gap > 0
    ]
    interval = float(np.median(gaps)) if gaps else data.reference_cycles
    candidates = []
    for i, cable in enumerate(data.cables):
        logs, wear = draws.cables[:, i, :count], draws.cables[:, i, count]
        cycles = last[i] + interval
        scatter = generator.standard_normal(logs.shape) @ noise.T
        scatter *= np.sqrt(freedom / generator.chisquare(freedom, len(logs)))[:, None]
        readings = logs + wear[:, None] * cycles / data.reference_cycles + scatter
        if limit is not None and limit.cycles is not None:
            fails = (cycles_to_failure(limit, logs, wear, data.reference_cycles) < limit.cycles).astype(float)
            proxy = friction_log_margin(limit, logs) - wear * limit.cycles / data.reference_cycles
            inspection = NextInspection(
                cable, cycles, "failing", *_sd_before_and_after(fails, proxy, readings), float(fails.mean())
            )
        else:
            inspection = NextInspection(cable, cycles, "wear", *_sd_before_and_after(wear, wear, readings), None)
        candidates.append(inspection)
    best = sorted(candidates, key=lambda candidate: candidate.after**2 - candidate.before**2)[:MOST_INSPECTIONS]
    return tuple(
        candidate for candidate in best if candidate.before**2 - candidate.after**2 > _LEAST * candidate.before**2
    )


def _sd_before_and_after(target: np.ndarray, proxy: np.ndarray, readings: np.ndarray) -> tuple[float, float]:
    """Standard deviation of a target before and after.

    Args:
        target: Draws of it.
        near: What it depends on, about which readings tell in proportion.
        read: What may be read, (draw, coefficient).
    """
    centered = readings - readings.mean(axis=0)
    slope, *_ = np.linalg.lstsq(centered, proxy - proxy.mean(), rcond=None)
    groups = np.array_split(target[np.argsort(centered @ slope, kind="stable")], _GROUPS)
    inside = float(np.mean([group.var(ddof=1) for group in groups]))
    before = float(target.var(ddof=1))
    return float(np.sqrt(before)), float(np.sqrt(min(inside, before)))
