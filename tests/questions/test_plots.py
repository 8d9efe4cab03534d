"""The figures: what they draw, what they leave out, and how they are written."""

import dataclasses
import io
import pickle
import re
import subprocess
import sys
import zlib
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from figure_words import assert_readable, check_words, words
from fontTools.ttLib import TTFont
from matplotlib.collections import PolyCollection
from matplotlib.contour import ContourSet
from shared_figures import DrawnOnce
from stored_figure_data import assert_kept

from bowdenfit.inference.interval import Interval
from bowdenfit.plots.curves import BAND_QUANTILES, NEW_RUN, Band, density
from bowdenfit.plots.layout import NUMBER_SPACE, axes_at, empty_page, number_below, ticks
from bowdenfit.plots.style import in_paper_style
from bowdenfit.plots.write import FORMATS, write
from bowdenfit.questions.figures import FIGURES, collect_figure_data, write_figure_files
from bowdenfit.questions.length.efficiency_figure import EfficiencyAlongRoute, EfficiencyPoints
from bowdenfit.questions.length.wrap_angles_figure import AngleCurve, WrapAngles
from bowdenfit.questions.summary import pairs_figure
from bowdenfit.questions.summary.coefficients_figure import Coefficient
from bowdenfit.questions.summary.pairs_figure import Pairs, SampledQuantity
from bowdenfit.questions.summary.residuals_figure import Residuals
from bowdenfit.questions.summary.traces_figure import Traces
from bowdenfit.results.optimal_length import Choice, OptimalLength, Window
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH

LABEL = "Cable length (mm)"
RANGE = (430.0, 530.0)
GRID = np.linspace(*RANGE, 41)
WALKERS, DRAWS, ENSEMBLES = 32, 10, 4
SPREAD = np.array([-1.6, -0.7, 0.0, 0.7, 1.6])[:, None]
EFFICIENCIES = np.array([0.77, 0.785, 0.753, 0.678])


def coefficient(name, symbol, middle, sd, unit="1", estimate=None):
    rng = np.random.default_rng(len(name))
    draws = np.abs(middle + sd * rng.standard_normal((WALKERS, DRAWS)))
    prior = np.abs(middle + 5 * sd * rng.standard_normal((1, 500)))
    return Coefficient(symbol, unit, draws, prior, middle if estimate is None else estimate, sd)


def positive(item):
    """A coefficient as the pair plot and the paths of the ensembles show it."""
    return SampledQuantity(item.symbol if item.unit == "1" else f"{item.symbol} ({item.unit})", item.draws, (0.0, np.inf))


def best(lengths, efficiency):
    return [
        SampledQuantity("Optimum (mm)", lengths, RANGE),
        SampledQuantity("Efficiency at\noptimum (%)", 100 * efficiency, (0, 100)),
    ]


def angle_curve(contact, at_start, at_end, outside):
    median = np.geomspace(at_start, at_end, len(GRID))
    route = np.arange(430.0, 531.0, 10.0)
    angle = np.interp(route, GRID, median) + 0.5
    seen = angle >= 10.0
    return AngleCurve(
        contact, Band(GRID, median * (1 + 0.05 * SPREAD)), route[seen], angle[seen], route[~seen],
        np.full((~seen).sum(), 10.0), np.array([540.0, 550.0]), np.array(outside), 1.1 * median,
    )  # fmt: skip


def optimum(draws):
    choices = tuple(Choice(float(c), 0.5 if c in (470.0, 480.0) else 0.0, 0.0) for c in range(430, 531, 10))
    best = Interval.of(np.full(draws.shape, 0.79))
    at_edge = float((draws >= RANGE[1]).mean())
    return OptimalLength(
        "cable_length", "mm", Interval.of(draws), best, at_edge, Window(0.01, 0.95, 455.0, 484.0), choices
    )


def paper_data(length_draws=None):
    """What the figures of the on-body data set show, by name."""
    rng = np.random.default_rng(7)
    route = np.array([440.0, 470.0, 510.0, 550.0])
    points = EfficiencyPoints(
        False, tuple(f"{r:g} mm" for r in route), route, EFFICIENCIES,
        EFFICIENCIES + 0.002 + 0.01 * SPREAD, route <= RANGE[1],
    )  # fmt: skip
    lengths = 470 + 4.5 * rng.standard_normal((WALKERS, DRAWS)) if length_draws is None else length_draws
    curves = (
        angle_curve("free sheath", 5.0, 118.0, [108.0, 100.0]), angle_curve("squeezed sheath", 58.0, 5.0, [28.0, 37.0])
    )  # fmt: skip
    friction = (
        coefficient("mu1", r"$\mu_1$", 0.084, 0.01), coefficient("mu22", r"$\mu_2$", 0.123, 0.02),
        coefficient("mu333", r"$\mu_3$", 0.17, 0.05, estimate=float("nan")),
    )  # fmt: skip
    noise = coefficient("sigma_theta", r"$\sigma_\theta$", 2.3, 0.5, "deg"), coefficient("tau", r"$\tau$", 0.0, 0.012)
    shape = coefficient("free_sheath_angle_a", r"$a_\mathrm{fs}$", 3.2, 0.05, "log rad")
    band = Band(GRID, 0.79 - 1e-5 * (GRID - 470) ** 2 + 0.01 * SPREAD)
    answer = best(lengths, 0.79 + 0.008 * rng.standard_normal((WALKERS, DRAWS)))
    return {
        "wrap_angles": WrapAngles(curves, LABEL, RANGE),
        "efficiency": EfficiencyAlongRoute(LABEL, RANGE, band, (points,), optimum(lengths), lengths),
        "coefficients": friction,
        "pairs": Pairs([positive(c) for c in (*friction, *noise)] + answer, "cable length"),
        "traces": Traces([positive(c) for c in (*friction, *noise, shape)] + answer[:1], ENSEMBLES, 310, 600),
        "residuals": Residuals((points,)),
    }


def without_route(data):
    (points,), first = data["residuals"].points, data["coefficients"][:1]
    points = dataclasses.replace(points, route=np.full(4, np.nan), inside=np.ones(4, dtype=bool))
    paths = Traces([positive(first[0])], ENSEMBLES, 310, 600)
    return {"coefficients": first, "traces": paths, "residuals": Residuals((points,))}


def without_draws(data):
    def line(band):
        return Band(band.route, band.quantiles[2:3])

    (points,), along = data["residuals"].points, data["efficiency"]
    curves = tuple(dataclasses.replace(c, band=line(c.band)) for c in data["wrap_angles"].curves)
    points = (dataclasses.replace(points, predicted=points.predicted[2:3]),)
    return {
        "wrap_angles": WrapAngles(curves, LABEL, RANGE),
        "efficiency": EfficiencyAlongRoute(LABEL, RANGE, line(along.efficiency), points),
        "residuals": Residuals(points),
    }


def changed(data, name, **parts):
    """The same with parts of what one figure shows replaced."""
    return data | {name: dataclasses.replace(data[name], **parts)}


def with_many_runs(data):
    route = np.resize(np.arange(430.0, 531.0, 10.0), 40)
    measured = np.resize(EFFICIENCIES[:3], 40)
    labels = tuple(f"forces/2024-05-03_bench_a.csv, run {i}" for i in range(40))
    runs = EfficiencyPoints(
        True, labels, route, measured, measured + 0.01 * SPREAD, np.ones(40, dtype=bool)
    )
    points = (*data["residuals"].points, runs)
    return changed(changed(data, "efficiency", points=points), "residuals", points=points)


def with_five_contacts(data):
    curves = data["wrap_angles"].curves
    curves += tuple(dataclasses.replace(curves[0], contact=f"contact {i}") for i in range(3))
    friction = tuple(coefficient(f"mu{'4' * i}", rf"$\mu_{i}$", 0.1, 0.01) for i in range(4, 9))
    sampled = [positive(c) for c in friction]
    data = data | {"coefficients": friction + data["coefficients"]}
    data = changed(data, "wrap_angles", curves=curves)
    pairs = sampled + data["pairs"].quantities
    data = changed(data, "pairs", quantities=pairs[: pairs_figure.MOST_QUANTITIES - 2] + pairs[-2:])
    return changed(data, "traces", quantities=sampled + data["traces"].quantities)


def with_constant_draws(data):
    def constant(quantity, value=0.1):
        return dataclasses.replace(quantity, draws=np.full((WALKERS, DRAWS), value))

    def all_constant(quantities):
        values = {"Optimum (mm)": 470.0, "Efficiency at\noptimum (%)": 79.0}
        return [constant(q, values.get(q.label, 0.1)) for q in quantities]

    data = data | {"coefficients": tuple(map(constant, data["coefficients"]))}
    data = changed(data, "efficiency", optimal_length=np.full((WALKERS, DRAWS), 470.0))
    data = changed(data, "pairs", quantities=all_constant(data["pairs"].quantities))
    return changed(data, "traces", quantities=all_constant(data["traces"].quantities))


def with_long_names(data):
    name = "$\\mu$ a rope of a rather long name, braided"
    friction = tuple(dataclasses.replace(c, symbol=f"{name} {i}") for i, c in enumerate(data["coefficients"]))
    data = data | {"coefficients": friction}
    pairs = [positive(c) for c in friction] + data["pairs"].quantities[3:]
    return changed(data, "pairs", quantities=pairs)


def at_the_edge():
    rng = np.random.default_rng(1)
    return paper_data(np.minimum(525 + 6 * rng.standard_normal((WALKERS, DRAWS)), RANGE[1]))


CASES = {
    "on body": paper_data,
    "no route": lambda: without_route(paper_data()),
    "least squares only": lambda: without_draws(paper_data()),
    "many runs": lambda: with_many_runs(paper_data()),
    "five contacts": lambda: with_five_contacts(paper_data()),
    "constant draws": lambda: with_constant_draws(paper_data()),
    "optimum at the edge": at_the_edge,
    "long names": lambda: with_long_names(paper_data()),
}
ALL = ["wrap_angles", "efficiency", "residuals", "coefficients", "pairs", "traces"]


ONCE = DrawnOnce(CASES)
forget = ONCE.forgotten()


def draw_figure(name, data=None):
    return ONCE.figure(name, "on body") if data is None else FIGURES[name].draw(data[name])


def line(axes, label):
    return next(artist for artist in axes.get_lines() if artist.get_label() == label)


@pytest.fixture(scope="module")
def fit(quick_fit):
    return quick_fit


@pytest.mark.extended
def test_only_figures_that_apply_are_drawn(fit, least_squares_of):
    shown = dict(collect_figure_data(fit))
    assert list(shown) == [*ALL, "checks"]
    assert_readable(shown, fit.name)
    squares = least_squares_of("on-body-exoskeleton")
    assert [name for name, _ in collect_figure_data(squares)] == ["wrap_angles", "efficiency", "residuals"]
    without = least_squares_of("yarn-on-cylinder")
    assert [name for name, _ in collect_figure_data(without)] == ["forces", "residuals"]


def test_a_single_draw_of_each_walker_has_no_trace_but_all_else(fit):
    def first(draws):
        return {name: values[:, :1] for name, values in draws.items()}

    draws = fit.posterior
    single = dataclasses.replace(draws, z=draws.z[:, :1], values=first(draws.values), optimum=first(draws.optimum))
    single = dataclasses.replace(fit, sampled=single)
    assert FIGURES["traces"].data(single) is None
    assert FIGURES["coefficients"].data(single) is not None
    assert FIGURES["pairs"].data(single) is not None


def test_another_process_reads_what_figures_show_without_a_model_or_matplotlib(fit):
    program = "import pickle, sys; pickle.load(sys.stdin.buffer); print({'jax', 'matplotlib'} & set(sys.modules))"
    data = pickle.dumps(dict(collect_figure_data(fit)))
    done = subprocess.run([sys.executable, "-c", program], input=data, capture_output=True, check=True)
    assert done.stdout.strip() == b"set()"


@pytest.mark.extended
@pytest.mark.parametrize("case", CASES)
def test_no_words_overlap_or_leave_the_page(case):
    for name in ONCE.data(case):
        check_words(ONCE.figure(name, case), name)


@pytest.mark.parametrize("case", CASES)
def test_every_axis_says_what_it_shows_or_shares_one_that_does(case):
    for name in ONCE.data(case).keys() - {"pairs", "traces"}:
        for axes in ONCE.figure(name, case).axes:
            assert any(other.get_xlabel() for other in axes.get_shared_x_axes().get_siblings(axes))
            lists_rows = name == "residuals"
            assert lists_rows or any(other.get_ylabel() for other in axes.get_shared_y_axes().get_siblings(axes))


@pytest.mark.parametrize(
    ("name", "labels"),
    [
        ("wrap_angles", {"Cable length (mm)", "Wrap angle (deg)"}),
        ("efficiency", {"Cable length (mm)", "Efficiency (%)", "Density (1/mm)", "Probability (%)"}),
        ("coefficients", {r"$\mu_1$", r"$\mu_2$", r"$\mu_3$", "Density"}),
        ("pairs", {r"$\mu_1$", r"$\sigma_\theta$ (deg)", "Optimum (mm)", "Efficiency at\noptimum (%)"}),
        ("traces", {r"$\mu_1$", r"$\sigma_\theta$ (deg)", "Optimum (mm)", "Step of the sampler"}),
        ("residuals", {"Efficiency (%)", "Measured minus predicted median\n(percentage points)"}),
    ],
)
def test_names_and_units_are_the_same_everywhere(name, labels):
    assert labels <= {text for text, _ in words(draw_figure(name))}


def test_wrap_angles_show_every_reading_as_what_it_is():
    data = paper_data()
    axes = draw_figure("wrap_angles", data).axes[0]
    curve = data["wrap_angles"].curves[0]
    np.testing.assert_array_equal(line(axes, "Reading").get_xydata().T, [curve.route, curve.angle])
    np.testing.assert_array_equal(
        line(axes, "Not detected, at its limit").get_xydata().T, [curve.undetected_route, curve.limit]
    )
    unused = line(axes, "Not used by the curve")
    np.testing.assert_array_equal(unused.get_xydata().T, [curve.outside_route, curve.outside_angle])
    assert unused.get_markerfacecolor() == "white"
    assert len(axes.patches) >= len(curve.undetected_route)


def test_bands_hold_the_quantiles_of_the_curve():
    data = paper_data()
    axes = draw_figure("wrap_angles", data).axes[0]
    low, _, median, _, high = data["wrap_angles"].curves[0].band.quantiles
    np.testing.assert_array_equal(line(axes, "Median").get_ydata(), median)
    widest = next(c for c in axes.collections if c.get_label() == "90 % interval")
    heights = widest.get_paths()[0].vertices[:, 1]
    assert (heights.min(), heights.max()) == (low.min(), high.max())


def test_without_draws_there_is_a_line_and_no_band():
    data = without_draws(paper_data())
    for name in ("wrap_angles", "efficiency"):
        axes = draw_figure(name, data).axes[0]
        assert line(axes, "Least squares")
        assert not [c for c in axes.collections if isinstance(c, PolyCollection)]
    assert len(draw_figure("efficiency", data).axes) == 2  # the curve and its residuals


def test_no_curve_is_drawn_outside_the_range():
    for name in ("wrap_angles", "efficiency"):
        axes = draw_figure(name).axes[0]
        route = line(axes, "Median").get_xdata()
        assert (route.min(), route.max()) == RANGE
        assert axes.get_xlim()[1] > 550.0
        assert "Outside the range of the curves" in [p.get_label() for p in axes.patches]


def test_efficiency_marks_points_outside_with_their_prediction():
    data = paper_data()
    axes = draw_figure("efficiency", data).axes[0]
    np.testing.assert_allclose(line(axes, "Measured").get_ydata(), 100 * EFFICIENCIES[:3])
    outside = line(axes, "Measured, outside the range")
    np.testing.assert_allclose(outside.get_xydata(), [[550.0, 67.8]])
    (container,) = axes.containers
    (bar,) = container[2][0].get_segments()
    np.testing.assert_allclose(bar[:, 1], 100 * data["efficiency"].points[0].predicted[[0, -1], 3])


def test_optimum_window_and_choices_stand_below_the_efficiency():
    data = paper_data()
    _, strip, location, which = draw_figure("efficiency", data).axes
    np.testing.assert_allclose(strip.get_lines()[0].get_ydata(), -0.2, atol=1e-9)
    window = next(p for p in location.patches if "best with 95 %" in p.get_label())
    assert (window.get_x(), window.get_x() + window.get_width()) == (455.0, 484.0)
    heights = [bar.get_height() for bar in which.containers[0]]
    assert heights == [100 * choice.probability_best for choice in data["efficiency"].optimum.choices]


def test_runs_stand_beside_the_lines_between_which_nine_of_ten_lie():
    data = with_many_runs(paper_data())
    ends = data["efficiency"].efficiency.quantiles[[0, -1]] + [[-0.02], [0.02]]
    axes = draw_figure("efficiency", changed(data, "efficiency", new_run=ends)).axes[0]
    shown = [line.get_ydata() for line in axes.get_lines() if line.get_label() == NEW_RUN]
    np.testing.assert_allclose(shown, 100 * ends)


def test_a_missing_window_is_not_drawn():
    data = paper_data()
    nowhere = dataclasses.replace(data["efficiency"].optimum, window=Window(0.01, 0.95, float("nan"), float("nan")))
    figure = draw_figure("efficiency", changed(data, "efficiency", optimum=nowhere))
    assert not [text for text, _ in words(figure) if "probability" in text]


def test_an_optimum_at_the_edge_is_said_to_be_there():
    share = at_the_edge()["efficiency"].optimum.at_edge
    assert share > 0.1
    assert f"at an end of the range with {100 * share:.3g} % probability" in [
        t for t, _ in words(draw_figure("efficiency", at_the_edge()))
    ]


@pytest.mark.parametrize("width", [3.0, 3.5, 7.0])
def test_what_is_said_of_an_edge_stands_beside_the_density(width):
    figure = FIGURES["efficiency"].draw(at_the_edge()["efficiency"], width)
    figure.draw_without_rendering()
    message = [(axes, text) for axes in figure.axes for text in axes.texts if text.get_text().startswith("at an end of")]
    ((axes, text),) = message
    assert text.get_window_extent().width <= 0.45 * axes.get_window_extent().width


def test_coefficients_show_prior_posterior_and_least_squares():
    data = paper_data()
    axes = draw_figure("coefficients", data).axes
    assert len(axes) == 3
    for panel, p in zip(axes, data["coefficients"], strict=True):
        assert {"With the measurements", "Before them (prior)"} <= {artist.get_label() for artist in panel.get_lines()}
        low, median, high = (f"{q:.3f}" for q in np.quantile(p.draws, (0.05, 0.5, 0.95)))
        if p.symbol == r"$\mu_1$":
            assert panel.get_title() == f"Median {median}\n90 % interval {low} to {high}"
    (bar,) = axes[0].containers[0][2][0].get_segments()
    np.testing.assert_allclose(bar[:, 0], [0.074, 0.094])
    assert "Least squares: not identified" in [t.get_text() for t in axes[2].texts]


def test_a_far_least_squares_estimate_is_written_not_drawn():
    data = paper_data()
    far = dataclasses.replace(data["coefficients"][0], least_squares=5.0)
    (axes,) = draw_figure("coefficients", {"coefficients": (far,)}).axes
    assert not axes.containers
    assert [t.get_text() for t in axes.texts] == ["Least squares: off the axis, 5"]


@pytest.mark.parametrize("force", [1e-6, 1e-7, 1e6])
def test_densities_of_very_small_and_very_large_quantities_have_short_numbers(force):
    (small,) = (coefficient("drag", "$D$", 1.2 * force, 0.3 * force, "N"),)
    figure = draw_figure("coefficients", {"coefficients": (small, *paper_data()["coefficients"][:2])})
    check_words(figure, "coefficients")
    (axes, *_) = figure.axes
    numbers = [text for text in axes.get_yticklabels() if text.get_text()]
    assert all(len(text.get_text()) < 7 for text in numbers)
    left = axes.yaxis.label.get_window_extent()
    assert not any(text.get_window_extent().overlaps(left) for text in numbers)
    assert not axes.yaxis.get_offset_text().get_text()


class Stub(SimpleNamespace):
    """Something that answers may be cached for."""

    __hash__ = object.__hash__


def fit_of_nine():
    """As much of a fit of nine coefficients as the pair plot asks for."""
    draws = {f"mu{i}": np.random.default_rng(i).uniform(0.1, 0.2, (WALKERS, DRAWS)) for i in range(9)}
    free = [SimpleNamespace(name=name, symbol=f"${name}$", unit="1", role="friction", meaning="") for name in draws]
    lengths = np.random.default_rng(9).uniform(460.0, 480.0, (WALKERS, DRAWS))
    optimum = {OPTIMAL_LENGTH: lengths, OPTIMAL_EFFICIENCY: np.full(lengths.shape, 0.79) + 1e-4 * lengths}
    route = SimpleNamespace(variable="cable_length", unit="mm", range=RANGE)
    return Stub(
        sampled=SimpleNamespace(values=draws, optimum=optimum, has_bench_errors=True),
        model=SimpleNamespace(space=SimpleNamespace(free=free)),
        dataset=SimpleNamespace(description=SimpleNamespace(route=route)),
    )  # fmt: skip


def test_pair_plot_shows_at_most_eight_and_keeps_the_optimum():
    texts = [text for text, _ in words(draw_figure("pairs", {"pairs": pairs_figure.data(fit_of_nine())}))]
    assert texts.count("Optimum (mm)") == 2  # below its column and left of its row
    symbols = {text for text in texts if text.startswith("$")}
    assert len(symbols) == 6


def test_traces_tell_a_stray_ensemble():
    data = paper_data()
    first = data["traces"].quantities[0]
    stray = first.draws.copy()
    stray[: WALKERS // ENSEMBLES] += 0.05
    moved = dataclasses.replace(first, draws=stray)
    figure = draw_figure("traces", {"traces": Traces([moved], ENSEMBLES, 310, 600)})
    medians = [line.get_ydata().mean() for line in figure.axes[0].lines if line.get_linewidth() == 1.0]
    assert len(medians) == ENSEMBLES
    assert medians[0] > max(medians[1:]) + 0.04


def test_residuals_are_measured_minus_predicted_in_points():
    figure = draw_figure("residuals")
    axes, strip = figure.axes
    np.testing.assert_allclose(line(axes, "Measured").get_xdata(), 100 * EFFICIENCIES[:3])
    np.testing.assert_allclose(line(strip, "Measured").get_xdata(), -0.2, atol=1e-12)
    np.testing.assert_allclose(line(strip, "Outside the range of the curves").get_xydata(), [[-0.2, 3.0]])
    assert [t.get_text() for t in axes.get_yticklabels()] == ["440 mm", "470 mm", "510 mm", "550 mm"]


def test_angle_residuals_are_readings_minus_the_curve():
    for axes in draw_figure("wrap_angles").axes[1::2]:
        np.testing.assert_allclose(axes.get_lines()[0].get_ydata(), 0.5)


def test_a_density_integrates_to_one_up_to_its_bound():
    draws = np.abs(np.random.default_rng(0).standard_normal(20_000))
    grid = np.linspace(0.0, 5.0, 301)
    height = density(draws, grid, lower=0.0)
    assert np.trapezoid(height, grid) == pytest.approx(1.0, abs=0.01)
    assert height[0] == pytest.approx(
        np.sqrt(2 / np.pi), rel=0.05
    )  # a half normal's, which smoothing alone would halve
    assert density(draws, np.linspace(-1.0, 5.0, 301), lower=0.0)[0] == 0.0


def test_the_95_percent_region_holds_95_percent_of_the_draws():
    x, y = np.random.default_rng(0).standard_normal((2, WALKERS, 20_000 // WALKERS))
    shown = [SampledQuantity(name, draws, (-np.inf, np.inf)) for name, draws in (("x", x), ("y", y))]
    panel = next(axes for axes in draw_figure("pairs", {"pairs": Pairs(shown)}).axes if axes.get_xlabel() and axes.get_ylabel())
    outlines = next(c for c in panel.collections if isinstance(c, ContourSet) and not c.filled)
    at_95 = outlines.get_paths()[0]  # the lowest level of density
    inside = at_95.contains_points(np.column_stack([x.ravel(), y.ravel()]))
    assert inside.mean() == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize(
    "limits", [(0.0, 0.034), (430.0, 530.0), (-1.31, -1.05), (1e-6, 3e-6), (0.171, 0.189), (1.0, 20.0)]
)
def test_ticks_are_round_and_within_the_axis(limits):
    values, texts = ticks(limits, lambda _: 4.0)
    assert len(values) == len(set(texts)) > 0
    assert limits[0] <= values.min() <= values.max() <= limits[1]


def panel_of(page, left, width, limits):
    axes = axes_at(page, left, 0.5, width, 0.8)
    axes.set(xlim=limits, yticks=[])
    axes.plot(limits, (0, 1))
    number_below(axes)


@in_paper_style
def test_numbers_at_the_edges_of_neighbors_keep_apart():
    page = empty_page(3.2, 1.5)
    for i, shown in enumerate([(0.003, 0.02), (0.0, 0.42)]):
        panel_of(page, 0.5 + 1.085 * i, 1.0, shown)
    check_words(page, "neighbors")
    assert {"0.02", "0.0"} <= {text for text, _ in words(page)}


@pytest.mark.parametrize("width", [0.57, 0.7, 0.9])
def test_an_axis_has_two_numbers_which_make_a_scale(width):
    """Of axes that begin and end anywhere; numbers of four letters, two of which fit side by side."""
    generator = np.random.default_rng(1)
    for i, (low, span) in enumerate(zip(generator.uniform(0.01, 0.3, 200), generator.uniform(0.02, 0.4, 200), strict=True)):
        values, texts = ticks((low, low + span), lambda texts: width / (NUMBER_SPACE * max(map(len, texts))))
        assert len(texts) > 1, (low, span)
        assert [float(text) for text in texts] == pytest.approx(values, abs=1e-9)
        if i % 25 == 0:
            page = empty_page(width + 1.0, 1.5)
            panel_of(page, 0.5, width, (low, low + span))
            check_words(page, f"{low} {span}")


@pytest.mark.extended
def test_all_figures_are_written_in_every_format_and_nothing_else(tmp_path):
    initial = dict(mpl.rcParams)
    written = [path for name, data in paper_data().items() for path in write_figure_files(name, data, tmp_path / "figures")]
    assert [path.name for path in written] == [f"{name}.{ending}" for name in paper_data() for ending in FORMATS]
    assert sorted(written) == sorted((tmp_path / "figures").iterdir())
    assert all(1_000 < path.stat().st_size < 500_000 for path in written)
    assert dict(mpl.rcParams) == initial


def test_only_the_formats_asked_for_are_written(tmp_path):
    written = write_figure_files("coefficients", paper_data()["coefficients"], tmp_path, formats=("svg",))
    assert [path.name for path in written] == ["coefficients.svg"]


@pytest.mark.extended
def test_the_same_data_give_the_same_bytes_with_words_as_text(tmp_path):
    for folder in ("first", "second"):
        for name, data in paper_data().items():
            write_figure_files(name, data, tmp_path / folder, formats=("svg",))
    for path in (tmp_path / "first").iterdir():
        assert path.read_bytes() == (tmp_path / "second" / path.name).read_bytes()
    assert "Wrap angle (deg)</text>" in (tmp_path / "first" / "wrap_angles.svg").read_text(encoding="utf-8")


def test_a_pdf_has_letters_that_can_be_searched(tmp_path):
    name = "Łódź λ <b> $x (50 %)"
    for folder in (tmp_path / "first", tmp_path / "second"):
        write_figure_files("coefficients", paper_data()["coefficients"], folder, ("pdf",), name)
    page = (tmp_path / "first" / "coefficients.pdf").read_bytes()
    assert page == (tmp_path / "second" / "coefficients.pdf").read_bytes()
    assert page.startswith(b"%PDF") and b"/FontFile2" in page and b"/Type3" not in page
    streams = [zlib.decompress(part) for part in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", page, re.DOTALL)]
    fonts = [TTFont(io.BytesIO(stream)) for stream in streams if stream[:4] == b"\x00\x01\x00\x00"]
    assert fonts
    assert any(b"beginbfchar" in stream or b"beginbfrange" in stream for stream in streams)  # from glyphs to letters


def test_a_failed_write_leaves_the_old_file_and_no_temporary_one(tmp_path):
    path = tmp_path / "coefficients.nonsense"
    path.write_text("old")
    with pytest.raises(ValueError, match="nonsense"):
        write(draw_figure("coefficients"), path)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "old"


def test_drawing_loads_neither_jax_nor_pyplot(tmp_path):
    program = (
        "import sys, bowdenfit.questions.figures as figures, bowdenfit.plots.layout as layout\n"
        "figures.write_all(layout.empty_page(1, 1), __import__('pathlib').Path(sys.argv[1]), 'empty')\n"
        "print(*sorted({'jax', 'scipy', 'arviz_base', 'matplotlib.pyplot'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program, str(tmp_path)], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_the_quantiles_of_the_bands_are_those_that_the_legends_name():
    assert BAND_QUANTILES == (0.05, 0.25, 0.5, 0.75, 0.95)


@pytest.mark.parametrize("case", CASES)
def test_data_come_back_from_the_file_in_which_they_are_kept(case, tmp_path):
    assert_kept(CASES[case](), tmp_path / "figures.npz")
