"""Clusters as engines: Dask and Slurm."""

import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from bowdenfit.child_process import starting_safely
from bowdenfit.errors import UsageError
from bowdenfit.inference.engines import Cluster, Engine, EngineError
from bowdenfit.inputs import refuse_special
from bowdenfit.outputs import refuse_link
from bowdenfit.words import shown

DATASETS_PER_JOB = 4096  # most data sets of one Slurm job; each job loads and compiles everything again
_DEFAULT_JOBS = 16  # Slurm jobs at a time, by default
_CONNECT_SECONDS, _WORKER_SECONDS = 10, 60  # seconds to wait for a Dask scheduler, and for its first worker
_JOB_MINUTES = 240  # time limit of a Slurm job; SBATCH_TIMELIMIT overrides it


@contextmanager
def open_dask(address: str, workers: int | None, folder: Path | None) -> Iterator[Engine[Any, Any]]:  # noqa: ARG001
    """Connect to a Dask cluster, and yield it as an engine; see `Cluster`.

    Raises:
        UsageError: distributed is not installed.
        EngineError: The scheduler does not answer, or has no worker.
    """
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
        count, check = max(sum(client.nthreads().values()), 1), partial(_refuse_no_workers, client, address)
        yield Engine(lambda: client.get_executor(pure=False), count, f"dask://{address}", check=check)
    finally:
        client.close()


def _refuse_no_workers(client: Any, address: str) -> None:
    """Wait for a worker for a limited time.

    Raises:
        EngineError: There is no worker, or the scheduler is gone.
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


@contextmanager
def open_slurm(address: str, workers: int | None, folder: Path | None) -> Iterator[Engine[Any, Any]]:  # noqa: ARG001
    """Yield Slurm as an engine; see `Cluster`.

    Raises:
        UsageError: There is no Slurm here, submitit is not installed, or no folder is named.
    """
    if folder is None:
        raise UsageError("--engine slurm needs a folder that all its nodes see; name it with --output.")
    if shutil.which("srun") is None:
        raise _slurm_missing_error()
    jobs = workers or _DEFAULT_JOBS
    engine: Engine[Any, Any] = Engine(partial(make_slurm_executor, folder, jobs), jobs, "slurm", DATASETS_PER_JOB)
    try:
        yield engine
    finally:
        engine.close()


def make_slurm_executor(folder: Path, jobs: int, cluster: str = "slurm") -> Executor:
    """Return an executor of Slurm jobs, or of local processes in their place.

    Args:
        folder: Where jobs write; all nodes must see it.
        jobs: Jobs at a time.
        cluster: "slurm", or "local" for processes here.

    Raises:
        UsageError: submitit is not installed, or there is no Slurm here.
    """
    try:
        import submitit
    except ImportError:
        raise _library_missing_error("submitit") from None
    refuse_special(folder)
    refuse_link(folder)
    folder.mkdir(parents=True, exist_ok=True)
    try:  # in a folder that is new: answers come back as pickles, and nobody else's may be taken for one
        inner = submitit.AutoExecutor(mkdtemp(dir=folder.resolve()), cluster=cluster)
    except RuntimeError:
        raise _slurm_missing_error() from None
    inner.update_parameters(timeout_min=_JOB_MINUTES, name="bowdenfit")

    def submit(function: Callable[..., Any], *arguments: Any) -> Any:
        with starting_safely(keep_paths=True):  # a job inherits the environment of whoever submits it
            job = inner.submit(function, *arguments)
        return job.result()

    return make_waiting_executor(submit, jobs)


def make_waiting_executor(submit: Callable[..., Any], most: int) -> Executor:
    """Return an executor whose threads wait for work that is done elsewhere.

    Args:
        submit: Runs a piece elsewhere, and waits for it.
        most: Pieces at once.
    """

    class Waiting(ThreadPoolExecutor):
        def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> "Future[Any]":
            return super().submit(submit, function, *arguments, **named)

    return Waiting(most)


def _slurm_missing_error() -> UsageError:
    return UsageError(
        "there is no Slurm here (no srun and sbatch); run this on a login node of the cluster, or leave --engine out."
    )


def _library_missing_error(library: str) -> UsageError:
    return UsageError(f"this engine needs {library}, which is not installed; install bowdenfit[cluster].")


DASK = Cluster("dask://HOST:PORT", open_dask)
SLURM = Cluster("slurm", open_slurm)
