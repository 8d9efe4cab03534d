"""The report of a fit: one file that opens anywhere, says everything, and lets no name act."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from offline_browser import opened

import bowdenfit as bf
from bowdenfit.pages.page import MOST_BYTES
from bowdenfit.questions.report.page import report_page
from bowdenfit.questions.writing import write_page
from bowdenfit.results.folder import REPORT

pytestmark = pytest.mark.extended

DATASETS = Path(__file__).parents[3] / "datasets"
QUICK = ("sampler.n_walkers=64", "sampler.target_ess=200", "sampler.target_r_hat=1.05", "sampler.max_steps=4000")
SHEETS = 6
CHART = "#figure-{} .chart"
HOSTILE = """</title><script>alert(1)</script><img src=x onerror=alert(2)>"' ]]> &lt; {{7*7}}"""
LONGER = f"{HOSTILE}\n\u202egnp.exe"  # which no description may hold, but a folder that was edited


@pytest.fixture(scope="module")
def routed(on_body, tmp_path_factory):
    """The results of a cable with a route, names that would like to act among them."""
    folder = shutil.copytree(on_body, tmp_path_factory.mktemp("hostile") / "cable")
    text = (folder / "cable.toml").read_text()
    for plain, odd in (
        ('name = "On-body knee exoskeleton"', f'name = """{HOSTILE}"""'),
        ('"mu1"', "\"<b onclick='alert(3)'>\""),
        ("[friction.mu1]", "[friction.\"<b onclick='alert(3)'>\"]"),
        ('"free sheath"', '"</script><script>alert(4)</script>"'),
    ):
        text = text.replace(plain, odd)
    (folder / "cable.toml").write_text(text, encoding="utf-8")
    results = folder.parent / "fit"
    bf.fit(folder, output=results, seed=11, settings=QUICK)
    return results


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The results of recordings, by least squares."""
    results = tmp_path_factory.mktemp("recorded") / "fit"
    bf.fit(DATASETS / "synthetic-recordings", output=results, seed=1, mcmc=False)
    return results


def assert_sound(chromium, path):
    """It opens, light and dark, wide and on a phone, without a fault, and is not too long on paper."""
    assert path.stat().st_size < MOST_BYTES
    for settings in ({"width": 1200, "color_scheme": "light"}, {"width": 390, "color_scheme": "dark"}):
        with opened(chromium, path, **settings) as reader:
            assert reader.faults() == []
            assert reader.page.locator("main img").count() >= 1
            assert reader.sheets() <= SHEETS


def test_the_report_of_a_cable_with_a_route_is_sound(chromium, routed):
    assert_sound(chromium, routed / REPORT)


def test_the_report_of_recordings_is_sound(chromium, recorded):
    assert_sound(chromium, recorded / REPORT)


@pytest.mark.slow
@pytest.mark.parametrize("name", [p.parent.name for p in sorted(DATASETS.glob("*/cable.toml"))])
def test_the_report_of_every_data_set_is_sound(chromium, tmp_path, name):
    bf.fit(DATASETS / name, output=tmp_path / "fit", seed=1)
    assert_sound(chromium, tmp_path / "fit" / REPORT)


def test_names_stay_text(chromium, routed):
    with opened(chromium, routed / REPORT) as reader:
        assert reader.page.locator("h1").text_content() == HOSTILE
        assert reader.page.title() == HOSTILE
        assert "<b onclick='alert(3)'>" in reader.page.locator("section.part-coefficients tbody th").all_text_contents()
        assert reader.page.locator("script").count() == 2  # the library, and what draws with it
        assert reader.messages == []


def test_a_name_that_turns_its_direction_is_written_out(chromium, routed, tmp_path):
    fit = bf.load(routed)
    description = fit.dataset.description.model_copy(update={"name": LONGER})
    odd = replace(fit, dataset=replace(fit.dataset, description=description))
    path = write_page(report_page(odd, {}), tmp_path, tmp_path / "odd.html")
    with opened(chromium, path) as reader:
        assert reader.page.locator("h1").text_content().endswith("\\u202egnp.exe")
        assert "\u202e" not in reader.page.content()
        assert reader.messages == []


def test_a_chart_is_zoomed_into_and_read_with_the_pointer(chromium, routed):
    with opened(chromium, routed / REPORT) as reader:
        chart = reader.page.locator(CHART.format("efficiency"))
        whole = shown(chart)
        over = chart.locator(".u-over")
        over.scroll_into_view_if_needed()
        box = over.bounding_box()
        middle = box["y"] + box["height"] / 2
        reader.page.mouse.move(box["x"] + 0.3 * box["width"], middle)
        assert re.search(r"Median\s*7\d\.\d", chart.locator(".key").inner_text())
        shades = chart.locator(".key .mark.low").evaluate_all("marks => marks.map(mark => getComputedStyle(mark).opacity)")
        assert len(shades) == len(set(shades)) > 1, "bands look alike in the key"
        reader.page.mouse.down()
        reader.page.mouse.move(box["x"] + 0.6 * box["width"], middle, steps=5)
        reader.page.mouse.up()
        low, high = shown(chart)
        assert whole[0] < low < high < whole[1]
        assert high - low == pytest.approx(0.3 * (whole[1] - whole[0]), rel=0.05)
        chart.get_by_role("button", name="Show all").click()
        assert shown(chart) == whole
        assert reader.messages == []


def test_a_chart_is_read_with_the_keyboard(chromium, routed):
    with opened(chromium, routed / REPORT) as reader:
        chart = reader.page.locator(CHART.format("efficiency"))
        whole = shown(chart)
        chart.get_by_role("application").focus()
        reader.page.keyboard.press("ArrowRight")
        first = chart.locator(".key").inner_text()
        reader.page.keyboard.press("ArrowRight")
        assert chart.locator(".key").inner_text() != first
        reader.page.keyboard.press("+")
        assert shown(chart)[1] - shown(chart)[0] < whole[1] - whole[0]
        reader.page.keyboard.press("0")
        assert shown(chart) == whole
        reader.page.evaluate("document.querySelectorAll('details').forEach(part => { part.open = true; })")
        for name in ("coefficients", "pairs", "residuals", "loss"):
            chart = reader.page.locator(CHART.format(name))
            chart.get_by_role("application").focus()
            reader.page.keyboard.press("ArrowRight")
            assert re.search(r"\d to \d", chart.locator(".key").inner_text()), name
            reader.page.keyboard.press("+")
        assert "<b onclick='alert(3)'>" in "".join(reader.page.locator("#figure-pairs option").all_text_contents())
        assert "</script>" in reader.page.locator("#figure-loss .key").inner_text()
        assert reader.faults() == []


def test_each_recording_is_chosen_by_its_name(chromium, recorded):
    with opened(chromium, recorded / REPORT) as reader:
        chart = reader.page.locator(CHART.format("recordings"))
        names = chart.locator("option").all_text_contents()
        assert len(names) == 7
        initial = shown(chart)
        chart.get_by_role("combobox").select_option(label=names[-1])
        assert shown(chart) != initial
        assert reader.messages == []


def shown(chart):
    """The stretch of the axis that is in view."""
    chart.locator(".u-over").wait_for()
    low, high = chart.get_attribute("data-shown").split()
    return float(low), float(high)


def test_without_scripts_and_on_paper_the_drawing_stands_in_place_of_the_chart(chromium, routed):
    drawing = "#figure-efficiency .drawing img"
    with opened(chromium, routed / REPORT) as reader:
        assert reader.page.locator(CHART.format("efficiency")).is_visible()
        assert not reader.page.locator(drawing).is_visible()
        reader.page.emulate_media(media="print")
        assert not reader.page.locator(CHART.format("efficiency")).is_visible()
        assert reader.page.locator(drawing).is_visible()
    with opened(chromium, routed / REPORT, java_script_enabled=False) as reader:
        assert not reader.page.locator(CHART.format("efficiency")).is_visible()
        assert reader.page.locator(drawing).is_visible()


def test_the_report_says_what_the_summary_says(routed):
    text = (routed / REPORT).read_text(encoding="utf-8").replace("\u00a0", " ")
    fit = bf.load(routed)
    assert fit.optimal_length().headline in text
    assert "You can trust this" in text
    assert '<div class="verdict">' in text
    for name, digest in fit.dataset.sha256.items():
        assert name in text
        assert digest in text
    assert "Foreman-Mackey" in text
    assert f"seed {fit.provenance.seed}" in text


def test_least_squares_alone_say_so_to_those_who_cite_them(recorded):
    text = (recorded / REPORT).read_text(encoding="utf-8").replace("\u00a0", " ")
    assert "Values are those of least squares" in text
    assert '<div class="verdict doubtful">' in text
    assert "No posterior was sampled." in text
    assert "Foreman-Mackey" not in text


def test_a_report_is_written_again_over_the_one_there(run, routed):
    (routed / REPORT).write_text("old")
    code, out, _ = run("report", routed)
    assert code == 0
    assert out == f"{routed / REPORT}\n"
    assert (routed / REPORT).read_text(encoding="utf-8").startswith("<!doctype html>")


def test_a_folder_that_is_no_fit_or_was_edited_is_refused(refuse, tmp_path):
    assert "does not exist" in refuse("report", tmp_path / "nowhere")
    (tmp_path / "fit").mkdir()
    assert "is not a results folder" in refuse("report", tmp_path / "fit")
    (tmp_path / "fit" / "fit.json").write_text('{"schema": 7, "description": 3}')
    assert "damaged)" in refuse("report", tmp_path / "fit")


def test_a_fit_whose_report_cannot_be_written_is_kept(on_body, tmp_path, monkeypatch):
    from bowdenfit.questions.report import page

    messages = []
    monkeypatch.setattr(page, "BELOW_FIGURES", (lambda _: 1 / 0,))
    bf.fit(on_body, output=tmp_path / "fit", seed=3, mcmc=False, figures=False, report=messages.append)
    (sentence,) = messages
    assert "holds the whole fit, but its report could not be written (division by zero)" in sentence
    assert bf.load(tmp_path / "fit").converged
    assert not (tmp_path / "fit" / REPORT).exists()
    monkeypatch.undo()
    assert bf.report(tmp_path / "fit") == tmp_path / "fit" / REPORT


def test_a_fit_by_itself_needs_a_file_for_its_report(recorded, tmp_path):
    with pytest.raises(bf.UsageError, match="name a file for the report"):
        bf.report(bf.load(recorded))


def test_the_report_says_what_changed_since_an_earlier_fit(routed, recorded, tmp_path):
    same = bf.report(routed, tmp_path / "same.html", compare=routed).read_text()
    assert "What changed" in same and "The input files are the same." in same
    assert same.count("optimal_length") > 1
    other = bf.report(routed, tmp_path / "other.html", compare=recorded).read_text()
    assert "New: efficiencies.csv." in other and "No longer read: " in other and "In the description: " in other
    assert "What changed" not in (routed / REPORT).read_text()


def test_on_a_phone_pictures_scroll_and_what_is_cut_has_a_shadow(chromium, routed):
    """The shadow of what scrolls is at its right end until it is scrolled there; what fits has none."""
    shade = "e => getComputedStyle(e).backgroundImage.includes('gradient') && e.scrollWidth > e.clientWidth"
    with opened(chromium, routed / REPORT, width=390) as reader:
        width = "e => e.getBoundingClientRect().width"
        assert reader.page.locator("#figure-wrap_angles img").evaluate(width) > 500  # so that its letters can be read
        assert reader.page.locator("#figure-pairs").is_visible()
        assert reader.page.locator(".part-coefficients .wide").first.evaluate(shade)
        assert reader.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    with opened(chromium, routed / REPORT, width=1200) as reader:
        assert reader.page.locator("#figure-wrap_angles img").evaluate(width) < 1200
