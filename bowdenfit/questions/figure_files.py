"""Figures of answers with their titles in their folder, and what each shows, in words."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from bowdenfit.plots.layout import title_above
from bowdenfit.plots.style import in_paper_style
from bowdenfit.plots.write import write_all
from bowdenfit.results.answer_cache import write_captions

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure


@runtime_checkable
class AnswerFigure(Protocol):
    """A figure file of an answer."""

    HEADING: str

    def draw(self, answer: Any, /) -> "Figure":
        """Return the figure."""

    def caption(self, answer: Any, /) -> str:
        """Say what is drawn, in plain words."""


def add_cable_name(heading: str, cable: str) -> str:
    """Return a heading with the name of the cable, where it is known."""
    return f"{heading} \N{EN DASH} {cable}" if cable else heading


@in_paper_style
def draw_answer_figure(figure: AnswerFigure, answer: Any, cable: str) -> "Figure":
    """Draw the figure of an answer under its title.

    Args:
        figure: Its file.
        answer: The answer.
        cable: Name of the cable; empty where there are several.
    """
    drawing = figure.draw(answer)
    title_above(drawing, add_cable_name(figure.HEADING, cable))
    return drawing


def write_figure(figure: AnswerFigure, answer: Any, folder: Path, name: str, cable: str) -> list[Path]:
    """Write the figure of an answer in every format, and its caption beside it.

    Args:
        figure, answer, cable: See `draw_answer_figure`.
        folder: Where to; made if it is missing.
        name: Name of the files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = write_all(draw_answer_figure(figure, answer, cable), folder, name)
    write_captions({name: f"{add_cable_name(figure.HEADING, cable)}. {figure.caption(answer)}"}, folder)
    return paths
