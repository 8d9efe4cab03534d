"""All the figures of a fit, and the writing of those that apply to its folder.

`draw_all` takes only plain data, so that a second process can run it while the first goes on.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from bowdenfit.plots.autocorrelation import autocorrelation, has_autocorrelation
from bowdenfit.plots.bending_loss import bending_loss, has_bending_loss
from bowdenfit.plots.checks import checks, has_checks
from bowdenfit.plots.coefficients import coefficients, has_coefficients
from bowdenfit.plots.dependence import dependence, has_dependence
from bowdenfit.plots.efficiency import efficiency, has_route
from bowdenfit.plots.hysteresis import has_hysteresis, hysteresis
from bowdenfit.plots.loops import has_loops, loops
from bowdenfit.plots.pairs import has_pairs, pairs
from bowdenfit.plots.preload import has_preload, preload
from bowdenfit.plots.preload_window import has_preload_window, preload_window
from bowdenfit.plots.recordings import has_recordings, recordings
from bowdenfit.plots.residuals import has_residuals, residuals
from bowdenfit.plots.sample_efficiency import has_sample_efficiency, sample_efficiency
from bowdenfit.plots.stretch import has_stretch, stretch
from bowdenfit.plots.style import DOTS_PER_INCH, in_paper_style
from bowdenfit.plots.traces import has_traces, traces
from bowdenfit.plots.wrap_angles import has_curves, wrap_angles

if TYPE_CHECKING:
    from bowdenfit.results.figure_data import FigureData

FORMATS = ("png", "svg")
OPTIONS: dict[str, dict[str, Any]] = {
    "png": {"pil_kwargs": {"compress_level": 2}},  # half the time of the usual 6, a tenth more bytes
    "svg": {"metadata": {"Date": None}},
}


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


@in_paper_style
def write(figure: Figure, path: Path) -> Path:
    """Write one file under a temporary name and rename it; the same figure always gives the same bytes.

    Whoever reads the folder meanwhile sees the old file or the new one, never half of one.
    """
    ending = path.suffix.removeprefix(".")
    temporary = path.with_name(f".{path.name}.part")
    try:
        figure.savefig(temporary, format=ending, dpi=DOTS_PER_INCH, **OPTIONS.get(ending, {}))
        os.replace(temporary, path)  # noqa: PTH105
    finally:
        temporary.unlink(missing_ok=True)
    return path
