"""What works beside a fit: one more process, or a thread where none may be started; and a stopwatch."""

import os
import signal
import sys
import threading
import time
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib import import_module
from itertools import cycle
from multiprocessing import connection, get_context
from typing import Any, TypeAlias

from bowdenfit.errors import BowdenfitError
from bowdenfit.inference.engines.processes import cores, end_with_parent

COMPUTING = ("jax", "bowdenfit.run.fitting")  # what this process and the other both need
DRAWING = (
    "matplotlib.figure",
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
    "matplotlib.backends.backend_pdf",
    "bowdenfit.questions.figures",
    "bowdenfit.pages.page",
    "jinja2",
)
Answers = tuple["Future[Any]", ...]
Connection: TypeAlias = "connection.Connection[Any, Any]"


class Assistant(ABC):
    """Does jobs beside the fit, one after the other."""

    @abstractmethod
    def begin(self, stages: Callable[..., Iterator[Any]], *arguments: Any, answers: int) -> Answers:
        """What a generator gives, one after the other; it gives so many answers."""

    @abstractmethod
    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """What a function gives."""

    def prepare_to_draw(self) -> None:  # noqa: B027  (here figures load what they need)
        """Load what figures need, after what was asked for so far."""


class InThisProcess(Assistant):
    """Generators in a thread, functions at once."""

    def __init__(self) -> None:
        self.thread = ThreadPoolExecutor(1)

    def begin(self, stages: Callable[..., Iterator[Any]], *arguments: Any, answers: int) -> Answers:
        """See `Assistant`."""

        def in_64_bits() -> None:
            import jax

            with jax.enable_x64(True):  # the setting is each thread's own
                _deliver(stages(*arguments), futures)

        futures = tuple(Future[Any]() for _ in range(answers))
        self.thread.submit(in_64_bits)
        return futures

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """See `Assistant`."""
        done: Future[Any] = Future()
        done.set_result(function(*arguments))
        return done


class InAnotherProcess(Assistant):
    """Everything in a process that ends with this one.

    Args:
        copy: Whether it begins as a copy of this one, or anew.
        settings: Called in it first.
        draws: Whether it will draw figures.
        others: Ends of pipes to other processes, which a copy has too and is not to hold open.
    """

    def __init__(
        self, copy: bool, settings: Callable[[], None], draws: bool, others: "tuple[Connection, ...]" = ()
    ) -> None:
        self.thread, self.draws = ThreadPoolExecutor(1), draws
        context: Any = get_context("fork" if copy else "spawn")
        self.ours, theirs = context.Pipe()
        passed = (theirs, (self.ours, *others) if copy else (), settings)
        self.process = context.Process(target=_serve, args=passed, daemon=True)
        self.process.start()
        theirs.close()

    def begin(self, stages: Callable[..., Iterator[Any]], *arguments: Any, answers: int) -> Answers:
        """See `Assistant`."""
        futures = tuple(Future[Any]() for _ in range(answers))
        self.thread.submit(_deliver, self._asked(stages, arguments), futures)
        return futures

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """See `Assistant`."""
        return self.begin(function, *arguments, answers=1)[0]

    def prepare_to_draw(self) -> None:
        """See `Assistant`."""
        if self.draws:
            self.submit(load, *DRAWING)

    def _asked(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Iterator[Any]:
        try:
            self.ours.send((function, arguments))
            while (reply := self.ours.recv()) is not None:
                error, answer = reply
                if error is not None:
                    self.ours.recv()  # the end of this job, so that the next one gets its own answer
                    raise error
                yield answer
        except (EOFError, ConnectionError):
            raise BowdenfitError(
                "the process that does least squares and draws figures was ended from outside; the usual cause is that "
                "memory ran out: free some, and fit again."
            ) from None

    def end(self) -> None:
        """End the process, whatever it does."""
        self.process.kill()
        self.process.join()
        self.ours.close()
        self.thread.shutdown()


class InTwoProcesses(Assistant):
    """Generators in one copy of this process, functions in that and another one by turns.

    The second has nothing to do before the first is through with its generator: then it loads what figures need.
    """

    def __init__(self, settings: Callable[[], None]) -> None:
        self.first = InAnotherProcess(True, settings, True)
        self.second = InAnotherProcess(True, settings, True, (self.first.ours,))
        self.turns = cycle((self.second, self.first))

    def begin(self, stages: Callable[..., Iterator[Any]], *arguments: Any, answers: int) -> Answers:
        """See `Assistant`."""
        return self.first.begin(stages, *arguments, answers=answers)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """See `Assistant`."""
        return next(self.turns).submit(function, *arguments)

    def prepare_to_draw(self) -> None:
        """See `Assistant`."""
        self.first.submit(os.getpid).add_done_callback(lambda _: self._second_prepares())
        self.first.prepare_to_draw()

    def _second_prepares(self) -> None:
        with suppress(RuntimeError):  # all has ended
            self.second.prepare_to_draw()

    def end(self) -> None:
        """End both."""
        for process in (self.first, self.second):
            process.end()


@contextmanager
def assistant(in_background: bool, settings: Callable[[], None], draws: bool) -> Iterator[Assistant]:
    """An assistant in a process of its own, or in this one.

    A copy of this process has all its libraries and starts at once, but may be made only while nothing runs in it besides.
    A new process imports the main module again, so only a program that guards its start may ask for one: the command line
    does, the library does not unless told to.

    Args:
        in_background: Whether another process may be started.
        settings: Called first, in every process that computes.
        draws: Whether figures will be drawn.
    """
    copy = sys.platform == "linux" and "jax" not in sys.modules and threading.active_count() == 1
    load(*COMPUTING)
    settings()
    if not in_background:
        helper = InThisProcess()
        with helper.thread:
            yield helper
        return
    two = copy and draws and cores() > 1
    other = InTwoProcesses(settings) if two else InAnotherProcess(copy, settings, draws)
    try:
        yield other
    finally:
        other.end()


def _deliver(source: Iterable[Any], futures: Answers) -> None:
    """Each answer to its future; an error to all that are left."""
    try:
        for future, answer in zip(futures, source, strict=True):
            future.set_result(answer)
    except BaseException as error:
        for future in futures:
            if not future.done():
                future.set_exception(error)


def _serve(requests: "Connection", theirs: "tuple[Connection, ...]", settings: Callable[[], None]) -> None:
    """Do one job after the other until the process that asks for them ends; an interrupt is for that one to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    for end in theirs:
        end.close()
    end_with_parent()
    import jax

    jax.config.update("jax_platforms", "cpu")
    settings()
    with jax.enable_x64(True), suppress(EOFError, ConnectionError):  # that process has ended, perhaps with a reply unread
        while True:
            function, arguments = requests.recv()
            for reply in _replies(function, arguments):
                requests.send(reply)
    os._exit(0)


def _replies(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Iterator[tuple[Any, Any] | None]:
    """Error and answer, one after the other; at last None."""
    try:
        found = function(*arguments)
        for answer in found if isinstance(found, Iterator) else (found,):
            yield None, answer
    except Exception as error:
        error.add_note(traceback.format_exc())
        yield error, None
    yield None


def load(*modules: str) -> None:
    """Load modules."""
    for name in modules:
        import_module(name)


def load_beside(*modules: str) -> None:
    """Load modules in a thread, which gets its time while XLA compiles; what fails there fails where they are needed."""

    def quietly() -> None:
        with suppress(Exception):
            load(*modules)

    threading.Thread(target=quietly).start()


@dataclass
class Stopwatch:
    """Seconds spent in each stage of a fit."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what runs inside."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
