"""Many data sets of one shape, fitted in one program: each by the least engine whose own checks it passes.

First importance sampling from a mixture about the maxima of the posterior, where the Pareto k of the weights and the
effective number of draws decide, given up where the first draws are worth little; then ensembles of walkers, started from
those draws, in rounds until they agree; then NUTS.
What comes of a data set depends on its own data and seed alone, not on what else is fitted.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
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
    threads = programs.settings.threads or len(os.sched_getaffinity(0))
    pool = ThreadPoolExecutor(threads)
    try:
        groups = [_fit_group(programs, pool, numbered[i : i + _GROUP]) for i in range(0, len(numbered), _GROUP)]
    finally:  # an interrupt, or an error of one chunk, waits for none of the others
        pool.shutdown(wait=False, cancel_futures=True)
    return [fit for group in groups for fit in group]


def _fit_group(
    programs: BatchPrograms, pool: ThreadPoolExecutor, numbered: Sequence[tuple[int, Any, int]]
) -> list[BatchFit]:
    """Fits of as many data sets as memory is given to at once."""

    def in_chunks(
        function: Callable[[BatchPrograms, list[Any]], list[Case]], parts: Sequence[Any], count: int = CHUNK
    ) -> list[Case]:
        """What a function gives of all parts, chunk by chunk."""

        def in_64_bits(chunk: list[Any]) -> list[Case]:
            with jax.enable_x64(True):  # the setting is each thread's own
                return function(programs, chunk)

        chunks = [list(parts[i : i + count]) for i in range(0, len(parts), count)]
        return [case for cases in pool.map(in_64_bits, chunks) for case in cases]

    _ = programs.gradients, programs.densities, programs.noise, programs.names
    done = {case.number: case for case in in_chunks(weigh, numbered)}
    limit = max(programs.settings.sampler.max_steps // STEPS, _FIRST_LOOK)
    target = _FIRST_LOOK
    while walking := [case for case in done.values() if len(case.fit.z) and case.fit.reasons and case.rounds < limit]:
        _ = programs.ensembles
        for _ in range(walking[0].rounds, target):
            walking = in_chunks(walk, walking, WALKING)
        done |= {case.number: case for case in in_chunks(partial(look, last=target == limit), walking)}
        target = min(target + max(target // 3, 1), limit)
    for case in done.values():
        if programs.settings.nuts and len(case.fit.z) and case.fit.reasons:
            done[case.number] = replace(case, fit=by_nuts(programs, case))
    return [case.fit for case in done.values()]
