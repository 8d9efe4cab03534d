"""Many data sets of one shape, fitted in one program: each by the least engine whose own checks it passes.

First importance sampling from a mixture about the maxima of the posterior, where the Pareto k of the weights and the
effective number of draws decide, given up where the first draws are worth little; then ensembles of walkers, started from
those draws, in rounds until they agree; then NUTS.
What comes of a data set depends on its own data and seed alone, not on what else is fitted.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import replace
from functools import partial
from typing import Any

import jax

from bowdenfit.inference.batch.ensembles import STEPS
from bowdenfit.inference.batch.programs import CHUNK, WALKING, BatchPrograms, BatchSettings
from bowdenfit.inference.batch.stages import BatchFit, Case, by_nuts, look, walk, weigh
from bowdenfit.inference.log_density import LogDensity

_GROUP = 256  # data sets from the start to the end, before the next; bounds memory
_FIRST_LOOK = 3  # rounds before the first look


def fit_batch(
    posterior: LogDensity,
    data: Sequence[Any],
    seeds: Sequence[int],
    settings: BatchSettings | None = None,
    programs: BatchPrograms | None = None,
) -> list[BatchFit]:
    """Fit data sets of one shape.

    Args:
        posterior: The posterior, whose model is that of all of them.
        data: What `posterior.data` is, for every data set; all arrays of the same shapes.
        seeds: One for every data set, which with its data decides what it draws.
        settings: How carefully.
        programs: What was compiled for another batch of the same shape and model; its settings count.
    """
    programs = programs or BatchPrograms(posterior, settings or BatchSettings())
    numbered = list(zip(range(len(data)), data, seeds, strict=True))
    pool = ThreadPoolExecutor(programs.threads)
    try:
        groups = [_fit_group(programs, pool, numbered[i : i + _GROUP]) for i in range(0, len(numbered), _GROUP)]
    finally:  # an interrupt, or an error of one chunk, waits for none of the others
        pool.shutdown(wait=False, cancel_futures=True)
    return [fit for group in groups for fit in group]


def _fit_group(
    programs: BatchPrograms, pool: ThreadPoolExecutor, numbered: Sequence[tuple[int, Any, int]]
) -> list[BatchFit]:
    """Fits of as many data sets as memory is given to at once."""
    _ = programs.gradients, programs.densities, programs.noise, programs.names
    weighed = pool.map(partial(_in_64_bits, weigh, programs), _chunks(numbered, CHUNK))
    done = {case.number: case for cases in weighed for case in cases}
    limit = max(programs.settings.sampler.max_steps // STEPS, _FIRST_LOOK)
    walking = [case for case in done.values() if _goes_on(case, limit)]
    if walking:
        _ = programs.ensembles
        done |= {case.number: case for case in _walked(programs, pool, walking, limit)}
    for case in done.values():
        if programs.settings.nuts and len(case.fit.z) and case.fit.reasons:
            done[case.number] = replace(case, fit=by_nuts(programs, case))
    return [case.fit for case in done.values()]


def _walked(programs: BatchPrograms, pool: ThreadPoolExecutor, cases: Sequence[Case], limit: int) -> Iterator[Case]:
    """All cases, each when its walkers have gone far enough; any that went as far go on to their next look together."""
    waiting, running = {0: list(cases)}, set[Future[list[Case]]]()
    while waiting or running:
        while waiting and len(running) < programs.threads:
            # Full programs first, and of those whose walkers went farthest: the last to end should begin early.
            rounds = max(waiting, key=lambda rounds: (len(waiting[rounds]) >= WALKING, rounds))
            chunk, waiting[rounds] = waiting[rounds][:WALKING], waiting[rounds][WALKING:]
            if not waiting[rounds]:
                del waiting[rounds]
            running.add(pool.submit(_in_64_bits, partial(_to_next_look, limit=limit), programs, chunk))
        ended, running = wait(running, return_when=FIRST_COMPLETED)
        for case in (case for future in ended for case in future.result()):
            if _goes_on(case, limit):
                waiting.setdefault(case.rounds, []).append(case)
            else:
                yield case


def _goes_on(case: Case, limit: int) -> bool:
    """Whether walkers may make more of a case than is known."""
    return bool(len(case.fit.z) and case.fit.reasons and case.rounds < limit)


def _to_next_look(programs: BatchPrograms, cases: list[Case], limit: int) -> list[Case]:
    """Rounds of cases of as many, and what their draws say then."""
    begun = cases[0].rounds
    target = min(begun + max(begun // 3, 1), limit) if begun else _FIRST_LOOK
    for _ in range(begun, target):
        cases = walk(programs, cases)
    return look(programs, cases, last=target == limit)


def _in_64_bits(
    function: Callable[[BatchPrograms, list[Any]], list[Case]], programs: BatchPrograms, parts: list[Any]
) -> list[Case]:
    """What a function gives in a thread, where the setting is the thread's own."""
    with jax.enable_x64(True):
        return function(programs, parts)


def _chunks(parts: Sequence[Any], count: int) -> list[list[Any]]:
    return [list(parts[i : i + count]) for i in range(0, len(parts), count)]
