"""Prior predictive check: readings that the priors alone allow beside the measured ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import TITLE, drop_unused, legend_above, panels
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    EFFICIENCY,
    MEDIUM,
    SERIES_MARKERS,
    VERMILLION,
    WIDE,
    WIDE_INTERVAL,
    in_paper_style,
)
from bowdenfit.words import capitalized, counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure

HEADING = "Prior predictive check: readings that the priors allow"
ROW, COLUMNS = 1.9, 2  # in; panels in a row
WIDEST = "99 % interval by the priors"
WITHIN = 0.01  # share of the axis that counts as one place
WIDE_RANGE = 20.0  # times the typical reading, beyond which an axis is logarithmic
_GROUP_MARKERS = SERIES_MARKERS[1:]  # the first is of tables without groups
SHIFT = 0.006  # of the axis, between contacts whose readings would hide each other


@dataclass(frozen=True)
class PriorTable:
    """Readings of one table beside their prior predictive quantiles.

    Args:
        name: Name of the readings, in words.
        label: Axis label of the readings.
        numbers: Where they were taken, the first that varies.
        place: Its axis label.
        group: Contact or the like of each reading.
        labels: Each reading in words.
        reading: As measured; NaN of readings that are only a bound.
        quantiles: 0.5 %, 5 %, 50 %, 95 % and 99.5 % quantiles (first axis) of readings by the priors.
        outside: Whether each reading lies outside the widest of these intervals.
    """

    name: str
    label: str
    numbers: np.ndarray
    place: str
    group: tuple[str, ...]
    labels: tuple[str, ...]
    reading: np.ndarray
    quantiles: np.ndarray
    outside: np.ndarray


@dataclass(frozen=True)
class PriorPredictive:
    """Prior predictive readings and efficiencies of a cable.

    Args:
        name: Name of the cable.
        tables: By table.
        route_label: Axis label of the route; empty without one.
        route: Route values of the curve.
        efficiency: Quantiles (first axis, as in `PriorTable`) of the efficiency there; empty without a route.
    """

    name: str
    tables: tuple[PriorTable, ...]
    route_label: str = ""
    route: np.ndarray | None = None
    efficiency: np.ndarray | None = None


def caption(data: PriorPredictive) -> str:
    """Describe what is drawn, in plain words."""
    n = sum(len(table.reading) for table in data.tables)
    text = (
        "Readings that the priors alone allow, before anything is fitted, with the measured ones: thick lines contain "
        "90 %, thin ones 99 %. Readings outside these have a color of their own; the usual cause is a wrong unit."
    )
    if data.efficiency is not None:
        text += " Efficiency of the cable: median, and the same intervals as bands."
    return f"{text} n = {counted(n, 'reading')}."


@in_paper_style
def draw(data: PriorPredictive) -> Figure:
    """Draw efficiency along the route by the priors, and a panel for each table with its readings."""
    n = len(data.tables) + (data.efficiency is not None)
    rows = -(-n // COLUMNS)
    columns = min(COLUMNS, n)
    figure, flat = panels([ROW] * rows, columns, TITLE, (0.7, 0.78), WIDE if columns > 1 else MEDIUM)
    flat = drop_unused(flat, n)
    for axes, table in zip(flat, data.tables, strict=False):
        _draw_readings(axes, table)
    if data.efficiency is not None:
        _draw_efficiency(flat[-1], data)
    legend_above(figure, flat, columns=4)
    return figure


def _draw_readings(axes: Axes, table: PriorTable) -> None:
    """Draw intervals by the priors wherever readings were taken, and what was read."""
    span = float(np.ptp(table.numbers)) or 1.0
    groups = list(dict.fromkeys(table.group))
    for i, group in enumerate(groups):
        in_group = np.array([g == group for g in table.group])
        shift = SHIFT * span * (i - (len(groups) - 1) / 2)
        at, low, lower, upper, high = _intervals(table.numbers[in_group], table.quantiles[:, in_group], WITHIN * span)
        axes.vlines(at + shift, low, high, color=BLUE, linewidth=0.8, alpha=0.7, label=WIDEST)
        axes.vlines(at + shift, lower, upper, color=BLUE, linewidth=3.2, alpha=0.35, label=WIDE_INTERVAL)
        name = group.replace("_", " ") or "Measured"
        marker = _GROUP_MARKERS[i % len(_GROUP_MARKERS)] if len(groups) > 1 else "o"
        x, reading, out = table.numbers[in_group] + shift, table.reading[in_group], table.outside[in_group]
        axes.plot(x[~out], reading[~out], marker, color=BLACK, markersize=3.4, zorder=3, label=name)
        if (out & np.isfinite(reading)).any():
            axes.plot(
                x[out], reading[out], marker, color=VERMILLION, markersize=4.2, zorder=3, label="Measured, outside"
            )
    _set_scale(axes, table)
    if np.all(table.numbers == np.round(table.numbers)):
        axes.locator_params(axis="x", integer=True)
    axes.set_title(capitalized(table.name))
    axes.set(xlabel=table.place, ylabel=table.label)


def _intervals(numbers: np.ndarray, quantiles: np.ndarray, within: float) -> tuple[np.ndarray, ...]:
    """Return the distinct places of readings, and the intervals there that contain those of all readings."""
    order = np.argsort(numbers)
    starts = np.flatnonzero(np.append(True, np.diff(numbers[order]) > within))
    low, lower, _, upper, high = quantiles[:, order]
    least, most = np.minimum.reduceat, np.maximum.reduceat
    at = np.add.reduceat(numbers[order], starts) / np.diff(np.append(starts, len(order)))
    return at, least(low, starts), least(lower, starts), most(upper, starts), most(high, starts)


def _set_scale(axes: Axes, table: PriorTable) -> None:
    """Let an axis show every reading and all 90 % intervals; logarithmic beyond the readings where these are wide."""
    read = table.reading[np.isfinite(table.reading)]
    shown = np.concatenate([read, table.quantiles[1], table.quantiles[3]])
    low, high = float(shown.min()), float(shown.max())
    typical = float(np.median(np.abs(read))) if len(read) else 0.0
    if table.label == EFFICIENCY:
        axes.set_ylim(min(0.0, low), max(100.0, 1.05 * high))
    elif typical > 0 and max(abs(low), abs(high)) > WIDE_RANGE * typical:
        axes.set_yscale("symlog", linthresh=10.0 ** np.ceil(np.log10(typical)), linscale=1.5)
        axes.set_ylim(2 * low if low < 0 else 0.0, 2 * high)
    else:
        room = 0.08 * (high - low) or 0.5
        axes.set_ylim(low - room, high + room)


def _draw_efficiency(axes: Axes, data: PriorPredictive) -> None:
    """Draw efficiency against the route."""
    assert data.efficiency is not None and data.route is not None  # the caller looked
    low, lower, median, upper, high = data.efficiency
    axes.fill_between(data.route, low, high, color=BLUE, alpha=0.12, linewidth=0)
    axes.fill_between(data.route, lower, upper, color=BLUE, alpha=0.22, linewidth=0)
    axes.plot(data.route, median, color=BLUE)
    for table in data.tables:
        if table.label == EFFICIENCY and table.place == data.route_label:
            axes.plot(table.numbers, table.reading, "o", color=BLACK, markersize=3.6, zorder=3)
    axes.set_ylim(0, 100)
    axes.set_title("Efficiency of the cable")
    axes.set(xlabel=data.route_label, ylabel=EFFICIENCY)
