"""Figures of a fit, drawn by another process while this one goes on."""

from collections.abc import Iterable
from concurrent.futures import Future
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bowdenfit.plots.write import FORMATS
from bowdenfit.questions.figures import AT_ONCE, FIGURES, draw_figure, figures_of, mark_of
from bowdenfit.questions.summary.verdict import verdict
from bowdenfit.run.helpers import Assistant

if TYPE_CHECKING:
    from bowdenfit.front_desk import Fit


class Drawing:
    """All figures of a fit. Whatever is wrong with one, the others are drawn.

    Args:
        found: The fit.
        folder: Where the figures go.
        helper: Who draws them.

    Attributes:
        data: What each figure shows, by its name.
        mark: See `mark_of`; empty as long as it is not known.
    """

    def __init__(self, found: "Fit", folder: Path, helper: Assistant) -> None:
        self.data: dict[str, Any] = {}
        self.mark = ""
        self._found, self._folder, self._helper = found, folder, helper
        self._drawn: dict[str, Future[Any]] = {}
        self._failed: dict[str, Exception] = {}

    def begin(self) -> None:
        """Ask for all of them, first those whose data are there before it is known whether the fit can be trusted."""
        self._ask(AT_ONCE)
        self.mark = mark_of(verdict(self._found).troubles)
        self._ask(name for name in FIGURES if name not in AT_ONCE)
        if self.mark:
            failed = self.failed()  # once these are drawn, so that none is drawn twice at a time
            self._ask(name for name in AT_ONCE if name not in failed)

    def _ask(self, names: Iterable[str]) -> None:
        for name in names:
            try:
                if name not in self.data:
                    self.data |= dict(figures_of(self._found, [name]))
                if name in self.data:
                    of = name, self.data[name], self._folder, FORMATS, self._found.name, None, self.mark
                    self._drawn[name] = self._helper.submit(draw_figure, *of)  # meanwhile, the next
            except Exception as error:
                self._failed[name] = error

    def failed(self) -> dict[str, Exception]:
        """What went wrong with figures, by name, once all that were asked for are drawn."""
        for name, figure in self._drawn.items():
            try:
                figure.result()
            except Exception as error:
                self._failed[name] = error
        return self._failed
