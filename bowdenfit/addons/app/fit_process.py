"""One fit in a process of its own, which reads what to fit, and reports in lines how far it is.

It ends when its standard input closes: so whoever started it cancels it, and so it ends when that process ends, however that
ends. What is sampled by then is kept.
"""

import io
import json
import logging
import os
import sys
import threading
from contextlib import suppress
from functools import partial
from typing import Any

from tqdm import tqdm

import bowdenfit as bf
from bowdenfit.child_process import ignore_local_settings
from bowdenfit.errors import BowdenfitError, describe_unforeseen, system_error
from bowdenfit.outputs import remove_unfinished
from bowdenfit.run.verb import WATCH
from bowdenfit.stages import LOGGER

_INTERRUPTED = 130  # exit code, as shells have it


class Announcer(logging.Handler):
    """Sends each stage as a line."""

    def __init__(self, stream: Any) -> None:
        super().__init__()
        self._stream, self._lock_of_lines = stream, threading.Lock()

    def emit(self, record: logging.LogRecord) -> None:
        """Send a stage."""
        self.send(stage=record.getMessage())

    def send(self, **line: Any) -> None:
        """Send a line."""
        with self._lock_of_lines:
            self._stream.write(f"{json.dumps(line)}\n")
            self._stream.flush()


def main() -> None:
    """Fit what the first line of standard input says."""
    ignore_local_settings()
    announcer, request = Announcer(sys.stdout), json.loads(sys.stdin.readline())
    sys.stdout = sys.stderr  # what libraries print is no line of ours
    threading.Thread(target=_end_with_reader, daemon=True).start()
    LOGGER.addHandler(announcer)
    LOGGER.setLevel(logging.INFO)
    LOGGER.propagate = False
    try:
        _fit(request, announcer)
    except Exception as error:
        known = error if isinstance(error, BowdenfitError) else system_error(error)
        announcer.send(refused=str(known or describe_unforeseen(error)))
        sys.exit(known.exit_code if known else 1)


def _end_with_reader() -> None:
    """End this process when nobody waits for it any more."""
    sys.stdin.read()
    with suppress(OSError):
        remove_unfinished()
    os._exit(_INTERRUPTED)


def _fit(request: dict[str, Any], announcer: Announcer) -> None:
    """Fit, and send whether the answer may be trusted as soon as it is known."""

    class AnnouncedBar(tqdm):
        monitor_interval = 0

        def display(self, msg: str | None = None, pos: int | None = None) -> None:  # noqa: ARG002
            announcer.send(progress=str(self) if msg is None else msg)

    with AnnouncedBar(file=io.StringIO(), **WATCH.bar) as bar:
        bf.fit(
            **request,
            progress=partial(WATCH.show, bar),
            report=lambda sentence: announcer.send(note=sentence),
            answered=lambda fit: announcer.send(trusted=fit.verdict().trusted),
        )
