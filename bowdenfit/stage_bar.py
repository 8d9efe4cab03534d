"""One line that shows what long work does: the stage with a clock, or a verb's progress; on terminals and in notebooks."""

import io
import logging
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import copy_context
from dataclasses import dataclass
from typing import Any, TypeAlias

from tqdm import tqdm

from bowdenfit.stages import LOGGER

Report: TypeAlias = Callable[..., None]
DELAY = 1.0  # s, before which a quick command shows nothing; a judgement
_TICK = 0.5  # s between two looks at the clock; a judgement
_STAGE = "{desc}, {elapsed}"


@dataclass(frozen=True)
class Watch:
    """Progress bar and interrupts of a verb that takes long.

    Args:
        kept: File in the results folder that lets it go on later; empty where nothing does.
        remark: Clause on what is saved; the folder follows.
        bar: Options of the progress bar.
        show: Moves the bar by what the function reports.
        whole: File in the results folder that says that its fit is whole, but for figures; empty if there is none.
    """

    kept: str
    remark: str
    bar: Mapping[str, Any]
    show: Callable[..., None]
    whole: str = ""


class StageLine(logging.Handler):
    """One line: the stage with a clock, or the progress bar of a verb while there is progress.

    Args:
        bar: Writes the line.
        watch: Bar and interrupts of a verb; None if it has none.
    """

    def __init__(self, bar: Any, watch: Watch | None) -> None:
        super().__init__()
        self._bar, self._watch = bar, watch
        self._progress_format = watch.bar.get("bar_format") if watch is not None else None
        self._progress: str | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Show a stage from now on; the clock goes on."""
        self._bar.bar_format, self._bar.desc = _STAGE, record.getMessage()

    def show_progress(self, *progress: Any) -> None:
        """Show the progress that a verb reports."""
        if self._watch is not None:
            self._bar.bar_format, self._bar.desc = self._progress_format, self._watch.bar["desc"]
            self._watch.show(self._bar, *progress)
            self._progress = self._bar.desc

    def show_end(self) -> None:
        """Show the last progress again, or that the work is done."""
        if self._progress is None:
            self._bar.bar_format, self._bar.desc = _STAGE, "done"
        else:
            self._bar.bar_format, self._bar.desc = self._progress_format, self._progress

    def show_stop(self) -> None:
        """Show at which stage the work has stopped."""
        self._bar.bar_format, self._bar.desc = _STAGE, f"stopped while {(self._bar.desc or '').removesuffix(': ')}"


@contextmanager
def follow_stages(bar: Any, watch: Watch | None) -> Iterator[StageLine]:
    """Yield a line with the stages that are announced meanwhile, whose clock runs.

    Args:
        bar: Writes the line.
        watch: Bar and interrupts of a verb; None if it has none.
    """
    line, done, before = StageLine(bar, watch), threading.Event(), (LOGGER.level, LOGGER.propagate)
    clock = threading.Thread(target=copy_context().run, args=(_refresh, bar, done), daemon=True)
    if not LOGGER.isEnabledFor(logging.INFO):
        LOGGER.setLevel(logging.INFO)
        LOGGER.propagate = False  # to nobody who did not ask for stages
    LOGGER.addHandler(line)
    clock.start()
    try:
        yield line
    finally:
        LOGGER.removeHandler(line)
        LOGGER.setLevel(before[0])
        LOGGER.propagate = before[1]
        done.set()
        clock.join()


def stage_options(watch: Watch | None) -> dict[str, Any]:
    """Return the options of a bar that shows a stage first, then the progress of a verb."""
    return {**(watch.bar if watch is not None else {}), "bar_format": _STAGE, "desc": "starting"}


def _refresh(bar: Any, done: threading.Event) -> None:
    """Write the line again and again, so that its clock runs."""
    if done.wait(DELAY):
        return
    while not done.wait(_TICK):
        bar.refresh()


@contextmanager
def show_progress_bar(watch: Watch | None, report: Report | None) -> Iterator[Report | None]:
    """Yield what to call while a verb runs: the caller's function, else in a notebook one that moves a bar.

    Between and before calls the line shows the stage, with a clock. It is a display object rather than a stream, so that a
    notebook keeps one line; tqdm's own bar for notebooks asks for ipywidgets. Work of less than a second without progress
    shows nothing, and neither does work inside of other that is shown.

    Args:
        watch: Bar and interrupts of a verb; None for stages alone.
        report: Function of the caller; None if there is none.
    """
    if report is not None or not is_notebook() or any(isinstance(handler, StageLine) for handler in LOGGER.handlers):
        yield report
        return
    with _notebook_bar()(file=io.StringIO(), **stage_options(watch)) as bar, follow_stages(bar, watch) as line:
        try:
            yield line.show_progress
        except BaseException:
            line.show_stop()
            raise
        line.show_end()


def _notebook_bar() -> type[Any]:
    """Return a bar that is a display of IPython, shown once there is progress or it has run for a while."""
    from IPython.display import display  # which a notebook brings, and nothing else needs

    class Bar(tqdm):
        monitor_interval = 0  # no thread of its own: a process with threads is not copied
        _line: Any = None

        def display(self, msg: str | None = None, pos: int | None = None) -> None:  # noqa: ARG002
            if self._line is None:
                if self.bar_format == _STAGE and self.format_dict["elapsed"] < DELAY:
                    return
                self._line = display({"text/plain": ""}, raw=True, display_id=True)
            self._line.update({"text/plain": str(self) if msg is None else msg}, raw=True)

    return Bar


def is_notebook() -> bool:
    """Return whether the program runs in the kernel of a notebook."""
    shell: Any = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None
