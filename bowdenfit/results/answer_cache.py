"""The answers that a fit has given, kept in its folder and read back without its draws and its model.

The page of answers carries checksums of itself and of the files from which the answers follow. If one of them has changed, or
another version of bowdenfit wrote them, nothing is read and the question is answered anew.
"""

import json
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any
from zlib import crc32

from bowdenfit.errors import StoreError
from bowdenfit.inputs import refuse_special
from bowdenfit.results.folder import ANSWERS, FIGURE_DATA, FIT, POSTERIOR, read_page, write_text

SCHEMA = 6  # counted up with every change of what one of the questions answers, and of how figures look
CHECKSUM = "crc32"  # of a page, in itself
_PIECE = 1 << 22  # bytes of a file read at once


def write_answers(folder: Path, answers: Mapping[str, Any], fit_page: str) -> None:
    """Write what a fit has answered; everything that it follows from is there already, but for fit.json.

    Args:
        folder: The results folder.
        answers: Plain data, by question.
        fit_page: Text that fit.json will be.
    """
    checksums = {FIT: crc32(fit_page.encode()), **{name: file_checksum(folder / name) for name in (POSTERIOR, FIGURE_DATA)}}
    _write(folder, {"schema": SCHEMA, "version": installed_version("bowdenfit"), "of": checksums, "answers": answers})


def add_answer(folder: Path, question: str, answer: Any) -> None:
    """Add one answer to the kept ones, which stay as they are."""
    page = read_page(folder / ANSWERS)
    del page[CHECKSUM]
    _write(folder, page | {"answers": page["answers"] | {question: answer}})


def _write(folder: Path, page: Mapping[str, Any]) -> None:
    write_text(folder / ANSWERS, json.dumps({CHECKSUM: page_checksum(page), **page}, allow_nan=False) + "\n")


def read_answers(folder: Path, *beside: str) -> dict[str, Any]:
    """Return the kept answers of the fit in a folder, by question; empty if none belong to this very fit.

    Args:
        folder: The results folder.
        beside: Files that must be as they were written too.
    """
    try:
        page = read_page(folder / ANSWERS)
        of_this = (page["schema"], page["version"]) == (SCHEMA, installed_version("bowdenfit"))
        as_written = page.pop(CHECKSUM) == page_checksum(page) and of_this
        same = as_written and all(file_checksum(folder / name) == page["of"][name] for name in (FIT, POSTERIOR, *beside))
        return dict(page["answers"]) if same else {}
    except (StoreError, OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def page_checksum(page: Mapping[str, Any]) -> int:
    """Return the CRC-32 of a page of JSON regardless of spacing; the page carries it as `CHECKSUM`, which is left out."""
    return crc32(json.dumps(page).encode())


def file_checksum(path: Path) -> int | None:
    """Return the CRC-32 of a file; None if there is no file."""
    if not path.exists():
        return None
    refuse_special(path, StoreError)
    checksum = 0
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            checksum = crc32(piece, checksum)
    return checksum


def installed_version(package: str) -> str:
    """Return the installed version of a package; empty if unknown."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""
