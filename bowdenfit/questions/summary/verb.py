"""The summary of a fit, and its figures."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bowdenfit.arguments import PATH, RESULTS, TEXTS, Output, Quantity, as_pair, number_with_unit, read_first
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.questions.writing import Files
    from bowdenfit.results.record import Record

# Captions of figures, the order of all that a folder may hold, and what brings their files into a folder in some formats.
_Asked = tuple[dict[str, str], Sequence[str], Callable[[Path, Sequence[str]], None]]


@read_first
def summary(results: Annotated[str | Path, RESULTS, PATH], *, full: bool = False) -> "tuple[str, Any] | Record":
    """The summary of a finished fit, for people and as JSON; or the fit, where they were not written.

    Args:
        results: Its folder.
        full: Everything that the fit says, instead of one page.

    Raises:
        StoreError: The folder is missing, unfinished or damaged.
    """
    from bowdenfit.results.folder import DETAILS_TEXT, FIT, SUMMARY, SUMMARY_TEXT, read_page, read_text

    folder = Path(results)
    if all((folder / name).exists() for name in (FIT, SUMMARY, SUMMARY_TEXT, DETAILS_TEXT)):
        shown = DETAILS_TEXT if full else SUMMARY_TEXT
        text, page = (read_text(folder / shown), read_page(folder / SUMMARY))
        return text, page
    from bowdenfit.results.store import load

    return load(folder)


def reply(found: "tuple[str, Any] | Record", asked: Mapping[str, Any]) -> Reply:
    """What is printed of a fit."""
    if isinstance(found, tuple):
        text, page = found
        return Reply(text, lambda: page, exit_code=0 if page["verdict"]["trusted"] else NOT_TRUSTED)
    from bowdenfit.questions.summary.brief_words import summary_text
    from bowdenfit.questions.summary.page import summarize
    from bowdenfit.questions.summary.verdict import verdict
    from bowdenfit.questions.summary.words import full_text

    text = full_text(found) if asked.get("full") else summary_text(found)
    return Reply(text, lambda: summarize(found), exit_code=0 if verdict(found).trusted else NOT_TRUSTED)


@read_first
def plot(
    found: Annotated["Record | str | Path", RESULTS, PATH],
    output: Annotated[Output, Parameter(show_default="RESULTS/figures")] = None,
    *,
    figures: Annotated[Sequence[str], Parameter("--figure", metavar="NAME"), TEXTS] = (),
    width: Annotated[Quantity | None, Parameter(metavar="LENGTH"), number_with_unit("3.5in")] = None,
    formats: Annotated[Sequence[str], Parameter("--format", metavar="ENDING", show_default="png"), TEXTS] = (),
) -> "Files":
    """Draw the figures of a fit into a folder, and write what each shows, in words, to captions.txt beside them.

    Args:
        found: The fit, or its results folder.
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
    from bowdenfit.errors import UsageError
    from bowdenfit.questions.writing import Files
    from bowdenfit.results.figures_folder import copy_captions, write_captions
    from bowdenfit.results.folder import FIGURES, fill_folder_atomically

    if isinstance(found, str | Path):
        output = output or Path(found) / FIGURES
    if output is None:
        raise UsageError("a fit by itself has no folder; name one for the figures.")
    endings = _formats(formats)
    there = _there(Path(found), figures, endings) if isinstance(found, str | Path) and width is None else None
    captions, order, bring = there or _anew(found, figures, width)
    with fill_folder_atomically(Path(output)) as place:
        copy_captions(Path(output), place)
        bring(place, endings)
        said = write_captions(captions, place, order)
    names = [f"{name}.{ending}" for name in captions for ending in endings]
    return Files(Path(output) / name for name in (*names, said.name))


def _there(results: Path, names: Sequence[str], endings: Sequence[str]) -> "_Asked | None":
    """Figures that the fit has drawn already, to be copied."""
    from bowdenfit.results.figures_folder import captions_if_unchanged
    from bowdenfit.results.folder import FIGURES

    captions = captions_if_unchanged(results, names, endings)
    if captions is None:
        return None
    chosen = {name: text for name, text in captions.items() if name in names or not names}
    return chosen, tuple(captions), partial(_copy, results / FIGURES, tuple(chosen))


def _copy(there: Path, names: Sequence[str], place: Path, endings: Sequence[str]) -> None:
    for name in names:
        for ending in endings:
            shutil.copyfile(there / f"{name}.{ending}", place / f"{name}.{ending}")


def _anew(found: "Record | str | Path", names: Sequence[str], width: Quantity | None) -> "_Asked":
    """Figures to be drawn."""
    from bowdenfit.questions.figures import FIGURES, captions_of, page_width

    page = page_width(as_pair(width))
    shown, cable, mark = _shown(found, names)
    return captions_of(shown, cable, mark), tuple(FIGURES), partial(_draw, shown, (cable, page, mark))


def _draw(shown: Mapping[str, Any], look: tuple[str, float | None, str], place: Path, endings: Sequence[str]) -> None:
    from bowdenfit.questions.figures import draw_figure

    for name, data in shown.items():
        draw_figure(name, data, place, endings, *look)


def _formats(named: Sequence[str]) -> Sequence[str]:
    """Return the endings of the files; PNG where none is named."""
    from bowdenfit.errors import UsageError, suggest_name
    from bowdenfit.plots.write import FORMATS, PNG

    for name in named:
        if name not in FORMATS:
            raise UsageError(f"there is no format {name!r} for figures{suggest_name(name, list(FORMATS))}")
    return tuple(dict.fromkeys(named)) or (PNG,)


def _shown(found: "Record | str | Path", names: Sequence[str]) -> tuple[dict[str, Any], str, str]:
    """Data of all figures of a fit, or of some, the cable and `mark_of`; what is kept of it is not worked out again."""
    from bowdenfit.errors import UsageError, suggest_name
    from bowdenfit.questions.figures import FIGURES, figures_of, kept_figures, mark_of
    from bowdenfit.results.answer_cache import read_answers
    from bowdenfit.results.folder import FIT, read_page

    for name in names:
        if name not in FIGURES:
            raise UsageError(f"there is no figure {name!r}{suggest_name(name, list(FIGURES))}")
    shown = kept_figures(Path(found), names) if isinstance(found, str | Path) else {}
    if shown and isinstance(found, str | Path):
        cable, troubles = read_page(Path(found) / FIT)["description"]["name"], read_answers(Path(found))["troubles"]
    else:
        from bowdenfit.questions.summary.verdict import verdict

        if isinstance(found, str | Path):
            from bowdenfit.results.store import load

            found = load(Path(found))
        shown, cable, troubles = dict(figures_of(found, names)), found.name, tuple(verdict(found).troubles)
    if missing := [name for name in names if name not in shown]:
        raise UsageError(f"this fit has nothing to show in the figure {missing[0]!r}; leave it out.")
    return shown, cable, mark_of(troubles)


SUMMARY_VERB = Verb(
    summary,
    reply,
    """Print the summary of a fit.

    The summary is one page: the answer, whether to trust it, and what to do next.
    """,
    json="Print summary.json instead of the summary for people.",
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
