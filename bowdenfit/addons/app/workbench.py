"""What lies on the bench: the folder with its data sets and fits, the fits that run, and those that were opened."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from secrets import token_hex
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import bowdenfit as bf
from bowdenfit.addons.app.draft import Draft, is_module_name, is_reserved
from bowdenfit.addons.app.fit_job import FitJob, FitRequest
from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.errors import BowdenfitError, UsageError, disk_error
from bowdenfit.inputs import sha256_of
from bowdenfit.outputs import refuse_link
from bowdenfit.plots.write import PNG
from bowdenfit.questions.figures import FIGURES, collect_figure_data, read_figure_data, warning_mark, write_figure_files
from bowdenfit.results.folder import CHAIN, kept_file
from bowdenfit.results.folder import FIGURES as FIGURES_FOLDER
from bowdenfit.results.folder import FIT as FIT_FILE
from bowdenfit.words import shown

if TYPE_CHECKING:
    from bowdenfit.finished_fit import Fit

Answer = TypeVar("Answer")
FITS = "fits"  # the folder in which the command line keeps them, too
BIN = ".deleted"  # in it, where fits go that are deleted
_HERE = "."  # the data set that the folder itself is
_NAME = re.compile(r"[^\W_][\w .()+-]{0,79}")  # of folders that are made: no separator, no leading dot, one line
_MOST_OPEN = 4  # fits that are kept in memory; a judgement


@dataclass(frozen=True)
class KeptFit:
    """A fit in the folder.

    Args:
        name: Name of its folder.
        finished: Whether it has its answer; else it was interrupted.
    """

    name: str
    finished: bool


class Watched(Protocol):
    """A data set that is watched."""

    def stop(self) -> None:
        """Watch it no longer."""
        ...


class Workbench:
    """The folder of the app, the same for all tabs.

    Args:
        folder: Where data sets and fits lie.
        scratch: Folder for temporary files, which goes with the app.
    """

    def __init__(self, folder: Path, scratch: Path) -> None:
        self.folder, self._scratch = folder.resolve(), scratch
        self.jobs: dict[str, FitJob] = {}
        self.drafts: dict[str, Draft] = {}
        self.watched: dict[str, Watched] = {}
        self._open: dict[str, tuple[int, Fit]] = {}
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="answers")  # one, as libraries of files are not made for more

    def new_draft(self) -> Draft:
        """Return a new data set that is to be brought."""
        folder = self._scratch / token_hex(4)
        folder.mkdir()
        draft = Draft(folder)
        self.drafts[draft.key] = draft
        return draft

    def data_sets(self) -> list[str]:
        """Return the data sets in the folder, by name."""
        inside = [name for name in self._data_set_folders() if name.isprintable()]
        return [_HERE, *inside] if (self.folder / DESCRIPTION_FILE).is_file() else inside

    def unnamed_data_sets(self) -> int:
        """Number of data sets whose folder has a name that no address can have."""
        return sum(not name.isprintable() for name in self._data_set_folders())

    def _data_set_folders(self) -> list[str]:
        return [path.name for path in sorted(self.folder.iterdir()) if (path / DESCRIPTION_FILE).is_file()]

    def data_set(self, name: str) -> Path:
        """Return the folder of a data set.

        Raises:
            UsageError: There is none of that name.
        """
        if name not in self.data_sets():
            raise UsageError(f"there is no data set {shown(name)} in {self.folder.name} any more; go back to the start.")
        return self.folder if name == _HERE else self.folder / name

    def title_of(self, name: str) -> str:
        """Return what a data set is called."""
        return self.folder.name if name == _HERE else name

    def data_set_of(self, fit: Fit, name: str) -> str:
        """Return the data set that a fit is of, by the checksum of its description; empty where it does not lie here.

        Args:
            fit: The fit.
            name: Name of the fit, which decides between data sets with the same description.
        """
        checksum = fit.dataset.sha256.get(DESCRIPTION_FILE)
        names = [one for one in self.data_sets() if file_checksum(self.data_set(one) / DESCRIPTION_FILE) == checksum]
        return max(names, key=lambda one: (name.startswith(self.title_of(one)), len(one)), default="")

    def fits(self) -> list[KeptFit]:
        """Return the fits that are kept, those that were interrupted among them."""
        place = self.folder / FITS
        folders = [path for path in sorted(place.iterdir()) if path.is_dir()] if place.is_dir() else []
        kept = [KeptFit(path.name, (path / FIT_FILE).is_file()) for path in folders if path.name.isprintable()]
        return [fit for fit in kept if fit.finished or (place / fit.name / CHAIN).is_file()]

    def results(self, name: str) -> Path:
        """Return the results folder of a fit that is kept or runs.

        Raises:
            UsageError: There is none of that name.
        """
        job = self.jobs.get(name)
        if (job is None or job.is_void) and name not in {fit.name for fit in self.fits()}:
            raise UsageError(f"there is no fit {shown(name)} in {self.folder.name} any more; go back to the start.")
        return self.folder / FITS / name

    def running_fit(self, name: str) -> str:
        """Name of a fit of a data set that runs; empty where none does."""
        folder = self.data_set(name)
        return next((fit for fit, job in self.jobs.items() if job.running and job.request.dataset == folder), "")

    def rename_fit(self, name: str, new_name: str) -> None:
        """Give a fit that does not run another name.

        Raises:
            UsageError: There is none of that name, it runs, or the new name cannot be one or is in use.
            StoreError: It cannot be renamed.
        """
        refuse_folder_name(new_name)
        if (self.folder / FITS / new_name).exists():
            raise UsageError(f"there is {shown(new_name)} already; write another name.")
        self._move_fit(name, self.folder / FITS / new_name)

    def discard_fit(self, name: str) -> Path:
        """Put a fit that does not run into the bin, and return where it lies there.

        Raises:
            UsageError, StoreError: See `rename_fit`.
        """
        names = [name, *(f"{name}-{number}" for number in range(2, 1000))]
        place = next(place for place in (self.folder / FITS / BIN / free for free in names) if not place.exists())
        self._move_fit(name, place)
        return place

    def _move_fit(self, name: str, place: Path) -> None:
        folder, job = self.results(name), self.jobs.get(name)
        if job is not None and job.running:
            raise UsageError(f"the fit {name} runs; wait for it, or cancel it first.")
        try:
            refuse_link(folder)
            place.parent.mkdir(exist_ok=True)
            refuse_link(place.parent)
            folder.rename(place)
        except OSError as error:
            raise disk_error(folder, error) from None
        self.jobs.pop(name, None)
        self._open.pop(name, None)

    def free_name(self, name: str) -> str:
        """Return the name of a data set, or with a number behind it, that no fit has yet."""
        title = self.title_of(name)
        names = [title, *(f"{title}-{number}" for number in range(2, 1000))]
        taken = {name for name, job in self.jobs.items() if not job.is_void}
        return next(free for free in names if not (self.folder / FITS / free).exists() and free not in taken)

    def request_fit(self, name: str, data_set: str, seed: int | None = None, **changes: Any) -> FitRequest:
        """Return the request for a fit, or for going on with one.

        Args:
            name: Name of the fit.
            data_set: Which.
            seed: Random seed.
            changes: Other arguments of `FitRequest`.

        Raises:
            UsageError: The name is not one of a folder, or there is no such data set.
        """
        refuse_folder_name(name)
        return FitRequest(self.data_set(data_set), self.folder / FITS / name, seed, **changes)

    def start_fit(self, request: FitRequest) -> FitJob:
        """Start a fit, or go on with one.

        Raises:
            UsageError: It runs already.
        """
        name = request.output.name
        job = self.jobs.get(name)
        if job is not None and job.running:
            raise UsageError(f"the fit {name} runs already; wait for it, or cancel it.")
        self.jobs[name] = FitJob(request)
        return self.jobs[name]

    async def compute(self, function: Callable[..., Answer], *arguments: object) -> Answer:
        """Return what a function returns that takes a while, in the thread for that."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, function, *arguments)

    async def open_fit(self, name: str) -> Fit:
        """Return a fit, read from its folder unless that has not changed since.

        Raises:
            StoreError: The folder is damaged.
        """
        folder = self.results(name)
        changed = (folder / FIT_FILE).stat().st_mtime_ns
        known = self._open.get(name)
        if known is None or known[0] != changed:
            known = (changed, await self.compute(bf.Fit.load, folder))
            self._open = dict([*((key, kept) for key, kept in self._open.items() if key != name), (name, known)][-_MOST_OPEN:])
        return known[1]

    async def figure_data(self, name: str) -> dict[str, Any]:
        """Return what the figures of a fit show, by their names: kept beside it, or worked out.

        Raises:
            StoreError: The folder is damaged.
        """
        kept = await self.compute(read_figure_data, self.results(name))
        return kept or dict(await self.compute(_collect_figure_data, await self.open_fit(name)))

    async def draw_figure(self, name: str, figure: str) -> bytes:
        """Return a figure of a fit as PNG, drawn as `bowdenfit plot` draws it where it does not lie in the folder.

        Raises:
            UsageError: There is no such figure.
            StoreError: The folder is damaged.
        """
        if figure not in FIGURES:
            raise UsageError(f"there is no figure {shown(figure)}.")
        drawing = kept_file(self.results(name), FIGURES_FOLDER, f"{figure}.png")
        if drawing.is_file():
            return drawing.read_bytes()
        data = (await self.figure_data(name)).get(figure)
        if data is None:
            raise UsageError(f"this fit has nothing to show in the figure {figure}.")
        fit = await self.open_fit(name)
        return await self.compute(_draw, figure, data, fit)

    def close(self) -> None:
        """End all fits that run; what they have sampled is kept."""
        for job in self.jobs.values():
            if job.running:
                job.cancel()
        for bench in self.watched.values():
            bench.stop()
        self._thread.shutdown(wait=False, cancel_futures=True)


def file_checksum(path: Path) -> str:
    """Checksum of a file, as a fit keeps it; empty of none that can be read.

    Args:
        path: The file.
    """
    try:
        status = path.stat()
        return sha256_of(path) if path.is_dir() else _digest(path, status.st_mtime_ns, status.st_size)
    except (OSError, BowdenfitError):
        return ""


@lru_cache(1000)
def _digest(path: Path, _: int, __: int) -> str:
    """Checksum of a file that is as it was at a time, with a size."""
    return sha256_of(path)


def _collect_figure_data(fit: Fit) -> dict[str, Any]:
    return dict(collect_figure_data(fit))


def _draw(figure: str, data: Any, fit: Fit) -> bytes:
    """Return a figure as PNG."""
    with TemporaryDirectory() as folder:
        (file,) = write_figure_files(figure, data, Path(folder), (PNG,), fit.name, mark=warning_mark(fit.verdict().troubles))
        return file.read_bytes()


def refuse_folder_name(name: str) -> None:
    """Refuse a name that a new folder may not have.

    Raises:
        UsageError: It has a separator, begins with a dot, is reserved on some systems, or is too long.
    """
    plain = name.strip()
    if plain != name or not _NAME.fullmatch(name) or name.endswith((".", " ")) or is_reserved(name):
        raise UsageError(f"{shown(name)} cannot be the name of a folder; use letters, digits, blanks and - _ . ( ) +.")


def refuse_module_name(name: str) -> None:
    """Refuse a name that a new data set may not have, because Python started next to it would load the data set as a module.

    Raises:
        UsageError: It is the name of a module.
    """
    if is_module_name(name):
        raise UsageError(
            f"{shown(name)} is also the name of a Python module, and a program started next to the folder could load it "
            f"instead; use another name, such as {name}-cable."
        )
