"""The figures of a fit on its report: the answer first, what is for statisticians folded, two to zoom into."""

from collections.abc import Callable
from typing import Any

from bowdenfit.pages.chart import Chart
from bowdenfit.pages.section import Picture, Section, prose
from bowdenfit.questions.figures import FIGURES, caption_of
from bowdenfit.questions.length.efficiency_chart import efficiency_chart
from bowdenfit.questions.recorded.recordings_chart import recordings_charts

FIRST = ("efficiency",)  # the answer
FOLDED = ("coefficients", "pairs", "traces", "residuals", "checks", "autocorrelation", "sample_efficiency")
CHARTS: dict[str, Callable[[Any], tuple[Chart, ...]]] = {
    "efficiency": efficiency_chart,
    "recordings": recordings_charts,
}


def figures_section(figures: dict[str, Any]) -> Section | None:
    """The figures of a fit; None without any.

    Args:
        figures: Data by name.
    """
    names = sorted(figures, key=lambda name: (name in FOLDED, name not in FIRST))
    pictures = tuple(_picture(name, figures[name]) for name in names)
    return prose("Figures", (), pictures=pictures) if pictures else None


def _picture(name: str, data: Any) -> Picture:
    charts = CHARTS[name](data) if name in CHARTS else ()
    return Picture(name, FIGURES[name].HEADING, caption_of(name, data), charts, name in FOLDED)
