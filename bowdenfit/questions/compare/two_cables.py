"""Two cables side by side: fits of different measurements, the difference of what they have in common, and its probability."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.errors import UsageError
from bowdenfit.inference.interval import Interval
from bowdenfit.pages.section import Chart, PageSection, Picture, Series, SeriesGroup, prose_section
from bowdenfit.plots.curves import GRID_POINTS, density, limits, support
from bowdenfit.plots.style import MEDIAN, WIDE_INTERVAL
from bowdenfit.questions.groups import Contrast
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Record
from bowdenfit.words import begin_sentence, listed

TITLE = "Two cables side by side"
_COLORS = ("blue", "vermillion")
_DRAWS = 20_000  # of a difference: its 90 % interval then has an error of 1 % of its width; a judgement
_CURVE_POINTS = 121  # of an efficiency along the route; a judgement


@dataclass(frozen=True, repr=False)
class TwoCables(Display):
    """Two fits of different measurements beside each other.

    Args:
        names: Names of the two.
        contrasts: First minus second, of each quantity that both have.
        charts: Both on one chart: efficiency along the route, or the densities of a coefficient.
    """

    names: tuple[str, str]
    contrasts: tuple[Contrast, ...]
    charts: tuple[Chart, ...]

    def sentences(self) -> list[str]:
        """Return the differences in words."""
        return [f"{begin_sentence(contrast.coefficient)}: {contrast.sentence()}." for contrast in self.contrasts]

    def _table(self) -> Rows:
        rows = [contrast.row for contrast in self.contrasts]
        return rows, dict.fromkeys(rows[0] if rows else (), "1")

    @property
    def section(self) -> PageSection:
        """The same as a part of a page."""
        caption = f"{listed(list(self.names))} on one chart: line, median; band, {WIDE_INTERVAL}, or density of each value."
        note = (
            "The probability is that of the sign, which is 0.5 where nothing is known of it. It is by the readings alone: "
            "errors of one bench are in both cables and largely cancel; those of two benches do not, and are left out."
        )
        picture = Picture("two-cables", TITLE, caption, self.charts, caption, alone=True)
        return prose_section(TITLE, [*self.sentences(), note], pictures=(picture,))


def contrast_cables(one: Record, other: Record, names: tuple[str, str]) -> TwoCables:
    """Return two cables beside each other.

    Args:
        one, other: Fits with draws, of different measurements.
        names: Names.

    Raises:
        UsageError: They share measurements, one has no draws, or they have nothing in common.
    """
    if shared := shared_files(one, other):
        raise UsageError(
            f"both fits are of {listed(shared)}, whose errors they share, so that their difference is not that of two cables; "
            "bowdenfit compare says which of two models of the same measurements predicts better."
        )
    pairs, generator = dict(_common_draws(one, other)), np.random.default_rng(one.provenance.seed)
    if not pairs:
        raise UsageError("the fits have no coefficient of the same name and no efficiency in common to be compared.")
    contrasts = [_contrast(quantity, draws, names, generator) for quantity, draws in pairs.items()]
    charts = _efficiency_charts(one, other, names)
    charts = charts or tuple(_density_chart(quantity, draws, names) for quantity, draws in pairs.items())
    return TwoCables(names, tuple(contrasts), charts)


def shared_files(one: Record, other: Record) -> list[str]:
    """Names of the measured files that two fits share."""
    first, second = (dict(_files(fit)) for fit in (one, other))
    return [name for name, checksum in first.items() if checksum in second.values()]


def _files(fit: Record) -> Iterator[tuple[str, str]]:
    """Yield name and checksum of the measured files of a fit."""
    return ((name, checksum) for name, checksum in fit.dataset.sha256.items() if not name.endswith(".toml"))


def _common_draws(one: Record, other: Record) -> Iterator[tuple[str, tuple[np.ndarray, np.ndarray]]]:
    """Yield each quantity that both fits have, in words, with the draws of both."""
    first, second = one.draws(), other.draws()
    routes = one.dataset.description.route, other.dataset.description.route
    if routes[0] is not None and routes[1] is not None and routes[0].unit == routes[1].unit:
        yield f"best length ({routes[0].unit})", (first.optimum[OPTIMAL_LENGTH], second.optimum[OPTIMAL_LENGTH])
        at_best = (100 * draws.optimum[OPTIMAL_EFFICIENCY] for draws in (first, second))
        yield "efficiency there (%)", (next(at_best), next(at_best))
    elif routes == (None, None) and not (one.model.cable.is_loop or other.model.cable.is_loop):
        yield "efficiency at the nominal wrap angles (%)", (100 * one.efficiency_draws(), 100 * other.efficiency_draws())
    for name in [p.name for p in one.model.space.free if p.role == "friction" and p.name in second.values]:
        yield name, (first.values[name], second.values[name])


def _contrast(
    quantity: str, draws: tuple[np.ndarray, np.ndarray], names: tuple[str, str], generator: np.random.Generator
) -> Contrast:
    """Return the difference of two quantities that were measured apart: any draw of the one beside any of the other."""
    first, second = (generator.choice(np.ravel(values), _DRAWS) for values in draws)
    below = float(np.mean(first < second))
    return Contrast(quantity, *names, Interval.of(first - second), max(below, 1 - below))


def _efficiency_charts(one: Record, other: Record, names: tuple[str, str]) -> tuple[Chart, ...]:
    """Return both efficiencies along the route; none where one has no route, or another one."""
    first, second = one.dataset.description.route, other.dataset.description.route
    if first is None or second is None or first.unit != second.unit:
        return ()
    label = f"{first.variable.replace('_', ' ').capitalize()} ({first.unit})"
    pairs = zip((one, other), (first, second), names, _COLORS, strict=True)
    groups = tuple(_efficiency_group(fit, route.range, name, color) for fit, route, name, color in pairs)
    return (Chart("Efficiency", label, "Efficiency (%)", groups),)


def _efficiency_group(fit: Record, span: tuple[float, float], name: str, color: str) -> SeriesGroup:
    """Return the efficiency of a cable along its route, with its interval."""
    lengths, band = np.linspace(*span, _CURVE_POINTS), f"{name}, {WIDE_INTERVAL}"
    low, median, high = np.quantile(100 * fit.efficiency_draws(lengths), (0.05, 0.5, 0.95), axis=0)
    line = Series(f"{name}, {MEDIAN.lower()}", "line", color, median)
    return SeriesGroup(lengths, (Series(band, "low", color, low), Series(band, "high", color, high), line))


def _density_chart(quantity: str, draws: tuple[np.ndarray, np.ndarray], names: tuple[str, str]) -> Chart:
    """Return the densities of a quantity of both."""
    ends = [limits(values) for values in draws]
    grid = np.linspace(min(low for low, _ in ends), max(high for _, high in ends), 2 * GRID_POINTS)
    pairs = zip(draws, names, _COLORS, strict=True)
    lines = tuple(Series(name, "line", color, density(values, grid, support(values))) for values, name, color in pairs)
    return Chart(quantity, quantity, "Density", (SeriesGroup(grid, lines),))
