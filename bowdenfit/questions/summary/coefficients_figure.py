"""What the data say about each coefficient, against what was assumed before and what least squares finds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.pages.section import Chart, Series, SeriesGroup, Span
from bowdenfit.parameters.symbols import to_plain_text
from bowdenfit.plots.captions import WITH_BENCH_ERRORS, count_shown, explain_symbols
from bowdenfit.plots.curves import GRID_POINTS, choose_evenly, density, limits, support
from bowdenfit.plots.layout import (
    TITLE,
    count_columns,
    drop_unused,
    label_across,
    legend_above,
    panels,
    room_for_labels,
)
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
    axis_label,
    in_paper_style,
    rounded_texts,
)
from bowdenfit.words import counted, significant

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Coefficients"
ROLES = ("friction", "friction_model", "angle", "sensor")
_SHORT = (1e-3, 1e5)  # numbers between these are written out
MOST_CHARTS = 24  # coefficients on a page; a judgement
WITH_READINGS, BEFORE_READINGS = "With the measurements", "Before them (prior)"
MOST_COLUMNS, LEAST_WIDTH = 3, 1.4  # panels in a row, and width of one [in]


@dataclass(frozen=True)
class Coefficient:
    """One free parameter in its shown unit.

    Args:
        symbol: In matplotlib's math notation.
        unit: Unit.
        draws: From the posterior, walkers by draws.
        prior: From the prior.
        least_squares: Estimate; NaN where not identified.
        standard_error: Its standard error.
        meaning: Meaning in words.
    """

    symbol: str
    unit: str
    draws: np.ndarray
    prior: np.ndarray
    least_squares: float = float("nan")
    standard_error: float = float("nan")
    meaning: str = ""


def data(fit: Record) -> tuple[Coefficient, ...] | None:
    """Return the parameters that belong to friction, constant angles or sensors; None without draws."""
    from bowdenfit.questions.error_budget import with_bench_errors  # here, as drawing again needs no JAX

    posterior, estimates, coefficients = with_bench_errors(fit).sampled, fit.least_squares.estimates, []
    if posterior is None:
        return None
    for p in (p for role in ROLES for p in fit.model.space.free if p.role == role):
        estimate = estimates.get(p.name)
        value, standard_error = (estimate.value, estimate.standard_error) if estimate else (float("nan"), float("nan"))
        coefficients.append(
            Coefficient(
                p.symbol, p.unit, posterior.values[p.name], posterior.prior[p.name], value, standard_error, p.meaning
            )
        )
    return tuple(coefficients) or None


def caption(parameters: tuple[Coefficient, ...]) -> str:
    """Describe what is drawn, in plain words."""
    return (
        f"What the measurements say of {counted(len(parameters), 'coefficient')}. Shaded: how plausible each value is, "
        f"{WITH_BENCH_ERRORS} considered; dashed: by the prior alone; square with bar: the least-squares estimate with "
        "its standard error. Above each panel stand the median and the interval that holds the value with 90 % probability. "
        f"{explain_symbols((p.symbol, p.meaning) for p in parameters)}"
        f"n = {parameters[0].draws.size} draws from the posterior."
    )


@in_paper_style
def draw(parameters: tuple[Coefficient, ...], width: float | None = None) -> Figure:
    """Draw the posterior density of each coefficient against its prior, and the least-squares estimate."""
    columns = count_columns(width or WIDE, min(MOST_COLUMNS, len(parameters)), LEAST_WIDTH, 0.68)
    rows = -(-len(parameters) // columns)
    page = width or (WIDE if columns > 1 else MEDIUM)
    figure, flat = panels([1.35] * rows, columns, TITLE + 0.14, (0.68, TITLE + 0.64), page)
    flat = drop_unused(flat, len(parameters))
    for axes, parameter in zip(flat, parameters, strict=True):
        _draw_panel(axes, parameter)
    legend_above(figure, flat, columns=3)
    room_for_labels(figure)
    return figure


def _draw_panel(axes: Axes, parameter: Coefficient) -> None:
    """Draw the posterior density of one coefficient against its prior, and the least-squares estimate."""
    draws, shown = parameter.draws, _find_limits(parameter)
    grid, lower = np.linspace(*shown, GRID_POINTS), support(draws, parameter.prior)
    posterior = density(draws, grid, lower)
    axes.fill_between(grid, posterior, color=BLUE, alpha=0.38, linewidth=0)
    axes.plot(grid, posterior, color=BLUE, label=WITH_READINGS)
    prior = density(parameter.prior, grid, lower)
    axes.plot(grid, prior, color=BLACK, linestyle="--", linewidth=1.0, label=BEFORE_READINGS)
    _draw_least_squares(axes, parameter, shown, 0.08 * posterior.max())
    axes.set(xlim=shown, ylim=(0, 1.2 * posterior.max()))
    label_across(axes, axis_label(parameter.symbol, parameter.unit))
    axes.yaxis.set_major_formatter(lambda value, _: _format_in_few_letters(value))
    axes.set_ylabel(_density_label(parameter))
    axes.set_title(_describe_posterior(parameter))


def _format_in_few_letters(value: float) -> str:
    """Format a number as it is, or as a power of ten where that is shorter: 4e5."""
    if value == 0 or _SHORT[0] <= abs(value) < _SHORT[1]:
        return f"{value:.6g}".replace("-", "\N{MINUS SIGN}")
    digits, power = f"{value:.3e}".split("e")
    return f"{digits.rstrip('0').rstrip('.')}e{int(power)}".replace("-", "\N{MINUS SIGN}")


def _find_limits(parameter: Coefficient) -> tuple[float, float]:
    """Return limits that show the posterior, and the least-squares estimate unless it is far away."""
    low, high = limits(parameter.draws)
    value, width = parameter.least_squares, high - low
    if np.isfinite(value) and low - width < value < high + width:
        low, high = min(low, value - 0.05 * width), max(high, value + 0.05 * width)
    return low, high


def _draw_least_squares(axes: Axes, parameter: Coefficient, shown: tuple[float, float], height: float) -> None:
    """Draw the estimate with its standard error, or a note where there is none to draw."""
    value, error = parameter.least_squares, parameter.standard_error
    if shown[0] <= value <= shown[1]:
        axes.errorbar(
            [value], [height], xerr=[error] if np.isfinite(error) else None, fmt="s", color=VERMILLION, capsize=2.5,
            markerfacecolor="white", linewidth=1.2, label=f"{LEAST_SQUARES} \N{PLUS-MINUS SIGN} standard error",
        )  # fmt: skip
        return
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    note = f"off the axis, {significant(value)}{unit}" if np.isfinite(value) else "not identified"
    axes.text(
        0.98, 0.98, f"{LEAST_SQUARES}: {note}", transform=axes.transAxes, ha="right", va="top", fontsize=SMALL,
        color=VERMILLION,
    )  # fmt: skip


def _describe_posterior(parameter: Coefficient) -> str:
    """Return the median and 90 % interval of a coefficient, as a title."""
    low, median, high = _round_quantiles(_quantiles(parameter))
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"{MEDIAN} {median}{unit}\n{WIDE_INTERVAL} {low} to {high}{unit}"


def _density_label(parameter: Coefficient) -> str:
    return "Density" if parameter.unit == "1" else f"Density (1/{parameter.unit})"


def _quantiles(parameter: Coefficient) -> tuple[float, float, float]:
    """Return the lower end of the 90 % interval, the median, and the upper end."""
    low, median, high = (float(q) for q in np.quantile(parameter.draws, (0.05, 0.5, 0.95)))
    return low, median, high


def _round_quantiles(quantiles: tuple[float, float, float]) -> tuple[str, ...]:
    """Return quantiles as texts with digits that the width of the interval warrants."""
    return tuple(rounded_texts(quantiles, quantiles[2] - quantiles[0]))


def make_coefficient_charts(parameters: tuple[Coefficient, ...]) -> tuple[Chart, ...]:
    """Return a chart of the density of each coefficient, or of evenly chosen ones of many.

    Args:
        parameters: Parameters in the figure.
    """
    return tuple(_make_chart(parameter) for parameter in choose_evenly(parameters, MOST_CHARTS))


def describe_coefficient_charts(parameters: tuple[Coefficient, ...]) -> str:
    """Describe the charts, one coefficient at a time."""
    counting = count_shown(min(len(parameters), MOST_CHARTS), len(parameters), "coefficient")
    return (
        f"What the measurements say of {counting}, one at a time. Line: how plausible each value is, measurements and "
        "priors considered; dashed: by the prior alone. Shaded: the interval that holds the value with 90 % probability. "
        "Upright lines: median, and the least-squares estimate. "
        f"{explain_symbols((p.symbol, p.meaning) for p in parameters)}"
        f"n = {parameters[0].draws.size} draws from the posterior."
    )


def _make_chart(parameter: Coefficient) -> Chart:
    """Return the chart of one coefficient: densities, the interval, the median, and least squares where it is near."""
    shown, lower = _find_limits(parameter), support(parameter.draws, parameter.prior)
    grid = np.linspace(*shown, GRID_POINTS)
    lines = (
        Series(WITH_READINGS, "line", "blue", density(parameter.draws, grid, lower)),
        Series(BEFORE_READINGS, "dashed", "black", density(parameter.prior, grid, lower)),
    )
    low, median, high = _quantiles(parameter)
    low_text, _, high_text = _round_quantiles((low, median, high))
    spans = [Span(f"{WIDE_INTERVAL}, {low_text} to {high_text}", "pull", low, high), Span(MEDIAN, "blue", median, median)]
    estimate, error = parameter.least_squares, parameter.standard_error
    if shown[0] <= estimate <= shown[1]:
        note = f" (standard error {significant(error)})" if np.isfinite(error) else ""
        spans.append(Span(f"{LEAST_SQUARES}{note}", "vermillion", estimate, estimate))
    label = to_plain_text(axis_label(parameter.symbol, parameter.unit))
    name = to_plain_text(parameter.symbol) + (f", {parameter.meaning}" if parameter.meaning else "")
    return Chart(name, label, _density_label(parameter), (SeriesGroup(grid, lines),), tuple(spans))
