"""What runs beside a fit: libraries are loaded while XLA compiles, figures are drawn while files are written."""

import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bowdenfit.results.figure_data import FigureData

_DRAWING = ("bowdenfit.plots.gallery", "bowdenfit.results.figure_data")


class Inline(Executor):
    """Does every job at once, where it is asked for."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **keywords: Any) -> "Future[Any]":
        """The finished job."""
        job: Future[Any] = Future()
        job.set_result(function(*args, **keywords))
        return job


@contextmanager
def draftsman(in_background: bool) -> Iterator[Executor]:
    """Who draws the figures: a process that loads matplotlib while this one computes, or this one, here and now.

    A started process imports the main module again, so only a program that guards its start may ask for the background:
    the command line does, the library does not unless told to.
    """
    if not in_background:
        yield Inline()
        return
    with ProcessPoolExecutor(1, get_context("spawn"), initializer=_ready) as pool:
        pool.submit(len, ())  # the process starts with its first job
        yield pool


def draw(data: "FigureData", folder: Path) -> list[Path]:
    """Draw all figures that apply; loads matplotlib, and no model."""
    from bowdenfit.plots.gallery import draw_all

    return draw_all(data, folder)


def _ready() -> None:
    """Load what drawing needs; an interrupt is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for module in _DRAWING:
        import_module(module)


def load_ahead(*modules: str) -> None:
    """Load modules in a thread, which gets its time while XLA compiles."""
    Thread(target=lambda: [import_module(name) for name in modules], daemon=True).start()
