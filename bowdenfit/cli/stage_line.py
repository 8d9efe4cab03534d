"""What long work shows of itself: on a terminal one line with stage and clock, and with `--verbose` a line for each stage."""

import logging
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias

from tqdm import tqdm

from bowdenfit.cli.terminal import say
from bowdenfit.stages import LOGGER
from bowdenfit.verb import Watch

Report: TypeAlias = Callable[..., None]
_DELAY = 1.0  # s, before which a quick command shows nothing; a judgement
_TICK = 0.5  # s between two looks at the clock; a judgement
_STAGE = "{desc}, {elapsed}"


class StageLine(logging.Handler):
    """One line on a terminal: the stage with a clock, or the progress bar of a verb while there is progress.

    Args:
        bar: Writes the line.
        watch: What the bar shows of a verb's progress; None if it has none.
    """

    def __init__(self, bar: Any, watch: Watch | None) -> None:
        super().__init__()
        self._bar, self._watch, self._progress_format = bar, watch, bar.bar_format

    def emit(self, record: logging.LogRecord) -> None:
        """Show a stage from now on; the clock goes on."""
        self._bar.bar_format, self._bar.desc = _STAGE, record.getMessage()

    def show_progress(self, *progress: Any) -> None:
        """Show the progress that a verb reports."""
        if self._watch is not None:
            self._bar.bar_format, self._bar.desc = self._progress_format, self._watch.bar["desc"]
            self._watch.show(self._bar, *progress)


@contextmanager
def show_stages(watch: Watch | None) -> Iterator[Report]:
    """Yield what a verb calls with its progress; on a terminal, show that and the stages that are announced meanwhile.

    Args:
        watch: What the bar shows of a verb's progress; None if it has none.
    """
    if not sys.stderr.isatty() or LOGGER.isEnabledFor(logging.INFO):  # nobody looks, or --verbose prints them
        yield lambda *_: None
        return
    options: dict[str, Any] = dict(watch.bar) if watch else {}
    with tqdm(leave=False, delay=_DELAY, **options) as bar:
        line, done = StageLine(bar, watch), threading.Event()
        bar.bar_format, bar.desc = _STAGE, "starting"
        clock = threading.Thread(target=_refresh, args=(bar, done), daemon=True)
        LOGGER.addHandler(line)
        LOGGER.setLevel(logging.INFO)
        clock.start()
        try:
            yield line.show_progress
        finally:
            LOGGER.setLevel(logging.NOTSET)
            LOGGER.removeHandler(line)
            done.set()
            clock.join()
            bar.clear()


def _refresh(bar: Any, done: threading.Event) -> None:
    """Write the line again and again, so that its clock runs."""
    if done.wait(_DELAY):
        return
    while not done.wait(_TICK):
        bar.refresh()


def say_beside_stages(sentence: str) -> None:
    """Print a sentence on standard error, above the line with the stage where there is one."""
    with tqdm.external_write_mode(file=sys.stderr):
        say(sentence, err=True)


def print_stages() -> None:
    """Print every stage on standard error from now on, with the time of day."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
    LOGGER.addHandler(handler)
    LOGGER.setLevel(logging.INFO)
    LOGGER.propagate = False
