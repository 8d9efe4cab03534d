"""The report of a fit, written again."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit.arguments import PATH, RESULTS, Output, read_first
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.results.record import Record


@read_first
def report(
    found: Annotated["Record | str | Path", RESULTS, PATH],
    output: Annotated[Output, Parameter(metavar="FILE", show_default="RESULTS/report.html")] = None,
    *,
    ranked: Annotated[bool, Parameter("--next")] = False,
) -> Path:
    """Write everything that a fit found on one page: a file that stands alone, to read in a browser, print and hand on.

    Args:
        found: The fit, or its results folder.
        output: The file, one that is there is replaced; or a folder for report.html.
        ranked: Rank what could be measured next too, which takes a few seconds.

    Returns:
        The file written.

    Raises:
        UsageError: A fit is given without a file.
        StoreError: The results folder is missing or damaged, or the file cannot be written.
    """
    from bowdenfit.errors import UsageError
    from bowdenfit.plots.write import PNG
    from bowdenfit.questions.figures import draw_figure, figures_of, kept_figures, mark_of
    from bowdenfit.questions.next.ranking import next_measurement
    from bowdenfit.questions.report.sections import report_page
    from bowdenfit.questions.summary.verdict import verdict
    from bowdenfit.questions.writing import write_page
    from bowdenfit.results.folder import REPORT, file_to_write
    from bowdenfit.results.store import load

    kept = dict[str, Any]()
    if isinstance(found, str | Path):
        folder = Path(found)
        output, found, kept = output or folder / REPORT, load(folder), kept_figures(folder)
    if output is None:
        raise UsageError("a fit by itself has no folder; name a file for the report.")
    ranking = next_measurement(found) if ranked else None
    figures, path, mark = kept or dict(figures_of(found)), Path(output), mark_of(verdict(found).troubles)
    path = path / REPORT if path.is_dir() else path
    with file_to_write(path) as temporary, TemporaryDirectory() as drawn:
        for name, data in figures.items():
            draw_figure(name, data, Path(drawn), (PNG,), found.name, mark=mark)
        write_page(report_page(found, figures, ranking), Path(drawn), temporary)
    return path


def _reply(path: Path, _: Mapping[str, Any]) -> Reply:
    return Reply(f"{path}\n")


VERB = Verb(
    report,
    _reply,
    """Write the report of a fit: everything on one page.

    The report of a finished fit is one HTML file with the answer, whether to trust
    it, figures, checks, a paragraph on methods with citations, and where the
    numbers come from. It asks no other computer for anything, and can be mailed,
    printed and read in light and dark.
    """,
    json="",
    warns=True,
)
