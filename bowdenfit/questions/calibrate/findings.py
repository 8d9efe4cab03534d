"""From replications to what they say together."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bowdenfit.multiple_testing import adjust_p_values
from bowdenfit.questions.calibrate.answer import INTERVALS, LEVEL, Calibration, CheckedQuantity, Coverage, QuantityLabel
from bowdenfit.questions.calibrate.power import estimate_power
from bowdenfit.questions.calibrate.replication import Replication
from bowdenfit.questions.calibrate.uniformity import UniformRanks


def summarize_replications(
    replications: Sequence[Replication],
    quantities: Mapping[str, QuantityLabel],
    *,
    name: str = "",
    assumed: tuple[str, ...] = (),
    truths: tuple[str, ...] = (),
    seed: int = 0,
) -> Calibration:
    """What replications say.

    Args:
        replications: Any number, in any order.
        quantities: What is known of each quantity; others are shown by name.
        name: Name of the cable.
        assumed: What was assumed in the fits.
        truths: True values that did not come from the priors, in words.
        seed: Seed of the replications.
    """
    replications = sorted(replications, key=lambda r: r.number)
    converged = [r for r in replications if not r.reasons]
    descriptions = {q: quantities.get(q, QuantityLabel(q)) for q in (converged[0].ranked if converged else ())}
    criterion = "coverage" if truths else "ranks and coverage"
    judged_by = {q: criterion if each.is_answer or not truths else "" for q, each in descriptions.items()}
    n_judged = sum(map(bool, judged_by.values()))
    checked = _check_all(descriptions, judged_by, converged)
    with_draws = [r for r in replications if r.ranked]
    with_all = checked if len(with_draws) == len(converged) else _check_all(descriptions, judged_by, with_draws)
    redrawn: Counter[str] = Counter()
    for each in replications:
        redrawn.update(each.redrawn)
    unconverged = {r.number: r.reasons[0] for r in replications if r.reasons}
    seconds = float(np.median([r.seconds for r in replications])) if replications else float("nan")
    engines = Counter(r.engine for r in converged if r.engine)
    bands = {claimed: _band(len(converged), claimed, n_judged) for claimed in INTERVALS} if checked else {}
    power = estimate_power(len(converged), LEVEL / n_judged, bands, not truths) if checked else ()
    summary = len(replications), checked, unconverged, dict(redrawn), seconds
    wrong_with_all = {q.name: q.fault for q in with_all if not q.is_calibrated}
    return Calibration(name, assumed, seed, *summary, truths, dict(engines.most_common()), power, wrong_with_all)


def _check_all(
    descriptions: Mapping[str, QuantityLabel], judged_by: Mapping[str, str], replications: Sequence[Replication]
) -> tuple[CheckedQuantity, ...]:
    """Every quantity over the same replications."""
    n_judged = sum(map(bool, judged_by.values()))
    ranks = [np.array([r.ranked[q].rank for r in replications]) for q in descriptions]
    p_values = [UniformRanks(len(replications)).p_value(r) for r in ranks]
    return tuple(
        replace(
            _check_quantity(q, descriptions[q].symbol, r, (p, c), n_judged, judged_by[q], replications),
            meaning=descriptions[q].meaning,
        )
        for q, r, p, c in zip(descriptions, ranks, p_values, adjust_p_values(p_values).tolist(), strict=True)
    )


def _check_quantity(
    name: str,
    symbol: str,
    ranks: np.ndarray,
    p: tuple[float, float],
    n_judged: int,
    judged_by: str,
    replications: Sequence[Replication],
) -> CheckedQuantity:
    ranked_truths = [r.ranked[name] for r in replications]
    truth, mean, sd = (
        np.array([getattr(ranked_truth, what) for ranked_truth in ranked_truths]) for what in ("truth", "mean", "sd")
    )
    usable = (sd > 0) & np.isfinite(truth)  # an optimum at the same end in every draw has no spread
    deviation = (mean - truth)[usable] / sd[usable]
    n = max(len(deviation), 1)
    bias, error = (float(deviation.mean()), float(deviation.std() / np.sqrt(n))) if usable.any() else (np.nan, np.nan)
    # The prior of z is the standard normal; that of the optimum is what was drawn.
    prior = float(np.var(truth)) if name.startswith("optimal_") else 1.0
    of_prior = prior > 0 and judged_by == CheckedQuantity.judged_by
    shrinkage = 1 - float(np.mean(sd**2)) / prior if of_prior else float("nan")
    coverage = tuple(_coverage(ranks, probability, n_judged) for probability in INTERVALS)
    return CheckedQuantity(name, symbol, tuple(ranks.tolist()), *p, coverage, bias, error, shrinkage, judged_by)


def _coverage(ranks: np.ndarray, probability: float, n_judged: int) -> Coverage:
    held = np.abs(ranks - 0.5) < probability / 2
    return Coverage(probability, float(held.mean()), *_band(len(ranks), probability, n_judged))


def _band(n: int, probability: float, n_judged: int) -> tuple[float, float]:
    """Rates between which chance keeps the intervals of all quantities that are judged."""
    from scipy import stats

    tail = LEVEL / (2 * len(INTERVALS) * n_judged)
    low, high = (float(stats.binom.ppf(t, n, probability)) / n for t in (tail, 1 - tail))
    return low, high
