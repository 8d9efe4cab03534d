"""The results folder of a fit: whether it may be written, the checkpoint, and all files once the fit is done."""

import secrets
from dataclasses import replace
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any

from bowdenfit.dataset import Dataset
from bowdenfit.description import SamplerSettings
from bowdenfit.errors import DescriptionError, DiskError, StoreError, UsageError, system_error
from bowdenfit.kinds.settings import parse_description
from bowdenfit.results.folder import CHAIN, clear, read_checkpoint, refuse_to_overwrite, start_checkpoint
from bowdenfit.run.helpers import Assistant
from bowdenfit.verb import LARGEST_SEED
from bowdenfit.words import few, listed, printable

if TYPE_CHECKING:
    from bowdenfit.front_desk import Fit


def write_results(found: "Fit", folder: Path, figures: bool, helper: Assistant) -> tuple[str, ...]:
    """All files of the results folder, as far as possible at the same time; fit.json comes last of the fit's own.

    Args:
        found: The fit.
        folder: Its results folder.
        figures: Whether to draw them.
        helper: Who draws them.

    Returns:
        What is missing, in sentences; a fit whose figures or report fail is kept all the same.

    Raises:
        StoreError: The fit itself, or for want of room what belongs to it, could not be written.
    """
    from bowdenfit.questions.figures import FIGURES as FIGURE_NAMES
    from bowdenfit.questions.figures import captions_of
    from bowdenfit.questions.kept import answers_of
    from bowdenfit.questions.report.sections import report_page
    from bowdenfit.questions.summary.brief_words import summary_text
    from bowdenfit.questions.summary.words import full_text
    from bowdenfit.questions.writing import write_page
    from bowdenfit.results.captions import write_captions
    from bowdenfit.results.drawn import keep_drawn
    from bowdenfit.results.folder import DETAILS_TEXT, FIGURES, REPORT, SUMMARY_TEXT, write_text
    from bowdenfit.results.store import save
    from bowdenfit.run.drawing import Drawing

    if found.sampled is None:
        clear(folder)
    drawing, failed = Drawing(found, folder / FIGURES, helper), dict[str, Exception]()
    if figures:
        drawing.begin()
    data = drawing.data
    save(found, found.summary(), folder, True, answers_of(found), data)
    for name, words in ((SUMMARY_TEXT, summary_text), (DETAILS_TEXT, full_text)):
        try:
            write_text(folder / name, printable(words(found)))
        except Exception as error:
            failed[name] = error
    try:
        page = report_page(found, data)
        failed |= drawing.failed()
        helper.submit(write_page, page, folder / FIGURES, folder / REPORT).result()  # behind the figures, whose files it takes
    except Exception as error:
        failed |= drawing.failed() | {REPORT: error}
    try:
        if data:
            captions = captions_of({name: data[name] for name in data.keys() - failed}, found.name, drawing.mark)
            write_captions(captions, folder / FIGURES)
            if failed.keys().isdisjoint(FIGURE_NAMES):
                keep_drawn(folder, captions)
    except Exception as error:
        failed["captions"] = error
    return _what_is_missing(folder, failed)


def _what_is_missing(folder: Path, failed: dict[str, Exception]) -> tuple[str, ...]:
    """That some figures, texts or the report are missing, in a sentence each.

    Raises:
        DiskError: The same, where it is for want of room.
    """
    from bowdenfit.results.folder import DETAILS_TEXT, REPORT, SUMMARY_TEXT

    texts = [name for name in (SUMMARY_TEXT, DETAILS_TEXT) if name in failed]
    figures = [name for name in failed if name not in {REPORT, *texts}]
    some = f"its figures {few(figures)}" if len(figures) > 1 else f"its figure {few(figures)}"
    parts = (
        (figures, some, "drawn", f"draw them later with bowdenfit plot {folder}"),
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


def with_sampler(data: Dataset, method: str | None, mcmc: bool) -> Dataset:
    """The same data set, to be sampled by another method than its description says; the description's if None.

    Raises:
        UsageError: Nothing is sampled, or the sampler cannot reach what is asked of it.
    """
    if method is not None and not mcmc:
        raise UsageError("--no-mcmc leaves out what --sampler would do; leave one of them out.")
    asked = _with_method(data, method)
    _refuse_out_of_reach(asked.description.sampler)
    return asked


def _refuse_out_of_reach(settings: SamplerSettings) -> None:
    """Refuse a target that sampling would miss at its last step, however well it goes."""
    if settings.target_ess > settings.most_draws:
        raise UsageError(
            f"sampler.target_ess asks for {settings.target_ess:,} effective draws, but after sampler.max_steps = "
            f"{settings.max_steps:,} steps there are {settings.most_draws:,} draws at most; ask for fewer, or allow more steps."
        )


def _with_method(data: Dataset, method: str | None) -> Dataset:
    if method is None:
        return data
    sampler = data.description.sampler.model_copy(update={"method": method})
    return replace(data, description=data.description.model_copy(update={"sampler": sampler}))


def _fingerprint(data: Dataset, seed: int) -> dict[str, Any]:
    """What must not change between an interrupted fit and its continuation; how long to sample may."""
    return {"description": _for_good(data.description.to_json()), "sha256": data.sha256, "seed": seed}


def _for_good(description: dict[str, Any]) -> dict[str, Any]:
    """A description without what may change."""
    free = {"max_steps", "target_r_hat", "target_ess"}
    return description | {"sampler": {k: v for k, v in description["sampler"].items() if k not in free}}


def _with_defaults(description: dict[str, Any]) -> dict[str, Any]:
    """A checkpoint's description as it reads today: settings that have come since stand at their defaults."""
    try:
        return _for_good(parse_description(description).to_json())
    except DescriptionError:
        return description


def choose_seed(folder: Path | None, data: Dataset, mcmc: bool, seed: int | None, resume: bool, force: bool) -> int:
    """The seed, once it is clear that the results have a place, or that the checkpoint there belongs to this fit."""
    if resume and (folder is None or not mcmc):
        raise UsageError("--resume needs the results folder of a fit with MCMC; name it with --output.")
    if folder is None or not resume:
        if folder is not None:
            refuse_to_overwrite(folder, force)
        return secrets.randbelow(LARGEST_SEED) if seed is None else seed
    before = read_checkpoint(folder)
    now = _fingerprint(data, before["seed"] if seed is None else seed)
    before["description"] = _with_defaults(before["description"])
    changed = [key for key in now if now[key] != before[key]]
    if changed:
        what = {"description": "the description", "sha256": "an input file", "seed": "the seed"}[changed[-1]]
        raise StoreError(
            f"{folder} cannot be resumed because {what} changed since; undo the change, or start over with --force."
        )
    return int(before["seed"])


def start_checkpointing(folder: Path | None, data: Dataset, seed: int, resume: bool) -> Path | None:
    """The checkpoint to sample into, in a folder cleared of what was there; nothing is touched before this."""
    if folder is None:
        return None
    if not resume:
        clear(folder)
        start_checkpoint(folder / CHAIN, _fingerprint(data, seed))
    return folder / CHAIN
