"""What a fit has answered, kept in its folder: read back without its draws and its model, and only beside that very fit.

The page of answers carries checksums of itself and of the files that the answers follow from. Where one of them is not as
it was written, or another bowdenfit wrote them, nothing is read, and the question is answered anew.
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

SCHEMA = 3  # counted up with every change of what one of the questions answers
CHECKSUM = "crc32"  # of a page, in itself
_PIECE = 1 << 22  # bytes of a file read at once


def keep(folder: Path, answers: Mapping[str, Any], fit_page: str) -> None:
    """Write what a fit has answered; everything that it follows from is there already, but for fit.json.

    Args:
        folder: The results folder.
        answers: Plain data, by question.
        fit_page: Text that fit.json will be.
    """
    of = {FIT: crc32(fit_page.encode()), **{name: checksum(folder / name) for name in (POSTERIOR, FIGURE_DATA)}}
    page = {"schema": SCHEMA, "version": _version(), "of": of, "answers": answers}
    write_text(folder / ANSWERS, json.dumps({CHECKSUM: own_checksum(page), **page}, allow_nan=False) + "\n")


def kept(folder: Path, *beside: str) -> dict[str, Any]:
    """What the fit in a folder has answered, by question; empty where nothing is kept of just this fit.

    Args:
        folder: The results folder.
        beside: Files that must be as they were written too.
    """
    try:
        page = read_page(folder / ANSWERS)
        as_written = page.pop(CHECKSUM) == own_checksum(page) and (page["schema"], page["version"]) == (SCHEMA, _version())
        same = as_written and all(checksum(folder / name) == page["of"][name] for name in (FIT, POSTERIOR, *beside))
        return dict(page["answers"]) if same else {}
    except (StoreError, OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def own_checksum(page: Mapping[str, Any]) -> int:
    """Of what a page of JSON says, however it is spaced; the page carries it as its `CHECKSUM`, which is no part of it."""
    return crc32(json.dumps(page).encode())


def checksum(path: Path) -> int | None:
    """Of a file; None where there is none."""
    if not path.exists():
        return None
    refuse_special(path, StoreError)
    checksum = 0
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            checksum = crc32(piece, checksum)
    return checksum


def _version() -> str:
    try:
        return version("bowdenfit")
    except PackageNotFoundError:
        return ""
