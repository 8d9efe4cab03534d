"""An interrupt is answered in time, whatever runs: while compiled code does, Python does not hear one.

Signals are handled between two steps of Python in the main thread. A compiler, a sampler or a library that reads a file may be
at it for many seconds, and threads may be waited for. The system tells another thread of a signal at once, through a pipe; that
thread ends the process where the main one has not done so in time. What is kept is kept then as it is when a process is killed.
"""

import _thread
import os
import select
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from bowdenfit.cli.terminal import say_interrupted

INTERRUPTED = 130
_PATIENCE = 1.0  # s
_END = b"\0"  # no signal
_speaking = threading.Lock()
_answered: list[bool] = []
_kept: list[Callable[[], str]] = []


@contextmanager
def answered_in_time() -> Iterator[None]:
    """Meanwhile an interrupt that does not end this context soon ends the process, in one line."""
    if os.name != "posix":  # elsewhere no pipe is told of signals
        yield
        return
    _answered.clear()
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    before = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    # Not one of the module `threading`: a process with some is not copied. This one waits in the system and holds nothing.
    _thread.start_new_thread(_watch, (reader, writer))
    try:
        yield
    finally:
        answer()
        signal.set_wakeup_fd(before)
        os.write(writer, _END)


@contextmanager
def keeping(go_on: Callable[[], str]) -> Iterator[None]:
    """Meanwhile something may be kept when the process ends.

    Args:
        go_on: Says what, and how to go on; empty where nothing is.
    """
    _kept.append(go_on)
    try:
        yield
    finally:
        _kept.remove(go_on)


def answer() -> None:
    """From now on the caller says what is to be said; where the other thread is at it, this waits for the end."""
    with _speaking:
        _answered.append(True)


def _watch(reader: int, writer: int) -> None:
    """Wait for an interrupt, and for its answer."""
    asked = {bytes([signal.SIGINT]), bytes([signal.SIGTERM])}
    while (told := os.read(reader, 1)) != _END:
        if told in asked:
            if _ends(reader, time.monotonic() + _PATIENCE):
                break
            _end()
    os.close(reader)
    os.close(writer)


def _ends(reader: int, until: float) -> bool:
    """Whether the context ends by then."""
    while (left := until - time.monotonic()) > 0 and select.select([reader], [], [], left)[0]:
        if os.read(reader, 1) == _END:
            return True
    return False


def _end() -> None:
    """End the process, unless somebody has said that it was interrupted."""
    with _speaking:
        if _answered:
            return
        try:
            say_interrupted(next((said for go_on in _kept if (said := go_on())), ""))
        finally:  # whether or not anybody reads it
            os._exit(INTERRUPTED)
