"""Interrupts that are not lost: one that somebody swallowed is raised again until it is heard.

Python prints and forgets an interrupt that arrives inside a callback of the garbage collector or of a compiled library, and
some libraries turn it into an error of their own.
"""

import os
import select
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import TextIO

_AGAIN = 0.3  # s
_asked: list[bool] = []


@contextmanager
def listening() -> Iterator[None]:
    """Meanwhile an interrupt raises `KeyboardInterrupt` again and again until that leaves this context."""
    _asked.clear()
    printed, shown, before = sys.unraisablehook, sys.excepthook, signal.getsignal(signal.SIGINT)

    def lost(what: "sys.UnraisableHookArgs") -> None:
        if not issubclass(what.exc_type, KeyboardInterrupt):
            printed(what)

    def refused(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if not issubclass(kind, KeyboardInterrupt):  # which compiled code prints before it goes on
            shown(kind, error, trace)

    sys.unraisablehook, sys.excepthook = lost, refused
    if before is signal.default_int_handler:  # a shell may have made this deaf to interrupts
        signal.signal(signal.SIGINT, _interrupt)
    try:
        yield
    finally:
        if _asked and hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, signal.SIG_IGN)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        if before is signal.default_int_handler:
            signal.signal(signal.SIGINT, before)
        sys.unraisablehook, sys.excepthook = printed, shown


def line_of(terminal: TextIO) -> str:
    """The next line that is typed; empty where the input has ended.

    An interrupt that arrives after Python has looked for one, and before the system waits for the terminal, would otherwise be
    heard no sooner than the next key. It writes into a pipe, and the system waits for both.
    """
    reader, writer = os.pipe()
    both: list[TextIO | int] = [terminal, reader]
    os.set_blocking(writer, False)
    before = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    try:
        while terminal not in select.select(both, [], [])[0]:
            os.read(reader, 1)
        return terminal.readline()
    finally:
        signal.set_wakeup_fd(before)
        os.close(reader)
        os.close(writer)


def _interrupt(*_: object) -> None:
    _asked.append(True)
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, _interrupt)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN)
    raise KeyboardInterrupt


def was_asked() -> bool:
    """Whether there was an interrupt."""
    return bool(_asked)
