"""Many data sets of one shape, fitted with the same programs: each by the least engine whose own checks it passes.

First importance sampling from a mixture about the maxima of the posterior, where the Pareto k of the weights and the effective
number of draws decide, given up where the first draws are worth little; then ensembles of walkers, started from draws of a
mixture that is learnt from those, in rounds until they agree; then NUTS. What comes of a data set depends on its own data and
seed alone, not on what else is fitted.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from operator import attrgetter
from threading import Event
from typing import Any, TypeVar

import jax

from bowdenfit.inference.batch.programs import CHUNK, BatchPrograms, BatchSettings
from bowdenfit.inference.batch.stages import BatchFit, sample_by_nuts, sample_dataset, start_chunk
from bowdenfit.inference.engines.one_thread import linear_algebra_in_one_thread
from bowdenfit.inference.log_density import LogDensity

Argument, Result = TypeVar("Given"), TypeVar("Found")


@linear_algebra_in_one_thread()
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
    parts, pool, stop = list(zip(data, seeds, strict=True)), ThreadPoolExecutor(programs.threads), Event()
    try:
        needed = ("gradients", "evaluate_points", "noise", "friction", "names")  # by all, so before any
        for future in [pool.submit(_in_64_bits, attrgetter(name), programs) for name in needed]:
            future.result()
        chunks = [pool.submit(_in_64_bits, partial(start_chunk, programs), chunk) for chunk in _split(parts, CHUNK)]
        drawing = partial(_in_64_bits, partial(sample_dataset, programs, stopped=stop.is_set))
        futures = [pool.submit(drawing, dataset) for chunk in chunks for dataset in chunk.result()]
        outcomes = [future.result() for future in futures]
    finally:  # an interrupt, or an error of one data set, waits for none of the others
        stop.set()
        pool.shutdown(wait=False, cancel_futures=True)
    use_nuts = programs.settings.nuts
    return [
        sample_by_nuts(programs, future, future.start) if use_nuts and future.start is not None else future.fit
        for future in outcomes
    ]


def _in_64_bits(function: Callable[[Argument], Result], argument: Argument) -> Result:
    """What a function gives in a thread, where the setting is the thread's own."""
    with jax.enable_x64(True):
        return function(argument)


def _split(parts: Sequence[Any], count: int) -> list[list[Any]]:
    return [list(parts[i : i + count]) for i in range(0, len(parts), count)]
