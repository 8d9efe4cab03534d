"""The figures of stretch, preload and loops: what they draw, of how many, and how they are written."""

import dataclasses

import matplotlib as mpl
import numpy as np
import pytest
from figure_words import assert_readable, check_words, words
from shared_figures import DrawnOnce
from stored_figure_data import assert_kept

from bowdenfit.plots.curves import choose_evenly
from bowdenfit.questions.bends.bending_loss_figure import BendingLoss, EfficiencyLine
from bowdenfit.questions.bends.loops_figure import LoopCurve
from bowdenfit.questions.bends.preload_figure import PreloadCurve, true_stretches
from bowdenfit.questions.bends.preload_window_figure import PreloadWindowCurves
from bowdenfit.questions.bends.stretch_figure import StretchCurve
from bowdenfit.questions.figures import FIGURES, write_figure_files

pytestmark = pytest.mark.extended

NAMES = ("stretch", "preload", "bending_loss", "loops", "preload_window")
QUANTILES = (0.05, 0.5, 0.95)
STIFFNESS, BEDDING_STRETCH, BEDDING_LOAD = 28.0, 0.9, 12.0  # N/mm, mm, N
RADIUS = 12.0  # mm, of the pulley
ANGLES = (0.0, 90.0, 180.0, 270.0)
LOADS = np.linspace(0.0, 80.0, 61)
INPUTS = np.linspace(0.0, 90.0, 61)
DRAWS = 300


@dataclasses.dataclass(frozen=True)
class Cable:
    """Draws of a loop: friction coefficient, preload when straight [N], center line's growth [mm/rad], rope's softness."""

    friction: np.ndarray
    preload: np.ndarray
    lengthening: np.ndarray
    softness: np.ndarray

    def quantiles(self, values):
        return np.quantile(values, QUANTILES, axis=0) if len(self.friction) > 1 else values[:1]


def cable(draws=True, preload=22.0, lengthening=-0.35):
    rng = np.random.default_rng(3)
    wobble = rng.standard_normal((4, DRAWS, 1)) if draws else np.zeros((4, 1, 1))
    preloads, softness = preload * np.exp(0.05 * wobble[1]), np.exp(0.03 * wobble[3])
    return Cable(0.11 + 0.008 * wobble[0], preloads, lengthening + 0.04 * wobble[2], softness)


def half(draws):
    return np.median(draws, axis=0)


def extension(tension):
    """e(T) = T/k + d (1 - exp(-T/T_c))."""
    return tension / STIFFNESS + BEDDING_STRETCH * (1 - np.exp(-tension / BEDDING_LOAD))


def tension(extended):
    """Its inverse, 0 where the rope is slack."""
    grid = np.linspace(0.0, 400.0, 8001)
    return np.interp(extended, extension(grid), grid)


def mean_tension(force, exponent):
    return force * np.where(exponent == 0, 1.0, (1 - np.exp(-exponent)) / np.where(exponent == 0, 1.0, exponent))


def unloaded(force, peak, exponent):
    """Mean tension once the load has come down from its peak: the rope slides back near its end, friction holds the rest."""
    some = np.maximum(exponent, 1e-9)
    held = (2 * np.sqrt(force * peak) - force - peak * np.exp(-some)) / some
    return np.where(peak < force * np.exp(2 * some), held, force * np.expm1(some) / some)


def stretch_curve(made, angle, unloading=True):
    exponent, slack = made.friction * np.deg2rad(angle), 0.5 * np.deg2rad(angle)
    up = made.softness * extension(mean_tension(LOADS, exponent)) - slack
    down = made.softness * extension(unloaded(LOADS, LOADS[-1], exponent)) - slack
    rng = np.random.default_rng(int(angle))
    load = np.repeat(np.linspace(10.0, 80.0, 8), 2 if unloading else 1)
    is_down = np.arange(len(load)) % 2 == 1 if unloading else np.zeros(len(load), dtype=bool)
    read = np.where(is_down, np.interp(load, LOADS, half(down)), np.interp(load, LOADS, half(up)))
    return StretchCurve(
        angle, LOADS, made.quantiles(up), made.quantiles(down) if unloading else None, load,
        read + 0.03 * rng.standard_normal(len(load)), is_down,
    )  # fmt: skip


def preload_curve(made, angles=ANGLES):
    angle = np.linspace(0.0, max(*angles, 90.0), 61)
    extended = extension(made.preload) + made.lengthening * np.deg2rad(angle)
    force = tension(extended)
    slack = np.maximum(-extended, 0.0)
    points = np.array(angles)
    read = np.maximum(np.interp(points, angle, half(force)) + np.resize([0.4, -0.6, 0.3], len(points)), 0.0)
    return PreloadCurve(angle, made.quantiles(force), made.quantiles(slack), (extended < 0).mean(axis=0), points, read)


def efficiency(input_force, preload, exponent):
    return np.minimum(input_force - 2 * preload * exponent, input_force * np.exp(-exponent)) / input_force


def bending_loss(made):
    angle, force = np.linspace(0.0, 360.0, 73), 50.0
    radians = np.deg2rad(angle)
    middle, preload = float(np.median(made.friction)), float(np.median(made.preload))

    def line(label, mu, p):
        return EfficiencyLine(label, np.maximum(efficiency(force, p, mu * radians), 0.0), np.exp(-mu * radians))

    return BendingLoss(
        angle, force, made.quantiles(np.maximum(efficiency(force, made.preload, made.friction * radians), 0.0)),
        np.exp(-middle * radians), f"as fitted, preload {preload:.0f} N",
        tuple(line(f"coefficient {mu:g}", mu, preload) for mu in (0.05, 0.08, 0.15, 0.2)),
        tuple(line(f"preload {p:g} N", middle, p) for p in (5.0, 10.0, 35.0, 50.0)),
    )  # fmt: skip


def loop_curve(made, angle, recorded=False):
    """F_out = s min(s F_in - 2 P Lambda, s F_in exp(-Lambda), s F_in exp(Lambda))."""
    exponent = made.friction * np.deg2rad(angle)
    force = INPUTS * np.ones_like(exponent)
    preload = tension(extension(made.preload) + made.lengthening * np.deg2rad(angle))
    forward = np.minimum(force - 2 * preload * exponent, force * np.exp(-exponent))
    back = np.maximum(force + 2 * preload * exponent, force * np.exp(exponent))
    goes_slack = 2 * preload / mean_tension(np.ones_like(exponent), exponent)
    rng = np.random.default_rng(int(angle) + 1)
    points = np.linspace(5.0, 85.0, 600 if recorded else 16)
    share = np.clip(rng.random(len(points)), 0.05, 0.95)
    stroke = np.zeros(len(points)) if recorded else np.resize([1, -1], len(points))
    low, high = np.interp(points, INPUTS, half(forward)), np.interp(points, INPUTS, half(back))
    output = np.where(stroke > 0, low, np.where(stroke < 0, high, low + share * (high - low)))
    return LoopCurve(
        f"{angle:g} deg", INPUTS, made.quantiles(forward), made.quantiles(back),
        np.median(force * np.exp(-exponent), axis=0), made.quantiles(goes_slack)[:, 0], points,
        output + 0.6 * rng.standard_normal(len(points)), stroke,
    )  # fmt: skip


def preload_window(made, top=60.0, force=60.0, bends=(0.0, 270.0)):
    preload = np.linspace(0.0, top, 61)
    exponent = made.friction * np.deg2rad(bends[1])
    lowest = force * mean_tension(1.0, exponent) / 2 + 2.0 * (made.preload - np.median(made.preload))
    return PreloadWindowCurves(
        preload, "at 0 deg", made.quantiles(2 * preload * exponent * RADIUS), "N*mm", (preload >= lowest).mean(axis=0),
        np.quantile(lowest, QUANTILES), bends, force,
    )  # fmt: skip


def glove(angles=ANGLES, draws=True, unloading=True, preload=22.0, lengthening=-0.35, **window):
    made = cable(draws, preload, lengthening)
    return {
        "stretch": tuple(stretch_curve(made, a, unloading) for a in angles),
        "preload": preload_curve(made, angles),
        "bending_loss": bending_loss(made),
        "loops": tuple(loop_curve(made, a, i % 2 == 1) for i, a in enumerate(angles)),
        "preload_window": preload_window(made, **window),
    }


def every(step, last):
    return tuple(np.arange(0.0, last + 1.0, step))


def far_window():
    """A lowest preload beyond the axis, in newtons, at a single bend, of a rope with springs."""
    data = glove(top=12.0, force=400.0, bends=(90.0, 90.0))
    window = dataclasses.replace(data["preload_window"], reference="", friction_unit="N")
    return data | {"preload_window": window, "bending_loss": dataclasses.replace(data["bending_loss"], coefficients=())}


CASES = {
    "four angles": glove,
    "one wrap angle": lambda: glove((135.0,)),
    "no draws": lambda: glove(draws=False),
    "all slack": lambda: glove(preload=1e-6, lengthening=-0.5),
    "no slack": lambda: glove(lengthening=-0.05),
    "grows tighter": lambda: glove(lengthening=0.3),
    "eight angles": lambda: glove(every(45.0, 315.0)),
    "twelve angles": lambda: glove(every(90.0, 990.0)),
    "no unloading": lambda: glove(every(90.0, 180.0), unloading=False),
    "eight angles, lines only": lambda: glove(every(45.0, 315.0), draws=False, unloading=False),
    "far window": far_window,
    "two angles, strong": lambda: glove((0.0, 1080.0), preload=43.0, lengthening=-0.02),
}


ONCE = DrawnOnce(CASES)
forget = ONCE.forgotten()


def draw_figure(name, case="four angles"):
    return ONCE.figure(name, case) if isinstance(case, str) else FIGURES[name].draw(case[name])


def line(axes, label):
    return next(artist for artist in axes.get_lines() if artist.get_label() == label)


def labels_of(figure):
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def bands(axes):
    """Polygons that are as wide as their data, without the empty ones that only name a color in the legend."""
    return [
        c.get_paths()[0].vertices for c in axes.collections if len(c.get_paths()) and len(c.get_paths()[0].vertices)
    ]


def spans(axes, label):
    """Left and right end of every region shaded so, in order."""
    ends = [(p.get_x(), p.get_x() + p.get_width()) for p in axes.patches if p.get_label() == label]
    return sorted(ends)


@pytest.mark.parametrize("case", CASES)
def test_no_words_overlap_or_leave_the_page(case):
    for name in NAMES:
        check_words(draw_figure(name, case), name)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("case", CASES)
def test_every_axis_is_labeled_or_shares_one_that_is(name, case):
    figure = draw_figure(name, case)
    for axes in figure.axes:
        place = axes.get_position()
        below = [a for a in figure.axes if abs(a.get_position().x0 - place.x0) < 0.01]
        neighbors = [a for a in figure.axes if abs(a.get_position().y0 - place.y0) < 0.01]
        assert any("(" in a.get_xlabel() for a in below)
        assert any("(" in a.get_ylabel() for a in neighbors)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("case", CASES)
def test_no_legend_covers_a_panel_or_a_title(name, case):
    figure = draw_figure(name, case)
    figure.draw_without_rendering()
    legends = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    for legend in (*figure.legends, *legends):
        box = legend.get_window_extent()
        for axes in figure.axes:
            assert not box.padded(-1.0).overlaps(axes.get_window_extent())
            assert not box.padded(-1.0).overlaps(axes.title.get_window_extent())


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("stretch", {"Load (N)", "Stretch (mm)", "270 deg", "Median, loading", "Median, unloading", "90 % interval"}),
        ("preload", {"Wrap angle (deg)", "Preload (N)", "Slack (mm)", "Reading", "Slack with more than 50 % probability",
                     "Slack with 5 % to 50 % probability"}),
        ("bending_loss", {"Wrap angle (deg)", "Efficiency (%)", "Friction, at 50 N input force", "coefficient 0.05",
                          "Preload, at 50 N input force", "preload 35 N", "As fitted, preload 22 N",
                          "Capstan equation alone"}),
        ("loops", {"Input force (N)", "Output force (N)", "180 deg", "return side taut", "slack", "Recorded",
                   "Forward, median", "Back, median", "Forward, no preload", "Return side goes slack"}),
        ("preload_window", {"Preload at 0 deg (N)", "Friction felt (N·mm)", "Both taut (%)", "Friction, median",
                            "Bends 0 deg to 270 deg, input force up to 60 N", "Lowest preload, median",
                            "Lowest preload, 90 % interval", "Taut with at least 95 % probability"}),
    ],
)  # fmt: skip
def test_names_and_units_are_the_words_of_the_field(name, shown):
    assert shown <= {text for text, _ in words(draw_figure(name))}


@pytest.mark.parametrize("name", NAMES)
def test_without_draws_there_are_lines_and_neither_intervals_nor_medians(name):
    figure = draw_figure(name, "no draws")
    assert not any(bands(axes) for axes in figure.axes)
    assert not [text for text in labels_of(figure) if "interval" in text or "edian" in text or "probability" in text]
    assert name == "bending_loss" or any("least squares" in text.lower() for text in labels_of(figure))


def test_stretch_shows_both_branches_and_fills_what_was_read_while_loading():
    data = glove((90.0,))
    (curve,) = data["stretch"]
    axes, _ = draw_figure("stretch", data).axes
    up, down = (a for a in axes.get_lines() if len(a.get_xdata()) == len(LOADS))
    np.testing.assert_array_equal(up.get_ydata(), curve.loading[1])
    np.testing.assert_array_equal(down.get_ydata(), curve.unloading[1])
    assert (up.get_linestyle(), down.get_linestyle()) == ("-", "--")
    for vertices, quantiles in zip(bands(axes), (curve.loading, curve.unloading), strict=True):
        assert np.isin(quantiles[[0, 2]], vertices[:, 1]).all() and not np.isin(quantiles[1, 9:], vertices[:, 1]).any()
    points = [a for a in axes.get_lines() if a.get_linestyle() == "None" and len(a.get_xdata())]
    for artist, mask in zip(points, (~curve.points_unloading, curve.points_unloading), strict=True):
        np.testing.assert_array_equal(artist.get_ydata(), curve.points_stretch[mask])
        assert (artist.get_markerfacecolor() == "white") == curve.points_unloading[mask].all()


def test_negative_stretch_is_shown_below_a_line_at_zero():
    data = glove()
    axes, _ = draw_figure("stretch", data).axes
    lowest = min(c.points_stretch.min() for c in data["stretch"])
    assert axes.get_ylim()[0] < lowest < 0
    assert [a for a in axes.get_lines() if list(a.get_xdata()) == [0, 1] and set(a.get_ydata()) == {0.0}]


def test_wrap_angles_differ_in_color_and_marker_and_are_sorted():
    data = glove((270.0, 0.0, 90.0))
    figure = draw_figure("stretch", data)
    assert [text for text in labels_of(figure) if "deg" in text] == ["0 deg", "90 deg", "270 deg"]
    for case, count in (("eight angles", 8), ("twelve angles", 8)):
        axes, _ = draw_figure("stretch", case).axes
        named = [a for a in axes.get_lines() if "deg" in a.get_label()]
        assert len({a.get_marker() for a in named}) == len({a.get_color() for a in named}) == count
        luminance = [float(np.array(a.get_color()[:3]) @ (0.299, 0.587, 0.114)) for a in named]
        assert np.diff(luminance).min() > 0.03 and max(luminance) < 0.8


def test_of_many_wrap_angles_an_even_choice_is_shown_and_this_is_said():
    assert choose_evenly(range(12), 6) == [0, 2, 4, 7, 9, 11]
    assert choose_evenly(range(3), 6) == [0, 1, 2]
    assert "8 of 12 shown" in labels_of(draw_figure("stretch", "twelve angles"))
    loops = draw_figure("loops", "twelve angles")
    assert len(loops.axes[::2]) == 6 and loops.axes[-2].get_title() == "990 deg"
    assert "6 of 12 wrap angles shown" in labels_of(loops)
    assert not any("shown" in text for name in ("stretch", "loops") for text in labels_of(draw_figure(name)))


@pytest.mark.parametrize("name", ["stretch", "preload", "loops"])
def test_residuals_below_are_readings_less_the_line(name):
    data = glove((90.0,))
    (shown,) = data[name] if isinstance(data[name], tuple) else (data[name],)
    main, strip = draw_figure(name, data).axes[:2]
    read, line = {
        "stretch": lambda: (shown.points_stretch[~shown.points_unloading], (shown.load, shown.loading)),
        "preload": lambda: (shown.points_preload, (shown.wrap_angle, shown.preload)),
        "loops": lambda: (shown.points_output[shown.points_stroke > 0], (shown.input_force, shown.forward)),
    }[name]()
    points = strip.get_lines()[0]
    np.testing.assert_allclose(points.get_ydata(), read - np.interp(points.get_xdata(), line[0], line[1][1]), atol=1e-9)
    assert strip.get_ylim()[0] == -strip.get_ylim()[1] and "Residual" in strip.get_ylabel()
    assert main.get_shared_x_axes().joined(main, strip)


def test_a_rope_that_was_only_loaded_has_one_branch():
    labels = labels_of(draw_figure("stretch", "no unloading"))
    assert "Median" in labels and not any("unloading" in text for text in labels)


def test_slack_is_shaded_by_its_probability_in_both_panels():
    data = glove()
    curve = data["preload"]
    for axes in draw_figure("preload", data).axes:
        ((light, dark),) = spans(axes, "Slack with 5 % to 50 % probability")
        ((start, stop),) = spans(axes, "Slack with more than 50 % probability")
        assert light < dark == pytest.approx(start, abs=0.2) and stop == curve.wrap_angle[-1]
        np.testing.assert_allclose(
            np.interp((light, dark), curve.wrap_angle, curve.slack_probability), (0.05, 0.5), atol=0.01
        )


def test_stretches_of_true_values_are_found_to_the_last_place():
    assert true_stretches(np.array([1, 1, 0, 0, 1, 0, 1], dtype=bool)) == [(0, 1), (4, 4), (6, 6)]
    assert true_stretches(np.zeros(3, dtype=bool)) == []


@pytest.mark.parametrize(
    ("case", "panels"), [("no slack", 1), ("grows tighter", 1), ("four angles", 2), ("all slack", 2)]
)
def test_slack_has_a_panel_only_where_there_is_some(case, panels):
    data = CASES[case]()
    figure = draw_figure("preload", data)
    assert len(figure.axes) == panels + 1  # and a strip of residuals
    assert any("lack" in text for text in labels_of(figure)) == (panels == 2)
    if panels == 2:
        np.testing.assert_array_equal(figure.axes[-1].get_lines()[0].get_ydata(), data["preload"].slack[1])


def test_preload_shows_curve_band_and_readings_from_zero():
    data = glove()
    curve, axes = data["preload"], draw_figure("preload", data).axes[0]
    np.testing.assert_array_equal(line(axes, "Median").get_ydata(), curve.preload[1])
    np.testing.assert_array_equal(line(axes, "Reading").get_xydata().T, [curve.points_wrap_angle, curve.points_preload])
    assert bands(axes)[0][:, 1].max() == curve.preload[2].max()
    low, high = axes.get_ylim()
    assert -0.1 * high < low < 0
    bare = dataclasses.replace(curve, points_wrap_angle=np.zeros(0), points_preload=np.zeros(0))
    assert "Reading" not in labels_of(draw_figure("preload", {"preload": bare}))


@pytest.mark.parametrize("scale", [0.005, 1.0, 200.0])
def test_a_preload_of_any_size_keeps_its_words_on_the_page(scale):
    curve = glove()["preload"]
    other = dataclasses.replace(curve, preload=scale * curve.preload, points_preload=scale * curve.points_preload)
    assert_readable({"preload": other}, "Glove")


def test_each_efficiency_has_the_capstan_equation_dashed_in_its_color():
    data = glove()
    loss = data["bending_loss"]
    for axes, lines in zip(draw_figure("bending_loss", data).axes, (loss.coefficients, loss.preloads), strict=True):
        curves = [a for a in axes.get_lines() if len(a.get_xdata())]
        solid = [a for a in curves if a.get_linestyle() == "-"]
        dashed = [a for a in curves if a.get_linestyle() == "--"]
        assert [a.get_color() for a in solid] == [a.get_color() for a in dashed]
        for artist, values in zip(solid, [*(x.efficiency for x in lines), loss.fitted[1]], strict=True):
            np.testing.assert_array_equal(artist.get_ydata(), 100 * values)
        for artist, values in zip(dashed, [*(x.capstan for x in lines), loss.fitted_capstan], strict=True):
            np.testing.assert_array_equal(artist.get_ydata(), 100 * values)
        assert [t.get_text() for t in axes.get_legend().get_texts()] == [x.label for x in lines]
        (band,) = bands(axes)
        assert band[:, 1].min() == 100 * loss.fitted[0].min()


def test_both_panels_of_bending_loss_have_one_efficiency_axis_and_other_colors():
    first, second = draw_figure("bending_loss").axes
    assert first.get_ylim() == second.get_ylim()
    colors = [{tuple(h.get_color()) for h in axes.get_legend().get_lines()} for axes in (first, second)]
    assert not colors[0] & colors[1]


def test_bending_loss_without_other_coefficients_or_preloads_has_fewer_panels():
    data = glove()
    loss = data["bending_loss"]
    (axes,) = draw_figure("bending_loss", "far window").axes
    assert axes.get_title() == "Preload, at 50 N input force"
    bare = {"bending_loss": dataclasses.replace(loss, coefficients=(), preloads=())}
    (axes,) = draw_figure("bending_loss", bare).axes
    assert axes.get_title() == "Efficiency, at 50 N input force" and axes.get_legend() is None


def test_loops_show_both_ways_and_the_readings_by_stroke():
    data = glove()
    _, recorded, read, _ = data["loops"]
    _, second, first, _ = draw_figure("loops", data).axes[::2]
    np.testing.assert_array_equal(line(first, "Forward, median").get_ydata(), read.forward[1])
    np.testing.assert_array_equal(line(first, "Back, median").get_ydata(), read.back[1])
    np.testing.assert_array_equal(line(first, "Forward, no preload").get_ydata(), read.capstan)
    for stroke, name in ((1, "Read moving forward"), (-1, "Read moving back")):
        mask = read.points_stroke == stroke
        np.testing.assert_array_equal(
            line(first, name).get_xydata().T, [read.points_input[mask], read.points_output[mask]]
        )
    dots = line(second, "Recorded")
    assert len(dots.get_xdata()) == len(recorded.points_input) and dots.get_markersize() < 2


def test_the_slack_load_parts_both_branches_with_its_interval():
    data = glove()
    loop, axes = data["loops"][1], draw_figure("loops", data).axes[2]
    assert set(line(axes, "Return side goes slack").get_xdata()) == {loop.slack_load[1]}
    (interval,) = axes.patches
    assert (interval.get_x(), interval.get_x() + interval.get_width()) == pytest.approx(tuple(loop.slack_load[[0, 2]]))
    place = axes.transAxes.inverted().transform(axes.transData.transform((loop.slack_load[1], 0)))[0]
    taut, slack = axes.texts
    assert (taut.get_text(), slack.get_text()) == ("return side taut", "slack")
    assert taut.get_position()[0] < place < slack.get_position()[0]


def test_a_slack_load_outside_the_shown_forces_is_left_out():
    data = glove((90.0,))
    far = dataclasses.replace(data["loops"][0], slack_load=np.array([190.0, 200.0, 210.0]))
    axes, _ = draw_figure("loops", {"loops": (far,)}).axes
    assert not axes.texts and not axes.patches and axes.get_xlim()[1] < 100
    assert "Return side goes slack" not in labels_of(draw_figure("loops", {"loops": (far,)}))


@pytest.mark.parametrize("case", CASES)
def test_the_branches_are_named_clear_of_the_loop(case):
    figure = draw_figure("loops", case)
    figure.draw_without_rendering()
    for axes in figure.axes:
        curves = [a for a in axes.get_lines() if a.get_label().startswith(("Forward", "Back", "Read"))]
        for box in (text.get_window_extent() for text in axes.texts):
            for artist in curves:
                x, y = axes.transData.transform(artist.get_xydata()).T
                if artist.get_linestyle() != "None":
                    places = np.linspace(0, len(x) - 1, 2000)
                    x, y = (np.interp(places, np.arange(len(x)), values) for values in (x, y))
                assert not np.any((x > box.x0) & (x < box.x1) & (y > box.y0) & (y < box.y1)), artist.get_label()


def test_the_window_and_the_lowest_preload_stand_in_both_panels():
    data = glove()
    window = data["preload_window"]
    for axes in draw_figure("preload_window", data).axes:
        ((start, stop),) = spans(axes, "Taut with at least 95 % probability")
        assert np.interp(start, window.preload, window.taut_probability) == pytest.approx(0.95, abs=0.01)
        assert stop == window.preload[-1]
        assert set(line(axes, "Lowest preload, median").get_xdata()) == {window.lowest[1]}
        assert spans(axes, "Lowest preload, 90 % interval") == [pytest.approx(tuple(window.lowest[[0, 2]]))]


def test_preload_window_shows_friction_and_probability_in_percent():
    data = glove()
    window = data["preload_window"]
    cost, gain = draw_figure("preload_window", data).axes
    np.testing.assert_array_equal(line(cost, "Friction, median").get_ydata(), window.friction[1])
    assert bands(cost)[0][:, 1].max() == window.friction[2].max()
    probability = line(gain, "Probability that both sides stay taut").get_ydata()
    np.testing.assert_array_equal(probability, 100 * window.taut_probability)


def test_a_window_that_is_not_shown_is_put_in_words():
    figure = draw_figure("preload_window", "far window")
    labels = labels_of(figure)
    assert "No preload shown is taut with 95 %" in labels and "Lowest preload off the axis, 184 N" in labels
    assert [axes.get_xlim() for axes in figure.axes] == [(0.0, 12.0)] * 2
    shown = {text for text, _ in words(figure)}
    assert {"Preload (N)", "Friction felt (N)", "Bends 90 deg, input force up to 400 N"} <= shown


@pytest.mark.slow
def test_the_same_data_give_the_same_small_files(tmp_path):
    initial = dict(mpl.rcParams)
    data = CASES["twelve angles"]()
    for folder in ("first", "second"):
        written = [path for name in NAMES for path in write_figure_files(name, data[name], tmp_path / folder)]
    assert [path.name for path in written] == [f"{name}.{ending}" for name in NAMES for ending in ("png", "svg", "pdf")]
    for path in (tmp_path / "first").iterdir():
        assert path.read_bytes() == (tmp_path / "second" / path.name).read_bytes()
        assert 1_000 < path.stat().st_size < 500_000, path.name
    assert "Stretch (mm)</text>" in (tmp_path / "first" / "stretch.svg").read_text(encoding="utf-8")
    assert dict(mpl.rcParams) == initial


@pytest.mark.parametrize("case", CASES)
def test_data_come_back_from_the_file_in_which_they_are_kept(case, tmp_path):
    assert_kept(CASES[case](), tmp_path / "figures.npz")
