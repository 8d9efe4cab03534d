"""What the fits in a folder say, in a line each: date, answer, verdict, seed; and whether their data have changed since."""

import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from bowdenfit.addons.app.elements import address, block, link, text
from bowdenfit.addons.app.page_words import page_words
from bowdenfit.addons.app.workbench import Workbench, file_checksum
from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.errors import BowdenfitError
from bowdenfit.results.folder import FIT, SUMMARY, SUMMARY_TEXT, read_page, read_text
from bowdenfit.words import listed, shown

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
        changed: Files of that which are not as they were fitted.
    """

    name: str
    date: str = ""
    answer: str = ""
    state: str = BAD
    seed: str = ""
    data_set: str = ""
    changed: tuple[str, ...] = ()

    @property
    def change(self) -> str:
        """Which data have changed since, in a sentence; empty where none have."""
        if not self.changed:
            return ""
        names = listed([shown(name) for name in self.changed])
        return f"Changed since this fit: {names}. Fit again for an answer from the data as they are now."


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
        verdict, provenance, checksums = summary["verdict"], page["provenance"], page["sha256"]
        date = str(provenance["created"])[:16].replace("T", " ")
        answer, state = f"{_SENTENCE.split(words)[0].rstrip('.')}.", _state_of(verdict)
        data_set, changed = _find_changes(workbench, name, {str(file): str(checksum) for file, checksum in checksums.items()})
        return PastFit(name, date, answer[:300], state, str(provenance["seed"]), data_set, changed)
    except (BowdenfitError, OSError, KeyError, TypeError, AttributeError):
        return PastFit(name)


def _state_of(verdict: Any) -> str:
    """Return whether a fit is to be trusted."""
    if not verdict["trusted"]:
        return BAD
    return DOUBTFUL if verdict["doubts"] or not verdict["usable"] else GOOD


def _find_changes(workbench: Workbench, name: str, checksums: dict[str, str]) -> tuple[str, tuple[str, ...]]:
    """Return the data set that a fit is likely to be of, and the files of it that are not as they were fitted."""
    data_sets, described = workbench.data_sets(), checksums.get(DESCRIPTION_FILE, "")
    by_name = [data_set for data_set in data_sets if f"{name}-".startswith(f"{workbench.title_of(data_set)}-")]
    folders = {data_set: workbench.data_set(data_set) for data_set in data_sets}
    likely = by_name or [key for key, path in folders.items() if file_checksum(path / DESCRIPTION_FILE) == described]
    if not likely:
        return "", ()
    data_set = max(likely, key=lambda candidate: len(workbench.title_of(candidate)))
    folder = folders[data_set]
    return data_set, tuple(file for file, checksum in checksums.items() if _is_changed(folder, file, checksum))


def _is_changed(folder: Path, file: str, checksum: str) -> bool:
    """Whether a file of a data set is not as it was fitted; one whose folder is not known is looked for."""
    path = PurePosixPath(file)
    if path.is_absolute() or ".." in path.parts or (folder / path).is_dir():
        return False
    if not (folder / path).is_file() and path.name != DESCRIPTION_FILE:
        namesakes = [other for other in folder.rglob("*") if other.name == path.name]
        return all(file_checksum(other) != checksum for other in namesakes)
    return file_checksum(folder / path) != checksum


def show_past_fit(fit: PastFit) -> None:
    """Show a fit as a card says it."""
    if fit.answer:
        text(page_words(fit.answer), "p", "said", dir="auto")
        text(_VERDICTS[fit.state], "p", f"state {fit.state}")
        text(f"{fit.date} UTC, seed {fit.seed}", "p", "hint")
    else:
        text("It cannot be read: its files are damaged, or of another version.", "p", "state bad")
    if fit.change:
        with block("div", "verdict doubtful"):
            text(fit.change)


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
