"""Figures as methods of a fit: those that it has, handed to whoever asks, and to nobody else."""

import gc
import subprocess
import sys
import weakref

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

import bowdenfit as bf
from bowdenfit.plots.style import in_paper_style
from bowdenfit.questions.figures import FIGURES, collect_figure_data, parse_page_width


@pytest.fixture(scope="module")
def fit(on_body_squares):
    return on_body_squares


def test_the_figures_that_a_fit_has_are_listed_and_no_others(fit):
    assert dir(fit.plot) == sorted(dict(collect_figure_data(fit)))
    assert {"efficiency", "residuals"} <= set(dir(fit.plot)) < set(FIGURES)
    assert "plot.efficiency()" in repr(fit.plot)


def test_a_figure_is_matplotlibs_and_shows_itself(fit):
    before = dict(mpl.rcParams)
    figure = fit.plot.efficiency()
    assert isinstance(figure, Figure)
    (data, size), wide = figure._repr_png_(), fit.plot("efficiency", width=(5, "in"))
    assert data.startswith(b"\x89PNG") and size["width"] == int(100 * figure.get_size_inches()[0])
    assert wide.get_size_inches()[0] == pytest.approx(5.0) == fit.plot.efficiency(width="127 mm").get_size_inches()[0]
    assert dict(mpl.rcParams) == before


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
    found = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False)
    assert found.stdout.split() == ["False", "False"], found


@pytest.mark.parametrize(("least", "unit"), [(3, "in"), (76.2, "mm"), (7.62, "cm")])
def test_figures_may_be_as_wide_as_is_said_and_no_narrower(least, unit):
    assert parse_page_width((least, unit)) == 3.0
    with pytest.raises(bf.UsageError, match="say a width from 3 in to 20 in"):
        parse_page_width((0.999 * least, unit))


def test_settings_of_matplotlib_that_lie_about_do_not_count():
    @in_paper_style
    def settings_in_force():
        return mpl.rcParams["text.usetex"], mpl.rcParams["savefig.facecolor"], mpl.rcParams["font.size"]

    with mpl.rc_context({"text.usetex": True, "savefig.facecolor": "red", "font.size": 30}):
        assert settings_in_force() == (False, "auto", 8)
        assert mpl.rcParams["text.usetex"]
