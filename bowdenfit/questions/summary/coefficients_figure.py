"""What the data say about each coefficient, against what was assumed before and what least squares finds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.densities import GRID_POINTS, density, limits, support
from bowdenfit.plots.layout import TITLE, drop_unused, legend_above, panels
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    LEAST_SQUARES,
    MEDIAN,
    MEDIUM,
    SMALL,
    VERMILLION,
    WIDE,
    WIDE_INTERVAL,
    in_paper_style,
    labeled,
    rounded,
)

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.summary.figure_data import FigureData, ParameterDraws

ROLES = ("friction", "friction_model", "angle", "sensor")
MOST_COLUMNS = 3


def shown_coefficients(data: FigureData) -> list[ParameterDraws]:
    """The parameters with draws that belong to friction, constant angles or sensors."""
    return [p for role in ROLES for p in data.parameters if p.role == role and p.draws is not None]


def has_coefficients(data: FigureData) -> bool:
    """Whether a coefficient was sampled."""
    return bool(shown_coefficients(data))


@in_paper_style
def coefficients(data: FigureData) -> Figure:
    """Posterior density of each coefficient against its prior, and the least-squares estimate with standard error."""
    parameters = shown_coefficients(data)
    columns = min(MOST_COLUMNS, len(parameters))
    rows = -(-len(parameters) // columns)
    figure, flat = panels([1.35] * rows, columns, TITLE + 0.14, (0.68, TITLE + 0.64), WIDE if columns > 1 else MEDIUM)
    flat = drop_unused(flat, len(parameters))
    for axes, parameter in zip(flat, parameters, strict=True):
        _panel(axes, parameter)
    legend_above(figure, flat, columns=3)
    return figure


def _panel(axes: Axes, parameter: ParameterDraws) -> None:
    draws = parameter.draws
    assert draws is not None  # shown_coefficients
    shown = _axis(parameter, draws)
    grid, lower = np.linspace(*shown, GRID_POINTS), support(draws, parameter.prior)
    posterior = density(draws, grid, lower)
    axes.fill_between(grid, posterior, color=BLUE, alpha=0.38, linewidth=0)
    axes.plot(grid, posterior, color=BLUE, label="Posterior")
    if parameter.prior is not None:
        prior = density(parameter.prior, grid, lower)
        axes.plot(grid, prior, color=BLACK, linestyle="--", linewidth=1.0, label="Prior")
    _least_squares(axes, parameter, shown, 0.08 * posterior.max())
    axes.set(xlim=shown, ylim=(0, 1.2 * posterior.max()), xlabel=labeled(parameter.symbol, parameter.unit))
    axes.set_ylabel("Density" if parameter.unit == "1" else f"Density (1/{parameter.unit})")
    axes.set_title(_title(parameter, draws))


def _axis(parameter: ParameterDraws, draws: np.ndarray) -> tuple[float, float]:
    """Limits that show the posterior, and the least-squares estimate unless it is far away."""
    low, high = limits(draws)
    value, width = parameter.least_squares, high - low
    if np.isfinite(value) and low - width < value < high + width:
        low, high = min(low, value - 0.05 * width), max(high, value + 0.05 * width)
    return low, high


def _least_squares(axes: Axes, parameter: ParameterDraws, shown: tuple[float, float], height: float) -> None:
    """The estimate with its standard error, or a note where there is none to draw."""
    value, error = parameter.least_squares, parameter.standard_error
    if shown[0] <= value <= shown[1]:
        axes.errorbar(
            [value], [height], xerr=[error] if np.isfinite(error) else None, fmt="s", color=VERMILLION, capsize=2.5,
            markerfacecolor="white", linewidth=1.2, label=f"{LEAST_SQUARES} \N{PLUS-MINUS SIGN} standard error",
        )  # fmt: skip
        return
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    note = f"off the axis, {value:.3g}{unit}" if np.isfinite(value) else "not identified"
    axes.text(
        0.98, 0.98, f"{LEAST_SQUARES}: {note}", transform=axes.transAxes, ha="right", va="top", fontsize=SMALL,
        color=VERMILLION,
    )  # fmt: skip


def _title(parameter: ParameterDraws, draws: np.ndarray) -> str:
    low, middle, high = (float(q) for q in np.quantile(draws, (0.05, 0.5, 0.95)))
    low_text, median, high_text = rounded((low, middle, high), high - low)
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"{MEDIAN} {median}{unit}\n{WIDE_INTERVAL} {low_text} to {high_text}{unit}"
