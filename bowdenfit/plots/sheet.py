"""Many small panels on one sheet, drawn in inches.

A matplotlib Axes costs about 10 ms to make and draw in each format, so a grid of dozens takes seconds; here the whole
sheet is one Axes, a panel is a box on it, and all panels share a few collections.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import empty_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TICK = 0.035  # in
TICK_SIZE = 6  # pt
NUMBER_SPACE, NUMBER_ROW = 0.075, 0.16  # in, from one number to the next: a character across, and a row up
LETTER = 0.053  # in, width of a character of a number
LEAST_SPACE = 1.1 * LETTER / NUMBER_SPACE  # of that from one number to the next, where there would be one number else


@dataclass(frozen=True)
class Panel:
    """A box on the sheet [in] and the limits of its two axes."""

    left: float
    bottom: float
    width: float
    height: float
    x_limits: tuple[float, float]
    y_limits: tuple[float, float]

    def x(self, values: np.ndarray) -> np.ndarray:
        """Places across the sheet [in]."""
        low, high = self.x_limits
        return self.left + self.width * (np.clip(values, low, high) - low) / (high - low)

    def y(self, values: np.ndarray) -> np.ndarray:
        """Places up the sheet [in]."""
        low, high = self.y_limits
        return self.bottom + self.height * (np.clip(values, low, high) - low) / (high - low)

    def path(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Points on the sheet, one a row."""
        return np.column_stack([self.x(x), self.y(y)])


class PanelSheet:
    """A figure whose only Axes measures inches from the lower left corner."""

    def __init__(self, width: float, height: float) -> None:
        self.figure = empty_page(width, height)
        self.axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self.axes.set(xlim=(0, width), ylim=(0, height))
        self.axes.set_axis_off()
        self._strokes: list[np.ndarray] = []

    def lines(self, paths: Sequence[np.ndarray], **style: object) -> None:
        """Draw lines, all in one style."""
        from matplotlib.collections import LineCollection

        self.axes.add_collection(LineCollection(paths, **style), autolim=False)  # type: ignore[arg-type]

    def areas(self, outlines: Sequence[np.ndarray], **style: object) -> None:
        """Fill areas, all in one style."""
        from matplotlib.collections import PolyCollection

        self.axes.add_collection(PolyCollection(outlines, linewidth=0, **style), autolim=False)  # type: ignore[arg-type]

    def text(self, x: float, y: float, words: str, **style: object) -> None:
        """Write at a place."""
        self.axes.text(x, y, words, **style)  # type: ignore[arg-type]

    def frames(self, panels: Iterable[Panel]) -> None:
        """The left and lower side of every panel."""
        corners = [[(p.left, p.bottom + p.height), (p.left, p.bottom), (p.left + p.width, p.bottom)] for p in panels]
        self._strokes += [np.array(corner) for corner in corners]

    def ticks_below(self, panel: Panel, numbers: bool = True, whole: bool = False) -> None:
        """Ticks of the lower axis, with numbers or without, at whole numbers only or not."""
        over, most = TICK / panel.width, panel.width / NUMBER_SPACE
        values, texts = ticks(panel.x_limits, lambda texts: most / max(map(len, texts)), whole, over)
        places = panel.x(values)
        self._strokes += [np.array([(x, panel.bottom), (x, panel.bottom - TICK)]) for x in places]
        for x, number in zip(places, texts if numbers else (), strict=numbers):
            half = LETTER * len(number) / 2 - TICK  # of it that may not stand beyond the panel, clear of the neighbors' numbers
            middle = np.clip(x, panel.left + half, max(panel.left + panel.width - half, panel.left + half))
            self.text(middle, panel.bottom - 1.8 * TICK, number, ha="center", va="top", fontsize=TICK_SIZE)

    def ticks_left(self, panel: Panel) -> None:
        """Ticks of the left axis, with numbers."""
        values, texts = ticks(panel.y_limits, lambda _: panel.height / NUMBER_ROW)
        places = panel.y(values)
        self._strokes += [np.array([(panel.left, y), (panel.left - TICK, y)]) for y in places]
        for y, number in zip(places, texts, strict=True):
            self.text(panel.left - 1.6 * TICK, y, number, ha="right", va="center_baseline", fontsize=TICK_SIZE)

    def finished(self) -> Figure:
        """The figure, with the frames and ticks of all panels."""
        self.lines(self._strokes, color="black", linewidth=0.6)
        return self.figure


def ticks(
    limits: tuple[float, float], room: Callable[[list[str]], float], whole: bool = False, over: float = 0.0
) -> tuple[np.ndarray, list[str]]:
    """As many round values as there is room for, and the same as text.

    Args:
        limits: Of the axis.
        room: How many of the given texts fit next to each other along the axis.
        whole: Whether only whole numbers make sense.
        over: How far a number may stand beyond an end, as a share of the axis.
    """
    from matplotlib.ticker import MaxNLocator

    low, high = limits

    def round_values(most: int) -> tuple[np.ndarray, float]:
        every = np.asarray(MaxNLocator(most, steps=[1, 2, 4, 5, 10], min_n_ticks=1, integer=whole).tick_values(low, high))
        return every[(every >= low) & (every <= high)], float(every[1] - every[0])

    for most in (4, 3, 2, 1):
        values, step = round_values(most)
        texts = _texts(values, step)
        if texts and (high - low) / step <= room(texts):
            if len(texts) > 1:
                return values, texts
            break
    for most in (2, 3, 4, 6, 8):  # one number is no scale: the outermost two of a finer step
        finer, step = round_values(most)
        if len(finer) < 2:
            continue
        outer = finer[[0, -1]]
        words = _texts(outer, step)
        share = LEAST_SPACE / room(words)  # of the axis that a number takes
        first, last = np.clip((outer - low) / (high - low), share / 2 - over, 1 - share / 2 + over)
        if last - first >= share:
            return outer, words
    return values, texts


def _texts(values: np.ndarray, step: float) -> list[str]:
    """Numbers with just the decimals of their step."""
    decimals = next((d for d in range(5) if abs(round(step, d) - step) < 1e-6 * step), None)
    shown = [f"{v + 0.0:.3g}" if decimals is None or step >= 1e5 else f"{v + 0.0:.{decimals}f}" for v in values]
    return [text.replace("-", "\N{MINUS SIGN}") for text in shown]
