"""The engine that is asked for: local, dask://HOST:PORT, slurm, or any executor."""

import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from bowdenfit.errors import UsageError
from bowdenfit.inference.engines.engine import Engine, EngineError, InThisProcess, make_waiting_executor
from bowdenfit.inference.engines.processes import available_cores, start_worker
from bowdenfit.inputs import refuse_special
from bowdenfit.words import shown

ENGINES = "local, dask://HOST:PORT or slurm"
DATASETS_PER_JOB = 4096  # data sets of a job of Slurm at the most; each job loads and compiles all over again
JOBS_FOLDER = "jobs"  # folder in which Slurm's jobs write
_DEFAULT_JOBS = 16  # jobs of Slurm, if nothing else is said
_CONNECT_SECONDS, _WORKER_SECONDS = 10, 60  # seconds
_JOB_MINUTES = 240  # of a job of Slurm; SBATCH_TIMELIMIT says otherwise


@contextmanager
def open_engine(
    engine: str | Executor,
    workers: int | None = None,
    folder: Path | None = None,
    processes: int = 1,
) -> Iterator[Engine[Any, Any]]:
    """An engine, which ends with what is done inside.

    Args:
        engine: Its name, or an executor of one's own, which is left open.
        workers: Processes here, or jobs at a time.
        folder: Where Slurm's jobs write; asked for by that alone.
        processes: Processes of this machine that "local" uses; with more than one, programs begin with
            `if __name__ == "__main__"`, as with everything that starts processes.

    Raises:
        UsageError: There is no such engine, or it is not installed.
        EngineError: It does not answer.
    """
    if isinstance(engine, Executor):
        yield Engine(lambda: engine, workers or available_cores(), "the executor")
        return
    opened: Engine[Any, Any]
    if engine == "local":
        opened = (
            InThisProcess()
            if processes == 1
            else Engine(partial(_make_process_pool, processes), processes, "this machine")
        )
    elif engine.startswith("dask://"):
        address = engine.removeprefix("dask://")
        with _dask_client(address) as (client, count):
            check = partial(_refuse_no_workers, client, address)
            yield Engine(lambda: client.get_executor(pure=False), count, engine, check=check)
        return
    elif engine == "slurm":
        if folder is None:
            raise UsageError("--engine slurm needs a folder that all its nodes see; name it with --output.")
        if shutil.which("srun") is None:
            raise _slurm_missing_error()
        opened = Engine(
            partial(make_slurm_executor, folder, workers or _DEFAULT_JOBS),
            workers or _DEFAULT_JOBS,
            "slurm",
            DATASETS_PER_JOB,
        )
    else:
        raise UsageError(f"there is no engine {shown(engine)}; known here: {ENGINES}.")
    try:
        yield opened
    finally:
        opened.close()


def _make_process_pool(count: int) -> Executor:
    return ProcessPoolExecutor(count, get_context("spawn"), start_worker)


@contextmanager
def _dask_client(address: str) -> Iterator[tuple[Any, int]]:
    """A client of a Dask cluster that answers, and how many pieces its workers do at once."""
    try:
        from distributed import Client
    except ImportError:
        raise _library_missing_error("distributed") from None
    try:
        client = Client(f"tcp://{address}", timeout=_CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:  # a timeout is an OSError
        raise EngineError(
            f"the scheduler at {shown(address)} does not answer ({type(error).__name__}); start it with `dask scheduler`, and "
            "write the address that it prints behind tcp:// as --engine dask://HOST:PORT."
        ) from None
    try:
        _refuse_no_workers(client, address)
        yield client, max(sum(client.nthreads().values()), 1)
    finally:
        client.close()


def _refuse_no_workers(client: Any, address: str) -> None:
    """Wait for a worker, but not for ever.

    Raises:
        EngineError: There is none, or the scheduler is gone.
    """
    try:
        client.wait_for_workers(1, timeout=_WORKER_SECONDS)
    except TimeoutError:
        raise EngineError(
            f"the scheduler at {shown(address)} has no worker; start some with `dask worker tcp://{address}`. What is done is "
            "kept where there is a results folder, and goes on with --resume."
        ) from None
    except Exception as error:  # of whatever kind: a client whose scheduler is gone says so in several ways
        raise EngineError(
            f"the scheduler at {shown(address)} is gone ({type(error).__name__}); start it and its workers again. What is done "
            "is kept where there is a results folder, and goes on with --resume."
        ) from None


def make_slurm_executor(folder: Path, jobs: int, cluster: str = "slurm") -> Executor:
    """An executor of Slurm's jobs, or of processes here that stand for them.

    Args:
        folder: Where they write; all nodes must see it.
        jobs: At a time.
        cluster: "slurm", or "local" for processes here.

    Raises:
        UsageError: submitit is not installed, or there is no Slurm here.
    """
    try:
        import submitit
    except ImportError:
        raise _library_missing_error("submitit") from None
    refuse_special(folder)
    try:
        inner = submitit.AutoExecutor(folder.resolve(), cluster=cluster)
    except RuntimeError:
        raise _slurm_missing_error() from None
    inner.update_parameters(timeout_min=_JOB_MINUTES, name="bowdenfit")

    def submit(function: Callable[..., Any], *arguments: Any) -> Any:
        return inner.submit(function, *arguments).result()

    return make_waiting_executor(submit, jobs)


def _slurm_missing_error() -> UsageError:
    return UsageError(
        "there is no Slurm here (no srun and sbatch); run this on a login node of the cluster, or leave --engine out."
    )


def _library_missing_error(library: str) -> UsageError:
    return UsageError(f"this engine needs {library}, which is not installed; install bowdenfit[cluster].")
