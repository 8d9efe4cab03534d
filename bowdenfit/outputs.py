"""Writing files: whole or not at all, and never through a link that somebody left in the folder."""

import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkdtemp
from threading import Lock
from typing import Any

from bowdenfit.errors import StoreError
from bowdenfit.words import shown

PARTIAL = ".partial"  # ends the names of what is being written
_LONGEST = 40  # characters of a file's name in its temporary name; a judgement
_PATIENCE = 0.2  # s that the end of the process waits for a disk that does not answer; a judgement

_unfinished: set[Path] = set()  # temporary files and folders of this process that are being written
_creating = Lock()


@contextmanager
def replace_atomically(path: Path) -> Iterator[Path]:
    """Yield a new, empty file beside `path` to write to; it becomes `path` only if nothing went wrong.

    Its name cannot be guessed and is new, so that nobody can have planted a link there. Of a link at `path` the link itself is
    replaced, not what it leads to.

    Raises:
        StoreError: A device, a pipe or a folder would be replaced by a file.
    """
    if path.exists() and not path.is_file():
        raise StoreError(f"{path} is not a file and stays as it is; name a new file, or one that may be replaced.")
    temporary = path.with_name(f".{path.name[:_LONGEST]}.{secrets.token_hex(8)}{PARTIAL}")
    try:
        create_unfinished(lambda: _touch(temporary))
        yield temporary
        os.replace(temporary, path)  # noqa: PTH105  (Path.replace says the same; this is the usual word for it)
    finally:
        temporary.unlink(missing_ok=True)
        forget_unfinished(temporary)


def _touch(path: Path) -> Path:
    """Create an empty file where nothing is; return its path."""
    path.touch(exist_ok=False)
    return path


def create_unfinished(create: Callable[[], Path]) -> Path:
    """Create a temporary file or folder that `remove_unfinished` removes; return its path.

    Args:
        create: Makes it, under a name that nothing else has, and returns its path.
    """
    with _creating:
        temporary = create()
        _unfinished.add(temporary)
    return temporary


def forget_unfinished(temporary: Path) -> None:
    """Forget a temporary file or folder that has become what it was written for, or is removed."""
    _unfinished.discard(temporary)


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Yield an empty folder among the system's temporary ones, which is removed at the end, also by `remove_unfinished`."""
    folder = create_unfinished(lambda: Path(mkdtemp(prefix="bowdenfit-")))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        forget_unfinished(folder)


def remove_unfinished() -> None:
    """Remove every temporary file and folder of this process, which ends right afterwards; no further one can be created.

    Other threads may still be writing them; nothing that another process writes is touched.
    """
    _creating.acquire(timeout=_PATIENCE)  # for good
    for temporary in tuple(_unfinished):
        if temporary.is_dir() and not temporary.is_symlink():
            shutil.rmtree(temporary, ignore_errors=True)
        else:
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file whole."""
    with replace_atomically(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


@contextmanager
def open_in_place(path: Path, mode: str, **options: Any) -> Iterator[Any]:
    """Open a file that is changed where it lies; it is closed at the end of the `with` block.

    Args:
        path: The file.
        mode: As for `open`.
        options: As for `open`.

    Raises:
        StoreError: It is a link, or has a second name elsewhere.
    """
    refuse_link(path)
    with open(path, mode, opener=_open_without_following, **options) as file:
        yield file


def _open_without_following(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0))  # Windows has no such flag


def refuse_link(path: Path) -> None:
    """Refuse to write through a link, or into a file that has a second name elsewhere.

    Args:
        path: File or folder; it may be missing.

    Raises:
        StoreError: It is such a link.
    """
    if path.is_symlink():
        leads_to = f"is a link to {shown(str(path.readlink()))}"
    elif path.is_file() and path.stat().st_nlink > 1:
        leads_to = "is a file with a second name elsewhere (a hard link)"
    else:
        return
    raise StoreError(
        f"{path} {leads_to}, and writing here would change what is there. Put a copy in its place or remove it, or name "
        "another folder with --output."
    )


def refuse_links_inside(folder: Path) -> None:
    """Refuse a folder to write into in which links lie; notes (*.md) may be links.

    Raises:
        StoreError: One does.
    """
    for path in sorted(folder.iterdir()) if folder.is_dir() else ():
        if path.is_symlink() and path.suffix != ".md":
            refuse_link(path)
