"""The figures of a fit on its report: the answer first, what is for statisticians folded, some to zoom into."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bowdenfit.errors import UsageError
from bowdenfit.inputs import damage_as
from bowdenfit.pages.section import Chart, HtmlPage, PageSection, Picture, prose_section
from bowdenfit.plots.write import PNG
from bowdenfit.questions.bends.words import section as bends_section
from bowdenfit.questions.error_budget import budget_section
from bowdenfit.questions.figures import (
    FIGURES,
    collect_figure_data,
    damaged_figure_data,
    figure_caption,
    read_figure_data,
    warning_mark,
    write_figure_files,
)
from bowdenfit.questions.length.efficiency_figure import describe_efficiency_chart, make_efficiency_chart
from bowdenfit.questions.loss import loss_section
from bowdenfit.questions.next.answer import NextMeasurement
from bowdenfit.questions.next.ranking import rank_measurements
from bowdenfit.questions.next.words import ranking_section
from bowdenfit.questions.recorded.recordings_figure import describe_recordings_charts, make_recordings_charts
from bowdenfit.questions.report.changes import changes_section
from bowdenfit.questions.summary.coefficients_figure import describe_coefficient_charts, make_coefficient_charts
from bowdenfit.questions.summary.methods import methods_section
from bowdenfit.questions.summary.pairs_figure import describe_pair_charts, make_pair_charts
from bowdenfit.questions.summary.residuals_figure import describe_residual_charts, make_residual_charts
from bowdenfit.questions.summary.sections import (
    answer_section,
    checks_section,
    coefficients_section,
    measured_section,
    next_step_section,
    provenance_section,
)
from bowdenfit.questions.summary.verdict import assess_fit
from bowdenfit.questions.writing import write_page
from bowdenfit.results.data_changes import find_data_changes
from bowdenfit.results.folder import REPORT, file_to_write
from bowdenfit.results.record import Record
from bowdenfit.results.store import load

ABOVE_FIGURES = (answer_section, measured_section, coefficients_section, loss_section, budget_section, bends_section)
BELOW_FIGURES = (methods_section, provenance_section)
FIGURES_TITLE = "Figures"
FIRST = ("efficiency",)  # the answer
FOLDED = ("coefficients", "traces", "residuals", "checks", "autocorrelation", "sample_efficiency")
CHARTS: dict[str, tuple[Callable[[Any], tuple[Chart, ...]], Callable[[Any], str]]] = {  # charts of a figure, and their caption
    "efficiency": (make_efficiency_chart, describe_efficiency_chart),
    "recordings": (make_recordings_charts, describe_recordings_charts),
    "coefficients": (make_coefficient_charts, describe_coefficient_charts),
    "pairs": (make_pair_charts, describe_pair_charts),
    "residuals": (make_residual_charts, describe_residual_charts),
}


def figures_section(figures: dict[str, Any]) -> PageSection | None:
    """Return the figures of a fit; None without any.

    Args:
        figures: Data by name.
    """
    names = sorted(figures, key=lambda name: (name in FOLDED, name not in FIRST))
    pictures = tuple(_figure_picture(name, figures[name]) for name in names)
    return prose_section(FIGURES_TITLE, (), pictures=pictures) if pictures else None


def _figure_picture(name: str, data: Any) -> Picture:
    heading, caption, folded = FIGURES[name].HEADING, figure_caption(name, data), name in FOLDED
    if name not in CHARTS:
        return Picture(name, heading, caption, folded=folded)
    make_charts, describe_charts = CHARTS[name]
    return Picture(name, heading, caption, make_charts(data), describe_charts(data), folded)


def report_page(
    fit: Record,
    figures: dict[str, Any],
    ranking: NextMeasurement | None = None,
    changes: PageSection | None = None,
    outdated: str = "",
) -> HtmlPage:
    """Return the report of a fit.

    Args:
        fit: The fit.
        figures: Data of the figures that are on it, by name.
        ranking: Ranking of further measurements; a sentence says how to ask if omitted.
        changes: Changes since an earlier fit; none are shown if omitted.
        outdated: Which data have changed since this fit, in a sentence.
    """
    (answer, *above), below = ([make_section(fit) for make_section in group] for group in (ABOVE_FIGURES, BELOW_FIGURES))
    following = next_step_section(fit) if ranking is None else ranking_section(ranking)
    newer = prose_section("Newer data", [outdated]) if outdated else None
    sections = [answer, newer, changes, *above, figures_section(figures), checks_section(fit), following, *below]
    when = f", {fit.provenance.created[:10]}" if fit.provenance.created else ""
    subtitle = f"Report of a fit by bowdenfit {fit.provenance.versions.get('bowdenfit', '')}{when}"
    return HtmlPage(fit.name, subtitle, tuple(section for section in sections if section is not None))


def write_report(
    fit: Record | str | Path, output: str | Path | None, rank_next: bool = False, earlier: Record | str | Path | None = None
) -> Path:
    """Write the report of a fit to one HTML file.

    Args:
        fit: The fit, or its results folder.
        output: The file, or a folder for report.html; the results folder if None.
        rank_next: Whether to rank what could be measured next.
        earlier: A fit, or its results folder, since which it is said what changed.

    Returns:
        The file written.

    Raises:
        UsageError: A fit is given without a file.
        StoreError: The results folder is missing or damaged, or the file cannot be written.
    """
    figures, outdated = dict[str, Any](), ""
    guard: AbstractContextManager[None] = nullcontext()
    if isinstance(fit, str | Path):
        folder = Path(fit)
        output, fit, figures = output or folder / REPORT, load(folder), read_figure_data(folder)
        outdated = find_data_changes(folder).describe()
        guard = damage_as(damaged_figure_data(folder)) if figures else guard
    if output is None:
        raise UsageError("a fit on its own has no folder; name a file for the report.")
    ranking = rank_measurements(fit) if rank_next else None
    figures, path, mark = figures or dict(collect_figure_data(fit)), Path(output), warning_mark(assess_fit(fit).troubles)
    path = path / REPORT if path.is_dir() else path
    changes = changes_section(fit, *_load_earlier(earlier)) if earlier is not None else None
    with guard, file_to_write(path) as temporary, TemporaryDirectory() as figures_folder:
        for name, data in figures.items():
            write_figure_files(name, data, Path(figures_folder), (PNG,), fit.name, mark=mark)
        write_page(report_page(fit, figures, ranking, changes, outdated), Path(figures_folder), temporary)
    return path


def _load_earlier(earlier: Record | str | Path) -> tuple[Record, str]:
    """Return an earlier fit and its name."""
    return (load(Path(earlier)), str(earlier)) if isinstance(earlier, str | Path) else (earlier, earlier.name)
