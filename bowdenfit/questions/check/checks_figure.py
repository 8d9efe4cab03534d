"""Every reading against its prediction from all the others: is their scatter as predicted, and does it depend on anything?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import TITLE, count_columns, drop_unused, legend_above, panels
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    GRAY,
    LIGHT,
    SERIES_COLORS,
    SERIES_MARKERS,
    VERMILLION,
    WIDE,
    in_paper_style,
)
from bowdenfit.questions import check as room
from bowdenfit.words import capitalized, counted, percent

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.check.answer import Checks, TableChecks
    from bowdenfit.results.record import Record

HEADING = "Leave-one-out check: every reading against its prediction from all others"
ROW, LEAST_WIDTH = 1.35, 1.0  # in, of a panel
MOST_NAMED = 3  # outliers of a panel that are named
BACK = "Read on the way back"
LEAST_LIMIT = 3.2  # standard deviations that the axis shows at least: beyond these about 1 healthy reading of 1,000 lies
MOST_PLACES = 2  # that deviations are shown against
NUMBER = "Number of the reading"  # what they are shown against where no place varies
DASHES = (0, (4, 2))


@dataclass(frozen=True)
class CheckedTable:
    """Readings of one table against their predictions from all the others.

    Args:
        name: Name of the readings, in words.
        z_score: Deviations in standard deviations of the predictions; NaN of readings that are only a bound.
        numbers: Where the readings were taken, by axis label: the first two that vary.
        group: Contact or the like of each reading; empty where all are of one kind.
        back: Whether each was taken on the way back, or while unloading.
        decisive: Mask of influential readings.
        outlier: Whether it is an outlier.
        labels: Each in words.
        at: Covariates in the predictions at which their distribution was looked at; empty of few readings.
        off, low, high: Share of readings up to there less what it should be, and the band of that.
        probability: Probability that it stays in the band.
    """

    name: str
    z_score: np.ndarray
    numbers: dict[str, np.ndarray]
    group: tuple[str, ...]
    back: np.ndarray
    decisive: np.ndarray
    outlier: np.ndarray
    labels: tuple[str, ...]
    at: np.ndarray
    off: np.ndarray
    low: np.ndarray
    high: np.ndarray
    probability: float


def data(fit: Record) -> tuple[CheckedTable, ...] | None:
    """Return the readings of every table that has several; None without draws, and without such a table."""
    checks = room.check_readings(fit)
    return (checked_tables(checks) or None) if checks is not None else None


def checked_tables(checks: Checks) -> tuple[CheckedTable, ...]:
    """Return the readings of each table as they are shown, without tables of a single reading, whose scatter shows nothing."""
    return tuple(
        _show_table(table, [r.outlier for r in checks.readings if r.table == table.table])
        for table in checks.tables
        if len(table.labels) > 1
    )


def _show_table(table: TableChecks, outlier: list[bool]) -> CheckedTable:
    """Return the readings of one table as they are shown."""
    uniformity, off, low, high = table.uniformity, *[np.zeros(0)] * 3
    if uniformity is not None:
        off, low, high = (part - uniformity.at for part in (uniformity.share, uniformity.low, uniformity.high))
    return CheckedTable(
        table.words,
        table.z_score,
        dict(list(table.positions.numbers.items())[:MOST_PLACES]) or {NUMBER: np.arange(1.0, 1 + len(table.labels))},
        table.positions.group,
        table.positions.back,
        table.influential,
        np.array(outlier),
        table.labels,
        uniformity.at if uniformity else off,
        off,
        low,
        high,
        uniformity.probability if uniformity else float("nan"),
    )


def caption(tables: tuple[CheckedTable, ...]) -> str:
    """Describe what is drawn, in plain words."""
    n = sum(len(table.labels) for table in tables)
    probabilities = [table.probability for table in tables if len(table.at)]
    distribution = (
        "First panel of a row: empirical distribution (ECDF) of the predicted probabilities of the readings (probability "
        "integral transform), minus the uniform one that is expected; if the model is right, the whole line stays in the band "
        "with at least "
        f"{percent(min(probabilities))} probability. Other panels: "
        if probabilities
        else "Each panel: "
    )
    return (
        f"Whether the readings scatter as predicted, {_rows_in_words(len(tables))}. {distribution}deviation of each reading "
        "from its prediction by all the others, in standard deviations, against where it was taken; there should be no trend, "
        f"and about one reading in twenty lies beyond two. n = {counted(n, 'reading')}."
    )


def _rows_in_words(n_tables: int) -> str:
    """Return how many rows the figure has, in words."""
    return "one table" if n_tables == 1 else f"a row for each of {n_tables} tables"


@in_paper_style
def draw(tables: tuple[CheckedTable, ...], width: float | None = None) -> Figure:
    """Draw one row a table: distribution of the readings in their predictions, and deviations by where they were taken."""
    page, counts = width or WIDE, [bool(len(table.at)) + len(table.numbers) for table in tables]
    columns = count_columns(page, max(counts), LEAST_WIDTH, 0.62)
    rows = [-(-count // columns) for count in counts]
    figure, flat = panels([ROW] * sum(rows), columns, TITLE, (0.62, 0.74), page)
    used = []
    for i, table in enumerate(tables):
        here = drop_unused(flat[sum(rows[:i]) * columns : sum(rows[: i + 1]) * columns], counts[i])
        if len(table.at):
            _draw_distribution(here[0], table)
        for axes, (label, numbers) in zip(here[bool(len(table.at)) :], table.numbers.items(), strict=True):
            _draw_deviations(axes, table, label, numbers)
        here[0].set_title(f"{capitalized(table.name)}: {counted(len(table.labels), 'reading')}", loc="left")
        used += here
    legend_above(figure, used, columns=3)
    return figure


def _draw_distribution(axes: Axes, table: CheckedTable) -> None:
    """Draw the empirical distribution of the readings in their predictions, less the uniform one."""
    axes.axhline(0.0, color=GRAY, linewidth=0.8)
    axes.set_xlim(0.0, 1.0)
    axes.set(xlabel="Predicted probability p", ylabel="ECDF of the readings − p")
    at = np.concatenate([[0.0], table.at, [1.0]])
    low, off, high = (np.concatenate([[0.0], part, [0.0]]) for part in (table.low, table.off, table.high))
    axes.fill_between(at, low, high, step="post", color=LIGHT, linewidth=0, label="Band if the model is right")
    axes.plot(at, off, drawstyle="steps-post", color=BLUE, label="Distribution of the readings (ECDF)")


def _draw_deviations(axes: Axes, table: CheckedTable, label: str, numbers: np.ndarray) -> None:
    """Draw deviations in standard deviations against where readings were taken."""
    z = table.z_score
    for two in (-2, 2):
        axes.axhline(two, color=GRAY, linewidth=0.8, linestyle=DASHES, label="Two standard deviations")
    axes.axhline(0.0, color=GRAY, linewidth=0.8)
    groups = list(dict.fromkeys(table.group))
    for i, group in enumerate(groups):
        in_group = np.array([g == group for g in table.group])
        color, marker = (SERIES_COLORS[i % 8], SERIES_MARKERS[i % 8]) if len(groups) > 1 else (BLACK, "o")
        name = group.replace("_", " ") if group else "Reading"
        for back in (False, True):
            mask = in_group & (table.back == back)
            if mask.any():
                words = BACK if back else name
                fill = "white" if back else color
                axes.plot(
                    numbers[mask], z[mask], marker, color=color, markerfacecolor=fill, markersize=3.6, label=words
                )
    influential = table.decisive & np.isfinite(z)
    if influential.any():
        axes.plot(
            numbers[influential], z[influential], "o", color=VERMILLION, markerfacecolor="none", markersize=7.5,
            markeredgewidth=0.9, label="Influential: the fit would change without it",
        )  # fmt: skip
    if np.all(numbers == np.round(numbers)):  # as of runs and groups, between which there is nothing
        axes.locator_params(axis="x", integer=True)
        if np.ptp(numbers) == 0:
            axes.set_xlim(numbers[0] - 1, numbers[0] + 1)
    limit = max(LEAST_LIMIT, 1.15 * float(np.nanmax(np.abs(z), initial=0.0)))
    axes.set_ylim(-limit, limit)
    for i in np.flatnonzero(table.outlier & np.isfinite(z))[:MOST_NAMED]:
        on_left = numbers[i] < (np.min(numbers) + np.max(numbers)) / 2
        axes.annotate(
            table.labels[i], (numbers[i], z[i]), (6 if on_left else -6, 0), textcoords="offset points",
            ha="left" if on_left else "right", va="center", fontsize=6,
        )  # fmt: skip
    axes.set(xlabel=label, ylabel="Deviation (sd)")
