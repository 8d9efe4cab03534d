"""What runs beside a fit: a stopwatch, libraries loaded while XLA compiles, figures drawn while files are written."""

import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from multiprocessing import get_context
from threading import Thread
from typing import Any

STATISTICS = (
    "arviz_stats.base",
    "arviz_base",
    "h5netcdf",
    "bowdenfit.inference.diagnostics",
    "bowdenfit.results.netcdf",
)
DRAWING = (
    "matplotlib.figure",
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
    "bowdenfit.questions.figures",
)


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
    """

    statistics: Executor
    drawing: Executor


@contextmanager
def assistants(statistics: bool, drawing: bool) -> Iterator[Assistants]:
    """Assistants that load their libraries in processes of their own while this one computes, or work here and now.

    A started process imports the main module again, so only a program that guards its start may ask for one: the command
    line does, the library does not unless told to.
    """
    with ExitStack() as open_pools:
        pools = [
            open_pools.enter_context(_process(modules)) if wanted else Inline()
            for wanted, modules in ((statistics, STATISTICS), (drawing, DRAWING))
        ]
        yield Assistants(*pools)


def _process(modules: tuple[str, ...]) -> Executor:
    """A process that loads what its jobs need."""
    pool = ProcessPoolExecutor(1, get_context("spawn"), initializer=_ready, initargs=(modules,))
    pool.submit(len, ())  # it starts with its first job
    return pool


def _ready(modules: tuple[str, ...]) -> None:
    """Load what the jobs need; an interrupt is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for module in modules:
        import_module(module)


def load_ahead(*modules: str) -> None:
    """Load modules in a thread, which gets its time while XLA compiles."""
    Thread(target=lambda: [import_module(name) for name in modules], daemon=True).start()


@dataclass
class Stopwatch:
    """Seconds spent in each stage of a fit."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what runs inside."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
