"""Numbers beside small panels: as many as there is room for, two at the least, and none over those of a neighbor."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.style import LEAST

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TICK = 0.035  # in
NUMBER_SPACE, NUMBER_ROW = 0.075, 0.16  # in, from one number to the next: a character across, and a row up
LETTER = 0.053  # in, width of a character of a number
LEAST_SPACE = 1.1 * LETTER / NUMBER_SPACE  # of that from one number to the next, where there would be one number else


def number_below(axes: Axes, whole: bool = False) -> None:
    """Number the lower axis of a panel.

    Args:
        axes: The panel, with its limits and in its place.
        whole: Whether only whole numbers make sense.
    """
    from matplotlib.transforms import ScaledTranslation

    width = _size(axes)[0]
    low, high = axes.get_xlim()
    most = width / NUMBER_SPACE
    values, texts = ticks((low, high), lambda texts: most / max(map(len, texts)), whole, TICK / width)
    axes.set_xticks(values, texts)
    axes.tick_params(axis="x", length=72 * TICK, pad=72 * 0.8 * TICK, width=0.6, labelsize=LEAST, labelrotation=0)
    for label, value in zip(axes.get_xticklabels(), values, strict=True):  # at the ends they are moved inwards
        half, position = LETTER * len(label.get_text()) / 2, width * (value - low) / (high - low)
        inwards = float(np.clip(position, half - TICK, max(width - half + TICK, half - TICK))) - position
        label.set_transform(label.get_transform() + ScaledTranslation(inwards, 0.0, axes.figure.dpi_scale_trans))


def number_left(axes: Axes) -> None:
    """Number the left axis of a panel that has its limits and is in its place."""
    height = _size(axes)[1]
    axes.set_yticks(*ticks(axes.get_ylim(), lambda _: height / NUMBER_ROW))
    axes.tick_params(axis="y", length=72 * TICK, pad=72 * 0.6 * TICK, width=0.6, labelsize=LEAST, labelrotation=0)


def _size(axes: Axes) -> tuple[float, float]:
    """Return width and height of a panel [in]."""
    figure, box = axes.figure, axes.get_position()
    assert figure is not None  # a panel is on a page
    width, height = figure.get_size_inches()  # type: ignore[union-attr]
    return box.width * width, box.height * height


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
        candidates = np.asarray(MaxNLocator(most, steps=[1, 2, 4, 5, 10], min_n_ticks=1, integer=whole).tick_values(low, high))
        return candidates[(candidates >= low) & (candidates <= high)], float(candidates[1] - candidates[0])

    def apart(values: np.ndarray, texts: list[str]) -> bool:
        """Whether numbers keep apart that are moved inwards at the ends of the axis."""
        share = LEAST_SPACE / room(texts)  # of the axis that a number takes
        positions = np.clip((values - low) / (high - low), share / 2 - over, 1 - share / 2 + over)
        return bool(np.all(np.diff(positions) >= share))

    for most in (4, 3, 2, 1):
        values, step = round_values(most)
        texts = _texts(values, step)
        if texts and (high - low) / step <= room(texts):
            if len(texts) == 1:
                break
            if apart(values, texts):
                return values, texts
    for most in (2, 3, 4, 6, 8):  # one number is no scale: the outermost two of a finer step
        finer, step = round_values(most)
        if len(finer) < 2:
            continue
        outer = finer[[0, -1]]
        words = _texts(outer, step)
        if apart(outer, words):
            return outer, words
    return values, texts


def _texts(values: np.ndarray, step: float) -> list[str]:
    """Numbers with just the decimals of their step."""
    decimals = next((d for d in range(5) if abs(round(step, d) - step) < 1e-6 * step), None)
    shown = [f"{v + 0.0:.3g}" if decimals is None or step >= 1e5 else f"{v + 0.0:.{decimals}f}" for v in values]
    return [text.replace("-", "\N{MINUS SIGN}") for text in shown]
