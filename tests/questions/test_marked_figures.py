"""Every figure of a fit that is not to be trusted says so, wherever it is shown; none of a good one does."""

import base64
from itertools import pairwise

import pytest
from matplotlib.text import Text

import bowdenfit as bf
from bowdenfit.plots.layout import EDGE, empty_page, title_above
from bowdenfit.questions.figures import warning_mark

pytestmark = pytest.mark.extended

MARK = "Do not use: this fit is not"


@pytest.fixture(scope="module")
def unfinished(on_body, tmp_path_factory):
    """A fit that was given too few steps, and its folder."""
    folder = tmp_path_factory.mktemp("unfinished") / "fit"
    few = ("sampler.n_walkers=32", "sampler.max_steps=200", "sampler.target_ess=100")
    return bf.fit(on_body, output=folder, seed=2, settings=few), folder


def unmarked(folder):
    """Drawings of a folder without the mark."""
    figures = sorted(folder.glob("*.svg"))
    assert figures
    return [path.stem for path in figures if MARK not in path.read_text()]


@pytest.mark.slow
def test_all_figures_of_a_refused_fit_and_their_captions_are_marked(unfinished, tmp_path):
    fit, folder = unfinished
    assert warning_mark(fit.verdict().troubles) == "Do not use: this fit is not converged and not identifiable."
    figures = list((folder / "figures").glob("*.png"))
    bf.plot(fit, tmp_path / "again", formats=["png", "svg"])
    assert unmarked(tmp_path / "again") == []
    assert len(figures) > 5 and all(path.read_bytes() == (tmp_path / "again" / path.name).read_bytes() for path in figures)
    captions = (folder / "figures" / "captions.txt").read_text().split("\n\n")
    assert all(MARK in " ".join(caption.split()) for caption in captions)


@pytest.mark.parametrize("width", [None, (3.5, "in")])
def test_figures_that_are_drawn_again_are_marked(unfinished, tmp_path, width):
    bf.plot(unfinished[1], tmp_path / "again", figures=["coefficients", "efficiency"], formats=["svg"], width=width)
    assert unmarked(tmp_path / "again") == []
    assert " ".join((tmp_path / "again" / "captions.txt").read_text().split()).count(MARK) == 2


def test_figures_of_a_notebook_and_of_the_report_are_marked(unfinished, tmp_path):
    fit, folder = unfinished
    assert any(text.get_text().startswith(MARK) for text in fit.plot.pairs().findobj(Text))
    marked = [base64.b64encode(path.read_bytes()).decode() for path in (folder / "figures").glob("*.png")]
    for report in (folder / "report.html", bf.report(fit, tmp_path / "report.html")):
        assert all(drawing in report.read_text() for drawing in marked)


def test_no_figure_of_a_good_fit_is_marked(quick_fit, quick_results, tmp_path):
    bf.plot(quick_results, tmp_path / "again", formats=["svg"])
    figures = list((tmp_path / "again").glob("*.svg"))
    assert figures and not any("Do not use" in path.read_text() for path in figures)
    assert "Do not use" not in (quick_results / "figures" / "captions.txt").read_text()
    assert not any("Do not use" in text.get_text() for text in quick_fit.plot.pairs().findobj(Text))


def test_a_mark_takes_lines_of_its_own_on_a_narrow_page():
    plain, marked = empty_page(3.0, 2.0), empty_page(3.0, 2.0)
    title_above(plain, "Coefficients")
    title_above(marked, "Coefficients", warning_mark(["not converged", "contradictory", "made of copied readings"]))
    taller = marked.get_figheight() - plain.get_figheight()
    title, *lines = marked.texts
    assert len(lines) >= 2 and taller == pytest.approx(0.15 * len(lines))
    boxes = [text.get_window_extent() for text in (title, *lines)]
    assert all(above.y0 > below.y0 for above, below in pairwise(boxes))
    assert max(box.x1 for box in boxes) <= marked.bbox.x1 - EDGE * marked.dpi / 2
    assert warning_mark([]) == ""
