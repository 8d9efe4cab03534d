"""All the figures of a fit, in their order: each is a file, and a line here.

A figure file has `data`, what the figure shows of a fit as plain arrays, None where that has nothing of it, and `draw`, the
figure of such data. Data load no matplotlib and drawing loads no JAX, so that another process can draw while this one goes on.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bowdenfit.plots.style import in_paper_style
from bowdenfit.plots.write import FORMATS, write_all
from bowdenfit.questions.bends import (
    bending_loss_figure,
    loops_figure,
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
from bowdenfit.questions.summary import coefficients_figure, pairs_figure, residuals_figure, traces_figure

if TYPE_CHECKING:
    from bowdenfit.results.record import Record

_FILES = (
    wrap_angles_figure,
    efficiency_figure,
    coefficients_figure,
    pairs_figure,
    traces_figure,
    residuals_figure,
    checks_figure,
    recordings_figure,
    hysteresis_figure,
    sample_efficiency_figure,
    autocorrelation_figure,
    dependence_figure,
    stretch_figure,
    preload_figure,
    bending_loss_figure,
    loops_figure,
    preload_window_figure,
)
FIGURES = {file.__name__.rpartition(".")[2].removesuffix("_figure"): file for file in _FILES}


def figures_of(fit: "Record") -> Iterator[tuple[str, Any]]:
    """Name and data of each figure that a fit has something to show in."""
    import jax

    for name, figure in FIGURES.items():
        with jax.enable_x64(True):
            data = figure.data(fit)
        if data is not None:
            yield name, data


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
