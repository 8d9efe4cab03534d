"""All the figures of a fit, and the writing of those that apply to its folder.

`draw_all` takes only plain data, so that a second process can run it while the first goes on.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bowdenfit.plots.style import in_paper_style
from bowdenfit.plots.write import FORMATS, write
from bowdenfit.questions.bends.bending_loss_figure import bending_loss, has_bending_loss
from bowdenfit.questions.bends.loops_figure import has_loops, loops
from bowdenfit.questions.bends.preload_figure import has_preload, preload
from bowdenfit.questions.bends.preload_window_figure import has_preload_window, preload_window
from bowdenfit.questions.bends.stretch_figure import has_stretch, stretch
from bowdenfit.questions.check.figure import checks, has_checks
from bowdenfit.questions.length.efficiency_figure import efficiency, has_route
from bowdenfit.questions.length.wrap_angles_figure import has_curves, wrap_angles
from bowdenfit.questions.recorded.autocorrelation_figure import autocorrelation, has_autocorrelation
from bowdenfit.questions.recorded.dependence_figure import dependence, has_dependence
from bowdenfit.questions.recorded.hysteresis_figure import has_hysteresis, hysteresis
from bowdenfit.questions.recorded.recordings_figure import has_recordings, recordings
from bowdenfit.questions.recorded.sample_efficiency_figure import has_sample_efficiency, sample_efficiency
from bowdenfit.questions.summary.coefficients_figure import coefficients, has_coefficients
from bowdenfit.questions.summary.pairs_figure import has_pairs, pairs
from bowdenfit.questions.summary.residuals_figure import has_residuals, residuals
from bowdenfit.questions.summary.traces_figure import has_traces, traces

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure
    from bowdenfit.questions.summary.figure_data import FigureData


@dataclass(frozen=True)
class Entry:
    """One kind of figure: the function that draws it, and whether the data have what it shows."""

    draw: "Callable[[FigureData], Figure]"
    applies: "Callable[[FigureData], bool]"


FIGURES = {
    "wrap_angles": Entry(wrap_angles, has_curves),
    "efficiency": Entry(efficiency, has_route),
    "coefficients": Entry(coefficients, has_coefficients),
    "pairs": Entry(pairs, has_pairs),
    "traces": Entry(traces, has_traces),
    "residuals": Entry(residuals, has_residuals),
    "checks": Entry(checks, has_checks),
    "recordings": Entry(recordings, has_recordings),
    "hysteresis": Entry(hysteresis, has_hysteresis),
    "sample_efficiency": Entry(sample_efficiency, has_sample_efficiency),
    "autocorrelation": Entry(autocorrelation, has_autocorrelation),
    "dependence": Entry(dependence, has_dependence),
    "stretch": Entry(stretch, has_stretch),
    "preload": Entry(preload, has_preload),
    "bending_loss": Entry(bending_loss, has_bending_loss),
    "loops": Entry(loops, has_loops),
    "preload_window": Entry(preload_window, has_preload_window),
}


@in_paper_style
def draw_all(
    data: "FigureData", folder: Path, formats: Sequence[str] = FORMATS, names: Sequence[str] = tuple(FIGURES)
) -> list[Path]:
    """Draw and write every figure that applies.

    Args:
        data: What the figures show.
        folder: Where the files go; made if it is missing.
        formats: Endings; each figure is written in every one.
        names: Which of `FIGURES`, so that several processes can share the work.

    Returns:
        The files, in the order of the names.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name in names:
        if FIGURES[name].applies(data):
            figure = FIGURES[name].draw(data)
            written += [write(figure, folder / f"{name}.{ending}") for ending in formats]
    return written
