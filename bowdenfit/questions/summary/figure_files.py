"""Figures of a fit that are to be drawn: their data, read back or worked out, and the files they become."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

from bowdenfit import results as results_door
from bowdenfit.arguments import NumberWithUnit
from bowdenfit.errors import StoreError, UsageError, suggest_name
from bowdenfit.inputs import damage_as
from bowdenfit.questions import summary
from bowdenfit.questions.figures import (
    FIGURES,
    collect_figure_data,
    damaged_figure_data,
    parse_page_width,
    read_figure_data,
    titles_and_captions,
    warning_mark,
    write_figure_files,
)
from bowdenfit.results.answer_cache import TROUBLES, read_answers
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
    data, cable, mark, stored = _collect_data(fit, names)
    with _guard(stored):
        captions = titles_and_captions(data, cable, mark)
    return captions, tuple(FIGURES), partial(_draw_figures, data, (cable, page, mark), stored)


def _draw_figures(
    figures: Mapping[str, Any], look: tuple[str, float | None, str], stored: Path | None, folder: Path, endings: Sequence[str]
) -> None:
    """Draw figures into a folder."""
    with _guard(stored):
        for name, data in figures.items():
            write_figure_files(name, data, folder, endings, *look)


def _guard(stored: Path | None) -> AbstractContextManager[None]:
    """Return a context in which whatever cannot be drawn is damage of the data that a results folder keeps, if it is they."""
    return nullcontext() if stored is None else damage_as(damaged_figure_data(stored))


def _collect_data(fit: Any, names: Sequence[str]) -> tuple[dict[str, Any], str, str, Path | None]:
    """Return the data of the figures, the name of the cable, the warning on figures of a fit that is not to be trusted, and the
    results folder that kept these data, if one did.

    Data that are stored in the results folder are read back, which needs neither the model nor JAX.
    """
    for name in names:
        if name not in FIGURES:
            raise UsageError(f"there is no figure {name!r}{suggest_name(name, list(FIGURES))}")
    results = Path(fit) if isinstance(fit, str | Path) else None
    data = read_figure_data(results, names) if results is not None else {}
    stored = results if data else None
    if stored is not None:
        with damage_as(StoreError(f"{stored} is damaged; fit again, or restore the folder from a copy.")):
            cable, troubles = read_page(stored / FIT)["description"]["name"], read_answers(stored)[TROUBLES]
    else:
        record = results_door.load(results) if results is not None else fit
        data, cable = dict(collect_figure_data(record, names)), record.name
        troubles = tuple(summary.assess_fit(record).troubles)
    if missing := [name for name in names if name not in data]:
        raise UsageError(f"this fit has nothing to show in the figure {missing[0]!r}; leave it out.")
    return data, cable, warning_mark(troubles), stored
