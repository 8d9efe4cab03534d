"""What works beside a fit: other processes, or a thread where none may be started."""

import os
import signal
import threading
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing import connection, get_context
from queue import SimpleQueue
from typing import Any, ClassVar, TypeAlias

from bowdenfit.errors import BowdenfitError
from bowdenfit.inference.engines.memory import refuse_too_little
from bowdenfit.inference.engines.processes import end_with_parent, has_room_beside, may_be_copied
from bowdenfit.run.loading import load_what_checking_needs, load_what_computing_needs, load_what_drawing_needs

Answers = tuple["Future[Any]", ...]
Connection: TypeAlias = "connection.Connection[Any, Any]"


class Assistant(ABC):
    """Does jobs beside the fit, one after the other.

    Attributes:
        checks: Whether another process diagnoses and checks draws, so that this one need not load what that takes.
    """

    checks: ClassVar = False

    @abstractmethod
    def begin(self, stages: Callable[..., Iterator[Any]], *arguments: Any, answers: int) -> Answers:
        """What a generator gives, one after the other; it gives so many answers."""

    @abstractmethod
    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """What a function gives, which needs no JAX."""

    def check(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """The same, of a function of draws: at once, where no other process is there for it."""
        done: Future[Any] = Future()
        done.set_result(function(*arguments))
        return done

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
        return self.check(function, *arguments)


class InAnotherProcess(Assistant):
    """Everything in a process that ends with this one.

    Args:
        copy: Whether it begins as a copy of this one, or anew.
        settings: Called in it first; None where no job will need JAX, and what drawing needs is loaded at once if it draws.
        draws: Whether it will draw figures.
        others: Ends of pipes to other processes, which a copy has too and is not to hold open.
        twin: Where a copy of it, once it has loaded what drawing needs, gets its jobs from; none is made without it.
        checks: Whether it loads what judges draws, once that copy is made.
    """

    def __init__(
        self,
        copy: bool,
        settings: Callable[[], None] | None,
        draws: bool,
        others: "tuple[Connection, ...]" = (),
        twin: "Connection | None" = None,
        checks: bool = False,
    ) -> None:
        self.thread, self.draws = ThreadPoolExecutor(1), draws
        context: Any = get_context("fork" if copy else "spawn")
        self.ours, theirs = context.Pipe()
        passed = (theirs, (self.ours, *others) if copy else (), settings, draws, twin, checks)
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
            self.submit(load_what_drawing_needs)

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


class Twin(InAnotherProcess):
    """A copy that a process which draws makes of itself; it ends with that one."""

    def __init__(self) -> None:
        self.thread, self.draws = ThreadPoolExecutor(1), True
        self.ours, self.theirs = get_context("fork").Pipe()

    def end(self) -> None:
        """Ask nothing more of it."""
        self.ours.close()
        self.thread.shutdown()


class LightProcesses:
    """Processes without JAX, begun before this one loads it: the first judges draws, and two draw figures if any are drawn.

    Args:
        draws: Whether figures will be drawn.
        checks: Whether there will be draws to judge.
    """

    def __init__(self, draws: bool, checks: bool) -> None:
        self.all: tuple[InAnotherProcess, ...]
        if not draws:
            self.first = InAnotherProcess(True, None, False, checks=checks)
            self.all = (self.first,)
            return
        twin = Twin()
        self.first = InAnotherProcess(True, None, True, (twin.ours,), twin.theirs, checks)
        twin.theirs.close()
        self.all = self.first, twin

    def end(self) -> None:
        """End all of them."""
        for process in self.all:
            process.end()


class InOtherProcesses(Assistant):
    """Generators in a copy of this process; functions in whichever of the light processes is free.

    Args:
        light: Those.
        settings: See `assistant`.
        computes: Whether a generator will be begun.
    """

    checks = True

    def __init__(self, light: LightProcesses, settings: Callable[[], None], computes: bool) -> None:
        self.light, alone = light, threading.active_count() == 1
        load_what_computing_needs(True)
        settings()
        ends = tuple(process.ours for process in light.all)
        self.computing = InAnotherProcess(alone, settings, False, ends) if computes else None
        self.free = SimpleQueue[InAnotherProcess]()
        for process in light.all:
            self.free.put(process)
        self.threads = ThreadPoolExecutor(len(light.all))

    def begin(self, stages: Callable[..., Iterator[Any]], *arguments: Any, answers: int) -> Answers:
        """See `Assistant`."""
        assert self.computing is not None  # as was asked for
        found = self.computing.begin(stages, *arguments, answers=answers)
        self.computing.submit(os._exit, 0)  # which gives its memory back
        return found

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """See `Assistant`."""
        return self.threads.submit(self._in_one_that_is_free, function, arguments)

    def check(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """See `Assistant`."""
        return self.light.first.submit(function, *arguments)

    def _in_one_that_is_free(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        process = self.free.get()
        try:
            return process.submit(function, *arguments).result()
        finally:
            self.free.put(process)

    def end(self) -> None:
        """End all but the light ones."""
        if self.computing is not None:
            self.computing.end()
        self.threads.shutdown(cancel_futures=True)


@contextmanager
def light_processes(in_background: bool, draws: bool, checks: bool) -> Iterator[LightProcesses | None]:
    """Processes without JAX, which load what they need while this one reads; None where there are to be none.

    A copy of this process has all its libraries and starts at once, but may be made only while nothing runs in it besides.

    Args:
        in_background: Whether other processes may be started.
        draws, checks: See `LightProcesses`.

    Raises:
        MemoryShortageError: There is too little memory for any fit.
    """
    refuse_too_little()
    if not (in_background and (draws or checks) and has_room_beside()):
        yield None
        return
    begun = LightProcesses(draws, checks)
    try:
        yield begun
    finally:
        begun.end()


@contextmanager
def assistant(
    light: LightProcesses | None, in_background: bool, settings: Callable[[], None], draws: bool, computes: bool = True
) -> Iterator[Assistant]:
    """An assistant in processes of its own, or in this one.

    A new process imports the main module again, so only a program that guards its start may ask for one: the command line
    does, the library does not unless told to.

    Args:
        light: Of `light_processes`.
        in_background: Whether another process may be started.
        settings: Called first, in every process that computes.
        draws: Whether figures will be drawn.
        computes: Whether it will be given a generator.
    """
    copy = may_be_copied()
    if light is not None:
        other: InOtherProcesses | InAnotherProcess = InOtherProcesses(light, settings, computes)
    else:
        load_what_computing_needs(in_background)
        settings()
        if not in_background:
            helper = InThisProcess()
            with helper.thread:
                yield helper
            return
        other = InAnotherProcess(copy, settings, draws)
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


def _serve(
    requests: "Connection",
    theirs: "tuple[Connection, ...]",
    settings: Callable[[], None] | None,
    draws: bool,
    twin: "Connection | None" = None,
    checks: bool = False,
) -> None:
    """Do one job after the other until the process that asks for them ends; an interrupt is for that one to handle.

    Args:
        requests: Where jobs come from.
        theirs: Ends that are not this process's.
        settings, draws, twin, checks: See `InAnotherProcess`.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    for end in theirs:
        end.close()
    end_with_parent()
    with suppress(EOFError, ConnectionError), ExitStack() as held:  # that process has ended, perhaps with a reply unread
        if settings is None:
            if draws:
                with suppress(Exception):  # what fails here fails where it is needed
                    load_what_drawing_needs()
            own = requests
            if twin is not None:
                requests = _one_of_two(requests, twin)
            if checks and requests is own:
                load_what_checking_needs()
        else:
            import jax

            jax.config.update("jax_platforms", "cpu")
            settings()
            held.enter_context(jax.enable_x64(True))
        while True:
            function, arguments = requests.recv()
            for reply in _replies(function, arguments):
                requests.send(reply)
    os._exit(0)


def _one_of_two(requests: "Connection", twin: "Connection") -> "Connection":
    """Where this process gets its jobs from, or the copy of it that is made here, where there may be one more."""
    try:
        original = os.fork() > 0
    except OSError:
        original = True
    if original:
        twin.close()
        return requests
    end_with_parent()
    requests.close()
    return twin


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
