"""Figures with their titles in their folder, and in one file what each shows, in words."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from bowdenfit.plots.layout import title_above
from bowdenfit.plots.style import in_paper_style
from bowdenfit.plots.write import write_all
from bowdenfit.results.folder import read_text, write_text
from bowdenfit.words import filled, printable

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure

CAPTIONS = "captions.txt"


@runtime_checkable
class AnswerFigure(Protocol):
    """A figure file of an answer."""

    HEADING: str

    def draw(self, found: Any, /) -> "Figure":
        """The figure."""

    def caption(self, found: Any, /) -> str:
        """What is drawn, in plain words."""


def titled(heading: str, cable: str) -> str:
    """A heading with the name of the cable, where it is known."""
    return f"{heading} \N{EN DASH} {cable}" if cable else heading


@in_paper_style
def answer_figure(figure: AnswerFigure, found: Any, cable: str) -> "Figure":
    """The figure of an answer under its title.

    Args:
        figure: Its file.
        found: The answer.
        cable: Name of the cable; empty where there are several.
    """
    drawn = figure.draw(found)
    title_above(drawn, titled(figure.HEADING, cable))
    return drawn


def write_figure(figure: AnswerFigure, found: Any, folder: Path, name: str, cable: str) -> list[Path]:
    """Write the figure of an answer in every format, and its caption beside it.

    Args:
        figure, found, cable: See `answer_figure`.
        folder: Where to; made if it is missing.
        name: Of the files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = write_all(answer_figure(figure, found, cable), folder, name)
    write_captions({name: f"{titled(figure.HEADING, cable)}. {figure.caption(found)}"}, folder)
    return written


def bring_captions(there: Path, place: Path) -> None:
    """Copy the captions of figures that stay in a folder, to be written again with those of others.

    Args:
        there: The folder.
        place: Where others are being written.
    """
    if (there / CAPTIONS).is_file():
        write_text(place / CAPTIONS, read_text(there / CAPTIONS))


def write_captions(said: Mapping[str, str], folder: Path, order: Iterable[str] = ()) -> Path:
    """Write the captions of some figures, a paragraph each, beside those of the others in the folder.

    Args:
        said: By figure.
        folder: Where the figures are.
        order: Of figures; others follow.
    """
    path = folder / CAPTIONS
    there = read_text(path).split("\n\n") if path.exists() else []
    texts = {text.partition(":")[0]: text.strip() for text in there if text.strip()}
    texts |= {name: printable(filled(" ".join(f"{name}: {text}".split()))) for name, text in said.items()}
    names = [*(name for name in order if name in texts), *(name for name in texts if name not in set(order))]
    write_text(path, "\n\n".join(texts[name] for name in names) + "\n")
    return path
