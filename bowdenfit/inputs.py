"""What may be opened at all: regular files of a size that fits what they are, found by patterns that end."""

import errno
import hashlib
import math
import os
import re
import stat
import tomllib
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from bowdenfit.errors import BowdenfitError, DatasetError, DescriptionError
from bowdenfit.words import shown

if TYPE_CHECKING:
    from numpy.lib.npyio import NpzFile

_LARGEST_TOML = 4_000_000  # bytes; a description has some thousand
_MOST_ENTRIES = 10_000  # judged: of one list or table; more take minutes to be refused one by one
_MOST_DOTS = 300  # of a key, or a sentence
_DEEPEST = 12  # keys below keys; a description has four
_LONGEST_PATTERN = 1000  # characters; names of files have 255 at most
_NO_NAME = {errno.EINVAL, errno.ENAMETOOLONG, errno.ELOOP}
_SYSTEM_FOLDERS = ("/proc/", "/sys/")  # some of these wait for ever, some never end
_ZIP = b"PK\x03\x04"  # how an archive with something in it begins
_SPECIAL = {
    stat.S_ISFIFO: "a named pipe",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
    stat.S_ISSOCK: "a socket",
}


def refuse_special(path: Path, error: Callable[[str], BowdenfitError] = DatasetError) -> None:
    """Refuse what is neither a file nor a folder, before it is opened: a pipe waits for ever, a device never ends.

    Args:
        path: To be opened; links are followed.
        error: Makes the error that is raised from a sentence.

    Raises:
        BowdenfitError: Of that type.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as failure:  # a zero byte is a ValueError
        if getattr(failure, "errno", errno.EINVAL) in _NO_NAME:
            raise error(
                f"{shown(str(path))} cannot be the name of a file ({getattr(failure, 'strerror', failure)}); write it as it is "
                "seen from the folder of cable.toml."
            ) from None
        return  # whoever opens it says that it is missing
    if stat.S_ISREG(mode) and os.path.realpath(path).startswith(_SYSTEM_FOLDERS):
        raise error(f"{path.name} is not a file on disk but is made by the system as it is read; copy it, and name the copy.")
    for is_so, what in _SPECIAL.items():
        if is_so(mode):
            raise error(f"{path.name} is {what}, not a file; copy what it gives into a file, and name that.")


def sha256_of(path: Path) -> str:
    """Return the checksum of a file, or of the names and contents of those in a folder.

    Raises:
        DatasetError: It is neither.
        OSError: It cannot be read.
    """
    if path.is_dir():
        inside = sorted(file for file in path.rglob("*") if file.is_file())
        listed = "".join(f"{sha256_of(file)}  {file.relative_to(path)}\n" for file in inside)
        return hashlib.sha256(listed.encode(errors="surrogateescape")).hexdigest()
    refuse_special(path)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextmanager
def damage_as(error: BowdenfitError) -> Iterator[None]:
    """Whatever a library stumbles over in a damaged file is that error: it may be of any kind, and say anything.

    Args:
        error: Error raised instead; errors of ours, of the system and for want of memory stay what they are.
    """
    try:
        yield
    except (BowdenfitError, MemoryError):
        raise
    except Exception as failure:
        if isinstance(failure, OSError) and failure.errno is not None and failure.filename is not None:
            raise
        raise error from failure


@contextmanager
def open_arrays(file: BinaryIO) -> Iterator["NpzFile"]:
    """Open an archive of arrays that bowdenfit has written; pickled ones are refused.

    Args:
        file: Open where the archive begins.

    Raises:
        ValueError: It is no such archive: of a single array NumPy would make room for whatever that says that it holds.
    """
    import numpy as np  # here, because `--help` does not load NumPy

    start = file.tell()
    if file.read(len(_ZIP)) != _ZIP:
        raise ValueError("no archive of arrays")
    file.seek(start)
    with np.load(file) as arrays:
        _refuse_packed(arrays)
        yield arrays


def _refuse_packed(archive: "NpzFile") -> None:
    """Refuse arrays that ask for more than they bring: what is written here is never packed, and as long as it says.

    Args:
        archive: Arrays that NumPy has opened.

    Raises:
        ValueError: One is packed, says that it is larger than what is there, or shares its bytes with another.
    """
    from numpy.lib import format as npy  # here, because `--help` does not load NumPy

    headers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    zipped = archive.zip
    assert zipped is not None  # it is open
    end = 0
    for entry in sorted(zipped.infolist(), key=lambda entry: entry.header_offset):
        if entry.header_offset < end:
            raise ValueError(f"{entry.filename} shares bytes with another array")
        end = entry.header_offset + entry.file_size
        if entry.compress_type != zipfile.ZIP_STORED:
            raise ValueError(f"{entry.filename} is packed")
        with zipped.open(entry) as stream:  # of a member that is longer than the file nothing is read
            shape, _, kind = headers[npy.read_magic(stream)](stream)
        if math.prod(shape) * kind.itemsize > entry.file_size:
            raise ValueError(f"{entry.filename} says that it is larger than it is")


def read_toml_file(path: Path, remedy: str = "") -> tuple[str, dict[str, Any]]:
    """Return text and plain data of a TOML file.

    Args:
        path: The file.
        remedy: Fix if there is none.

    Raises:
        DescriptionError: It is missing, cannot be read, or is no TOML that a person would write.
    """
    refuse_special(path, DescriptionError)
    try:
        if path.stat().st_size > _LARGEST_TOML:
            raise DescriptionError(f"{path.name} is larger than 4 MB; a TOML file that describes a cable has a few kB.")
        text = path.read_text(encoding="utf-8-sig")
        if any(part.count(".") > _MOST_DOTS for part in re.split(r"[=,\n]", text)):  # tomllib's time grows with their square
            raise RecursionError
        page = tomllib.loads(text)
    except FileNotFoundError:
        raise DescriptionError(f"{path} does not exist; {remedy or 'check the spelling and the folder'}.") from None
    except OSError as error:
        raise DescriptionError(f"{path} cannot be read ({error.strerror or os.strerror(error.errno or 0)}).") from None
    except RecursionError:
        raise DescriptionError(f"{path.name} is nested too deeply; a description has at most {_DEEPEST} levels.") from None
    except ValueError as error:  # no UTF-8, no TOML, a number of thousands of digits, an impossible path
        raise DescriptionError(f"{path.name} is not valid TOML: {' '.join(str(error).split())[:200]}.") from None
    if is_deeper(page, _DEEPEST):
        raise DescriptionError(f"{path.name} is nested too deeply; a description has at most {_DEEPEST} levels.")
    if crowded := _find_crowded(page):
        key, count = crowded
        raise DescriptionError(
            f"{path.name}{f', {shown(key)}' if key else ''}: one list or table has {count:,} entries, and at most "
            f"{_MOST_ENTRIES:,} are read; the usual cause is a list that a program wrote out: keep the entries that matter."
        )
    return text, page


def _find_crowded(page: Any, key: str = "") -> tuple[str, int] | None:
    """Return the key and the number of entries of the first list or table that has too many; None if none has."""
    if not isinstance(page, dict | list):
        return None
    if len(page) > _MOST_ENTRIES:
        return key, len(page)
    parts = page.items() if isinstance(page, dict) else ((key, part) for part in page)
    return next((crowded for name, part in parts if (crowded := _find_crowded(part, name))), None)


def is_deeper(page: Any, levels: int) -> bool:
    """Return whether dictionaries and lists of plain data lie in more than so many others."""
    layer: list[Any] = [page] if isinstance(page, dict | list) else []
    for _ in range(levels):
        inside = [part for x in layer for part in (x.values() if isinstance(x, dict) else x)]
        layer = [part for part in inside if isinstance(part, dict | list)]
        if not layer:
            return False
    return True


def match_files(folder: Path, pattern: str) -> list[Path]:
    """Return files that a pattern names, in sorted order.

    Args:
        folder: Where the pattern starts.
        pattern: With *, ? and [...]; ** for folders at any depth once.

    Raises:
        DescriptionError: The pattern starts elsewhere, or would take too long.
    """
    if pattern.startswith(("/", "~", "\\")) or "\0" in pattern or ":" in pattern[:3]:
        raise DescriptionError(
            f"cable.toml: the pattern {shown(pattern)} does not start in the folder of cable.toml; write it as seen from "
            'there, such as "recordings/*.csv".'
        )
    if pattern.count("**") > 1 or pattern.count("*") > 12 or len(pattern) > _LONGEST_PATTERN:
        what = "is too long" if len(pattern) > _LONGEST_PATTERN else "has too many stars"
        raise DescriptionError(
            f'cable.toml: the pattern {pattern[:60]!r} {what}; name the files, or write "recordings/*.csv".'
        )
    return sorted(folder.glob(pattern))
