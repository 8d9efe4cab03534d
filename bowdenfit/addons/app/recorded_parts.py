"""Recordings of a data set, of which a stretch or all is left out with a reason, and taken in again."""

from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TypeAlias

from nicegui import ui

from bowdenfit.addons.app.description_edit import Part, name_part, preview_exclusion
from bowdenfit.addons.app.elements import block, button, field, text, text_input
from bowdenfit.addons.app.equivalent_command import EquivalentCommand
from bowdenfit.addons.app.frame import attempt
from bowdenfit.addons.app.measured_rows import RecordedFile
from bowdenfit.errors import UsageError
from bowdenfit.words import counted

KIND = "recordings"
ChangePart: TypeAlias = Callable[[str, str, Part, str | None], Awaitable[None]]
_MOST_FILES = 200  # that a page shows; a judgement
_SHOW_FORM = "document.getElementById('leave-out')?.scrollIntoView({block: 'nearest'})"


class RecordedParts:
    """The recordings of a data set with what is left out of each, and a form that leaves more out.

    Args:
        folder: The data set.
        files: Files of the recordings.
        change: Leaves a part out (kind, file, part, reason), or takes it in again where the reason is None.
    """

    def __init__(self, folder: Path, files: Sequence[RecordedFile], change: ChangePart) -> None:
        self._folder, self._change, self._files = folder, change, files
        self._form = block("div", id="leave-out", aria_live="polite")
        self._file, self._is_stretch = "", False
        self._typed = {"start": "", "end": "", "reason": ""}
        excluded = sum(len(file.excluded) for file in files)
        with block("details") as part:
            count = counted(len(files), "recording")
            text(f"{count}, {counted(excluded, 'part')} left out" if excluded else count, "summary")
            with block("ul"):
                for file in files[:_MOST_FILES]:
                    self._show_file(file)
            if len(files) > _MOST_FILES:
                text(f"The first {_MOST_FILES} recordings.", classes="hint")
        if excluded:
            part.props["open"] = True

    def _show_file(self, file: RecordedFile) -> None:
        """Show a recording with what is left out of it."""
        with block("li"):
            text(file.file, "strong", dir="auto")
            for part, reason in file.excluded:
                with block("div", "row"):
                    text(f"{name_part(part)}: left out by you, {reason}", classes="hint", dir="auto")
                    self._offer("Use it again", f"{name_part(part)} of {file.file}", file.file, part)
            if not any(part is None for part, _ in file.excluded):
                with block("div", "row"):
                    for words, is_stretch in (("Leave a stretch out", True), ("Leave all of it out", False)):
                        self._offer(words, file.file, file.file, is_stretch)

    def _offer(self, words: str, about: str, file: str, part: Part | bool) -> None:
        """Show a button that takes a part in again, or opens the form."""

        async def press() -> None:
            if isinstance(part, bool):
                self._open(file, part)
                ui.run_javascript(f"document.getElementById('{'part-start' if part else 'part-reason'}')?.focus()")
            else:
                await attempt(lambda: self._change(KIND, file, part, None))

        button(words, press, key=f"{words} {about}", aria_label=f"{words}: {about}")

    def pick(self, file: str, time: float) -> None:
        """Take a click on the chart of a recording for the start of a stretch, the next for its end.

        Args:
            file: Its file, as seen from the data set.
            time: Time on its clock [s].
        """
        is_begun = self._is_stretch and self._file == file and bool(self._typed["start"]) and not self._typed["end"]
        if is_begun:
            first = _read_seconds(self._typed["start"])
            start, end = sorted((time if first is None else first, time))
            self._typed |= {"start": f"{start:.12g}", "end": f"{end:.12g}"}
        else:
            self._typed |= {"start": f"{time:.12g}", "end": ""}
        self._open(file, True)

    def _open(self, file: str, is_stretch: bool) -> None:
        """Show the form for a stretch or for all of a recording, with what has been typed."""
        if file != self._file:
            self._typed["reason"] = ""
        if not is_stretch or (file != self._file and self._typed["end"]):
            self._typed |= {"start": "", "end": ""}
        self._file, self._is_stretch = file, is_stretch
        self._form.clear()
        with self._form, block("div", "asked"):
            if is_stretch:
                how = "Click on the chart where it begins and ends, or write the times on its clock."
                text(f"Which stretch of {file} is left out? {how}")
                with block("div", "row"):
                    for key, label in (("start", "Start (s)"), ("end", "End (s)")):
                        with field(label, f"part-{key}"):
                            text_input(f"part-{key}", self._typed[key], partial(self._take, key))
            hint = "It is saved in cable.toml, and stands in the report."
            with field("Why?" if is_stretch else f"Why is all of {file} left out?", "part-reason", hint):
                text_input("part-reason", self._typed["reason"], partial(self._take, "reason"))
            with block("div", "row"):
                button("Leave it out", lambda: attempt(self._leave_out), "primary", key="leave-part-out")
                button("Keep it", self._close)
            self._lines = EquivalentCommand([""], "In cable.toml:", key="part-lines")
        self._preview()
        ui.run_javascript(_SHOW_FORM)

    def _take(self, key: str, typed: str) -> None:
        self._typed[key] = typed
        self._preview()

    def _preview(self) -> None:
        """Show the lines of cable.toml, once the times are numbers."""
        with suppress(UsageError):
            reason = self._typed["reason"] or "..."
            self._lines.show(preview_exclusion(self._folder, KIND, self._file, self._read_part(), reason))

    def _close(self) -> None:
        self._form.clear()
        self._file, self._typed = "", dict.fromkeys(self._typed, "")

    def _read_part(self) -> Part:
        """Return what is to be left out.

        Raises:
            UsageError: A time is no number, or the end is not after the start.
        """
        if not self._is_stretch:
            return None
        start, end = (_read_seconds(self._typed[key]) for key in ("start", "end"))
        if start is None or end is None or not start < end:
            raise UsageError("write where the stretch starts and where it ends, in seconds, such as 12.5 and 14.")
        return start, end

    async def _leave_out(self) -> None:
        """Leave out what the form says.

        Raises:
            UsageError, DescriptionError, StoreError: cable.toml cannot be changed so.
        """
        await self._change(KIND, self._file, self._read_part(), self._typed["reason"])


def _read_seconds(typed: str) -> float | None:
    """Return a time that is typed, with a decimal point or comma; None where it is no number."""
    with suppress(ValueError):
        return float(typed.strip().removesuffix("s").replace(",", "."))
    return None
