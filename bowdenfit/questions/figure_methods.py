"""The figures of a fit as methods, for notebooks: `fit.plot.efficiency()`."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from bowdenfit.arguments import NumberWithUnit
from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.questions.figures import FIGURES, collect_figure_data, draw_with_title, parse_page_width, warning_mark
from bowdenfit.questions.summary.verdict import assess_fit
from bowdenfit.results.record import Record
from bowdenfit.words import listed

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure


class NoSuchFigureError(UsageError, AttributeError):
    """There is no figure of that name."""


class FigureMethods:
    """A method for each figure that a fit has something to show in, which gives the figure; `dir()` lists them.

    Figures are matplotlib's; pyplot does not know them, so that they are shown once and go when nobody holds them.

    Args:
        fit: The fit.
    """

    def __init__(self, fit: Record) -> None:
        self._fit = fit
        self._data: dict[str, Any] = {}  # of the figures asked for; None where there is nothing to show

    def __call__(self, name: str, width: NumberWithUnit | None = None) -> "Figure":
        """One of the figures.

        Args:
            name: Which.
            width: On which words stay as large as they are, such as (3.5, "in"); what suits the figure if omitted.

        Raises:
            UsageError: The fit has no such figure, and which it has; or none can be so wide.
        """
        if name not in FIGURES:
            raise NoSuchFigureError(f"there is no figure {name!r}{suggest_name(name, list(FIGURES))}")
        if self._data_of(name) is None:
            raise UsageError(f"this fit has nothing to show in the figure {name!r}; it has {listed(dir(self))}.")
        mark = warning_mark(assess_fit(self._fit).troubles)
        return draw_with_title(name, self._data_of(name), self._fit.name, parse_page_width(width), mark)

    def __getattr__(self, name: str) -> "Callable[..., Figure]":
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in FIGURES:
            raise NoSuchFigureError(f"there is no figure {name!r}{suggest_name(name, list(FIGURES))}")
        return partial(self, name)

    def __dir__(self) -> list[str]:
        return [name for name in FIGURES if self._data_of(name) is not None]

    def __repr__(self) -> str:
        return f"Figures of {self._fit.name}: {', '.join(f'plot.{name}()' for name in dir(self))}"

    def _data_of(self, name: str) -> Any:
        if name not in self._data:
            self._data[name] = dict(collect_figure_data(self._fit, [name])).get(name)
        return self._data[name]
