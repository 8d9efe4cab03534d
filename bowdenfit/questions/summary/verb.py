"""The summary of a fit, and its figures."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit import results as results_door
from bowdenfit.arguments import PATH, RESULTS, TEXTS, Output, Purpose, Quantity, as_pair, number_with_unit, read_first
from bowdenfit.errors import StoreError
from bowdenfit.questions import summary as room
from bowdenfit.results.answer_cache import are_texts_unchanged
from bowdenfit.results.folder import DETAILS_TEXT, SUMMARY, SUMMARY_TEXT, read_page, read_text
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.questions.writing import Files
    from bowdenfit.results.record import Record


@read_first
def summary(
    results: Annotated[str | Path, RESULTS, PATH],
    *,
    full: bool = False,
    purpose: Purpose = "design",
) -> "tuple[str, Any] | Record":
    """The summary of a finished fit, for people and as JSON; or the fit, where they are not there as this version writes them.

    Args:
        results: Its folder.
        full: Everything that the fit says, instead of one page.
        purpose: What the answer is for, "design" or "coefficients": the first line answers that, and the exit code says
            whether it may be used for that.

    Raises:
        StoreError: The folder is missing, unfinished or damaged, or one of the texts was changed.
    """
    folder = Path(results)
    if purpose == "coefficients" or not are_texts_unchanged(folder):
        return results_door.load(folder)
    text, page = read_text(folder / (DETAILS_TEXT if full else SUMMARY_TEXT)), read_page(folder / SUMMARY)
    if not _says_whether_trusted(page):
        raise StoreError(f"{folder / SUMMARY} is damaged; remove it, and bowdenfit summary says again what the fit says.")
    return text, page


def _says_whether_trusted(page: Any) -> bool:
    return isinstance(page, dict) and isinstance(page.get("verdict"), dict) and type(page["verdict"].get("usable")) is bool


def reply(results: "tuple[str, Any] | Record", options: Mapping[str, Any]) -> Reply:
    """Return what is printed of a fit."""
    if isinstance(results, tuple):
        text, page = results
        return Reply(text, lambda: page, exit_code=0 if page["verdict"]["usable"] else NOT_TRUSTED)
    purpose: Purpose = options.get("purpose", "design")
    text = room.details_text(results) if options.get("full") else room.summary_text(results, purpose)
    exit_code = 0 if room.assess_fit(results).may_be_used_for(purpose) else NOT_TRUSTED
    return Reply(text, lambda: room.summarize(results), exit_code=exit_code)


@read_first
def plot(
    fit: Annotated["Record | str | Path", RESULTS, PATH],
    output: Annotated[Output, Parameter(show_default="RESULTS/figures")] = None,
    *,
    figures: Annotated[Sequence[str], Parameter("--figure", metavar="NAME"), TEXTS] = (),
    width: Annotated[Quantity | None, Parameter(metavar="LENGTH"), number_with_unit("3.5in")] = None,
    formats: Annotated[Sequence[str], Parameter("--format", metavar="ENDING", show_default="png"), TEXTS] = (),
) -> "Files":
    """Draw the figures of a fit into a folder, and write what each shows, in words, to captions.txt beside them.

    Args:
        fit: The fit, or its results folder.
        output: Folder for the figures.
        figures: Draw only this figure, such as efficiency; may be repeated.
        width: Width of the page, such as 3.5in or 88mm for a column of a paper; words keep their size.
        formats: Write this format, png, svg or pdf, instead of png; may be repeated.

    Returns:
        The files written.

    Raises:
        UsageError: Neither a folder for the figures nor one of results is named, or the fit has no such figure; or there is no
            such format, or figures cannot be so wide.
        StoreError: The results folder is missing or damaged, or the other cannot be written.
    """
    return room.draw_into_folder(fit, output, figures, as_pair(width), formats)


SUMMARY_VERB = Verb(
    summary,
    reply,
    """Print the summary of a fit.

    The summary is one page: the answer, whether to trust it, and what to do next.
    """,
    json="Print summary.json instead of the text summary.",
)
PLOT_VERB = Verb(
    plot,
    lambda files, _: Reply("".join(f"{path}\n" for path in files)),
    """Draw the figures of a fit again.

    For a column of a paper: --width 3.5in --format pdf.
    """,
    json="",
    warns=True,
)
