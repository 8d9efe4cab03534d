"""The answers that a fit has given, kept in its folder and read back without its draws and its model.

The page of answers carries checksums of itself and of the files from which the answers follow. If one of them has changed, or
another version of bowdenfit wrote them, nothing is read and the question is answered anew. Among the answers are the captions
of the figures that stand in the folder, so that figures which are there and unchanged are copied instead of drawn.
"""

import json
from collections.abc import Collection, Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any
from zlib import crc32

from bowdenfit.errors import StoreError
from bowdenfit.outputs import write_text
from bowdenfit.results.folder import (
    ANSWERS,
    DETAILS_TEXT,
    FIGURE_DATA,
    FIGURES,
    FIT,
    POSTERIOR,
    SUMMARY,
    SUMMARY_TEXT,
    kept_file,
    read_page,
    read_text,
)
from bowdenfit.words import filled, printable

SCHEMA = 10  # counted up with every change of what one of the questions answers, and of how figures look
TROUBLES, COEFFICIENT_TROUBLES = "troubles", "troubles of coefficients"  # keys of the answers: see `Verb.needs_coefficients`
CHECKSUM = "crc32"  # of a page, in itself
_PIECE = 1 << 22  # bytes of a file read at once; a judgement
CAPTIONS = "captions.txt"
TEXT_FILES = (SUMMARY, SUMMARY_TEXT, DETAILS_TEXT)
_DRAWN, _TEXTS = "drawn", "texts"


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
        answers = dict(page["answers"]) if same else {}
        troubles = [*answers.get(TROUBLES, ()), *answers.get(COEFFICIENT_TROUBLES, ())]
        return answers if all(isinstance(trouble, str) for trouble in troubles) else {}
    except (StoreError, OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def page_checksum(page: Mapping[str, Any]) -> int:
    """Return the CRC-32 of a page of JSON regardless of spacing; the page carries it as `CHECKSUM`, which is left out."""
    return crc32(json.dumps(page).encode())


def file_checksum(path: Path) -> int | None:
    """Return the CRC-32 of a file; None if there is no file."""
    if not path.exists():
        return None
    kept_file(path.parent, path.name)
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


def copy_captions(source: Path, target: Path) -> None:
    """Copy the captions of figures that stay in a folder, to be written again with those of others.

    Args:
        source: The folder.
        target: Where others are being written.
    """
    if texts := _read_captions(source):
        write_text(target / CAPTIONS, texts)


def write_captions(captions: Mapping[str, str], folder: Path, order: Iterable[str] = ()) -> Path:
    """Write the captions of some figures, a paragraph each, beside those of the others in the folder.

    Args:
        captions: By figure.
        folder: Where the figures are.
        order: Names of figures in the order of their captions; others follow.
    """
    path = folder / CAPTIONS
    existing = _read_captions(folder).split("\n\n")
    texts = {text.partition(":")[0]: text.strip() for text in existing if text.strip()}
    texts |= {name: printable(filled(" ".join(f"{name}: {text}".split()))) for name, text in captions.items()}
    names = [*(name for name in order if name in texts), *(name for name in texts if name not in set(order))]
    write_text(path, "\n\n".join(texts[name] for name in names) + "\n")
    return path


def _read_captions(folder: Path) -> str:
    """Return the captions that lie in a folder; empty where there are none, or a link to some other text."""
    path = folder / CAPTIONS
    return read_text(path) if path.is_file() and not path.is_symlink() else ""


def record_figure_data(folder: Path) -> None:
    """Record the checksum of what figures show, which has been written since the fit was."""
    page = read_page(folder / ANSWERS)
    del page[CHECKSUM]
    _write(folder, page | {"of": page["of"] | {FIGURE_DATA: file_checksum(folder / FIGURE_DATA)}})


def record_drawn_figures(folder: Path, captions: Mapping[str, str]) -> None:
    """Record which figures have been drawn, with checksums of their files.

    Args:
        folder: The results folder, whose figures have all been drawn.
        captions: Caption of each figure, by its name.
    """
    files = {path.name: file_checksum(path) for path in (folder / FIGURES).iterdir() if path.stem in captions}
    add_answer(folder, _DRAWN, {"with": installed_version("matplotlib"), "captions": dict(captions), "files": files})


def record_texts(folder: Path) -> None:
    """Record checksums of the summary as texts and as JSON, which lie in the folder and are printed as they are."""
    add_answer(folder, _TEXTS, {name: file_checksum(folder / name) for name in TEXT_FILES})


def are_texts_unchanged(folder: Path) -> bool:
    """Return whether the texts of the summary can be printed; not where some are missing, or where another version wrote them.

    Args:
        folder: The results folder.

    Raises:
        StoreError: One has changed since it was written.
    """
    recorded = read_answers(folder).get(_TEXTS)  # nothing where fit.json or the draws are missing or have changed
    if not isinstance(recorded, dict) or not all((folder / name).exists() for name in TEXT_FILES):
        return False
    for name in TEXT_FILES:
        if file_checksum(folder / name) != recorded.get(name):
            raise StoreError(
                f"{folder / name} has changed since it was written (edited or damaged); remove it, and bowdenfit summary says "
                "again what the fit says, or restore it from a copy."
            )
    return True


def captions_if_unchanged(folder: Path, names: Collection[str], endings: Collection[str]) -> dict[str, str] | None:
    """Return all captions by figure name; None unless every requested figure exists as it would be drawn now.

    Args:
        folder: The results folder.
        names: Names of the requested figures; all if empty.
        endings: In which formats.
    """
    page: dict[str, Any] = read_answers(folder).get(_DRAWN, {})
    try:
        if page.get("with") != installed_version("matplotlib"):
            return None
        captions: dict[str, str] = page["captions"]
        if not all(name.isidentifier() and isinstance(text, str) for name, text in captions.items()):
            return None  # a name that leads out of the folder
        files = [f"{name}.{ending}" for name in names or captions for ending in endings]
        same = all(page["files"][file] == file_checksum(folder / FIGURES / file) for file in files)
    except (KeyError, TypeError, AttributeError, StoreError, OSError):  # no such figure, or something else lies there
        return None
    return captions if same else None
