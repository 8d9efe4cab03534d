"""Other processes and threads that take work off a fit: statistics, files and figures need no model and no JAX."""

import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from threading import Thread
from typing import Any

STATISTICS = (
    "arviz_stats.base",
    "arviz_base",
    "h5netcdf",
    "bowdenfit.inference.diagnostics",
    "bowdenfit.results.netcdf",
)
DRAWING = ("bowdenfit.plots.gallery",)
_DRAFTSMEN = 2


class Inline(Executor):
    """Does every job at once, where it is asked for."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **keywords: Any) -> "Future[Any]":
        """The finished job."""
        job: Future[Any] = Future()
        job.set_result(function(*args, **keywords))
        return job


@dataclass(frozen=True)
class Assistants:
    """Who does what beside the fit itself.

    Args:
        statistics: Diagnostics and posterior.nc, which need ArviZ.
        drawing: Figures, which need matplotlib.
        n_drawing: How many figures can be drawn at a time.
    """

    statistics: Executor
    drawing: Executor
    n_drawing: int


@contextmanager
def assistants(in_background: bool) -> Iterator[Assistants]:
    """Assistants in other processes, which load their libraries while this one computes, or here and now.

    A started process imports the main module again, so only a program that guards its start may ask for the background:
    the command line does, the library does not unless told to.
    """
    if not in_background:
        yield Assistants(Inline(), Inline(), 1)
        return
    start = get_context("spawn")
    with (
        ProcessPoolExecutor(1, start, initializer=_ready, initargs=(STATISTICS,)) as statistics,
        ProcessPoolExecutor(_DRAFTSMEN, start, initializer=_ready, initargs=(DRAWING,)) as drawing,
    ):
        for pool, n in ((statistics, 1), (drawing, _DRAFTSMEN)):
            for _ in range(n):
                pool.submit(len, ())  # a process starts with its first job
        yield Assistants(statistics, drawing, _DRAFTSMEN)


def draw_share(data: Any, folder: Path, share: int, of: int) -> None:
    """Draw every so manieth figure of a fit; all shares together are all figures."""
    from bowdenfit.plots.gallery import FIGURES, draw_all

    draw_all(data, folder, names=tuple(FIGURES)[share::of])


def _ready(modules: tuple[str, ...]) -> None:
    """Load what the jobs need; an interrupt is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for module in modules:
        import_module(module)


def load_ahead(*modules: str) -> None:
    """Load modules in a thread, which gets its time while XLA compiles."""
    Thread(target=lambda: [import_module(name) for name in modules], daemon=True).start()
