"""What a page says stands where it belongs: warnings at tables, faults at fields, changes at fits; curves have pictures."""

import shutil
import tomllib
from pathlib import Path

import pytest
from app_in_browser import faults_of, serious_findings, served, visiting
from half_turn_bench import describe_half_turn
from recorded_benches import RecordedBench, write

DATASETS = Path(__file__).parents[3] / "datasets"
pytestmark = pytest.mark.extended
LOOKS = [(1280, "light"), (390, "dark")]


@pytest.fixture
def bench(tmp_path, quick_results):
    """Data sets of each kind that the pages show, and a fit."""
    shutil.copytree(DATASETS / "on-body-exoskeleton", tmp_path / "on-body")
    shutil.copytree(quick_results, tmp_path / "fits" / "on-body")
    shutil.copytree(DATASETS / "synthetic-catheter", tmp_path / "catheter")
    (tmp_path / "pulls").mkdir()
    (tmp_path / "pulls" / "cable.toml").write_text(describe_half_turn())
    rows = [f"{force},{force * loss:.2f},{run}" for run, loss in ((1, 0.71), (2, 0.73)) for force in (20, 40, 60)]
    (tmp_path / "pulls" / "forces.csv").write_text("\n".join(["input_force_N,output_force_N,run", *rows, ""]))
    recorded = write(RecordedBench(rate=100.0, length=60.0), tmp_path / "recorded", seed=4)
    text = (recorded / "cable.toml").read_text()
    left_out = 'recordings = { exclude = [{ start = 20, end = 26, reason = "leaned on the cell" }] }'
    (recorded / "cable.toml").write_text(text.replace("recordings = {}", left_out))
    return tmp_path


@pytest.mark.parametrize(("width", "scheme"), LOOKS)
def test_pages_of_data_show_warnings_at_tables_and_pictures_of_curves(chromium, axe, bench, width, scheme):
    with served(bench) as app, visiting(chromium, app, width=width, color_scheme=scheme) as visit:
        page, findings = visit.page, []

        def look():
            findings.extend([*serious_findings(page, axe), *faults_of(page)])

        page.goto(f"{visit.root}/data/pulls")
        page.get_by_role("link", name="1 warning about the table of forces").click()
        page.locator("#about-forces").get_by_text("Warning: ").wait_for()
        look()
        for name, figure in (("catheter", "#figure-data-displacement"), ("recorded", "#figure-data-recordings")):
            page.goto(f"{visit.root}/data/{name}")
            page.locator(f"{figure} .uplot").first.wait_for()
            look()
        page.get_by_text("1 stretch left out by the user").first.wait_for()
        page.get_by_text("Left out by the user", exact=True).first.wait_for()
        page.goto(f"{visit.root}/describe/on-body")
        page.get_by_text("Contact free sheath").click()
        page.locator("#key-contact-0-wrap_angle-curve svg").nth(3).wait_for()
        look()
        page.locator("#key-contact-0-wrap_angle-curve").get_by_role("radio", name="logistic").check()
        page.get_by_text("It can be saved.").wait_for()
        assert tomllib.loads(page.input_value("#toml"))["contact"][0]["wrap_angle"]["curve"] == "logistic"
        page.fill("#toml", page.input_value("#toml").replace('friction = "mu1"', "friction = 7"))
        page.keyboard.press("Tab")
        page.locator("#key-contact-0-friction-fault").wait_for()
        look()
        page.goto(f"{visit.root}/")
        page.get_by_role("button", name="New data set").click()
        page.set_input_files("input[type=file]", [bench / "on-body" / f"{name}.csv" for name in ("angles", "efficiencies")])
        page.locator(".curves svg").nth(7).wait_for()
        chosen = [menu.get_by_role("radio", checked=True).input_value() for menu in page.locator(".curves").all()]
        assert set(chosen) <= {"gaussian", "smooth"} and len(chosen) == 2
        look()
        assert findings == []


@pytest.mark.parametrize(("width", "scheme"), LOOKS)
def test_a_fit_says_that_its_data_have_changed_and_is_started_from_values(chromium, axe, bench, width, scheme):
    path = bench / "on-body" / "efficiencies.csv"
    path.write_text(path.read_text() + "# more\n")
    with served(bench) as app, visiting(chromium, app, width=width, color_scheme=scheme) as visit:
        page, findings = visit.page, []
        for place in ("", "data/on-body", "fit/on-body"):
            page.goto(f"{visit.root}/{place}")
            page.get_by_text("Changed since this fit: 'efficiencies.csv'.").first.wait_for()
            findings += [*serious_findings(page, axe), *faults_of(page)]
        page.get_by_role("link", name="Describe the cable").click()
        page.get_by_text("Nothing is wrong with this description").wait_for()
        page.goto(f"{visit.root}/try/on-body?fit=on-body")
        page.locator("#misfit span").wait_for()
        page.get_by_label("mu1", exact=True).press("ArrowRight")
        page.wait_for_function("() => document.querySelector('#start-command').textContent.includes('--start mu1=0.')")
        findings += [*serious_findings(page, axe), *faults_of(page)]
        page.get_by_role("button", name="Start the fit from here").click()
        page.locator(".stage .clock").wait_for()
        page.get_by_role("button", name="Cancel").click()
        page.get_by_text("It was cancelled").wait_for()
        assert findings == []
