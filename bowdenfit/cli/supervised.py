"""Under a limit of memory a copy of this process does the work, and this one says what became of it.

Compiled libraries that get no memory abort instead of raising an error, so that a process cannot always say why it ends. Where
a limit is set, a copy does everything and this process waits: it passes signals on and ends as the copy does, and if a library
ended the copy it says that memory ran out. Nothing of the kind is done without a limit.
"""

import ctypes
import json
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from bowdenfit.errors import MEMORY_RAN_OUT
from bowdenfit.words import printable

try:
    import resource
except ImportError:  # not on Windows, which has no such limits
    resource = None  # type: ignore[assignment]

_PASSED_ON = {signal.SIGINT, signal.SIGTERM}
_END_WITH_PARENT = 1  # PR_SET_PDEATHSIG of Linux
_MOST_WORDS = 1 << 16  # bytes, as many as a pipe holds
_reports: list[int] = []  # in the copy: where it writes to for the process that waits


def is_limited() -> bool:
    """Whether this process may have so much memory or so many addresses and no more, and another can wait for it."""
    if sys.platform != "linux" or resource is None:
        return False
    limits = (resource.RLIMIT_AS, resource.RLIMIT_DATA)
    return any(resource.getrlimit(limit)[0] != resource.RLIM_INFINITY for limit in limits)


def say_if_aborted(kept: Path, sentence: str) -> None:
    """What else is to be said if a library ends this process from now on.

    Args:
        kept: File or folder; nothing is said unless it is there then.
        sentence: What is said.
    """
    for pipe in _reports:
        os.write(pipe, json.dumps([os.fsdecode(kept.resolve()), sentence]).encode() + b"\n")


def supervise(work: Callable[[], None]) -> None:
    """Have a copy of this process work, and end as it does.

    Args:
        work: What is to be done.
    """
    read, write = os.pipe()
    os.set_blocking(read, False)
    watched, waiting = {*_PASSED_ON, signal.SIGCHLD}, os.getpid()
    signal.pthread_sigmask(signal.SIG_BLOCK, watched)
    child = os.fork()
    if not child:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, watched)
        os.close(read)
        _reports.append(write)
        _prepare(waiting)
        work()
        os._exit(0)
    os.close(write)
    code = _code_of(child, watched)
    if -code in {signal.SIGABRT, signal.SIGSEGV, signal.SIGBUS, signal.SIGILL}:
        sys.stderr.write(f"Error: {MEMORY_RAN_OUT}{_last_words(read)}\n")
        sys.stderr.flush()
        code = 1
    if code < 0:  # whoever ended the copy ends this process
        signal.signal(-code, signal.SIG_DFL) if -code != signal.SIGKILL else None
        signal.pthread_sigmask(signal.SIG_UNBLOCK, watched)
        os.kill(waiting, -code)
    os._exit(code)


def _code_of(child: int, watched: set[signal.Signals]) -> int:
    """How the copy ends; meanwhile signals that one sends to this process go to it, which a terminal sends to both."""
    while True:
        told = signal.sigwaitinfo(watched)
        if told.si_signo == signal.SIGCHLD:
            ended, status = os.waitpid(child, os.WNOHANG)
            if ended:
                return os.waitstatus_to_exitcode(status)
        elif told.si_pid:
            os.kill(child, told.si_signo)


def _prepare(parent: int) -> None:
    """Let this copy end when its parent does, leave no image of its memory, and keep to itself what libraries print.

    What Python says goes where it went before.
    """
    ctypes.CDLL(None).prctl(_END_WITH_PARENT, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if os.environ.get("BOWDENFIT_DEBUG"):
        return
    ours, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    sys.stderr = open(ours, "w", encoding=sys.stderr.encoding, errors=sys.stderr.errors, buffering=1)  # noqa: PTH123, SIM115


def _last_words(read: int) -> str:
    """What the copy wanted to be said, where it is still so."""
    try:
        lines = os.read(read, _MOST_WORDS).splitlines()
    except BlockingIOError:
        return ""
    kept, sentence = json.loads(lines[-1]) if lines else ("", "")
    return f" {printable(sentence)}" if kept and Path(kept).exists() else ""
