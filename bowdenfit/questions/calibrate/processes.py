"""Replications of a plan over all cores, in processes that start cleanly and keep what they have compiled."""

import multiprocessing
import os
import signal
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
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
    job = _Job(f"seed {plan.seed}", plan)
    with _pool(min(workers, len(numbers))) as pool:
        for done in as_completed([pool.submit(_replication, job, number) for number in numbers]):
            yield done.result()


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes of one thread each, ended at once when this one is interrupted."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ |= {name: value for name, value in _ONE_THREAD.items() if name not in os.environ}
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, context, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN))
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        _restore(before)


def _restore(environment: Mapping[str, str | None]) -> None:
    for name, value in environment.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


@dataclass(frozen=True)
class _Job:
    """What a process works on; two of one key are the same."""

    key: str
    plan: "Plan" = field(compare=False, repr=False)


def _replication(job: _Job, number: int) -> "Replication":
    """One replication, in a process that keeps what it has compiled for the next."""
    import jax

    with jax.enable_x64(True):
        return _workbench(job).replication(number)


@lru_cache(maxsize=1)
def _workbench(job: _Job) -> "Workbench":
    from bowdenfit.questions.calibrate.replication import Workbench

    return Workbench(job.plan)
