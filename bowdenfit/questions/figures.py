"""All the figures of a fit, in their order: each is a file, and a line here.

A figure file has `data`, what the figure shows of a fit as plain arrays, None where that has nothing of it, and `draw`, the
figure of such data. Data load no matplotlib and drawing loads no JAX, so that another process can draw while this one goes on.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

from bowdenfit.plots.style import in_paper_style
from bowdenfit.plots.write import FORMATS, write_all
from bowdenfit.questions.bends import (
    bending_loss_figure,
    loops_figure,
    motor_force_figure,
    preload_figure,
    preload_window_figure,
    stretch_figure,
)
from bowdenfit.questions.check import checks_figure
from bowdenfit.questions.length import efficiency_figure, wrap_angles_figure
from bowdenfit.questions.recorded import (
    autocorrelation_figure,
    dependence_figure,
    hysteresis_figure,
    recordings_figure,
    sample_efficiency_figure,
)
from bowdenfit.questions.summary import (
    coefficients_figure,
    forces_figure,
    pairs_figure,
    residuals_figure,
    traces_figure,
)
from bowdenfit.results.arrays import read_arrays
from bowdenfit.results.folder import FIGURE_DATA
from bowdenfit.results.kept import kept

if TYPE_CHECKING:
    from bowdenfit.results.record import Record

_FILES = (  # first those whose data are there, so that drawing begins at once
    coefficients_figure,
    pairs_figure,
    traces_figure,
    residuals_figure,
    forces_figure,
    wrap_angles_figure,
    efficiency_figure,
    motor_force_figure,
    stretch_figure,
    preload_figure,
    bending_loss_figure,
    loops_figure,
    preload_window_figure,
    checks_figure,
    recordings_figure,
    hysteresis_figure,
    sample_efficiency_figure,
    autocorrelation_figure,
    dependence_figure,
)
FIGURES = {file.__name__.rpartition(".")[2].removesuffix("_figure"): file for file in _FILES}


def figures_of(fit: "Record", names: Collection[str] = ()) -> Iterator[tuple[str, Any]]:
    """Name and data of each figure that a fit has something to show in, or of some of them."""
    import jax

    for name in names or FIGURES:
        with jax.enable_x64(True):
            data = FIGURES[name].data(fit)
        if data is not None:
            yield name, data


def kept_figures(folder: Path, names: Iterable[str] = ()) -> dict[str, Any]:
    """Data of the figures that a fit was drawn with, or of some of them; empty where they are not kept.

    Args:
        folder: Its results folder.
        names: Which; all if omitted.
    """
    if not kept(folder, FIGURE_DATA) or not (folder / FIGURE_DATA).exists():
        return {}
    try:
        return read_arrays(folder / FIGURE_DATA, data_types(names or FIGURES))
    except (KeyError, TypeError, ValueError):  # kept when the figure showed something else
        return {}


def data_types(names: Iterable[str]) -> dict[str, Any]:
    """Annotated type of the data of some figures, by their names."""
    return {name: get_type_hints(FIGURES[name].data, localns={"Record": object})["return"] for name in names}


@in_paper_style
def draw_figure(name: str, data: Any, folder: Path, formats: Sequence[str] = FORMATS) -> list[Path]:
    """Draw and write one figure; loads matplotlib, and no model.

    Args:
        name: Which of `FIGURES`.
        data: What it shows.
        folder: Where the files go; made if it is missing.
        formats: Endings; the figure is written in every one.
    """
    folder.mkdir(parents=True, exist_ok=True)
    return write_all(FIGURES[name].draw(data), folder, name, formats)
