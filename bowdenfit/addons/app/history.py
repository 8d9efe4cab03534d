"""What the fits in a folder say, in a line each: date, answer, verdict, seed; and whether their data have changed since."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bowdenfit.addons.app.elements import address, block, link, text
from bowdenfit.addons.app.page_words import page_words
from bowdenfit.addons.app.workbench import Workbench, file_checksum
from bowdenfit.errors import BowdenfitError
from bowdenfit.results.data_changes import DataChanges, find_data_changes
from bowdenfit.results.folder import FIT, SUMMARY, SUMMARY_TEXT, read_page, read_text

GOOD, DOUBTFUL, BAD = "good", "doubtful", "bad"
_VERDICTS = {GOOD: "Trustworthy.", DOUBTFUL: "Trustworthy, with doubts.", BAD: "Not trustworthy."}
_SENTENCE = re.compile(r"\.\s+(?=[A-Z])")


@dataclass(frozen=True)
class PastFit:
    """A fit as a line says it.

    Args:
        name: Name of its folder.
        date: When it was made, UTC; empty where it cannot be read.
        answer: First sentence of its summary.
        state: Whether it is to be trusted: "good", "doubtful" or "bad".
        seed: Its random seed; empty where it cannot be read.
        data_set: Data set that it is of; empty where none here is likely to be.
        changes: What became of its data since.
    """

    name: str
    date: str = ""
    answer: str = ""
    state: str = BAD
    seed: str = ""
    data_set: str = ""
    changes: DataChanges = field(default_factory=DataChanges)


def read_past_fit(workbench: Workbench, name: str) -> PastFit:
    """Return what a finished fit says; of one that is damaged its name alone.

    Args:
        workbench: Where it lies.
        name: Its name.
    """
    try:
        folder = workbench.results(name)
        page, summary = read_page(folder / FIT), read_page(folder / SUMMARY)
        words = " ".join(read_text(folder / SUMMARY_TEXT).split())
        verdict, provenance = summary["verdict"], page["provenance"]
        date = str(provenance["created"])[:16].replace("T", " ")
        answer, state = f"{_SENTENCE.split(words)[0].rstrip('.')}.", _state_of(verdict)
        changes = find_data_changes(folder, file_checksum)
        data_set = _name_data_set(workbench, changes.folder)
        return PastFit(name, date, answer[:300], state, str(provenance["seed"]), data_set, changes)
    except (BowdenfitError, OSError, KeyError, TypeError, AttributeError):
        return PastFit(name)


def _state_of(verdict: Any) -> str:
    """Return whether a fit is to be trusted."""
    if not verdict["trusted"]:
        return BAD
    return DOUBTFUL if verdict["doubts"] or not verdict["usable"] else GOOD


def _name_data_set(workbench: Workbench, folder: Path | None) -> str:
    """Return the name of the data set in a folder; empty where it is none of the workbench."""
    names = workbench.data_sets() if folder is not None else ()
    return next((name for name in names if workbench.data_set(name).resolve() == folder), "")


def show_past_fit(fit: PastFit) -> None:
    """Show a fit as a card says it."""
    if fit.answer:
        text(page_words(fit.answer), "p", "said", dir="auto")
        text(_VERDICTS[fit.state], "p", f"state {fit.state}")
        text(f"{fit.date} UTC, seed {fit.seed}", "p", "hint")
    else:
        text("It cannot be read: its files are damaged, or of another version.", "p", "state bad")
    if change := fit.changes.describe():
        with block("div", "verdict doubtful"):
            text(change)


async def show_history(workbench: Workbench, data_set: str) -> None:
    """Show the fits of a data set, the newest first."""
    finished = [fit.name for fit in workbench.fits() if fit.finished]
    fits = [await workbench.compute(read_past_fit, workbench, name) for name in finished]
    own_fits = sorted((fit for fit in fits if fit.data_set == data_set), key=lambda fit: fit.date, reverse=True)
    if not own_fits:
        text("It has not been fitted yet.", classes="hint")
        return
    with block("ul", "cards"):
        for fit in own_fits:
            with block("li"):
                text(fit.name, "h3", dir="auto")
                show_past_fit(fit)
                with block("div", "row"):
                    link("See the answer", address("fit", fit.name), "button", aria_label=f"See the answer of {fit.name}")
