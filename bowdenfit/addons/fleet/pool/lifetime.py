r"""How long cables last: cycles until the efficiency is below a limit, curves over cycles, and the best next inspection.

.. math:: \eta(c) = \exp\Bigl(-e^{b c / c_{ref}} \sum_k e^{a_k} \theta_k\Bigr), \qquad
          c^* = \frac{c_{ref}}{b} \log \frac{-\log \eta_{min}}{\sum_k e^{a_k} \theta_k}

c* is infinite where friction does not grow (b at most 0), and 0 where a new cable is below the limit already.

The value of another inspection is a preposterior analysis: draws of the posterior, with the scatter of a typical inspection
added, stand for its possible readings; the variance of the target that is left is that within groups of similar readings.
"""

import math
import re
from collections.abc import Sequence

import numpy as np

from bowdenfit.addons.fleet.pool.answer import Curves, Life, NextInspection, ServiceLimit
from bowdenfit.addons.fleet.pool.pooled_data import PoolingData
from bowdenfit.addons.fleet.population.sampling import PopulationDraws
from bowdenfit.arguments import NumberWithUnit
from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.units import conversion_factor
from bowdenfit.words import shown

_ANGLE_OPTION = re.compile(r"(?P<name>[^=]+)=\s*(?P<value>\d+\.?\d*|\.\d+)\s*(?P<unit>[A-Za-z°][\w°]*)")
_MOST_TURNS = 100  # a wrap angle beyond this is a typing error
_POINTS, _BEYOND = 61, 1.25  # of a curve, and how far it goes beyond what was inspected or asked for; judgements
_FURTHEST = 8.0  # times the longest inspected, where curves end; a judgement
MOST_INSPECTIONS = 5  # that are named; a judgement
_GROUPS = 20  # of draws: what is learned on all but one is judged on that one; a judgement
_LEAST = 1e-3  # share of a variance below which nothing is told; a judgement


def parse_service_limit(
    until: NumberWithUnit | None, wrap_angles: Sequence[str], cycles: int | None, coefficients: Sequence[str]
) -> ServiceLimit | None:
    """Return the limit until which a cable serves; None if no efficiency is given.

    Raises:
        UsageError: Something is missing, or cannot be.
    """
    if until is None:
        if wrap_angles or cycles is not None:
            raise UsageError(
                "--wrap-angle and --cycles ask how long cables last; state until which efficiency, as --until 60%."
            )
        return None
    value, unit = until
    efficiency = value * conversion_factor(unit, "ratio")
    if not 0 < efficiency < 1:
        raise UsageError(f"--until {value:g}{unit} is not an efficiency that a cable falls to; write it as 60% or 0.6 1.")
    angles = dict(_parse_wrap_angle(text) for text in wrap_angles)
    wrong = [name for name in angles if name not in coefficients]
    missing = [name for name in coefficients if name not in angles]
    if wrong or missing:
        what = f"there is no coefficient {wrong[0]!r}" if wrong else f"none is given for {missing[0]}"
        example = " ".join(f"--wrap-angle {name}=90deg" for name in coefficients)
        raise UsageError(f"how long a cable lasts depends on its wrap angles, and {what}; write {example}, with yours.")
    return ServiceLimit(
        efficiency, {name: angles[name] for name in coefficients}, None if cycles is None else float(cycles)
    )


def _parse_wrap_angle(text: str) -> tuple[str, float]:
    """Split an option such as mu_sheath=180deg into coefficient and wrap angle [rad].

    Raises:
        UsageError: It is something else, or no angle that a cable wraps.
    """
    match = _ANGLE_OPTION.fullmatch(text.strip())
    try:
        angle = float(match["value"]) * conversion_factor(match["unit"], "angle") if match else math.nan
    except DatasetError:
        angle = math.nan
    if match is None or not 0 <= angle < _MOST_TURNS * 2 * math.pi:
        raise UsageError(
            f"--wrap-angle {shown(text)} is not a coefficient with its wrap angle; write it as mu_sheath=180deg."
        )
    return match["name"].strip(), angle


def cycles_to_failure(limit: ServiceLimit, logs: np.ndarray, wear: np.ndarray, reference: float) -> np.ndarray:
    """Return the cycles at which each draw falls below the required efficiency; infinite where it never does.

    Args:
        limit: The efficiency and the wrap angles.
        logs: Log coefficients when new, (..., coefficient), in the order of the wrap angles.
        wear: Growth of log coefficients in the reference cycles, (...,).
        reference: The reference cycles.
    """
    log_margin = friction_log_margin(limit, logs)
    growing = np.where(wear > 0, wear, 1.0)
    return np.where(log_margin <= 0, 0.0, np.where(wear > 0, reference * log_margin / growing, np.inf))


def friction_log_margin(limit: ServiceLimit, logs: np.ndarray) -> np.ndarray:
    """Return by how much log coefficients may grow until the required efficiency is reached, (...,)."""
    angles = np.array(list(limit.wrap_angles.values()))
    return np.log(-np.log(limit.efficiency)) - np.log(np.exp(logs) @ angles)


def summarize_life(limit: ServiceLimit, cycles: np.ndarray, longest: float) -> Life:
    """Summarize draws of the cycles to failure.

    Args:
        limit: Limit that ends its life.
        cycles: Draws.
        longest: Cycles that were inspected.
    """
    early, median = (float(np.quantile(cycles, q, method="inverted_cdf")) for q in (0.05, 0.5))
    fails = None if limit.cycles is None else float(np.mean(cycles < limit.cycles))
    beyond = median > longest or (limit.cycles is not None and limit.cycles > longest)
    return Life(median, early, fails, float(np.mean(np.isinf(cycles))), bool(beyond))


def compute_curves(data: PoolingData, draws: PopulationDraws, limit: ServiceLimit | None, new: np.ndarray) -> Curves:
    """Compute curves over cycles of every cable and of a new one.

    Args:
        data: Pooled draws of all inspections.
        draws: Draws of the population and its cables.
        limit: Limit that ends the life of a cable.
        new: Draws of new cables, (draw, number).
    """
    reference, furthest = data.reference_cycles, data.reference_cycles
    cables = (draws.cables[:, i] for i in range(len(data.cables)))
    if limit is None:
        cycles = np.linspace(0.0, _BEYOND * furthest, _POINTS)
        medians = [_friction_quantiles(values, cycles, reference)[1] for values in cables]
        return Curves(cycles, _friction_quantiles(new, cycles, reference), np.array(medians), None, None)
    life = cycles_to_failure(limit, new[:, :-1], new[:, -1], reference)
    median = float(np.quantile(life, 0.5, method="inverted_cdf"))
    furthest = max(furthest, limit.cycles or 0.0, min(median, _FURTHEST * reference))
    cycles = np.linspace(0.0, _BEYOND * furthest, _POINTS)
    medians, fails = [], []
    for values in cables:
        medians.append(_efficiency_quantiles(limit, values, cycles, reference)[1])
        fails.append(_share_failed(cycles_to_failure(limit, values[:, :-1], values[:, -1], reference), cycles))
    return Curves(
        cycles,
        _efficiency_quantiles(limit, new, cycles, reference),
        np.array(medians),
        _share_failed(life, cycles),
        np.array(fails),
    )


def _friction_quantiles(values: np.ndarray, cycles: np.ndarray, reference: float) -> np.ndarray:
    """Return 5 %, 50 % and 95 % of friction relative to that when new."""
    growth: np.ndarray = np.exp(np.quantile(values[:, -1], (0.05, 0.5, 0.95))[:, None] * cycles / reference)
    return growth


def _efficiency_quantiles(limit: ServiceLimit, values: np.ndarray, cycles: np.ndarray, reference: float) -> np.ndarray:
    """Return 5 %, 50 % and 95 % of the efficiency."""
    total = np.exp(values[:, :-1]) @ np.array(list(limit.wrap_angles.values()))
    return np.quantile(np.exp(-total[:, None] * np.exp(values[:, -1:] * cycles / reference)), (0.05, 0.5, 0.95), axis=0)


def _share_failed(life: np.ndarray, cycles: np.ndarray) -> np.ndarray:
    """Return the share of lives that have ended by each number of cycles."""
    share: np.ndarray = np.searchsorted(np.sort(life), cycles, side="right") / len(life)
    return share


def rank_next_inspections(
    data: PoolingData, draws: PopulationDraws, limit: ServiceLimit | None, seed: int
) -> tuple[NextInspection, ...]:
    """Return the most informative next inspections, the best first; none if wear is not identifiable.

    Args:
        data: Pooled draws of all inspections.
        draws: Draws of the population and its cables.
        limit: Limit that ends the life of a cable.
        seed: Random seed.
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
                cable, cycles, "failing", *_compute_sd_before_and_after(fails, proxy, readings), float(fails.mean())
            )
        else:
            inspection = NextInspection(cable, cycles, "wear", *_compute_sd_before_and_after(wear, wear, readings), None)
        candidates.append(inspection)
    best = sorted(candidates, key=lambda candidate: candidate.after**2 - candidate.before**2)[:MOST_INSPECTIONS]
    return tuple(
        candidate for candidate in best if candidate.before**2 - candidate.after**2 > _LEAST * candidate.before**2
    )


def _compute_sd_before_and_after(target: np.ndarray, proxy: np.ndarray, readings: np.ndarray) -> tuple[float, float]:
    """Return the standard deviation of a target now, and expected after an inspection.

    Args:
        target: Draws of it.
        proxy: What it depends on, about which readings tell in proportion.
        readings: Possible readings, (draw, coefficient).
    """
    centered = readings - readings.mean(axis=0)
    slope, *_ = np.linalg.lstsq(centered, proxy - proxy.mean(), rcond=None)
    groups = np.array_split(target[np.argsort(centered @ slope, kind="stable")], _GROUPS)
    inside = float(np.mean([group.var(ddof=1) for group in groups]))
    before = float(target.var(ddof=1))
    return float(np.sqrt(before)), float(np.sqrt(min(inside, before)))
