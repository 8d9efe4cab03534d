"""The page of two fits: two cables beside each other, or two fits of the same measurements."""

import shlex
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import ui

from bowdenfit.addons.app.elements import block, button, choice, field, markup, text
from bowdenfit.addons.app.equivalent_command import EquivalentCommand, write_command
from bowdenfit.addons.app.frame import frame, refused
from bowdenfit.addons.app.page_words import page_html
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.errors import BowdenfitError
from bowdenfit.pages.page import render_section
from bowdenfit.questions import compare as compare_room
from bowdenfit.questions.compare.verb import VERB as COMPARE
from bowdenfit.questions.compare.verb import compare
from bowdenfit.words import listed

if TYPE_CHECKING:
    from bowdenfit.finished_fit import Fit


_CONTRAST = """import bowdenfit as bf
from bowdenfit.questions.compare import contrast_cables
for sentence in contrast_cables(bf.load({0!r}), bf.load({1!r}), {2}).sentences():
    print(sentence)"""


class TwoFitsPage:
    """Two cables on one chart, with the difference and its probability; of the same measurements, which fit predicts better.

    Args:
        workbench: Where the fits are.
        names: Names of the two; the first two that there are for those that are not.
    """

    def __init__(self, workbench: Workbench, names: tuple[str, str]) -> None:
        known = [fit.name for fit in workbench.fits() if fit.finished]
        self._workbench, others = workbench, [name for name in known if name not in names]
        self._names = tuple(name if name in known else others.pop(0) if others else "" for name in names)
        with frame("Compare two fits"):
            if len(known) < 2:
                text("There are fewer than two fits; fit another data set first.")
                return
            with block("div", "row"):
                for number, label in enumerate(("First fit", "Second fit")):
                    with field(label, f"fit-{number}"):
                        self._choice(number, known)
            self._place = block("div", role="status")
            ui.timer(0.05, self._compare, once=True)

    def _choice(self, number: int, known: list[str]) -> None:
        """Show the menu of one of the two."""

        async def change(name: str) -> None:
            self._names = (name, self._names[1]) if number == 0 else (self._names[0], name)
            await self._compare()

        choice(f"fit-{number}", self._names[number], [(name, name) for name in known], change)

    async def _compare(self) -> None:
        """Compare the two that are chosen; of the same measurements only when asked, as that takes long."""
        self._show_alone("Comparing ...")
        one, other = self._names
        if one == other:
            self._show_alone("Both are the same fit; choose another.")
            return
        try:
            fits = {name: await self._workbench.open_fit(name) for name in self._names}
            if shared := compare_room.shared_files(*fits.values()):
                self._offer(fits, shared)
                return
            comparison = await self._workbench.compute(compare_room.contrast_cables, *fits.values(), self._names)
            self._show(await self._workbench.compute(render_section, comparison.section, {}))
            folders = {name: path.relative_to(self._workbench.folder).as_posix() for name, path in self._folders.items()}
            self._show_command(shlex.join(["python", "-c", _CONTRAST.format(*folders.values(), self._names)]))
        except BowdenfitError as error:
            self._refuse(error)

    def _offer(self, fits: "dict[str, Fit]", shared: list[str]) -> None:
        """Say that two fits are of the same measurements, with the button that compares them as models."""

        async def compare_models() -> None:
            self._show_alone("Comparing; readings are left out one at a time, which may take a minute ...")
            try:
                self._show(await self._workbench.compute(_render_models, fits))
            except BowdenfitError as error:
                self._refuse(error)

        self._show_alone(f"Both fits are of the same measurements ({listed(shared)}): they differ in the model, or by chance.")
        with self._place, block("div", "row"):
            button("Compare how well they predict", compare_models)
        self._show_command(write_command(COMPARE, {"fits": self._folders}, self._workbench.folder))

    @property
    def _folders(self) -> dict[str, Path]:
        """Results folders of the two."""
        return {name: self._workbench.results(name) for name in self._names}

    def _show_command(self, command: str) -> None:
        with self._place:
            EquivalentCommand([command], f"In {self._workbench.folder}:", key="compare-command")

    def _show(self, words: str) -> None:
        self._place.clear()
        with self._place:
            markup(page_html(words), "div", id="comparison")

    def _refuse(self, error: BowdenfitError) -> None:
        self._place.clear()
        with self._place:
            refused(str(error))

    def _show_alone(self, sentence: str) -> None:
        self._place.clear()
        with self._place:
            text(sentence)


def _render_models(fits: "dict[str, Fit]") -> str:
    """Return which of two fits of the same measurements predicts better, and what changes, as HTML."""
    sections = compare_room.comparison_page(compare(fits)).sections
    return "".join(f"<h2>{escape(part.title)}</h2>{render_section(part, {})}" for part in sections)
