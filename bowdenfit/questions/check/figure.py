"""Every reading against its prediction from all the others: is their scatter as predicted, and does it depend on anything?"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import TITLE, drop_unused, legend_above, panels
from bowdenfit.plots.style import BLACK, BLUE, GRAY, LIGHT, SERIES_COLORS, SERIES_MARKERS, VERMILLION, in_paper_style

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.check.figure_data import CheckedTable
    from bowdenfit.questions.summary.figure_data import FigureData

ROW = 1.35  # in
MOST_NAMED = 3  # outliers of a panel that are named
BACK = "Read on the way back"
LEAST_LIMIT = 3.2  # standard deviations that the axis shows at least


def has_checks(data: FigureData) -> bool:
    """Whether readings were predicted without themselves."""
    return bool(data.checks)


@in_paper_style
def checks(data: FigureData) -> Figure:
    """One row a table: distribution of the readings in their predictions, and deviations by where they were taken."""
    columns = 1 + max(len(table.numbers) for table in data.checks)
    figure, flat = panels([ROW] * len(data.checks), columns, TITLE, (0.62, 0.74))
    used = []
    for row, table in enumerate(data.checks):
        here = flat[row * columns : (row + 1) * columns]
        _distribution(here[0], table)
        used.append(here[0])
        for axes, (label, numbers) in zip(here[1:], table.numbers.items(), strict=False):
            _deviations(axes, table, label, numbers)
            used.append(axes)
        drop_unused(here, 1 + len(table.numbers))
    legend_above(figure, used, columns=3)
    return figure


def _distribution(axes: Axes, table: CheckedTable) -> None:
    """Share of readings up to a place in their predictions, less what it should be."""
    axes.set_title(f"{table.name.capitalize()}: {len(table.labels)} readings")
    axes.axhline(0.0, color=GRAY, linewidth=0.8)
    axes.set_xlim(0.0, 1.0)
    axes.set(xlabel="Predicted probability p", ylabel="Share below p, less p")
    if not len(table.at):
        axes.set_ylim(-0.5, 0.5)
        axes.text(0.5, 0.25, "too few to judge", ha="center", va="center", color=GRAY)
        return
    at = np.concatenate([[0.0], table.at, [1.0]])
    low, off, high = (np.concatenate([[0.0], part, [0.0]]) for part in (table.low, table.off, table.high))
    axes.fill_between(at, low, high, step="post", color=LIGHT, linewidth=0, label="Where it stays if all is right")
    axes.plot(at, off, drawstyle="steps-post", color=BLUE, label="Distribution of the readings")


def _deviations(axes: Axes, table: CheckedTable, label: str, numbers: np.ndarray) -> None:
    """Deviations in standard deviations against one of the places."""
    z = table.z_score
    axes.axhspan(-2, 2, color=LIGHT, linewidth=0, zorder=0.4, label="Within two standard deviations")
    axes.axhline(0.0, color=GRAY, linewidth=0.8)
    groups = list(dict.fromkeys(table.group))
    for i, group in enumerate(groups):
        mine = np.array([g == group for g in table.group])
        color, marker = (SERIES_COLORS[i % 8], SERIES_MARKERS[i % 8]) if len(groups) > 1 else (BLACK, "o")
        name = group.replace("_", " ") if group else "Reading"
        for back in (False, True):
            here = mine & (table.back == back)
            if here.any():
                words = BACK if back else name
                fill = "white" if back else color
                axes.plot(
                    numbers[here], z[here], marker, color=color, markerfacecolor=fill, markersize=3.6, label=words
                )
    lean = table.decisive & np.isfinite(z)
    if lean.any():
        axes.plot(
            numbers[lean], z[lean], "o", color=VERMILLION, markerfacecolor="none", markersize=7.5, markeredgewidth=0.9,
            label="The fit leans on it (k above 0.7)",
        )  # fmt: skip
    limit = max(LEAST_LIMIT, 1.15 * float(np.nanmax(np.abs(z), initial=0.0)))
    axes.set_ylim(-limit, limit)
    for i in np.flatnonzero(table.outlier & np.isfinite(z))[:MOST_NAMED]:
        on_left = numbers[i] < (np.min(numbers) + np.max(numbers)) / 2
        axes.annotate(
            table.labels[i], (numbers[i], z[i]), (6 if on_left else -6, 0), textcoords="offset points",
            ha="left" if on_left else "right", va="center", fontsize=6,
        )  # fmt: skip
    axes.set(xlabel=label, ylabel="Deviation (sd)")
