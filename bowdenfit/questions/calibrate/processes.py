"""Replications of a plan over all cores, in processes that start cleanly and keep what they have compiled."""

import multiprocessing
import os
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bowdenfit.questions.calibrate.replication import Plan, Replication, Workbench

# Each process computes with one thread; else they would take each other's cores.
_ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
}
_benches: "list[Workbench]" = []  # of a process for one plan


def replicate(plan: "Plan", numbers: Sequence[int], workers: int) -> "Iterator[Replication]":
    """Replications as they are done: in processes that start cleanly, or here if there is one worker.

    Args:
        plan: What is replicated.
        numbers: Which replications.
        workers: How many processes.
    """
    if workers == 1 or len(numbers) < 2:
        import jax

        from bowdenfit.questions.calibrate.replication import Workbench

        bench = Workbench(plan)
        for number in numbers:
            with jax.enable_x64(True):
                replication = bench.replication(number)
            yield replication
        return
    with _pool(plan, min(workers, len(numbers))) as pool:
        for done in as_completed([pool.submit(_replication, number) for number in numbers]):
            yield done.result()


@contextmanager
def _pool(plan: "Plan", workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes of one thread each, ended at once when this one is interrupted."""
    added = {name: value for name, value in _ONE_THREAD.items() if name not in os.environ}
    os.environ |= added
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, context, initializer=_start, initargs=(plan,))
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        for name in added:
            os.environ.pop(name, None)


def _start(plan: "Plan") -> None:
    """A process for one plan, which keeps what it has compiled; an interruption is for the process that started it."""
    from bowdenfit.questions.calibrate.replication import Workbench

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _benches[:] = [Workbench(plan)]


def _replication(number: int) -> "Replication":
    import jax

    with jax.enable_x64(True):
        return _benches[0].replication(number)
