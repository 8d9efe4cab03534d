"""Start Python processes that neither import nor follow anything in the working folder.

`python -c` and `python -m` look for modules in the working folder first, then in PYTHONPATH, and only then in the standard
library: an `h5py.py` that came with somebody's data would run. Every child process of bowdenfit is started by this module.
"""

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import chdir, contextmanager
from importlib import import_module
from multiprocessing.context import SpawnContext, SpawnProcess
from pathlib import Path
from threading import RLock

_SETTINGS = {"matplotlibrc": "matplotlib", "arvizrc": "arviz_base"}  # files that libraries read in the working folder
_VARIABLE, _SAFE = "PYTHONPATH", "PYTHONSAFEPATH"
_changing = RLock()


def python_command(function: str, *arguments: str) -> list[str]:
    """Command of a child process that calls one of our functions; it needs `safe_environment()`, too.

    Folders that this process imports from, and Python does not know by itself, come last there.

    Args:
        function: Module and name of the function, such as "bowdenfit.files.isolation:serve".
        arguments: Its arguments.
    """
    module, _, name = function.partition(":")
    program = f"import sys; sys.path += [folder for folder in {_import_folders()!r} if folder not in sys.path]; "
    return [sys.executable, "-P", "-c", f"{program}from {module} import {name}; {name}(*sys.argv[1:])", *arguments]


def safe_environment() -> dict[str, str]:
    """Environment of a Python child process, without PYTHONPATH."""
    return {name: value for name, value in os.environ.items() if name != _VARIABLE}


def _import_folders() -> list[str]:
    """Folders to import from: those of this process without the working folder, and the one that bowdenfit is in."""
    return [*package_folders(), str(Path(__file__).resolve().parents[1])]


def package_folders() -> list[str]:
    """Folders that this process imports from, without the working folder: those in which packages were installed."""
    return _without_working_folder(sys.path)


def _without_working_folder(folders: Iterable[str]) -> list[str]:
    """Absolute folders other than the working folder."""
    working_folder = os.path.realpath(Path.cwd())
    return [folder for folder in folders if Path(folder).is_absolute() and os.path.realpath(folder) != working_folder]


@contextmanager
def starting_safely(keep_paths: bool = False) -> Iterator[None]:
    """Give this process a safe environment in a `with` block, for libraries that start Python child processes.

    Args:
        keep_paths: Whether PYTHONPATH stays, without the working folder: on a cluster, it may lead to the libraries.
    """
    with _changing:
        saved = {name: os.environ.get(name) for name in (_VARIABLE, _SAFE)}
        folders = _without_working_folder(os.environ.pop(_VARIABLE, "").split(os.pathsep)) if keep_paths else []
        os.environ |= {_SAFE: "1", **({_VARIABLE: os.pathsep.join(folders)} if folders else {})}
        try:
            yield
        finally:
            for name in saved:
                os.environ.pop(name, None)
            os.environ |= {name: value for name, value in saved.items() if value is not None}


def ignore_local_settings() -> None:
    """Load libraries without their settings in the working folder, which may be somebody else's and are partly evaluated.

    Called before threads start, because the working folder is changed for a moment.
    """
    for file, library in _SETTINGS.items():
        if os.path.lexists(file):
            with chdir(Path(__file__).parent):
                import_module(library)


class SafeProcess(SpawnProcess):
    """A process of `multiprocessing` that starts as `starting_safely` says, and so does the tracker of its resources."""

    def start(self) -> None:
        """Start it."""
        with starting_safely():
            super().start()


class SafeContext(SpawnContext):
    """A context of `multiprocessing` whose processes are `SafeProcess`."""

    Process = SafeProcess
