"""Interrupts that are not lost: one that somebody swallowed is raised again until it is heard.

Python prints and forgets an interrupt that arrives inside a callback of the garbage collector or of a compiled library, and
some libraries turn it into an error of their own. While a compiled library is loaded, an exception that it did not expect ends
the process as a crash does, so an interrupt waits for the end of that.
"""

import os
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import TextIO, TypeAlias

_SOON, _AGAIN, _PATIENCE = 0.05, 0.3, 3.0  # s
_LOADER = "<frozen importlib"  # what Python's own loader is in tracebacks
Handler: TypeAlias = Callable[[int, FrameType | None], None]
_asked: list[bool] = []
_since: list[float] = []  # when interrupts were looked at


@contextmanager
def listening() -> Iterator[None]:
    """Meanwhile an interrupt raises `KeyboardInterrupt` again and again until that leaves this context."""
    _asked.clear()
    _since.clear()
    printed, shown, before = sys.unraisablehook, sys.excepthook, signal.getsignal(signal.SIGINT)

    def lost(what: "sys.UnraisableHookArgs") -> None:
        if not issubclass(what.exc_type, KeyboardInterrupt):
            printed(what)

    def refused(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if not issubclass(kind, KeyboardInterrupt):  # which compiled code prints before it goes on
            shown(kind, error, trace)

    sys.unraisablehook, sys.excepthook = lost, refused
    if callable(before):  # a shell may have made this deaf to interrupts
        signal.signal(signal.SIGINT, _interrupt)
    try:
        yield
    finally:
        if _asked and hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, signal.SIG_IGN)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        if callable(before):
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


def _interrupt(_: int, frame: FrameType | None) -> None:
    _asked.append(True)
    if is_loading(frame):
        call_soon(_interrupt)
        return
    call_soon(_interrupt, _AGAIN)
    raise KeyboardInterrupt


def call_soon(handler: Handler, seconds: float = _SOON) -> None:
    """Call a handler of signals in a moment, where the system can."""
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, handler)
        signal.setitimer(signal.ITIMER_REAL, seconds)


def is_loading(frame: FrameType | None) -> bool:
    """Whether what was interrupted is the loading of a module, which nothing should be raised in, and may be waited for still.

    Args:
        frame: What was running.
    """
    _since.append(time.monotonic())
    if not hasattr(signal, "setitimer") or _since[-1] - _since[0] > _PATIENCE:
        return False
    while frame is not None and not frame.f_code.co_filename.startswith(_LOADER):
        frame = frame.f_back
    return frame is not None


def was_asked() -> bool:
    """Whether there was an interrupt."""
    return bool(_asked)
