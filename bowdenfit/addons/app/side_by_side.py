"""The page of two fits side by side."""

from nicegui import ui

from bowdenfit.addons.app.elements import block, choice, field, markup, text
from bowdenfit.addons.app.frame import frame, refused
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.errors import BowdenfitError
from bowdenfit.pages.page import render_section
from bowdenfit.questions import compare as compare_room


class TwoFitsPage:
    """Two fits on one chart, with the difference and its probability.

    Args:
        workbench: Where the fits are.
        names: Names of the two; the first two that there are for those that are not.
    """

    def __init__(self, workbench: Workbench, names: tuple[str, str]) -> None:
        known = [fit.name for fit in workbench.fits() if fit.finished]
        self._workbench, others = workbench, [name for name in known if name not in names]
        self._names = [name if name in known else others.pop(0) if others else "" for name in names]
        with frame("Two cables side by side"):
            if len(known) < 2:
                text("Fewer than two fits; fit another cable first.")
                return
            with block("div", "row"):
                for number, label in enumerate(("One cable", "The other")):
                    with field(label, f"fit-{number}"):
                        self._choice(number, known)
            self._place = block("div", role="status")
            ui.timer(0.05, self._compare, once=True)

    def _choice(self, number: int, known: list[str]) -> None:
        """Show the menu of one of the two."""

        async def change(name: str) -> None:
            self._names[number] = name
            await self._compare()

        choice(f"fit-{number}", self._names[number], [(name, name) for name in known], change)

    async def _compare(self) -> None:
        """Compare the two that are chosen."""
        self._show_alone("Comparing ...")
        one, other = self._names
        if one == other:
            self._show_alone("Both are the same fit; choose another.")
            return
        try:
            fits = await self._workbench.open_fit(one), await self._workbench.open_fit(other)
            comparison = await self._workbench.compute(compare_room.contrast_cables, *fits, (one, other))
            words = render_section(comparison.section, {})
        except BowdenfitError as error:
            self._place.clear()
            with self._place:
                refused(str(error))
            return
        self._place.clear()
        with self._place:
            markup(words, "div", id="comparison")

    def _show_alone(self, sentence: str) -> None:
        self._place.clear()
        with self._place:
            text(sentence)
