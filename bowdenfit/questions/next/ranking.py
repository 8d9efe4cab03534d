"""What to measure next: candidates ranked by how far each would narrow an answer, on average."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import jax
import numpy as np

from bowdenfit.display import Several
from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.kinds.candidate import Candidate
from bowdenfit.kinds.forces.next_run import typical_run
from bowdenfit.kinds.terms import candidate_kinds
from bowdenfit.questions.next.answer import (
    LEAST_SHARE,
    WITHIN,
    NextMeasurement,
    Ranked,
    Repeats,
    Step,
    Within,
    is_noticeable,
)
from bowdenfit.questions.next.candidate_names import parsed_candidates
from bowdenfit.questions.next.candidates import default_candidates, name_of, situation_of, words_of
from bowdenfit.questions.next.simulated_readings import simulated_readings
from bowdenfit.questions.next.target import Answer, answer_of
from bowdenfit.questions.next.variance_reduction import Explained, error_of_difference, explained_share, mean_and_spread
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Record
from bowdenfit.words import significant

REPEATS = (1, 2, 4, 8, 16, 32)
STEPS, MOST_IN_PLAN = 3, 24  # measurements in a plan, and candidates that it chooses from
_SEED = 7  # beside the fit's own


def next_measurement(
    fit: Record,
    wanted: str | None = None,
    candidates: Sequence[str] = (),
    costs: Mapping[str, float] | None = None,
) -> NextMeasurement:
    """Rank what could be measured next by the variance of an answer that it would take away, on average.

    Args:
        fit: The fit, with a posterior.
        wanted: The answer; see `answer_of`.
        candidates: Such as "angle@450"; whatever the tables can hold if none is named.
        costs: Cost of a measurement of each kind; then candidates are ranked by what they do for their cost.

    Raises:
        UsageError: The fit has no posterior, or the answer, a candidate or a cost makes no sense.
    """
    answer = answer_of(fit, wanted)
    chosen = parsed_candidates(fit, candidates) if candidates else default_candidates(fit)
    _check_costs(chosen, costs)
    readings = _readings(fit, chosen, STEPS)
    found = [explained_share(reading[:, 0], answer.draws) for reading in readings]
    ranked = _ranked(fit, answer, chosen, found, costs)
    route = fit.dataset.description.route
    shown = (route.label, route.range) if route else ("", (0.0, 0.0))
    loads, stop = _loads(fit), _stop(fit, answer)
    if not ranked[0].is_noticeable:
        return NextMeasurement(answer, ranked, None, (), *shown, fit.converged, loads, stop)
    repeats = _repeats(fit, answer, ranked[0].candidate)
    plan = _plan(answer, ranked, dict(zip(chosen, readings, strict=True)))
    within = _within(fit, answer, ranked[0].candidate)
    return NextMeasurement(answer, ranked, repeats, plan, *shown, fit.converged, loads, stop, within)


def _loads(fit: Record) -> tuple[float, float] | None:
    """Lowest and highest input force of the runs made so far, of which a next one would be like."""
    run = typical_run(fit.dataset.measurements)
    return (float(run.input_force.min()), float(run.input_force.max())) if run is not None else None


def _stop(fit: Record, answer: Answer) -> str:
    """Whether more needs to be measured at all."""
    if answer.name in (OPTIMAL_LENGTH.replace("_", "-"), OPTIMAL_EFFICIENCY.replace("_", "-")):
        best = fit.optimal_length()
        return f"You may stop: {best.good_enough[0].lower()}{best.good_enough[1:]}" if best.is_certain else best.not_good_enough
    unit = f" {answer.unit}" if answer.unit else ""
    return f"You may stop if it is enough to know {answer.words} to ± {significant(answer.sd, 2)}{unit}."


def _readings(fit: Record, chosen: Sequence[Candidate], repeats: int) -> list[np.ndarray]:
    measured, z = fit.dataset.measurements, fit.draws().flat_z
    with jax.enable_x64(True):
        seed = fit.provenance.seed + _SEED
        return simulated_readings(fit.model, measured, chosen, z, seed, repeats)


def _ranked(
    fit: Record,
    answer: Answer,
    chosen: Sequence[Candidate],
    found: Sequence[Explained],
    costs: Mapping[str, float] | None,
) -> tuple[Ranked, ...]:
    """Candidates by what they are worth, best first."""
    price = [costs[c.kind] if costs else 1.0 for c in chosen]
    worth = [e.share / p for e, p in zip(found, price, strict=True)]
    # What does next to nothing comes last, however little it costs.
    order = sorted(range(len(chosen)), key=lambda i: (not is_noticeable(found[i].share, found[i].error), -worth[i]))
    first = order[0]
    ranked = []
    for i in order:
        after = answer.sd_after(found[i].share)
        scaled = [Explained(found[k].share / price[k], 0.0, found[k].without / price[k]) for k in (first, i)]
        difference = scaled[0].share - scaled[1].share
        ranked.append(
            Ranked(
                chosen[i], name_of(chosen[i]), words_of(fit, chosen[i]), found[i].share, found[i].error, after,
                found[i].error * answer.sd**2 / (2 * after) if after > 0 else 0.0,
                bool(difference <= WITHIN * error_of_difference(*scaled)), price[i] if costs else None,
            )
        )  # fmt: skip
    return Several(ranked)


def _within(fit: Record, answer: Answer, best: Candidate) -> Within | None:
    """The best candidate with its readings at other loads or of one stroke; None where it names these, or has none."""
    kind, at = candidate_kinds()[best.kind], situation_of(fit.model, fit.dataset.measurements)
    if np.isfinite(best.load) or best.stroke or not (designs := kind.designs(at)):
        return None
    chosen = [best, *(replace(best, load=load, stroke=stroke) for load, stroke in designs)]
    found = [explained_share(reading[:, 0], answer.draws) for reading in _readings(fit, chosen, 1)]
    return Within(kind.describe_usual(at), _ranked(fit, answer, chosen, found, None))


def _repeats(fit: Record, answer: Answer, candidate: Candidate) -> Repeats:
    """The candidate measured several times."""
    (readings,) = _readings(fit, [candidate], max(REPEATS))
    shares = [explained_share(mean_and_spread(readings[:, :n]), answer.draws).share for n in REPEATS]
    return Repeats(REPEATS, tuple(answer.sd_after(share) for share in np.maximum.accumulate(shares)))


def _plan(answer: Answer, ranked: Sequence[Ranked], readings: Mapping[Candidate, np.ndarray]) -> tuple[Step, ...]:
    """The best candidate, then the one that does most beside it, and so on; one may come again, mounted anew."""
    able = [r for r in ranked if r.is_noticeable][:MOST_IN_PLAN] or list(ranked[:1])
    made: list[Ranked] = [ranked[0]]
    steps = [Step(ranked[0].words, ranked[0].name, ranked[0].sd)]
    while len(steps) < STEPS:
        known = [readings[r.candidate][:, made[:i].count(r)] for i, r in enumerate(made)]
        shares = [
            explained_share(np.column_stack([*known, readings[r.candidate][:, made.count(r)]]), answer.draws).share
            for r in able
        ]
        before = 1 - (steps[-1].sd / answer.sd) ** 2
        gains = [(share - before) / (r.cost or 1.0) for share, r in zip(shares, able, strict=True)]
        best = int(np.argmax(gains))
        if shares[best] - before < LEAST_SHARE:
            break
        made.append(able[best])
        steps.append(Step(able[best].words, able[best].name, answer.sd_after(shares[best])))
    return tuple(steps)


def _check_costs(chosen: Sequence[Candidate], costs: Mapping[str, float] | None) -> None:
    if not costs:
        return
    kinds = list(dict.fromkeys(c.kind for c in chosen))
    for kind, cost in costs.items():
        if kind not in kinds:
            raise UsageError(f"--cost {kind}={cost:g}: no candidate is of this kind{suggest_name(kind, kinds)}")
        if not (np.isfinite(cost) and cost > 0):
            raise UsageError(f"--cost {kind}={cost:g} is no cost; write a positive number, such as {kind}=2.")
    missing = [kind for kind in kinds if kind not in costs]
    if missing:
        raise UsageError(
            f"--cost says what {', '.join(costs)} costs, but nothing of {', '.join(missing)}; state the cost of every kind, in "
            f"the same unit, such as {missing[0]}=1."
        )
