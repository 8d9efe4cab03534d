"""What to measure next: candidates ranked by how far each would narrow an answer, on average."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np

import bowdenfit.questions.next.words  # noqa: F401  registers the text of the answer
from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.kinds.candidate import Candidate
from bowdenfit.kinds.forces.next_run import typical_run
from bowdenfit.kinds.terms import candidate_kinds
from bowdenfit.questions.error_budget import find_optimal_length
from bowdenfit.questions.next.answer import (
    EQUAL_WITHIN,
    LEAST_SHARE,
    LoadAndStroke,
    NextMeasurement,
    PlannedMeasurement,
    RankedCandidate,
    Repeats,
    SecondMounting,
    TargetQuantity,
    choose_target,
    is_noticeable,
)
from bowdenfit.questions.next.candidates import (
    build_situation,
    describe_candidate,
    format_candidate,
    list_candidates,
    parse_candidates,
    rests_on_one_mounting,
)
from bowdenfit.questions.next.variance_reduction import (
    Explained,
    error_of_difference,
    explained_share,
    mean_and_spread,
    simulate_readings,
    width_of_interval,
    widths_after_outcomes,
)
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Record
from bowdenfit.results.store import load
from bowdenfit.words import significant

REPEATS = (1, 2, 4, 8, 16, 32)  # how often the best candidate is measured; a judgement
PLAN_LENGTH, MAX_PLAN_CANDIDATES = 3, 24  # measurements in a plan, and candidates that it chooses from; judgements
_SEED = 7  # beside the fit's own


def open_fit(fit: Record | str | Path) -> Record:
    """Return a fit, read from its results folder where that is named.

    Args:
        fit: The fit, or its results folder.

    Raises:
        StoreError: The results folder is missing or damaged.
    """
    return load(Path(fit)) if isinstance(fit, str | Path) else fit


def rank_measurements(
    fit: Record,
    target_name: str | None = None,
    candidates: Sequence[str] = (),
    costs: Mapping[str, float] | None = None,
) -> NextMeasurement:
    """Rank what could be measured next by the variance of an answer that it would take away, on average.

    Args:
        fit: The fit, with a posterior.
        target_name: The answer; see `choose_target`.
        candidates: Such as "angle@450"; whatever the tables can hold if none is named.
        costs: Cost of a measurement of each kind; then candidates are ranked by what they do for their cost.

    Raises:
        UsageError: The fit has no posterior, or the answer, a candidate or a cost makes no sense.
    """
    target = choose_target(fit, target_name)
    chosen = parse_candidates(fit, candidates) if candidates else list_candidates(fit)
    _check_costs(chosen, costs)
    readings = _simulate(fit, chosen, PLAN_LENGTH)
    explained = [explained_share(reading[:, 0], target.draws) for reading in readings]
    ranked = _rank(fit, target, chosen, explained, costs)
    route = fit.dataset.description.route
    route_axis = (route.label, route.range) if route else ("", (0.0, 0.0))
    loads, stop = _load_range(fit), stopping_advice(fit, target)
    if (second := _second_mounting(fit, target, chosen, readings)) is not None:
        return NextMeasurement(
            target, ranked, None, (), *route_axis, fit.converged, loads, stop="", second_mounting=second
        )
    if not ranked[0].is_noticeable:
        return NextMeasurement(target, ranked, None, (), *route_axis, fit.converged, loads, stop)
    repeats = _repeat_measurement(fit, target, ranked[0].candidate)
    plan = _plan_measurements(target, ranked, dict(zip(chosen, readings, strict=True)))
    within = _vary_load_and_stroke(fit, target, ranked[0].candidate)
    return NextMeasurement(target, ranked, repeats, plan, *route_axis, fit.converged, loads, stop, within)


def _second_mounting(
    fit: Record, target: TargetQuantity, chosen: Sequence[Candidate], readings: Sequence[np.ndarray]
) -> SecondMounting | None:
    """Return what mounting the cable anew would do, of a fit that rests on one mounting; None of any other."""
    anew = [i for i, candidate in enumerate(chosen) if candidate_kinds()[candidate.kind].mounted_anew]
    if not anew or not rests_on_one_mounting(fit):
        return None
    first = chosen[anew[0]]
    now, after = float(width_of_interval(target.draws)), widths_after_outcomes(readings[anew[0]], target.draws)
    low, middle, high = (float(width) for width in np.quantile(after, (0.05, 0.5, 0.95)))
    return SecondMounting(describe_candidate(fit, first), format_candidate(first), now, middle, low, high)


def _load_range(fit: Record) -> tuple[float, float] | None:
    """Return the lowest and highest input force of the runs made so far, of which a next one would be like."""
    run = typical_run(fit.dataset.measurements)
    return (float(run.input_force.min()), float(run.input_force.max())) if run is not None else None


def is_good_enough(fit: Record, target: TargetQuantity) -> bool:
    """Return whether nothing needs to be measured, which can be said of the best length alone."""
    return _is_optimum(target) and find_optimal_length(fit).is_certain


def _is_optimum(target: TargetQuantity) -> bool:
    return target.name in (OPTIMAL_LENGTH.replace("_", "-"), OPTIMAL_EFFICIENCY.replace("_", "-"))


def stopping_advice(fit: Record, target: TargetQuantity) -> str:
    """Say whether more needs to be measured at all."""
    if _is_optimum(target):
        best = find_optimal_length(fit)
        return (
            f"You may stop: {best.good_enough[0].lower()}{best.good_enough[1:]}"
            if best.is_certain
            else best.not_good_enough
        )
    unit = f" {target.unit}" if target.unit else ""
    return f"You may stop if it is enough to know {target.words} to ± {significant(target.sd, 2)}{unit}."


def _simulate(fit: Record, chosen: Sequence[Candidate], repeats: int) -> list[np.ndarray]:
    measured, z = fit.dataset.measurements, fit.draws().flat_z
    with jax.enable_x64(True):
        seed = fit.provenance.seed + _SEED
        return simulate_readings(fit.model, measured, chosen, z, seed, repeats)


def _rank(
    fit: Record,
    target: TargetQuantity,
    chosen: Sequence[Candidate],
    explained: Sequence[Explained],
    costs: Mapping[str, float] | None,
) -> tuple[RankedCandidate, ...]:
    """Return candidates by what they are worth, best first."""
    price = [costs[c.kind] if costs else 1.0 for c in chosen]
    worth = [e.share / p for e, p in zip(explained, price, strict=True)]
    # What does next to nothing comes last, however little it costs.
    order = sorted(
        range(len(chosen)), key=lambda i: (not is_noticeable(explained[i].share, explained[i].error), -worth[i])
    )
    first = order[0]
    ranked = []
    for i in order:
        sd_after = target.sd_after(explained[i].share)
        of_first, of_this = (_divide_by_price(explained[k], price[k]) for k in (first, i))
        ranked.append(
            RankedCandidate(
                chosen[i], format_candidate(chosen[i]), describe_candidate(fit, chosen[i]),
                explained[i].share, explained[i].error, sd_after,
                explained[i].error * target.sd**2 / (2 * sd_after) if sd_after > 0 else 0.0,
                i == first or is_as_good(of_first, of_this), price[i] if costs else None,
            )
        )  # fmt: skip
    return tuple(ranked)


def _divide_by_price(explained: Explained, price: float) -> Explained:
    """Return what a candidate does for each unit of its cost."""
    return Explained(explained.share / price, explained.error / price, explained.without / price)


def is_as_good(best: Explained, other: Explained) -> bool:
    """Return whether another candidate is a tie with the best: clearly above 0, and not clearly below the best.

    A share of 0 is within the error of a small one, and yet nothing that would do equally well.
    """
    difference = best.share - other.share
    return bool(other.share > EQUAL_WITHIN * other.error and difference <= EQUAL_WITHIN * error_of_difference(best, other))


def _vary_load_and_stroke(fit: Record, target: TargetQuantity, best: Candidate) -> LoadAndStroke | None:
    """Rank the best candidate with its readings at other loads or of one stroke; None where it names these, or has none."""
    kind, situation = candidate_kinds()[best.kind], build_situation(fit.model, fit.dataset.measurements)
    if np.isfinite(best.load) or best.stroke or not (designs := kind.designs(situation)):
        return None
    chosen = [best, *(replace(best, load=load, stroke=stroke) for load, stroke in designs)]
    explained = [explained_share(reading[:, 0], target.draws) for reading in _simulate(fit, chosen, 1)]
    return LoadAndStroke(kind.describe_usual(situation), _rank(fit, target, chosen, explained, None))


def _repeat_measurement(fit: Record, target: TargetQuantity, candidate: Candidate) -> Repeats:
    """Return what the candidate would do if it were measured several times."""
    (readings,) = _simulate(fit, [candidate], max(REPEATS))
    shares = [explained_share(mean_and_spread(readings[:, :n]), target.draws).share for n in REPEATS]
    return Repeats(REPEATS, tuple(target.sd_after(share) for share in np.maximum.accumulate(shares)))


def _plan_measurements(
    target: TargetQuantity, ranked: Sequence[RankedCandidate], readings: Mapping[Candidate, np.ndarray]
) -> tuple[PlannedMeasurement, ...]:
    """Return the best candidate, then the one that does most beside it, and so on; one may come again, mounted anew."""
    noticeable = [r for r in ranked if r.is_noticeable][:MAX_PLAN_CANDIDATES] or list(ranked[:1])
    chosen: list[RankedCandidate] = [ranked[0]]
    steps = [PlannedMeasurement(ranked[0].words, ranked[0].name, ranked[0].sd)]
    while len(steps) < PLAN_LENGTH:
        previous = [readings[r.candidate][:, chosen[:i].count(r)] for i, r in enumerate(chosen)]
        shares = [
            explained_share(np.column_stack([*previous, readings[r.candidate][:, chosen.count(r)]]), target.draws).share
            for r in noticeable
        ]
        before = 1 - (steps[-1].sd / target.sd) ** 2
        gains = [(share - before) / (r.cost or 1.0) for share, r in zip(shares, noticeable, strict=True)]
        best = int(np.argmax(gains))
        if shares[best] - before < LEAST_SHARE:
            break
        chosen.append(noticeable[best])
        steps.append(PlannedMeasurement(noticeable[best].words, noticeable[best].name, target.sd_after(shares[best])))
    return tuple(steps)


def _check_costs(chosen: Sequence[Candidate], costs: Mapping[str, float] | None) -> None:
    if not costs:
        return
    kinds = list(dict.fromkeys(c.kind for c in chosen))
    for kind, cost in costs.items():
        if kind not in kinds:
            raise UsageError(f"--cost {kind}={cost:g}: no candidate is of this kind{suggest_name(kind, kinds)}")
        if not (np.isfinite(cost) and cost > 0):
            raise UsageError(f"--cost {kind}={cost:g} is not a cost; write a positive number, such as {kind}=2.")
    missing = [kind for kind in kinds if kind not in costs]
    if missing:
        raise UsageError(
            f"--cost says what {', '.join(costs)} costs, but nothing of {', '.join(missing)}; state the cost of every kind, in "
            f"the same unit, such as {missing[0]}=1."
        )
