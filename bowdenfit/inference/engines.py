"""Engines: where many independent pieces of work are done (this machine, a Dask cluster, Slurm, or any executor).

The result of a piece depends on the piece alone, never on the engine, so every engine gives the same results. Client and
workers must run the same versions of the libraries that compute.
"""

import platform
import re
import shutil
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Generic, TypeAlias, TypeVar

from bowdenfit.child_process import SafeContext, starting_safely
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.inference.resources import available_cores, start_worker
from bowdenfit.inputs import refuse_special
from bowdenfit.outputs import refuse_link
from bowdenfit.words import listed, shown

Work = TypeVar("Work")
Result = TypeVar("Result")
Outcome: TypeAlias = tuple[Exception | None, Any]
_PIECES_PER_WORKER = 2  # pieces submitted per worker, so that none waits for its next one
_PATIENCE = 30.0  # seconds without a finished piece before the engine checks that workers are left
_MOST_ATTEMPTS = 3  # times that a piece is tried when workers die of it
ENGINES = "local, dask://HOST:PORT or slurm"
DATASETS_PER_JOB = 4096  # most data sets of one Slurm job; each job loads and compiles everything again
JOBS_FOLDER = "jobs"  # folder in which Slurm jobs write
_DEFAULT_JOBS = 16  # Slurm jobs at a time, by default
_CONNECT_SECONDS, _WORKER_SECONDS = 10, 60  # seconds to wait for a Dask scheduler, and for its first worker
_JOB_MINUTES = 240  # time limit of a Slurm job; SBATCH_TIMELIMIT overrides it
VERSIONED = ("bowdenfit", "jax", "optimistix", "emcee", "blackjax", "arviz-stats", "numpy", "scipy")


class EngineError(BowdenfitError):
    """Workers died, or a cluster cannot be reached; the request itself was valid."""


@dataclass
class Engine(Generic[Work, Result]):
    """Runs independent pieces of work by an executor.

    Args:
        executor: Makes the executor; called again when it is broken.
        workers: Pieces done at a time.
        name: Name for messages.
        max_datasets: Most data sets of a piece: few, so that little is lost by an interrupt, or many where starting costs much.
        check: Called when nothing was finished for a while; raises if nothing can be.
        running: The executor in use.
    """

    executor: Callable[[], Executor]
    workers: int
    name: str
    max_datasets: int = 128
    check: Callable[[], None] = lambda: None
    running: Executor | None = field(default=None, init=False)

    def results(self, function: Callable[[Work], Result], pieces: Sequence[Work]) -> Iterator[Result]:
        """Yield the result of every piece, in the order in which they are finished.

        Args:
            function: Function of one piece; workers find it by its name.
            pieces: The work.

        Raises:
            BowdenfitError: The function refuses a piece.
            EngineError: Workers die of the same piece again and again, or are lost.
        """
        left = [(piece, 1) for piece in reversed(pieces)]
        in_flight: dict[Future[Outcome], tuple[Work, int]] = {}
        try:
            while left or in_flight:
                while left and len(in_flight) < _PIECES_PER_WORKER * self.workers:
                    in_flight[self._submit(function, left[-1][0])] = left[-1]
                    left.pop()
                done, _ = wait(in_flight, _PATIENCE, FIRST_COMPLETED)
                if not done:
                    self.check()
                for future in done:
                    piece, attempts = in_flight.pop(future)
                    try:
                        refused, result = future.result()
                    except (
                        Exception,
                        CancelledError,
                    ) as error:  # of the engine: what the function raises is in the outcome
                        self.check()
                        left.append((piece, self._count_attempt(attempts, error)))
                        continue
                    if refused is not None:
                        raise refused
                    yield result
        except EngineError:
            in_flight.clear()  # nobody is left who could be told to stop
            raise
        finally:
            for future in in_flight:
                future.cancel()

    def _submit(self, function: Callable[[Work], Result], piece: Work) -> "Future[Outcome]":
        if self.running is None:
            self.running = self.executor()
        try:
            return self.running.submit(run_piece, function, piece)
        except BrokenExecutor:
            self.close()
            self.running = self.executor()
            return self.running.submit(run_piece, function, piece)
        except Exception as error:
            self.check()
            reason = f"{type(error).__name__}: {error}"
            raise EngineError(
                f"{self.name} accepts no more work ({reason}); start it again, and go on with --resume."
            ) from None

    def _count_attempt(self, attempts: int, error: Exception) -> int:
        """Return the number of attempts at a piece including the next; raise if it must not be tried again."""
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        if isinstance(error, ImportError | AttributeError):
            raise EngineError(
                f"a worker of {self.name} cannot load what it is to do ({reason}); install the same bowdenfit there as here."
            ) from None
        if attempts >= _MOST_ATTEMPTS:
            raise EngineError(
                f"workers of {self.name} were lost {attempts} times at the same work ({reason}); the usual cause is too little "
                "memory: give each worker more, or have fewer of them."
            ) from None
        return attempts + 1

    def close(self) -> None:
        """Shut the executor down."""
        if self.running is not None:
            self.running.shutdown(wait=False, cancel_futures=True)
            self.running = None


def run_piece(function: Callable[[Any], Any], piece: Any) -> Outcome:
    """Return what a function gives or raises, so that an engine cannot mistake its error for one of its own.

    Args:
        function: Function of one piece.
        piece: The work.
    """
    try:
        return None, function(piece)
    except Exception as error:
        error.add_note(traceback.format_exc())
        return error, None


class InThisProcess(Engine[Work, Result]):
    """An engine that runs pieces one after the other in this process."""

    def __init__(self) -> None:
        super().__init__(lambda: ThreadPoolExecutor(1), 1, "this process")

    def results(self, function: Callable[[Work], Result], pieces: Sequence[Work]) -> Iterator[Result]:
        """See `Engine`."""
        return map(function, pieces)


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


@contextmanager
def open_engine(
    engine: str | Executor,
    workers: int | None = None,
    folder: Path | None = None,
    processes: int = 1,
) -> Iterator[Engine[Any, Any]]:
    """Open an engine that is closed at the end of the `with` block.

    Args:
        engine: Its name, or an executor of the caller, which is left open.
        workers: Processes here, or jobs at a time.
        folder: Where Slurm jobs write; needed for Slurm only.
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
    with starting_safely():  # its queues start the tracker of resources
        return ProcessPoolExecutor(count, SafeContext(), start_worker)


@contextmanager
def _dask_client(address: str) -> Iterator[tuple[Any, int]]:
    """Connect to a Dask cluster; yield its client and how many pieces its workers do at a time."""
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


def _slurm_missing_error() -> UsageError:
    return UsageError(
        "there is no Slurm here (no srun and sbatch); run this on a login node of the cluster, or leave --engine out."
    )


def _library_missing_error(library: str) -> UsageError:
    return UsageError(f"this engine needs {library}, which is not installed; install bowdenfit[cluster].")


@cache
def installed_versions() -> dict[str, str]:
    """Return versions of bowdenfit, Python and the libraries that compute."""
    def version_of(package: str) -> str:
        try:
            installed = distribution(package)
        except PackageNotFoundError:
            return "(not installed)"
        stated = re.search(
            r"^Version: (.+)$", installed.read_text("METADATA") or "", re.MULTILINE
        )  # parsing all takes longer
        return stated[1] if stated else installed.version

    return {package: version_of(package) for package in VERSIONED} | {"python": platform.python_version()}


def refuse_other_versions(of_client: dict[str, str]) -> None:
    """Refuse work that comes from other versions, whose draws could differ.

    Args:
        of_client: Versions where the work comes from.

    Raises:
        UsageError: Some differ.
    """
    installed = installed_versions()
    differing = [
        f"{name} {installed.get(name, '(not installed)')} (here {version})"
        for name, version in of_client.items()
        if installed.get(name) != version
    ]
    if differing:
        raise UsageError(
            f"a worker has other versions: {listed(differing)}. Draws must not depend on who makes them: install the same "
            "versions on all workers as here, such as from constraints.txt."
        )
