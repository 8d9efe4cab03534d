"""Binary files are read in a process of their own, with so much memory and time as fits their size.

The libraries that read them believe what a file says of itself: a file of 200 bytes may declare an array of gigabytes, or
blocks that point at themselves. Here such a file costs a sentence. What the libraries print stays there too.
"""

import atexit
import json
import os
import pickle
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from bowdenfit.child_process import python_command, safe_environment
from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import ChannelFile
from bowdenfit.inputs import refuse_special

try:
    import resource
except ImportError:  # Windows, where readers have no limits
    resource = None  # type: ignore[assignment]

# These limits are judged; tests/robustness/test_hostile_files.py holds honest and hostile files against them.
_MEMORY, _MEMORY_PER_BYTE = 1 << 29, 40  # bytes; what libraries need by themselves, and what they unpack
_SECONDS, _SECONDS_PER_BYTE = 8.0, 4e-6  # of CPU
_WALL = 8  # times the seconds of CPU, for machines that do much besides
_IDLE = 20.0  # seconds after which a reader with nothing to do ends
_KILLED = {-getattr(signal, name) for name in ("SIGXCPU", "SIGKILL") if hasattr(signal, name)}
_LENGTH, _NO_MEMORY = struct.Struct("<Q"), "no memory"
LIMITS: ContextVar[float] = ContextVar("LIMITS", default=1.0)


@contextmanager
def limits_times(factor: float) -> Iterator[None]:
    """Let files take so many times the memory and time that is usual for their size, during a `with` block."""
    before = LIMITS.set(factor)
    try:
        yield
    finally:
        LIMITS.reset(before)


@dataclass(frozen=True)
class Limits:
    """Memory and time that reading one file may take.

    Args:
        memory: Bytes beside what the reader has already.
        seconds: Seconds of CPU.
    """

    memory: int
    seconds: float

    @classmethod
    def for_file(cls, path: Path) -> "Limits":
        """Return the limits for a file, by its size or that of all files in a folder, times `LIMITS`."""
        files = path.rglob("*") if path.is_dir() else [path]
        size, factor = sum(file.stat().st_size for file in files if file.is_file()), LIMITS.get()
        return cls(int(factor * (_MEMORY + _MEMORY_PER_BYTE * size)), factor * (_SECONDS + _SECONDS_PER_BYTE * size))


def read_isolated(path: Path, sheet: str = "") -> ChannelFile:
    """Read a file in the other process.

    Args:
        path: A file whose reader is found by its ending.
        sheet: Title of the only sheet of a workbook that is read; all if empty.

    Raises:
        DatasetError: What the reader says of the file, or that it took more memory or time than fits its size.
    """
    result: ChannelFile = call_isolated(path, "bowdenfit.files:read_here", *([sheet] if sheet else []))
    return replace(result, path=path)


def call_isolated(path: Path, reader: str, *arguments: Any, limits: Limits | None = None) -> Any:
    """Return what a function makes of a file, in the other process.

    Args:
        path: The file.
        reader: Module and name of the function.
        arguments: Further ones, which JSON can carry.
        limits: Memory and time that it may take; by its size and `LIMITS` if omitted.

    Raises:
        DatasetError: What the reader says of the file, or that it took more memory or time than fits its size.
    """
    for file in (path, *(path.iterdir() if path.is_dir() else ())):
        refuse_special(file)
    limits, key = limits or Limits.for_file(path), _file_key(path)
    if key in _too_costly:
        raise DatasetError(_too_costly[key])
    with _request_lock:
        ended, content = _send_request(path, limits, reader, arguments)
    refused, result = pickle.loads(content) if content else ("", None)  # noqa: S301  (of our own process)
    excess = "memory" if refused == _NO_MEMORY else "time" if content is None and ended in _KILLED else ""
    if excess:
        _too_costly[key] = _describe_excess(path, limits, excess)
        raise DatasetError(_too_costly[key])
    if content is None:
        raise DatasetError(_describe_crash(path))
    if refused:
        raise DatasetError(refused)
    return result


_too_costly: dict[Any, str] = {}  # what was said of files that took too much, so that no other reader tries in vain


def _file_key(path: Path) -> Any:
    """Return what tells a file, as it is now, and the limits in force from others."""
    if not path.exists():
        return str(path)
    status = path.stat()
    return path.resolve(), status.st_mtime_ns, status.st_size, status.st_ino, LIMITS.get()


def _send_request(path: Path, limits: Limits, name: str, arguments: tuple[Any, ...]) -> tuple[int | None, bytes | None]:
    """Send one request; return the exit code of the reader, None if it still runs, and its answer, None if there is none."""
    request = json.dumps([str(path.resolve()), limits.memory, limits.seconds, name, arguments]).encode() + b"\n"
    for _ in range(2):  # one that had nothing to do may just have ended
        reader = _start_reader()
        assert reader.stdin is not None and reader.stdout is not None  # both are pipes
        try:
            reader.stdin.write(request)
            reader.stdin.flush()
            content, too_late = _read_answer(reader, _WALL * limits.seconds)
        except BrokenPipeError:
            content, too_late = b"", False
        if content:
            return None, content
        if (ended := _end_reader(reader)) != 0 or too_late:
            return ended, None
    return 0, None


_readers: dict[
    int, "subprocess.Popen[bytes]"
] = {}  # by process: a copy of this one starts its own, or answers would mix
_scratch: dict[int, str] = {}  # folders for temporary files of readers, which may be killed, by process
_request_lock = threading.Lock()


def _start_reader() -> "subprocess.Popen[bytes]":
    """Return the process that reads, started if there is none."""
    own = os.getpid()
    if own in _readers and _readers[own].poll() is not None:
        _end_reader(_readers[own])
    if own not in _readers:
        _scratch[own] = tempfile.mkdtemp(prefix="bowdenfit-")
        command = python_command("bowdenfit.files.apart:serve", _scratch[own])
        pipes: dict[str, Any] = dict.fromkeys(("stdin", "stdout"), subprocess.PIPE) | {"stderr": subprocess.DEVNULL}
        environment = safe_environment() | dict.fromkeys(("TMPDIR", "TEMP", "TMP"), _scratch[own])
        _readers[own] = subprocess.Popen(command, **pipes, env=environment, cwd=_scratch[own])  # noqa: S603  (our own)
    return _readers[own]


@atexit.register
def _end_all() -> None:
    """End the reader of this process when Python ends."""
    if os.getpid() in _readers:
        _end_reader(_readers[os.getpid()])


def _end_reader(reader: "subprocess.Popen[bytes]") -> int:
    """End a reader, and return its exit code, or minus the signal that it was ended by."""
    del _readers[os.getpid()]
    reader.kill()
    for stream in (reader.stdin, reader.stdout):
        assert stream is not None  # both are pipes
        with suppress(BrokenPipeError):
            stream.close()
    ended = reader.wait()
    shutil.rmtree(_scratch.pop(os.getpid()), ignore_errors=True)
    return ended


def _read_answer(reader: "subprocess.Popen[bytes]", seconds: float) -> tuple[bytes, bool]:
    """Return what a reader answers, empty if it ends before that is whole, and whether it was ended for taking too long."""
    assert reader.stdout is not None  # a pipe
    killer = threading.Timer(seconds, reader.kill)
    killer.daemon = True
    killer.start()
    try:
        head = reader.stdout.read(_LENGTH.size)
        (length,) = _LENGTH.unpack(head) if len(head) == _LENGTH.size else (0,)
        content = reader.stdout.read(length)
        return content if len(content) == length else b"", killer.finished.is_set()
    finally:
        killer.cancel()


def _describe_crash(path: Path) -> str:
    """Return what is said of a file at which the reader ended."""
    return (
        f"{path.name} cannot be read: the library that reads such files crashed on it; copy the file again from the "
        "acquisition computer, or export the recording as CSV."
    )


def _describe_excess(path: Path, limits: Limits, what: str) -> str:
    """Return what is said of a file that takes more than its limits."""
    most = f"{limits.memory / 2**20:.0f} MiB of memory" if what == "memory" else f"{limits.seconds:.0f} s"
    return (
        f"{path.name} takes more than {most} to read, far more than fits its size: it is damaged, or made to do so. Copy it "
        "again from the acquisition computer; if it is as it should be, allow more with --reading-limit 4."
    )


def serve(scratch: str) -> None:
    """Read one file after the other, as asked on standard input, until that ends or nothing is asked for a while.

    Args:
        scratch: Folder for temporary files, removed at the end; whoever kills this process removes it otherwise.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # for the process that asks to handle
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print

    def end(code: int = 0) -> None:
        shutil.rmtree(scratch, ignore_errors=True)
        os._exit(code)

    code = 1
    try:
        while True:
            idle = threading.Timer(_IDLE, end)
            idle.daemon = True
            idle.start()
            line = sys.stdin.buffer.readline()
            idle.cancel()
            if not line:
                break
            path, memory, seconds, name, arguments = json.loads(line)
            _limit_process(memory, seconds)
            content = pickle.dumps(_call(name, Path(path), arguments), protocol=5)
            answers.write(_LENGTH.pack(len(content)) + content)
            answers.flush()
        code = 0
    finally:
        end(code)


def _call(name: str, path: Path, arguments: list[Any]) -> tuple[str, Any]:
    """Return why the file cannot be read, empty if it can; and what is made of it."""
    module, _, function = name.partition(":")
    try:
        return "", getattr(import_module(module), function)(path, *arguments)
    except MemoryError:
        return _NO_MEMORY, None
    except DatasetError as error:
        return _NO_MEMORY if isinstance(error.__cause__, MemoryError) else str(error), None


def _limit_process(memory: int, seconds: float) -> None:
    """Limit this process to so much more memory [bytes] and CPU time [s] than it has used."""
    if resource is None:
        return
    used = resource.getrusage(resource.RUSAGE_SELF)
    most = int(used.ru_utime + used.ru_stime + seconds) + 1
    for kind, value in ((resource.RLIMIT_CPU, most), (resource.RLIMIT_DATA, _data_bytes() + memory)):
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (value if hard == resource.RLIM_INFINITY else min(value, hard), hard))


def _data_bytes() -> int:
    """Return bytes of data that this process has."""
    try:
        with Path("/proc/self/status").open() as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmData:")) * 1024
    except (OSError, StopIteration):
        return 1 << 28
