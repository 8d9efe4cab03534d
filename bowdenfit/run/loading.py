"""What a fit loads, where and when, without what of it is never used."""

import sys
import threading
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from types import ModuleType
from typing import Any

# What this process and a copy of it both need; linear algebra compiled by JAX takes its addresses from SciPy.
_COMPUTING = ("jax", "bowdenfit.run.fitting", "scipy.linalg", "scipy.special")
_OF_SCIPY = ("numpy.f2py", "numpy.testing")  # what it takes along with all else that NumPy has
_OF_ARVIZ = (  # what its diagnostics of arrays do without
    "scipy.interpolate",
    "scipy.optimize",
    "scipy.signal",
    "scipy.signal.windows",
    "scipy.sparse",
    "scipy.stats",
)
_DRAWING = (
    "matplotlib.figure",
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
    "matplotlib.backends.backend_pdf",
    "bowdenfit.questions.figures",
    "bowdenfit.pages.page",
    "jinja2",
)


def load(*modules: str, later: Collection[str] = ()) -> None:
    """Load modules.

    Args:
        modules: Their names.
        later: Modules that these name and may never call. A function of them loads them once it is called; none of their
            classes may be needed.
    """
    with _postponed(later):
        for name in modules:
            import_module(name)


class _Later(ModuleType):
    """Stands for a module while others are loaded that name its functions."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *arguments, **options: getattr(import_module(self.__name__), name)(*arguments, **options)


@contextmanager
def _postponed(names: Collection[str]) -> Iterator[None]:
    """What of these is not loaded yet is stood for."""
    standing = {name: _Later(name) for name in names if name not in sys.modules}
    above = {name: vars(sys.modules[name.rpartition(".")[0]]) for name in standing if name.rpartition(".")[0] in sys.modules}
    sys.modules.update(standing)
    for name, package in above.items():
        package[name.rpartition(".")[2]] = standing[name]
    try:
        yield
    finally:
        for name in standing:
            del sys.modules[name]
        for name, package in above.items():
            del package[name.rpartition(".")[2]]


@contextmanager
def _missing(name: str) -> Iterator[None]:
    """A library that others can do without is not there."""
    if name in sys.modules:
        yield
        return
    sys.modules[name] = None  # type: ignore[assignment]  # as Python has it of what cannot be imported
    try:
        yield
    finally:
        del sys.modules[name]


def load_what_computing_needs(is_ours: bool) -> None:
    """Load what this process and copies of it need.

    Args:
        is_ours: Whether nothing else runs in this process, so that nobody sees what is postponed.
    """
    load("numpy")
    load(*_COMPUTING, later=_OF_SCIPY if is_ours else ())


def load_what_drawing_needs() -> None:
    """Load what figures and pages need."""
    from bowdenfit.plots.fonts import take_fonts_apart

    load(*_DRAWING)
    take_fonts_apart()


def load_what_checking_needs() -> None:
    """Load what judges draws, which needs arrays alone: in a process that is all ours, and does nothing else meanwhile."""
    with suppress(Exception):  # what fails here fails where it is needed
        load("numpy")
        with _missing("xarray"):
            load("arviz_stats.base", later=(*_OF_SCIPY, *_OF_ARVIZ))
        load("bowdenfit.questions.check.evidence", "arviz_stats.ecdf_utils", later=("xarray", "arviz_base"))


def load_beside(*modules: str) -> None:
    """Load modules in a thread, which gets its time while XLA compiles; what fails there fails where they are needed."""

    def quietly() -> None:
        with suppress(Exception):
            load(*modules)

    threading.Thread(target=quietly).start()
