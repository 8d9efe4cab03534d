"""Engines: where many independent pieces of work are done (this machine, a cluster of an add-on, or any executor).

The result of a piece depends on the piece alone, never on the engine, so every engine gives the same results. Client and
workers must run the same versions of the libraries that compute.
"""

import platform
import re
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
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any, Generic, TypeAlias, TypeVar

from bowdenfit.child_process import SafeContext, starting_safely
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.extensions import CLUSTERS, iterate_extensions, load_extension
from bowdenfit.inference.resources import available_cores, start_worker
from bowdenfit.words import listed, shown

Work = TypeVar("Work")
Result = TypeVar("Result")
Outcome: TypeAlias = tuple[Exception | None, Any]
_PIECES_PER_WORKER = 2  # pieces submitted per worker, so that none waits for its next one
_PATIENCE = 30.0  # seconds without a finished piece before the engine checks that workers are left
_MOST_ATTEMPTS = 3  # times that a piece is tried when workers die of it
JOBS_FOLDER = "jobs"  # folder in which jobs of a cluster write
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


@dataclass(frozen=True)
class Cluster:
    """A cluster of which an add-on makes an engine; its entry point has the name that stands before `://`.

    Args:
        written: What is written behind --engine, such as "dask://HOST:PORT".
        open: Opens it, given the address behind `://`, jobs at a time (None for as many as it likes), and the folder in which
            jobs may write.
    """

    written: str
    open: Callable[[str, int | None, Path | None], AbstractContextManager[Engine[Any, Any]]]


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
        folder: Where jobs of a cluster may write.
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
    else:
        cluster, address = _find_cluster(engine)
        with cluster.open(address, workers, folder) as of_cluster:
            yield of_cluster
        return
    try:
        yield opened
    finally:
        opened.close()


def _find_cluster(engine: str) -> tuple[Cluster, str]:
    """Return the cluster that an engine names, and the address behind its name.

    Raises:
        UsageError: There is no such engine.
    """
    name, separator, address = engine.partition("://")
    cluster = load_extension(CLUSTERS, name)
    if isinstance(cluster, Cluster) and bool(separator) == ("://" in cluster.written):
        return cluster, address
    clusters = [cluster.written for _, cluster in iterate_extensions(CLUSTERS) if isinstance(cluster, Cluster)]
    *first, last = "local", *clusters
    engines = f"{', '.join(first)} or {last}" if first else last
    raise UsageError(f"there is no engine {shown(engine)}; known here: {engines}.")


def _make_process_pool(count: int) -> Executor:
    with starting_safely():  # its queues start the tracker of resources
        return ProcessPoolExecutor(count, SafeContext(), start_worker)


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
