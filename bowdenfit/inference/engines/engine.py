"""An engine does many independent pieces of work, and gives back each as it is done.

What a piece gives may depend on itself alone, never on the engine, so that any engine gives the same.
"""

import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from dataclasses import dataclass, field
from typing import Any, Generic, TypeAlias, TypeVar

from bowdenfit.errors import BowdenfitError

Work = TypeVar("Work")
Result = TypeVar("Result")
Outcome: TypeAlias = tuple[Exception | None, Any]
_PIECES_PER_WORKER = 2  # pieces that a worker is given at once, so that it need not wait for the next
_PATIENCE = 30.0  # seconds without a piece done, until is looked whether anybody is left
_MOST_ATTEMPTS = 3  # that a piece is tried when workers die of it


class EngineError(BowdenfitError):
    """Workers died, or a cluster cannot be reached, though the request was good."""


@dataclass
class Engine(Generic[Work, Result]):
    """An executor, and how it is used.

    Args:
        executor: Makes the executor; called again when it is broken.
        workers: How many pieces are done at a time.
        name: In words.
        most: Data sets of a piece; few, so that little is lost when it is interrupted, or many where starting costs much.
        check: Called where nothing was done for a while; raises if nothing can be.
        begun: The executor in use.
    """

    executor: Callable[[], Executor]
    workers: int
    name: str
    max_datasets: int = 128
    check: Callable[[], None] = lambda: None
    running: Executor | None = field(default=None, init=False)

    def results(self, function: Callable[[Work], Result], pieces: Sequence[Work]) -> Iterator[Result]:
        """What a function gives of every piece, in the order in which they are done.

        Args:
            function: Of one piece; known to workers by its name.
            pieces: The work.

        Raises:
            BowdenfitError: What the function refuses.
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
                    except (Exception, CancelledError) as error:  # of the engine: what the function raises is in the outcome
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
            why = f"{type(error).__name__}: {error}"
            raise EngineError(f"{self.name} takes no more work ({why}); start it again, and go on with --resume.") from None

    def _count_attempt(self, attempts: int, error: Exception) -> int:
        """How often a piece will have been tried, if it may be tried again."""
        why = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        if isinstance(error, ImportError | AttributeError):
            raise EngineError(
                f"a worker of {self.name} cannot load what it is to do ({why}); install the same bowdenfit there as here."
            ) from None
        if attempts >= _MOST_ATTEMPTS:
            raise EngineError(
                f"workers of {self.name} were lost {attempts} times at the same work ({why}); the usual cause is too little "
                "memory: give each worker more, or have fewer of them."
            ) from None
        return attempts + 1

    def close(self) -> None:
        """End what was begun."""
        if self.running is not None:
            self.running.shutdown(wait=False, cancel_futures=True)
            self.running = None


def run_piece(function: Callable[[Any], Any], piece: Any) -> Outcome:
    """What a function gives, or what it raises, so that no engine can take it for a fault of its own.

    Args:
        function: Of one piece.
        piece: The work.
    """
    try:
        return None, function(piece)
    except Exception as error:
        error.add_note(traceback.format_exc())
        return error, None


class InThisProcess(Engine[Work, Result]):
    """One piece after the other, here."""

    def __init__(self) -> None:
        super().__init__(lambda: ThreadPoolExecutor(1), 1, "this process")

    def results(self, function: Callable[[Work], Result], pieces: Sequence[Work]) -> Iterator[Result]:
        """See `Engine`."""
        return map(function, pieces)


def make_waiting_executor(submit: Callable[..., Any], most: int) -> Executor:
    """An executor of something that waits for its own answer.

    Args:
        submit: Does a piece somewhere else, and waits.
        most: Pieces at once.
    """

    class Waiting(ThreadPoolExecutor):
        def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> "Future[Any]":
            return super().submit(submit, function, *arguments, **named)

    return Waiting(most)
