"""An engine does many independent pieces of work, and gives back each as it is done.

What a piece gives may depend on itself alone, never on the engine, so that any engine gives the same.
"""

import time
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
from typing import Any, Generic, NamedTuple, TypeAlias, TypeVar

from bowdenfit.errors import BowdenfitError

Work = TypeVar("Work")
Result = TypeVar("Result")
Outcome: TypeAlias = tuple[Exception | None, Any]
_AHEAD = 2  # pieces that a worker is given at once, so that it need not wait for the next
_PATIENCE = 30.0  # seconds without a piece done, until is looked whether anybody is left
_TIMES = 3  # that a piece is tried when workers die of it
_WORTH_PROCESSES = 2.0  # times what it takes to begin them that more processes must save, before they are begun
_SEEN = 3  # pieces by which that is decided: the first compiles, and the second may compile what the first did not need
_LOADING = 2.0  # seconds until a new process has loaded what it computes with


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
    most: int = 128
    check: Callable[[], None] = lambda: None
    begun: Executor | None = field(default=None, init=False)

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
        running: dict[Future[Outcome], tuple[Work, int]] = {}
        try:
            while left or running:
                while left and len(running) < _AHEAD * self.workers:
                    running[self._submit(function, left[-1][0])] = left[-1]
                    left.pop()
                done, _ = wait(running, _PATIENCE, FIRST_COMPLETED)
                if not done:
                    self.check()
                for future in done:
                    piece, tried = running.pop(future)
                    try:
                        refused, result = future.result()
                    except (Exception, CancelledError) as error:  # of the engine: what the function raises is in the outcome
                        self.check()
                        left.append((piece, self._counted(tried, error)))
                        continue
                    if refused is not None:
                        raise refused
                    yield result
        except EngineError:
            running.clear()  # nobody is left who could be told to stop
            raise
        finally:
            for future in running:
                future.cancel()

    def _submit(self, function: Callable[[Work], Result], piece: Work) -> "Future[Outcome]":
        if self.begun is None:
            self.begun = self.executor()
        try:
            return self.begun.submit(attempt, function, piece)
        except BrokenExecutor:
            self.close()
            self.begun = self.executor()
            return self.begun.submit(attempt, function, piece)
        except Exception as error:
            self.check()
            why = f"{type(error).__name__}: {error}"
            raise EngineError(f"{self.name} takes no more work ({why}); start it again, and go on with --resume.") from None

    def _counted(self, tried: int, error: Exception) -> int:
        """How often a piece will have been tried, if it may be tried again."""
        why = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        if isinstance(error, ImportError | AttributeError):
            raise EngineError(
                f"a worker of {self.name} cannot load what it is to do ({why}); install the same bowdenfit there as here."
            ) from None
        if tried >= _TIMES:
            raise EngineError(
                f"workers of {self.name} were lost {tried} times at the same work ({why}); the usual cause is too little "
                "memory: give each worker more, or have fewer of them."
            ) from None
        return tried + 1

    def close(self) -> None:
        """End what was begun."""
        if self.begun is not None:
            self.begun.shutdown(wait=False, cancel_futures=True)
            self.begun = None


def attempt(function: Callable[[Any], Any], piece: Any) -> Outcome:
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


class Taken(NamedTuple):
    """What a piece took.

    Args:
        seconds: Of the clock.
        computed: Of all cores together.
    """

    seconds: float
    computed: float


def processes_pay(taken: Sequence[Taken], left: int, workers: int) -> bool:
    """Whether more processes save clearly more time than it takes to begin them.

    Every new process loads and compiles all over again, and the threads of one process use several cores already: what more
    processes can save is what cores are idle meanwhile. The quickest piece shows what one takes, the others what was compiled.

    Args:
        taken: What the first pieces took.
        left: Pieces to do.
        workers: Processes there would be, each with a core.
    """
    quickest = min(taken)
    if quickest.seconds <= 0.0:
        return False
    beginning = sum(piece.seconds - quickest.seconds for piece in taken) + _LOADING
    idle = max(1.0 - quickest.computed / (quickest.seconds * workers), 0.0)
    return left * quickest.seconds * idle > _WORTH_PROCESSES * beginning


class HereOrInProcesses(Engine[Work, Result]):
    """One process, until it is seen that more of them are quicker.

    Args:
        executor: Makes the executor of several processes.
        workers: How many; 1 if none may be started.
    """

    def __init__(self, executor: Callable[[], Executor], workers: int) -> None:
        super().__init__(executor, workers, "this machine")

    def results(self, function: Callable[[Work], Result], pieces: Sequence[Work]) -> Iterator[Result]:
        """See `Engine`."""
        taken = list[Taken]()
        for number, piece in enumerate(pieces):
            if self.workers > 1 and len(taken) == _SEEN and processes_pay(taken, len(pieces) - number, self.workers):
                yield from super().results(function, pieces[number:])
                return
            begin, computed = time.perf_counter(), time.process_time()
            result = function(piece)
            taken.append(Taken(time.perf_counter() - begin, time.process_time() - computed))
            yield result


def in_threads(submit: Callable[..., Any], most: int) -> Executor:
    """An executor of something that waits for its own answer.

    Args:
        submit: Does a piece somewhere else, and waits.
        most: Pieces at once.
    """

    class Waiting(ThreadPoolExecutor):
        def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> "Future[Any]":
            return super().submit(submit, function, *arguments, **named)

    return Waiting(most)
