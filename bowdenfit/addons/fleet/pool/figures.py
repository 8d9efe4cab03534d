"""Figures of a pooled fleet: coefficients of its cables, wear, and the probability of having failed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.addons.fleet.pool.words import HEADINGS, pool_page
from bowdenfit.outputs import write_text
from bowdenfit.plots.layout import (
    LEFT,
    RIGHT,
    TITLE,
    axes_at,
    empty_page,
    legend_above,
    place_labels,
    text_width,
    title_above,
)
from bowdenfit.plots.panels import shorten_name
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    GRAY,
    LIGHT,
    MEDIAN,
    MEDIUM,
    VERMILLION,
    WIDE,
    WIDE_INTERVAL,
    in_paper_style,
)
from bowdenfit.plots.write import write_all
from bowdenfit.questions.writing import write_page
from bowdenfit.results.folder import fill_folder_atomically
from bowdenfit.results.serialization import plain_data
from bowdenfit.words import printable

if TYPE_CHECKING:
    from bowdenfit.addons.fleet.pool.answer import Curves, Pool
    from bowdenfit.inference.interval import Interval
    from bowdenfit.plots.layout import Axes, Figure

MOST_CABLES, LONGEST_NAME, MOST_COEFFICIENTS = 60, 18, 2  # rows, characters and panels that a page has room for
_ROW, _BELOW, _HEIGHT = 0.115, 0.45, 2.3  # in


def draw_figures(pool: Pool, width: float | None = None) -> dict[str, Figure]:
    """Draw all figures of a pooled fleet, by name.

    Args:
        pool: The pooled fleet.
        width: Width of the page [in]; what suits each if omitted.
    """
    figures = {"pooled-coefficients": draw_coefficients(pool, width)}
    if pool.curves is not None:
        figures["pooled-wear"] = draw_wear(pool, pool.curves, width)
        if pool.curves.fails is not None and pool.curves.new_fails is not None:
            figures["pooled-life"] = draw_life(pool, pool.curves, pool.curves.fails, pool.curves.new_fails, width)
    return figures


@in_paper_style
def draw_coefficients(pool: Pool, width: float | None = None) -> Figure:
    """Draw coefficients and wear of every cable, alone and pooled."""
    names = [name for name in pool.typical if any(name in cable.coefficients for cable in pool.cables)][
        :MOST_COEFFICIENTS
    ]
    columns = [*names, *(["wear"] if pool.wear is not None else [])]
    order = sorted(
        pool.cables, key=lambda cable: (names[0] in cable.coefficients, _median_or_zero(cable.coefficients.get(names[0])))
    )
    step = -(-len(order) // MOST_CABLES)
    shown = [cable for i, cable in enumerate(order) if i % step == 0 or cable.departure]
    page = width or (WIDE if len(columns) > 1 else MEDIUM)
    labels = [shorten_name(cable.cable, LONGEST_NAME) for cable in shown]
    left = max(0.3, 0.2 + max(map(text_width, labels)))
    across = page >= MEDIUM
    inner = (page - left - RIGHT - 0.2 * (len(columns) - 1)) / len(columns) if across else page - left - RIGHT
    height = max(0.6, 0.1 + _ROW * len(shown))
    rows = 1 if across else len(columns)
    figure = empty_page(page, rows * (TITLE + height + _BELOW))
    panels = []
    for i, name in enumerate(columns):
        bottom = _BELOW + (rows - 1 - (0 if across else i)) * (TITLE + height + _BELOW)
        axes = axes_at(figure, left + (i * (inner + 0.2) if across else 0.0), bottom, inner, height)
        for y, cable in enumerate(shown):
            pooled = cable.wear if name == "wear" else cable.coefficients.get(name)
            _draw_cable(axes, y, pooled, cable.unpooled.get(name), bool(cable.departure), name == "wear")
        _draw_population(axes, pool, name)
        axes.set_yticks(range(len(shown)), labels if i == 0 or not across else [])
        axes.set(ylim=(-0.7, len(shown) - 0.3), xlabel=_axis_label(pool, name))
        axes.grid(axis="y", visible=False)
        axes.locator_params(axis="x", nbins=max(2, int(inner / 0.55)))
        place_labels(figure, axes)
        panels.append(axes)
    legend_above(figure, panels, columns=3)
    return _add_title(figure, "pooled-coefficients", pool)


def _draw_cable(
    axes: Axes, y: int, pooled: Interval | None, unpooled: Interval | None, is_outlier: bool, percent: bool
) -> None:
    """Draw one cable in one panel."""
    if pooled is None:
        return
    color, times = VERMILLION if is_outlier else BLUE, 100.0 if percent else 1.0
    if unpooled is not None:
        axes.plot(
            [times * unpooled.median], [y], "o", color=GRAY, markerfacecolor="white", markersize=3.2, label="By itself"
        )
    axes.plot([times * pooled.q05, times * pooled.q95], [y, y], "-", color=color, linewidth=1.0)
    label = "Outlier" if is_outlier else f"Pooled, {WIDE_INTERVAL}"
    axes.plot([times * pooled.median], [y], "s" if is_outlier else "o", color=color, markersize=2.6, label=label)


def _draw_population(axes: Axes, pool: Pool, name: str) -> None:
    """Mark where nine of ten new cables lie."""
    new = pool.coefficients.get(name)
    if new is not None:
        axes.axvspan(new.q05, new.q95, color=LIGHT, linewidth=0, zorder=0, label="Nine of ten new cables")


def _axis_label(pool: Pool, name: str) -> str:
    return f"Wear (% in {pool.reference_cycles:,.0f} cycles)" if name == "wear" else name.replace("_", " ")


@in_paper_style
def draw_wear(pool: Pool, curves: Curves, width: float | None = None) -> Figure:
    """Draw efficiency or friction over cycles."""
    figure, axes = _make_panel(width)
    at, scale = curves.cycles / _choose_cycle_unit(curves), _choose_cycle_unit(curves)
    times = 100.0 if pool.limit is not None else 1.0
    for i, line in enumerate(curves.cables):
        axes.plot(at, times * line, "-", color=GRAY, linewidth=0.5, alpha=0.7, label="A cable" if i == 0 else None)
    if len(pool.cables) > 1:
        low, middle, high = times * curves.new
        axes.fill_between(at, low, high, color=BLUE, alpha=0.18, linewidth=0, label=f"New cable, {WIDE_INTERVAL}")
        axes.plot(at, middle, "-", color=BLUE, linewidth=1.8, label=f"New cable, {MEDIAN.lower()}")
    axes.axvline(pool.reference_cycles / scale, color=BLACK, linestyle=":", linewidth=0.8, label="Longest inspected")
    if pool.limit is not None:
        axes.axhline(100 * pool.limit.efficiency, color=VERMILLION, linestyle="--", linewidth=1.0, label="Required")
    axes.set_ylabel("Efficiency (%)" if pool.limit is not None else "Friction / when new")
    return _finish_curves(figure, axes, curves, "pooled-wear", pool)


@in_paper_style
def draw_life(
    pool: Pool, curves: Curves, fails: np.ndarray, new_fails: np.ndarray, width: float | None = None
) -> Figure:
    """Draw the probability of having failed over cycles."""
    figure, axes = _make_panel(width)
    at, scale = curves.cycles / _choose_cycle_unit(curves), _choose_cycle_unit(curves)
    for i, line in enumerate(fails):
        axes.plot(at, line, "-", color=GRAY, linewidth=0.5, alpha=0.7, label="A cable" if i == 0 else None)
    if len(pool.cables) > 1:
        axes.plot(at, new_fails, "-", color=BLUE, linewidth=1.8, label="New cable")
    axes.axvline(pool.reference_cycles / scale, color=BLACK, linestyle=":", linewidth=0.8, label="Longest inspected")
    if pool.limit is not None and pool.limit.cycles is not None:
        axes.axvline(pool.limit.cycles / scale, color=VERMILLION, linestyle="--", linewidth=1.0, label="Required")
    axes.set(ylim=(-0.02, 1.02), ylabel="Probability of having failed")
    return _finish_curves(figure, axes, curves, "pooled-life", pool)


def _choose_cycle_unit(curves: Curves) -> float:
    """Return how many cycles a unit of the axis is."""
    return 1000.0 if curves.cycles[-1] >= 10_000 else 1.0


def _make_panel(width: float | None) -> tuple[Figure, Axes]:
    page = width or MEDIUM
    figure = empty_page(page, 0.12 + _HEIGHT + _BELOW)
    return figure, axes_at(figure, LEFT, _BELOW, page - LEFT - 2 * RIGHT, _HEIGHT)


def _finish_curves(figure: Figure, axes: Axes, curves: Curves, name: str, pool: Pool) -> Figure:
    scale = _choose_cycle_unit(curves)
    axes.set(xlim=(0.0, float(curves.cycles[-1]) / scale), xlabel="Cycles (thousands)" if scale > 1 else "Cycles")
    axes.locator_params(axis="x", nbins=6)
    place_labels(figure, axes)
    legend_above(figure, [axes], columns=4)
    return _add_title(figure, name, pool)


def _add_title(figure: Figure, name: str, pool: Pool) -> Figure:
    title_above(figure, f"{HEADINGS[name]} \N{EN DASH} {pool.name}" if pool.name else HEADINGS[name])
    return figure


def _median_or_zero(interval: Interval | None) -> float:
    return interval.median if interval is not None else 0.0


def write_pool(pool: Pool, folder: Path, name: str) -> None:
    """Write figures, page, text and, last, JSON, all of them or none: a folder with the JSON has everything.

    Args:
        pool: The pooled fleet.
        folder: Where to.
        name: Name of the files.
    """
    with fill_folder_atomically(folder, f"{name}.json") as place:
        for figure_name, figure in draw_figures(pool).items():
            write_all(figure, place, figure_name)
        write_page(pool_page(pool), place, place / f"{name}.html")
        write_text(place / f"{name}.txt", printable(f"{pool}\n"))
        write_text(place / f"{name}.json", json.dumps(plain_data(pool), indent=1, allow_nan=False) + "\n")
