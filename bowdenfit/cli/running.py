"""Run a command so that Ctrl-C and SIGTERM end it cleanly, with a progress bar while it is long.

Signals are handled between two steps of Python in the main thread, and compiled code may take seconds for one step. So a
command runs in a thread of its own while the main thread waits. A signal sets a flag; loops that keep what they have done (see
`watch_verb`) look at it and end. Whatever has not ended soon after is ended with the process: files are written whole under
their names or not at all, temporary ones are removed, and a checkpoint only grows.
"""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import copy_context
from pathlib import Path
from typing import Any

from bowdenfit.cli.stage_line import show_stages
from bowdenfit.cli.terminal import say_interrupted
from bowdenfit.errors import DiskError, MemoryShortageError, system_error
from bowdenfit.inference.resources import refuse_low_memory
from bowdenfit.outputs import remove_unfinished
from bowdenfit.stage_bar import Report, Watch

INTERRUPTED = 130  # exit code, as shells have it
_PATIENCE = 0.5  # s, in which a command may end by itself, so that all of it takes less than one; a judgement
_LOOK = 0.2  # s between two looks at the thread; a judgement, as some systems do not wake the main thread for a signal

requested = threading.Event()
"""Set where the user or the system stops the program."""

_how_to_go_on: list[Callable[[], str]] = []


@contextmanager
def announce_continuation(how_to_go_on: Callable[[], str]) -> Iterator[None]:
    """Announce how an interrupted command can be continued.

    Args:
        how_to_go_on: Returns what is kept and how to go on, in words; empty where nothing is kept.
    """
    _how_to_go_on.append(how_to_go_on)
    try:
        yield
    finally:
        _how_to_go_on.remove(how_to_go_on)


def refuse_interrupted() -> None:
    """Raise `KeyboardInterrupt` where the program is to stop; loops call this between two steps."""
    if requested.is_set():
        raise KeyboardInterrupt


def run_interruptibly(command: Callable[[], Any]) -> Any:
    """Run a command in a thread while this one, the main one, waits for signals.

    Args:
        command: Function to run.

    Returns:
        What the command returns.

    Raises:
        KeyboardInterrupt: The program is to stop, and the command has ended.
        Exception: Whatever the command raises.
    """
    results: list[Any] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            results.append(command())
        except BaseException as error:
            errors.append(error)

    requested.clear()
    worker = threading.Thread(target=copy_context().run, args=(run,), daemon=True)
    with _signals_set_the_flag():
        worker.start()
        while worker.is_alive() and not requested.is_set():
            worker.join(_LOOK)
        worker.join(_PATIENCE if requested.is_set() else None)
        if worker.is_alive():
            _end_process()
    if errors:
        raise errors[0]
    refuse_interrupted()
    return results[0]


@contextmanager
def _signals_set_the_flag() -> Iterator[None]:
    """Let SIGINT and SIGTERM set the flag, if this is the main thread; an ignored signal stays ignored."""
    before: dict[signal.Signals, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:  # a shell may have made this program deaf to interrupts
                before[number] = signal.signal(number, lambda *_: requested.set())
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _end_process() -> None:
    """Print that the program was interrupted, and end it whatever still runs."""
    try:
        say_interrupted(next(filter(None, (how_to_go_on() for how_to_go_on in _how_to_go_on)), ""))
    finally:  # whether or not anybody reads it
        with suppress(OSError):
            remove_unfinished()
        os._exit(INTERRUPTED)


def _time_of(path: Path | None) -> int | None:
    """Return when a file was written; None if there is none."""
    try:
        return None if path is None else path.stat().st_mtime_ns
    except OSError:
        return None


@contextmanager
def watch_verb(folder: Path | None, watch: Watch) -> Iterator[Report]:
    """Yield what to call while something long runs; say how to go on when the user (or the system) stops it.

    Args:
        folder: Results folder, where there is one.
        watch: Bar, and the file that lets the verb go on.

    Raises:
        MemoryShortageError: There is too little memory to begin.
        KeyboardInterrupt: The user stopped it; with how to go on, where something is kept.
    """
    refuse_low_memory()
    checkpoint = folder / watch.kept if folder is not None and watch.kept else None
    whole = folder / watch.whole if folder is not None and watch.whole else None
    earlier = _time_of(whole)

    def how_to_go_on() -> str:
        if _time_of(whole) not in (None, earlier):
            return f"{folder} holds the whole fit: bowdenfit report {folder} draws the rest"
        return (
            f"{watch.remark} {folder}: run the same command with --resume"
            if checkpoint is not None and checkpoint.exists()
            else ""
        )

    try:
        with announce_continuation(how_to_go_on), show_stages(watch) as show:

            def report(*progress: Any) -> None:
                refuse_interrupted()
                show(*progress)

            yield report
            refuse_interrupted()
    except KeyboardInterrupt:
        raise KeyboardInterrupt(how_to_go_on()) from None
    except Exception as error:
        shortage = error if isinstance(error, DiskError) else system_error(error)
        if how_to_go_on() and isinstance(shortage, DiskError | MemoryShortageError):
            raise type(shortage)(
                f"{shortage} What was done so far is kept in {folder}: with room, run the same command with --resume."
            ) from None
        raise
