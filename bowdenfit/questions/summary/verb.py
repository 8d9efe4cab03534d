"""The summary of a fit, and its figures."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from bowdenfit.verb import Argument, Option, Output, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.results.record import Record


def summary(results: Annotated[Path, Argument("RESULTS")]) -> "tuple[str, str] | Record":
    """The summary of a finished fit, for people and as JSON; or the fit, where they were not written.

    Args:
        results: Its folder.

    Raises:
        StoreError: The folder is missing, unfinished or damaged.
    """
    from bowdenfit.results.folder import FIT, SUMMARY, SUMMARY_TEXT

    folder = Path(results)
    if all((folder / name).exists() for name in (FIT, SUMMARY, SUMMARY_TEXT)):
        text, page = ((folder / name).read_text(encoding="utf-8") for name in (SUMMARY_TEXT, SUMMARY))
        return text, page
    from bowdenfit.results.store import load

    return load(folder)


def reply(found: "tuple[str, str] | Record", _: object = None) -> Reply:
    """What is printed of a fit."""
    if isinstance(found, tuple):
        text, page = found
        return Reply(text, lambda: json.loads(page))
    from bowdenfit.questions.summary.page import summarize
    from bowdenfit.questions.summary.words import summary_text

    return Reply(summary_text(found), lambda: summarize(found))


def plot(
    found: Annotated["Record | str | Path", Argument("RESULTS")],
    output: Annotated[Output, Option(("-o",), default="RESULTS/figures")] = None,
) -> list[Path]:
    """Draw all figures of a fit into a folder, PNG and SVG.

    Args:
        found: The fit, or its results folder.
        output: Folder for the figures.

    Returns:
        The files written.

    Raises:
        UsageError: Neither a folder for the figures nor one of results is named.
        StoreError: The folder cannot be written.
    """
    from bowdenfit.errors import UsageError
    from bowdenfit.questions.figures import draw_figure, figures_of
    from bowdenfit.results.folder import FIGURES, folder_to_write
    from bowdenfit.results.store import load

    if isinstance(found, str | Path):
        output, found = output or Path(found) / FIGURES, load(Path(found))
    if output is None:
        raise UsageError("a fit by itself has no folder; name one for the figures.")
    with folder_to_write(Path(output)) as place:
        return [path for name, data in figures_of(found) for path in draw_figure(name, data, place)]


SUMMARY_VERB = Verb(
    summary,
    reply,
    "Print the summary of a fit.",
    "Print the summary of a finished fit.",
    json="Print summary.json instead of the summary for people.",
)
PLOT_VERB = Verb(
    plot,
    lambda files, _: Reply("".join(f"{path}\n" for path in files)),
    "Draw the figures of a fit again.",
    "Draw the figures of a finished fit again, as PNG and SVG.",
    json="",
)
