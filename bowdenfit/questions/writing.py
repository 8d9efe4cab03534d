"""Writing an answer to a folder: for people, as a figure, and for programs; in one way for all questions."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bowdenfit.display import Display, Rows

if TYPE_CHECKING:
    from bowdenfit.pages.section import Page
    from bowdenfit.questions.figure_files import AnswerFigure

PAGE, TEXT = "json", "txt"


class Files(Display, list[Path]):
    """Files that were written."""

    def __str__(self) -> str:
        return "\n".join(map(str, self))

    def _table(self) -> Rows:
        return [{"file": str(path)} for path in self], {}


def files_of(folder: str | Path, name: str) -> list[Path]:
    """The files of an answer.

    Args:
        folder: Where they are.
        name: Of the answer.
    """
    return [*(Path(folder) / f"{name}.{ending}" for ending in (PAGE, TEXT)), *figures_of(folder, name)]


def figures_of(folder: str | Path, name: str) -> list[Path]:
    """The figure of an answer in every format.

    Args:
        folder: Where they are.
        name: Of the answer.
    """
    from bowdenfit.plots.write import FORMATS

    return [Path(folder) / f"{name}.{ending}" for ending in FORMATS]


def refuse_to_replace(folder: Path, name: str, what: str, force: bool) -> None:
    """Stop before anything is computed if an answer would have no place.

    Args:
        folder: Where it would go.
        name: Of the answer.
        what: What it is, in words without an article.
        force: Whether an earlier one there may be replaced.

    Raises:
        StoreError: The folder holds something else already, or an earlier answer.
    """
    from bowdenfit.errors import StoreError
    from bowdenfit.results.folder import is_empty

    if not folder.exists() or (folder.is_dir() and is_empty(folder)):
        return
    if not (folder / f"{name}.{PAGE}").exists():
        raise StoreError(f"{folder} exists and holds no {what}; name another with --output.")
    if not force:
        raise StoreError(f"{folder} holds a {what} already; add --force to replace it, or name another with --output.")


def write_answer(
    folder: str | Path,
    name: str,
    answer: Any,
    text: str,
    figures: "Mapping[str, AnswerFigure]",
    cable: str = "",
    page: "Page | None" = None,
) -> list[Path]:
    """Write an answer as text, as figures and, last, as JSON: all of them or none; a folder that has the JSON has everything.

    Args:
        folder: Where to; made if missing. Earlier files of these names are replaced.
        name: Of the files.
        answer: The answer.
        text: For people.
        figures: Files of its figures, by their names.
        cable: Name of the cable; empty where there are several.
        page: The same as a page with these figures; none is written without one.

    Returns:
        The files written.

    Raises:
        StoreError: The folder cannot be written.
    """
    from bowdenfit.questions.figure_files import write_figure
    from bowdenfit.results.figures_folder import copy_captions
    from bowdenfit.results.folder import fill_folder_atomically, write_text
    from bowdenfit.results.serialization import plain_data

    page_file, text_file, *_ = files = files_of(folder, name)
    files += [path for each in figures if each != name for path in figures_of(folder, each)]
    with fill_folder_atomically(Path(folder), page_file.name) as place:
        copy_captions(Path(folder), place)
        write_text(place / text_file.name, text)
        for each, figure in figures.items():
            write_figure(figure, answer, place, each, cable)
        if page is not None:
            written = write_page(page, place, place / f"{name}.html")
            files.insert(0, Path(folder) / written.name)
        write_text(place / page_file.name, json.dumps(plain_data(answer), indent=1, allow_nan=False) + "\n")
    return files


def write_page(page: "Page", drawn: Path, path: Path) -> Path:
    """Write a page whole, with the figures that lie in a folder; loads no model.

    Args:
        page: The page.
        drawn: Where its figures are, as PNG.
        path: The file.
    """
    from bowdenfit.pages.page import render
    from bowdenfit.results.folder import write_text

    files = {picture.name: drawn / f"{picture.name}.png" for picture in page.pictures}
    drawings = {name: file.read_bytes() for name, file in files.items() if file.is_file()}
    write_text(path, render(page, drawings))
    return path
