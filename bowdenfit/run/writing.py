"""Write the results folder of a finished fit: the fit itself and its texts, and then figures and the report."""

from collections.abc import Callable
from pathlib import Path
from textwrap import shorten
from typing import Any

import jax

from bowdenfit.errors import DiskError, system_error
from bowdenfit.finished_fit import Fit, collect_answers
from bowdenfit.outputs import write_text
from bowdenfit.plots.write import PNG
from bowdenfit.questions.figures import FIGURES as FIGURE_NAMES
from bowdenfit.questions.figures import collect_figure_data, titles_and_captions, warning_mark, write_figure_files
from bowdenfit.questions.report.page import report_page
from bowdenfit.questions.summary.brief import summary_text
from bowdenfit.questions.summary.details import details_text
from bowdenfit.questions.summary.verdict import assess_fit
from bowdenfit.questions.writing import write_page
from bowdenfit.results.answer_cache import record_drawn_figures, record_texts, write_captions
from bowdenfit.results.folder import DETAILS_TEXT, FIGURE_DATA, FIGURES, REPORT, SUMMARY_TEXT, remove_earlier_fit
from bowdenfit.results.store import save, save_figure_data
from bowdenfit.stages import announce_stage
from bowdenfit.words import few, listed, printable


class _Attempts(dict[str, Exception]):
    """Steps that failed, by what each was to write; the others go on."""

    def attempt(self, name: str, step: Callable[..., Any], *arguments: Any) -> None:
        """Take a step, and note its error."""
        try:
            step(*arguments)
        except Exception as error:
            self[name] = error


@jax.enable_x64(True)
def save_results(fit: Fit, folder: Path) -> tuple[str, ...]:
    """Write the fit itself, with fit.json last, and its texts: a folder that every command reads, without figures and report.

    Args:
        fit: The fit.
        folder: Its results folder.

    Returns:
        What is missing, in sentences; a fit whose texts fail is kept all the same.

    Raises:
        StoreError: The fit itself, or for want of room what belongs to it, could not be written.
    """
    if fit.sampled is None:
        remove_earlier_fit(folder)
    failed = _Attempts()
    announce_stage("working out the answers")
    save(fit, fit.summary(), folder, True, collect_answers(fit))
    failed.attempt(SUMMARY_TEXT, lambda: write_text(folder / SUMMARY_TEXT, printable(summary_text(fit))))
    failed.attempt(DETAILS_TEXT, lambda: write_text(folder / DETAILS_TEXT, printable(details_text(fit))))
    if not failed:
        failed.attempt(SUMMARY_TEXT, record_texts, folder)
    return _what_is_missing(folder, failed)


@jax.enable_x64(True)
def draw_results(fit: Fit, folder: Path, figures: bool) -> tuple[str, ...]:
    """Draw the figures of a fit into the results folder that holds it, and write its report.

    Args:
        fit: The fit.
        folder: Its results folder.
        figures: Whether to draw them.

    Returns:
        What is missing, in sentences.

    Raises:
        StoreError: There is no room for what is missing.
    """
    failed, data = _Attempts(), dict[str, Any]()
    if figures:
        announce_stage("working out what figures show")
        data = _figure_data(fit, failed)
        failed.attempt(FIGURE_DATA, save_figure_data, data, folder)
    mark = warning_mark(assess_fit(fit).troubles)
    for name, shown in data.items():
        announce_stage(f"drawing {name}")
        failed.attempt(name, write_figure_files, name, shown, folder / FIGURES, (PNG,), fit.name, None, mark)
    announce_stage("writing the report")
    drawn_figures = {name: shown for name, shown in data.items() if name not in failed}
    failed.attempt(REPORT, lambda: write_page(report_page(fit, data), folder / FIGURES, folder / REPORT))
    if data:
        captions, is_complete = titles_and_captions(drawn_figures, fit.name, mark), len(drawn_figures) == len(data)
        failed.attempt("captions", _write_captions, folder, captions, is_complete)
    return _what_is_missing(folder, failed)


def _figure_data(fit: Fit, failed: dict[str, Exception]) -> dict[str, Any]:
    """Return what each figure shows, by its name, and note those for which that cannot be worked out."""
    data: dict[str, Any] = {}
    for name in FIGURE_NAMES:
        try:
            data |= dict(collect_figure_data(fit, [name]))
        except Exception as error:
            failed[name] = error
    return data


def _write_captions(folder: Path, captions: dict[str, str], is_complete: bool) -> None:
    write_captions(captions, folder / FIGURES)
    if is_complete:
        record_drawn_figures(folder, captions)


def _what_is_missing(folder: Path, failed: dict[str, Exception]) -> tuple[str, ...]:
    """Return a sentence for each group of figures, texts or report that is missing.

    Raises:
        DiskError: The same, where it is for want of room.
    """
    texts = [name for name in (SUMMARY_TEXT, DETAILS_TEXT) if name in failed]
    data = [FIGURE_DATA] if FIGURE_DATA in failed else []
    figures = [name for name in failed if name not in {REPORT, *texts, *data}]
    some = f"its figures {few(figures)}" if len(figures) > 1 else f"its figure {few(figures)}"
    parts = (
        (figures, some, "drawn", f"draw them later with bowdenfit plot {folder}"),
        (data, "what its figures show", "kept", "it is worked out again where they are drawn"),
        (texts, listed(texts), "written", f"bowdenfit summary {folder} prints it"),
        ([REPORT] if REPORT in failed else [], "its report", "written", f"write it later with bowdenfit report {folder}"),
    )
    sentences = tuple(
        f"{folder} holds the whole fit, but {part} could not be {done} ({_why(failed[names[0]])}); {remedy}."
        for names, part, done, remedy in parts
        if names
    )
    if any(isinstance(system_error(error) or error, DiskError) for error in failed.values()):
        raise DiskError(" ".join(sentences))
    return sentences


def _why(error: Exception) -> str:
    return shorten(" ".join(str(error).split()) or type(error).__name__, 200)
