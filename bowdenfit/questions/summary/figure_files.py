"""Figures of a fit that are to be drawn: their data, read back or worked out, and the files they become."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from bowdenfit import results as results_door
from bowdenfit.arguments import NumberWithUnit
from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.questions import summary
from bowdenfit.questions.figures import (
    FIGURES,
    collect_figure_data,
    parse_page_width,
    read_figure_data,
    titles_and_captions,
    warning_mark,
    write_figure_files,
)
from bowdenfit.results.answer_cache import read_answers
from bowdenfit.results.folder import FIT, read_page

# Captions of the figures by name, the order of all figures in captions.txt, and a function that writes the files of the
# figures into a folder in some formats.
FigureFiles = tuple[dict[str, str], Sequence[str], Callable[[Path, Sequence[str]], None]]


def prepare_figures(fit: Any, names: Sequence[str], width: NumberWithUnit | None) -> FigureFiles:
    """Return figures that are to be drawn.

    Args:
        fit: The fit, or its results folder.
        names: Which figures; all if empty.
        width: Width of the page with its unit; what suits each figure if None.

    Raises:
        UsageError: There is no such figure, the fit has nothing to show in it, or it cannot be so wide.
    """
    page = parse_page_width(width)
    data, cable, mark = _collect_data(fit, names)
    return titles_and_captions(data, cable, mark), tuple(FIGURES), partial(_draw_figures, data, (cable, page, mark))


def _draw_figures(
    figures: Mapping[str, Any], look: tuple[str, float | None, str], folder: Path, endings: Sequence[str]
) -> None:
    """Draw figures into a folder."""
    for name, data in figures.items():
        write_figure_files(name, data, folder, endings, *look)


def _collect_data(fit: Any, names: Sequence[str]) -> tuple[dict[str, Any], str, str]:
    """Return the data of the figures, the name of the cable, and the warning on figures of a fit that is not to be trusted.

    Data that are stored in the results folder are read back, which needs neither the model nor JAX.
    """
    for name in names:
        if name not in FIGURES:
            raise UsageError(f"there is no figure {name!r}{suggest_name(name, list(FIGURES))}")
    results = Path(fit) if isinstance(fit, str | Path) else None
    data = read_figure_data(results, names) if results is not None else {}
    if data and results is not None:
        cable, troubles = read_page(results / FIT)["description"]["name"], read_answers(results)["troubles"]
    else:
        record = results_door.load(results) if results is not None else fit
        data, cable = dict(collect_figure_data(record, names)), record.name
        troubles = tuple(summary.assess_fit(record).troubles)
    if missing := [name for name in names if name not in data]:
        raise UsageError(f"this fit has nothing to show in the figure {missing[0]!r}; leave it out.")
    return data, cable, warning_mark(troubles)
