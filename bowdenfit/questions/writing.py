"""Writing an answer to a folder: for people, as a figure, and for programs; in one way for all questions."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bowdenfit.display import Display, Rows
from bowdenfit.errors import StoreError
from bowdenfit.outputs import write_text
from bowdenfit.plots.write import FORMATS
from bowdenfit.results.answer_cache import copy_captions
from bowdenfit.results.folder import fill_folder_atomically, is_empty, kept_file
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.pages.section import HtmlPage
    from bowdenfit.questions.figure_files import AnswerFigure

PAGE, TEXT = "json", "txt"


class Files(Display, list[Path]):
    """Files that were written."""

    def __str__(self) -> str:
        return "\n".join(map(str, self))

    def sentences(self) -> list[str]:
        """Return how many there are."""
        return [f"Wrote {counted(len(self), 'file')}."]

    def _table(self) -> Rows:
        return [{"file": str(path)} for path in self], {}


def answer_files(folder: str | Path, name: str) -> list[Path]:
    """Return the files of an answer.

    Args:
        folder: Where they are.
        name: Name of the answer.
    """
    return [*(Path(folder) / f"{name}.{ending}" for ending in (PAGE, TEXT)), *answer_figures(folder, name)]


def answer_figures(folder: str | Path, name: str) -> list[Path]:
    """Return the figure of an answer in every format.

    Args:
        folder: Where they are.
        name: Name of the answer.
    """
    return [Path(folder) / f"{name}.{ending}" for ending in FORMATS]


def refuse_to_replace(folder: Path, name: str, what: str, force: bool) -> None:
    """Stop before anything is computed if an answer would have no place.

    Args:
        folder: Where it would go.
        name: Name of the answer.
        what: What it is, in words without an article.
        force: Whether an earlier one there may be replaced.

    Raises:
        StoreError: The folder holds something else already, or an earlier answer.
    """
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
    page: "HtmlPage | None" = None,
) -> list[Path]:
    """Write an answer as text, as figures and, last, as JSON: all of them or none; a folder that has the JSON has everything.

    Args:
        folder: Where to; made if missing. Earlier files of these names are replaced.
        name: Name of the files.
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
    from bowdenfit.results.serialization import plain_data

    page_file, text_file, *_ = files = answer_files(folder, name)
    files += [path for figure_name in figures if figure_name != name for path in answer_figures(folder, figure_name)]
    with fill_folder_atomically(Path(folder), page_file.name) as working_folder:
        copy_captions(Path(folder), working_folder)
        write_text(working_folder / text_file.name, text)
        for figure_name, figure in figures.items():
            write_figure(figure, answer, working_folder, figure_name, cable)
        if page is not None:
            page_path = write_page(page, working_folder, working_folder / f"{name}.html")
            files.insert(0, Path(folder) / page_path.name)
        write_text(working_folder / page_file.name, json.dumps(plain_data(answer), indent=1, allow_nan=False) + "\n")
    return files


def write_page(page: "HtmlPage", figures_folder: Path, path: Path) -> Path:
    """Write a page whole, with the figures that lie in a folder; loads no model.

    Args:
        page: The page.
        figures_folder: Where its figures are, as PNG.
        path: The file.
    """
    from bowdenfit.pages.page import render_page
    files = {picture.name: kept_file(figures_folder, f"{picture.name}.png") for picture in page.pictures}
    drawings = {name: file.read_bytes() for name, file in files.items() if file.is_file()}
    write_text(path, render_page(page, drawings))
    return path
