"""Read binary files in a process of their own, with as much memory and time as fits their size.

The libraries that read them believe what a file says of itself: a file of 200 bytes may declare an array of gigabytes, or
blocks that point at themselves. Here such a file costs a sentence. What the libraries print stays there too.
"""

import atexit
import json
import os
import pickle
import shutil
import signal
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
_KILLED = {-getattr(signal, name) for name in ("SIGXCPU", "SIGKILL") if hasattr(signal, name)}
_NO_MEMORY, _NO_TIME = "no memory", "no time"
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
        memory = int(max(factor, 1.0) * (_MEMORY + _MEMORY_PER_BYTE * size))  # no less, or libraries do not even load
        return cls(memory, factor * (_SECONDS + _SECONDS_PER_BYTE * size))


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
        answer = _send_request(path, limits, reader, arguments)
    if isinstance(answer, int) and answer not in _KILLED:
        raise DatasetError(_describe_crash(path))
    refused, result = (_NO_TIME, None) if isinstance(answer, int) else answer
    if refused in (_NO_TIME, _NO_MEMORY):
        _too_costly[key] = _describe_excess(path, limits, refused)
        raise DatasetError(_too_costly[key])
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


@dataclass(frozen=True)
class _Reader:
    """A process that reads files, and its folder for temporary files, which remain there if it is killed."""

    process: "subprocess.Popen[bytes]"
    scratch: Path

    @classmethod
    def start(cls) -> "_Reader":
        """Start a process that neither imports nor follows anything in the working folder."""
        scratch = tempfile.mkdtemp(prefix="bowdenfit-")
        process = subprocess.Popen(  # noqa: S603  (our own)
            python_command("bowdenfit.files.isolation:serve", scratch),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, cwd=scratch,
            env=safe_environment() | dict.fromkeys(("TMPDIR", "TEMP", "TMP"), scratch),
        )  # fmt: skip
        return cls(process, Path(scratch))

    def read(self, request: list[Any], seconds: float) -> tuple[str, Any] | None:
        """Return the answer to one request, or None if the reader ended without one or was ended after so many seconds."""
        process = self.process
        assert process.stdin is not None and process.stdout is not None  # both are pipes
        too_late = threading.Timer(seconds, process.kill)
        too_late.daemon = True
        too_late.start()
        try:
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.flush()
            answer: tuple[str, Any] = pickle.load(process.stdout)  # noqa: S301  (of our own process)
            return answer
        except (BrokenPipeError, EOFError, pickle.UnpicklingError):
            return None
        finally:
            too_late.cancel()

    def end(self) -> int:
        """End it, and return its exit code, or minus the signal that it was ended by."""
        self.process.kill()
        for stream in (self.process.stdin, self.process.stdout):
            assert stream is not None  # both are pipes
            with suppress(BrokenPipeError):
                stream.close()
        exit_code = self.process.wait()
        shutil.rmtree(self.scratch, ignore_errors=True)
        return exit_code


_readers: dict[int, _Reader] = {}  # by process: a copy of this one starts its own, or answers would mix
_request_lock = threading.Lock()


@atexit.register
def _end_reader() -> int:
    """End the reader of this process, and return its exit code; 0 if there is none."""
    return _readers.pop(os.getpid()).end() if os.getpid() in _readers else 0


def _send_request(path: Path, limits: Limits, name: str, arguments: tuple[Any, ...]) -> tuple[str, Any] | int:
    """Return the answer to one request, or how the reader ended that gave none."""
    process = os.getpid()
    if process in _readers and _readers[process].process.poll() is not None:
        _end_reader()
    if process not in _readers:
        _readers[process] = _Reader.start()
    request = [str(path.resolve()), limits.memory, limits.seconds, name, arguments]
    try:
        answer = _readers[process].read(request, _WALL * limits.seconds)
    except BaseException:  # such as Ctrl-C in a notebook: the next request must not get this answer
        _end_reader()
        raise
    return _end_reader() if answer is None else answer


def _describe_crash(path: Path) -> str:
    """Return what is said of a file at which the reader ended."""
    return (
        f"{path.name} cannot be read: the library that reads such files crashed on it; copy the file again from the "
        "acquisition computer, or export the recording as CSV."
    )


def _describe_excess(path: Path, limits: Limits, lack: str) -> str:
    """Return what is said of a file that takes more than its limits."""
    most = f"{limits.memory / 2**20:.0f} MiB of memory" if lack == _NO_MEMORY else f"{limits.seconds:.0f} s"
    return (
        f"{path.name} takes more than {most} to read, far more than fits its size: it is damaged, or made to do so. Copy it "
        "again from the acquisition computer; if it is as it should be, allow more with --reading-limit 4."
    )


def serve(scratch: str) -> None:
    """Read one file after the other, as asked on standard input, until that ends.

    Args:
        scratch: Folder for temporary files, removed at the end; whoever kills this process removes it otherwise.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # for the process that asks to handle
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print
    exit_code = 1
    try:
        for line in sys.stdin.buffer:
            path, memory, seconds, name, arguments = json.loads(line)
            _limit_process(memory, seconds)
            answers.write(pickle.dumps(_call(name, Path(path), arguments), protocol=5))
            answers.flush()
        exit_code = 0
    finally:  # at once: a pipe that is closed before Python ends would have the process killed, as one that took too long
        shutil.rmtree(scratch, ignore_errors=True)
        os._exit(exit_code)


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
