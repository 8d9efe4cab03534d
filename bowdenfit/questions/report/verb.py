"""The report of a fit, written again."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit.arguments import PATH, RESULTS, Output, read_first
from bowdenfit.questions import report as room
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.results.record import Record


@read_first
def report(
    fit: Annotated["Record | str | Path", RESULTS, PATH],
    output: Annotated[Output, Parameter(metavar="FILE", show_default="RESULTS/report.html")] = None,
    *,
    ranked: Annotated[bool, Parameter("--next")] = False,
    compare: Annotated["Record | str | Path | None", PATH, Parameter(metavar="EARLIER")] = None,
) -> Path:
    """Write everything that a fit found on one page: a file that stands alone, to read in a browser, print and hand on.

    Args:
        fit: The fit, or its results folder.
        output: The file, one that is there is replaced; or a folder for report.html.
        ranked: Rank what could be measured next too, which takes a few seconds.
        compare: An earlier fit, or its results folder: the report says what changed since.

    Returns:
        The file written.

    Raises:
        UsageError: A fit is given without a file.
        StoreError: The results folder is missing or damaged, or the file cannot be written.
    """
    return room.write_report(fit, output, rank_next=ranked, earlier=compare)


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
