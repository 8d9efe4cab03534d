"""Figures of answers with their titles in their folder, and what each shows, in words."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from bowdenfit.plots.layout import title_above
from bowdenfit.plots.style import in_paper_style
from bowdenfit.plots.write import write_all
from bowdenfit.results.figures_folder import write_captions

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure


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
