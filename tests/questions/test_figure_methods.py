"""Figures as methods of a fit: those that it has, handed to whoever asks, and to nobody else."""

import gc
import subprocess
import sys
import weakref
from itertools import pairwise

import matplotlib as mpl
import numpy as np
import pytest
from figure_words import check_words
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import bowdenfit as bf
from bowdenfit.plots.borrowed import count_panels, move_legend
from bowdenfit.plots.style import in_paper_style
from bowdenfit.questions.figures import FIGURES, collect_figure_data, draw_on_axes, parse_page_width, warning_mark


@pytest.fixture(scope="module")
def fit(on_body_squares):
    return on_body_squares


def test_the_figures_that_a_fit_has_are_listed_and_no_others(fit):
    assert dir(fit.plot) == sorted(dict(collect_figure_data(fit)))
    assert {"efficiency", "residuals"} <= set(dir(fit.plot)) < set(FIGURES)
    assert "plot.efficiency()" in repr(fit.plot)


def test_a_figure_is_matplotlibs_and_shows_itself(fit):
    initial = dict(mpl.rcParams)
    figure = fit.plot.efficiency()
    assert isinstance(figure, Figure)
    (data, size), wide = figure._repr_png_(), fit.plot("efficiency", width=(5, "in"))
    assert data.startswith(b"\x89PNG") and size["width"] == int(100 * figure.get_size_inches()[0])
    assert wide.get_size_inches()[0] == pytest.approx(5.0) == fit.plot.efficiency(width="127 mm").get_size_inches()[0]
    assert dict(mpl.rcParams) == initial


@pytest.mark.extended
def test_a_figure_goes_when_nobody_holds_it(fit):
    held = weakref.ref(fit.plot.efficiency())
    gc.collect()
    assert held() is None


def test_a_figure_that_a_fit_has_not_is_refused_with_those_it_has(fit):
    with pytest.raises(bf.UsageError, match=r"nothing to show in the figure 'loops'; it has .*efficiency"):
        fit.plot.loops()
    with pytest.raises(bf.UsageError, match="no figure 'eficiency'; did you mean 'efficiency'"):
        fit.plot("eficiency")
    with pytest.raises(AttributeError, match="did you mean 'efficiency'"):
        fit.plot.eficiency()
    with pytest.raises(bf.UsageError, match=r"0\.5 in wide"):
        fit.plot.efficiency(width=(0.5, "in"))
    assert not hasattr(fit.plot, "_ipython_display_")
    assert np.all([callable(getattr(fit.plot, name)) for name in dir(fit.plot)])


@pytest.mark.extended
def test_a_figure_chooses_no_backend_and_loads_no_pyplot(on_body):
    code = (
        f"import sys, bowdenfit as bf; fit = bf.fit({str(on_body)!r}, seed=1, mcmc=False); fit.plot.efficiency()._repr_png_(); "
        "import matplotlib as m; chosen = m.rcParams._get('backend') is not m.rcsetup._auto_backend_sentinel; "
        "print('matplotlib.pyplot' in sys.modules, chosen)"
    )
    process = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False)
    assert process.stdout.split() == ["False", "False"], process


def test_a_figure_is_drawn_on_axes_of_the_user(fit):
    """The first panel with its legend and both names on one axes; all panels on as many, which keep their places."""
    page = Figure(figsize=(9, 4))
    left, right = page.subplots(1, 2, gridspec_kw={"left": 0.02})
    places = [axes.get_position().bounds for axes in (left, right)]
    assert fit.plot.efficiency(ax=left) is fit.plot.wrap_angles(ax=right) is page
    assert [axes.get_position().bounds for axes in (left, right)] == places and len(page.axes) == 2
    assert (left.get_xlabel(), left.get_ylabel()) == ("Cable length (mm)", "Efficiency (%)")
    assert right.get_ylabel() == "Wrap angle (deg)" and "Reading" in _words(right.get_legend())
    of_page = fit.plot.efficiency().axes
    rows = Figure().subplots(len(of_page), sharex=True)
    fit.plot.efficiency(ax=rows)
    assert [axes.get_xlim() for axes in rows] == [axes.get_xlim() for axes in of_page]
    assert [len(axes.lines) for axes in rows] == [len(axes.lines) for axes in of_page] and left.lines
    wide = Figure().subplots(2, 2)
    fit.plot.wrap_angles(ax=wide)
    assert [axes.get_title() for axes in wide.ravel()] == ["free sheath", "squeezed sheath", "", ""]


def test_the_legend_of_a_page_goes_beside_that_of_a_panel():
    page = Figure()
    page.legend(handles=[Line2D([], [], label="Reading of the bench"), Line2D([], [], label="no panel's")])
    axes = page.subplots()
    handle = axes.errorbar([1], [1], [1], fmt="D", label="Reading of\nthe bench")
    legends = axes.legend([handle], ["own"])
    move_legend(page.legends[0], axes, [axes])
    assert legends in axes.get_children() and _words(axes.get_legend()) == ["Reading of the bench", "no panel's"]
    assert isinstance(axes.get_legend().legend_handles[0], type(legends.legend_handles[0]))  # a mark with its bar


def _words(legend):
    return [text.get_text() for text in legend.get_texts()]


def test_a_mark_of_distrust_stands_on_axes_of_the_user_too(fit):
    axes = Figure().add_subplot()
    data = dict(collect_figure_data(fit, ["efficiency"]))["efficiency"]
    draw_on_axes("efficiency", data, axes, warning_mark(["not converged"]))
    assert any("Do not use" in text.get_text().replace("\n", " ") for text in axes.texts)


@pytest.mark.extended
def test_every_figure_is_drawn_on_as_many_axes_as_it_has_panels(fit):
    for name in dir(fit.plot):
        count = count_panels(lambda name=name: FIGURES[name].draw(fit.plot._data_of(name), None))
        flat = Figure().subplots(count, squeeze=False).ravel()
        fit.plot(name, ax=flat)
        assert all(axes.has_data() for axes in flat), name


def test_panels_are_stretched_to_a_page_and_what_is_between_them_stays(fit):
    usual = fit.plot.efficiency(width="7in")
    height = float(usual.get_size_inches()[1])
    taller = fit.plot.efficiency(figsize=(7, height + 2))
    assert tuple(taller.get_size_inches()) == pytest.approx((7, height + 2))

    def between(figure):
        boxes = [axes.get_position() for axes in figure.axes]
        return [(above.y0 - below.y1) * figure.get_size_inches()[1] for above, below in pairwise(boxes)]

    assert between(taller) == pytest.approx(between(usual), abs=1e-4)
    check_words(taller, "efficiency")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"figsize": (7, 1)}, r"write figsize=\(7, \d"),
        ({"figsize": 7}, r"in inches, not 7; write figsize=\(7, 5\)"),
        ({"figsize": (1, 5)}, "cannot be 1 in wide"),
        ({"figsize": (7, float("nan"))}, "nan in high"),
        ({"ax": "left"}, r"axes of matplotlib.*plt.subplots"),
        ({"ax": []}, "axes of matplotlib"),
        ({"ax": list(Figure().subplots(9))}, r"and ax holds 9 axes; give one, .*plt.subplots\(\d\)"),
        ({"figsize": (7, 5), "width": "7in"}, "give one of width, figsize and ax"),
    ],
)
def test_pages_and_axes_that_no_figure_fits_are_refused_with_a_remedy(fit, options, words):
    with pytest.raises(bf.UsageError, match=words):
        fit.plot.efficiency(**options)


@pytest.mark.parametrize(("least", "unit"), [(3, "in"), (76.2, "mm"), (7.62, "cm")])
def test_figures_may_be_as_wide_as_is_said_and_no_narrower(least, unit):
    assert parse_page_width((least, unit)) == 3.0
    with pytest.raises(bf.UsageError, match="give a width from 3 in to 20 in"):
        parse_page_width((0.999 * least, unit))


def test_settings_of_matplotlib_that_lie_about_do_not_count():
    @in_paper_style
    def settings_in_force():
        return mpl.rcParams["text.usetex"], mpl.rcParams["savefig.facecolor"], mpl.rcParams["font.size"]

    with mpl.rc_context({"text.usetex": True, "savefig.facecolor": "red", "font.size": 30}):
        assert settings_in_force() == (False, "auto", 8)
        assert mpl.rcParams["text.usetex"]
