"""The results folder as files: their names, writing them atomically, and not overwriting what exists.

`fit.json` is written last, so a folder that has it is complete. A folder with `chain.checkpoint` alone is an interrupted fit.
"""

import errno
import json
import os
import shutil
import tempfile
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from bowdenfit.arguments import LARGEST_SEED
from bowdenfit.errors import StoreError, disk_error
from bowdenfit.inputs import is_deeper, refuse_special
from bowdenfit.outputs import (
    PARTIAL,
    create_unfinished,
    forget_unfinished,
    refuse_link,
    refuse_links_inside,
    replace_atomically,
)

FIT, SUMMARY = "fit.json", "summary.json"
SUMMARY_TEXT, DETAILS_TEXT = "summary.txt", "details.txt"  # one page, and everything
REPORT = "report.html"
POSTERIOR, CHAIN, FIGURES = "posterior.nc", "chain.checkpoint", "figures"
ANSWERS, FIGURE_DATA = "answers.json", "figures.npz"
REPLICATIONS = "replications.jsonl"  # of a calibration
_LOCK = ".lock"  # there while something is being written
# Judgements: far more than a fit writes. Of JSON a byte may become thirty when it is read, so that this is still a gigabyte.
_LARGEST, _LARGEST_PAGE = 400e6, 40e6  # bytes of a text, and of a page of JSON
_DEEPEST = 40  # levels of a page of JSON; the deepest of a fit has ten
_WRITTEN = (FIT, ANSWERS, SUMMARY, SUMMARY_TEXT, DETAILS_TEXT, REPORT, FIGURE_DATA, POSTERIOR, CHAIN)


@contextmanager
def fill_folder_atomically(folder: Path, last: str = "") -> Iterator[Path]:
    """Yield a temporary folder to write into; its contents move to `folder` when all is written, and are removed otherwise.

    Args:
        folder: What it will be called; what lies there already and is called otherwise stays.
        last: File that says that the others are there: it is gone while they move, and comes last.

    Raises:
        StoreError: It cannot be written, or is a link, as one in the folder of a fit may be.
    """
    refuse_link(folder)
    exists = folder.is_dir()  # perhaps a disk of its own, or one in a folder that may not be written
    missing = _missing_folders(folder.parent)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        name = f".{folder.resolve().name[:40]}."
        place = folder if exists else folder.parent
        temporary = create_unfinished(lambda: Path(tempfile.mkdtemp(prefix=name, suffix=PARTIAL, dir=place)))
        temporary.chmod(0o700)  # whatever the umask is, it can be filled and removed
    except OSError as error:
        _remove_empty(missing)
        raise disk_error(folder, error) from None
    try:
        yield temporary
        if exists:
            if last:
                (folder / last).unlink(missing_ok=True)
            for path in sorted(temporary.iterdir(), key=lambda path: path.name == last):
                path.replace(folder / path.name)
        else:
            temporary.chmod(0o777 & ~_umask())
            temporary.replace(folder)
    except OSError as error:
        raise disk_error(folder, error) from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        forget_unfinished(temporary)


def is_empty(folder: Path) -> bool:
    """Return whether nothing lies in a folder, or nothing but what is left of writing that was ended."""
    return all(_is_partial(path) for path in _contents(folder))


def holds_only_run_files(folder: Path, names: Collection[str]) -> bool:
    """Return whether nothing lies in a folder but what a run of some kind writes, whole or not, and notes (*.md).

    Args:
        folder: The folder, which may be missing.
        names: Names of the files and folders that such a run writes.
    """
    inside = _contents(folder) if folder.is_dir() else ()
    return all(path.name in names or path.suffix == ".md" or _is_partial(path) for path in inside)


def remove_run_files(folder: Path, files: Iterable[str], folders: Iterable[str]) -> None:
    """Remove what a run of some kind wrote, whole or not, and nothing else.

    Args:
        folder: The folder, which nobody writes into meanwhile; it may be missing.
        files: Names of the files of such a run, first the one that says that it has finished.
        folders: Names of the folders of such a run.
    """
    for name in files:
        (folder / name).unlink(missing_ok=True)
    for name in folders:
        refuse_link(folder / name)
        if (folder / name).is_dir():
            shutil.rmtree(folder / name)
    remove_partial(folder)


def remove_partial(folder: Path) -> None:
    """Remove what a run that was ended had not finished writing.

    Args:
        folder: The folder, which nobody writes into meanwhile; it may be missing.
    """
    for path in [path for path in folder.iterdir() if _is_partial(path)] if folder.is_dir() else ():
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()


def _is_partial(path: Path) -> bool:
    return path.name.startswith(".") and path.name.endswith(PARTIAL)


def _umask() -> int:
    """Return the umask, which can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


@contextmanager
def folder_to_write(folder: Path) -> Iterator[Path]:
    """Yield a folder to write into, made if missing.

    Args:
        folder: The folder.

    Raises:
        StoreError: It cannot be made, or something inside cannot be written.
    """
    missing = _missing_folders(folder)
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            _remove_empty(missing)
            raise
        yield folder
    except OSError as error:
        raise disk_error(folder, error) from None


@contextmanager
def file_to_write(path: Path) -> Iterator[Path]:
    """Yield a temporary name for a file; it becomes the file, in a folder made if missing, if nothing went wrong.

    Args:
        path: The file.

    Raises:
        StoreError: It cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replace_atomically(path) as temporary:
            yield temporary
    except OSError as error:
        raise disk_error(path, error) from None


def kept_file(folder: Path, *names: str) -> Path:
    """Path of a file inside a results folder; whatever opens one, in the app too, takes its path from here.

    Args:
        folder: The results folder, which may be a link itself.
        names: Folders inside it, and the file; it may be missing.

    Raises:
        StoreError: One of them is a link, which may lead to any file of this machine, or is not a regular file.
    """
    path = folder
    for name in names:
        path = path / name
        if path.is_symlink():
            raise StoreError(
                f"{path} is a link, and links in a results folder are not followed; put a copy of the file in its place."
            )
    refuse_special(path, StoreError)
    return path


def read_text(path: Path, largest: float = _LARGEST) -> str:
    """Read a text file of a results folder.

    Args:
        path: The file.
        largest: Bytes that it may have.

    Raises:
        StoreError: It is a link, no file, too large, or no text.
        OSError: It is missing, or cannot be read.
    """
    kept_file(path.parent, path.name)
    if path.stat().st_size > largest:
        raise StoreError(f"{path} is larger than {largest / 1e6:.0f} MB: it is damaged; restore the folder from a copy.")
    try:
        return path.read_text(encoding="utf-8")
    except ValueError:
        raise StoreError(f"{path} is damaged: it is not text; fit again, or restore the folder from a copy.") from None


def read_page(path: Path) -> Any:
    """Read a page of JSON of a results folder.

    Raises:
        StoreError: It is a link, no file, too large, nested too deeply, or no JSON.
        OSError: It is missing, or cannot be read.
    """
    try:
        page = json.loads(read_text(path, _LARGEST_PAGE), parse_constant=_refuse_constant)
        if is_deeper(page, _DEEPEST):
            raise ValueError("nested too deeply")
        return page
    except (ValueError, RecursionError):  # no JSON, a number of thousands of digits, NaN, nested too deeply
        raise StoreError(f"{path} is damaged; fit again, or restore the folder from a copy.") from None


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is no JSON, and is not written here")


def refuse_unwritable(target: Path) -> None:
    """Refuse a target that cannot be written, before anything is computed.

    Args:
        target: File or folder; it and folders above it may be missing.

    Raises:
        StoreError: It cannot be made, as far as that can be told without making it.
    """
    existing = target
    try:
        while not existing.exists():
            if existing.is_symlink():
                raise OSError(errno.ENOENT, "it is a broken link")
            existing = existing.parent
        if existing != target and not existing.is_dir():
            raise OSError(errno.ENOTDIR, os.strerror(errno.ENOTDIR))
        if not (existing.is_dir() or existing.is_file()):
            raise OSError(errno.EEXIST, "it is a device or a pipe")
        if not os.access(existing if existing.is_dir() else existing.parent, os.W_OK | os.X_OK):
            raise OSError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        raise disk_error(target, error) from None


def refuse_to_overwrite(folder: Path, force: bool) -> None:
    """Refuse a results folder that is in use, before anything is computed; notes (*.md) may lie there.

    Args:
        folder: The results folder.
        force: Whether an earlier fit there may be replaced.

    Raises:
        StoreError: The folder holds something already.
    """
    if (folder / FIT).exists():
        problem = "holds a finished fit already; add --force to replace it, or name another with --output."
    elif (folder / CHAIN).exists():
        problem = "holds an interrupted fit; go on with --resume, or start over with --force."
    elif not folder.exists():
        return
    elif not folder.is_dir() or not holds_only_run_files(folder, {*_WRITTEN, FIGURES}):
        raise StoreError(f"{folder} exists and is not a results folder; name another with --output.")
    elif any(path.suffix != ".md" for path in _contents(folder)):
        problem = "holds the remains of an unfinished fit; add --force to replace it, or name another with --output."
    else:
        return
    if not force:
        raise StoreError(f"{folder} {problem}")


@contextmanager
def reserve_folder(folder: Path | None) -> Iterator[None]:
    """Lock a results folder, so that no other process writes into it; the lock ends with this process at the latest.

    Args:
        folder: The folder, made if missing; None for none, and nothing is reserved where a file lies in its place.

    Raises:
        StoreError: Another process does, or the folder cannot be made, or links lie in it.
    """
    if folder is None or (folder.exists() and not folder.is_dir()):
        yield
        return
    refuse_links_inside(folder)
    refuse_link(folder / _LOCK)  # which is emptied
    missing = _missing_folders(folder)
    lock = FileLock(folder / _LOCK, timeout=0)
    with folder_to_write(folder):
        try:
            lock.acquire()
        except PermissionError:  # the umask is such that what is made cannot be written
            _remove_empty(missing)
            raise
        except Timeout:
            raise StoreError(
                f"another fit or calibration is being written into {folder}; wait for it, or name another folder with --output."
            ) from None
    try:
        yield
    finally:
        with suppress(OSError):  # while it is held, so that nobody else's goes; Windows removes it by itself
            (folder / _LOCK).unlink()
        lock.release()
        if missing and not any(folder.iterdir()):
            folder.rmdir()


def remove_empty_results(folder: Path) -> None:
    """Remove a results folder in which a fit that was ended had not yet finished a file; any other stays.

    Args:
        folder: The folder, which may be missing, and which nobody writes into meanwhile.
    """
    with suppress(OSError):
        if not folder.is_symlink() and is_empty(folder):
            remove_partial(folder)
            (folder / _LOCK).unlink(missing_ok=True)  # missing where the fit was ended before it held it
            folder.rmdir()


def _missing_folders(folder: Path) -> list[Path]:
    """Return a folder and those around it that do not exist, the inner ones first."""
    return [path for path in (folder, *folder.parents) if not os.path.lexists(path)]


def _remove_empty(folders: Iterable[Path]) -> None:
    """Remove those of some folders that are empty, the inner ones first."""
    for folder in folders:
        with suppress(OSError):
            folder.rmdir()


def _contents(folder: Path) -> list[Path]:
    """Return what lies in a folder, without the lock of whoever is writing into it."""
    return [path for path in folder.iterdir() if path.name != _LOCK]


def remove_earlier_fit(folder: Path) -> None:
    """Remove what an earlier fit wrote, and nothing else; the mark of a finished fit goes first."""
    remove_run_files(folder, _WRITTEN, [FIGURES])


def remove_checkpoint(folder: Path) -> None:
    """Remove the checkpoint of a fit that needs no more draws; one that cannot be removed harms nothing."""
    with suppress(OSError):
        (folder / CHAIN).unlink(missing_ok=True)


def refuse_invalid_seed(seed: Any) -> None:
    """Refuse an invalid seed.

    Raises:
        ValueError: It is no seed.
    """
    if type(seed) is not int or not 0 <= seed <= LARGEST_SEED:
        raise ValueError("no seed")
