"""The command line tried on anything, each time in a process of its own that may take so much memory and time.

A process that has loaded what `check` needs, but no JAX, waits for requests and copies itself for each: some 20 ms.
"""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

MEMORY = 2 << 30  # bytes that one may take besides what is loaded
SECONDS = 60.0  # of CPU


@dataclass(frozen=True)
class Attempt:
    """What came of one.

    Args:
        code: Exit code; negative for the signal that ended it.
        out, err: What it printed.
        seconds: Of CPU.
        memory: Most that it held [bytes].
    """

    code: int
    out: str
    err: str
    seconds: float
    memory: int


class Attempts:
    """Makes attempts, one after the other."""

    def __init__(self) -> None:
        command = [sys.executable, __file__]
        self.server = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )

    def __call__(self, *arguments: object, folder: Path = Path(), user: int | None = None) -> Attempt:
        """One attempt.

        Args:
            arguments: Of the command line.
            folder: Where it is given.
            user: Who gives it, by number; whoever runs this if omitted.
        """
        assert self.server.stdin is not None and self.server.stdout is not None
        request = [[os.fsdecode(str(argument)) for argument in arguments], str(folder.resolve()), user]
        self.server.stdin.write(json.dumps(request).encode() + b"\n")
        self.server.stdin.flush()
        return Attempt(**json.loads(self.server.stdout.readline()))

    def end(self) -> None:
        """Make no more."""
        self.server.communicate(timeout=10)


def serve() -> None:
    """Answer requests until there are no more."""
    from contextlib import redirect_stdout, suppress

    from bowdenfit import cli

    sys.argv = ["bowdenfit", "check", str(Path(__file__).resolve().parents[2] / "datasets" / "synthetic-bench")]
    sys.argv = ["bowdenfit", "check", str(Path(__file__).resolve().parents[2] / "datasets" / "yarn-on-cylinder")]
    with suppress(SystemExit), redirect_stdout(sys.stderr):  # loads what it needs
        cli.main()
    while line := sys.stdin.buffer.readline():
        arguments, folder, user = json.loads(line)
        with TemporaryDirectory() as place:
            print(json.dumps(attempt(arguments, Path(folder), user, Path(place))), flush=True)


def attempt(arguments: list[str], folder: Path, user: int | None, place: Path) -> dict[str, object]:
    """Fork, run, and say what came of it."""
    child = os.fork()
    if not child:
        try:
            begin(arguments, folder, user, place)
        except SystemExit as stop:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(stop.code or 0)
        finally:
            os._exit(99)
    until = time.monotonic() + 5 * SECONDS
    while True:
        pid, status, used = os.wait4(child, os.WNOHANG)
        if pid:
            break
        if time.monotonic() > until:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.002)
    out, err = ((place / name).read_text(errors="backslashreplace") for name in ("out", "err"))
    seconds = used.ru_utime + used.ru_stime
    code = os.waitstatus_to_exitcode(status)
    return {"code": code, "out": out, "err": err, "seconds": seconds, "memory": used.ru_maxrss * 1024}


def begin(arguments: list[str], folder: Path, user: int | None, place: Path) -> None:
    """Become the command line."""
    import resource

    from bowdenfit.cli import start

    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for number, name in ((1, "out"), (2, "err")):
        os.dup2(os.open(place / name, os.O_WRONLY | os.O_CREAT), number)
    resource.setrlimit(resource.RLIMIT_CPU, (int(SECONDS), int(SECONDS) + 1))
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.chdir(folder)
    if user is not None:
        os.setgroups([])
        os.setgid(user)
        os.setuid(user)
    sys.argv = ["bowdenfit", *arguments]
    start()


if __name__ == "__main__":
    serve()
