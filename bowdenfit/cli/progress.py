"""While something long runs: a bar that says where it stands, and an interrupt that keeps what is done."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, TypeAlias

import click

from bowdenfit.cli.deadline import INTERRUPTED, answer, keeping
from bowdenfit.cli.interrupts import call_soon, is_loading
from bowdenfit.cli.supervised import say_if_aborted
from bowdenfit.cli.terminal import say_interrupted
from bowdenfit.errors import DiskError, MemoryShortageError, system_error
from bowdenfit.inference.engines.memory import refuse_too_little
from bowdenfit.verb import Watch

Report: TypeAlias = Callable[..., None]
# The interrupt, with all that ran: compiled code may be at work on arrays that would be freed with it, before the process ends.
_held: list[BaseException] = []


@contextmanager
def watch_verb(folder: Path | None, watch: Watch) -> Iterator[Report]:
    """Gives what to call while something long runs; says how to go on when the user (or the system) stops it.

    An interrupt that arrives inside a callback of the garbage collector is lost: Python prints it and goes on. So it is
    remembered, not printed, and raised again by the next call.

    Args:
        folder: Results folder, where there is one.
        watch: What is kept there, and what the bar shows.

    Raises:
        MemoryShortageError: There is too little memory to begin.
    """
    refuse_too_little()
    kept = folder / watch.kept if folder is not None and watch.kept else None
    go_on = f"What was done so far is kept in {folder}: with room, run the same command with --resume."
    if kept is not None:
        say_if_aborted(kept, go_on)
    asked, printed = threading.Event(), sys.unraisablehook
    how = f"{watch.remark} {folder}: run the same command with --resume"
    _listen(asked)
    try:
        with keeping(lambda: how if kept is not None and kept.exists() else ""), _bar(watch) as show:

            def report(*progress: Any) -> None:
                if asked.is_set():
                    raise KeyboardInterrupt
                show(*progress)

            yield report
            if asked.is_set():
                raise KeyboardInterrupt
    except BaseException as error:  # where an interrupt is wanted, whatever came of it is that interrupt
        wanted = asked.is_set() or isinstance(error, KeyboardInterrupt)
        shortage = error if isinstance(error, DiskError) else system_error(error)
        is_kept = kept is not None and kept.exists()
        if is_kept and wanted:
            answer()
            say_interrupted(how)
            _held[:] = [error]
            raise click.exceptions.Exit(INTERRUPTED) from None
        if is_kept and isinstance(shortage, DiskError | MemoryShortageError):
            raise type(shortage)(f"{shortage} {go_on}") from None
        if wanted:
            raise KeyboardInterrupt from None
        raise
    finally:
        sys.unraisablehook = printed


def _listen(asked: threading.Event) -> None:
    """Sets the event where the user or the system stops the program, and stops it where nothing is being loaded."""

    def stop(_: int, frame: FrameType | None) -> None:
        asked.set()
        if not is_loading(frame):
            raise KeyboardInterrupt
        call_soon(stop)

    printed = sys.unraisablehook

    def lost(what: "sys.UnraisableHookArgs") -> None:
        if not issubclass(what.exc_type, KeyboardInterrupt):
            printed(what)

    sys.unraisablehook = lost
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, stop)
    signal.signal(signal.SIGTERM, stop)


@contextmanager
def _bar(watch: Watch) -> Iterator[Report]:
    """A bar, on a terminal only."""
    if not sys.stderr.isatty():
        yield lambda *_: None
        return
    from tqdm import tqdm

    tqdm.monitor_interval = 0  # no thread of its own: a process with threads is not copied
    with tqdm(leave=False, **watch.bar) as bar:
        yield lambda *progress: watch.show(bar, *progress)
