"""Pages beside the way from an empty page to an answer: fits that end early, several tabs, two cables, a watched bench."""

import shlex
import shutil
import subprocess
import sys

import pytest
from app_in_browser import faults_of, served, visiting, watch
from half_turn_bench import describe_half_turn

import bowdenfit as bf

QUICK = """[sampler]
n_walkers = 64
target_ess = 200
target_r_hat = 1.05
max_steps = 4000
"""


def write_bench(folder, share, runs=5):
    """Write a data set of a cable that lets through a share of the force."""
    folder.mkdir()
    (folder / "cable.toml").write_text(describe_half_turn(name=folder.name) + QUICK)
    (folder / "forces.csv").write_text("input_force_N,output_force_N,run\n")
    for run in range(runs):
        mount(folder, share, run)


def mount(folder, share, run):
    """Write the readings of one more mounting."""
    with (folder / "forces.csv").open("a") as file:
        for i, force in enumerate((20, 40, 60)):
            file.write(f"{force},{share * force * (1 + 0.012 * ((run * 3 + i) % 5 - 2)):.2f},{run}\n")


@pytest.mark.slow
def test_a_cancelled_fit_and_one_of_a_killed_app_are_resumed(chromium, tmp_path):
    write_bench(tmp_path / "bench", 0.75)
    description = tmp_path / "bench" / "cable.toml"
    longer = description.read_text().replace("target_ess = 200", "target_ess = 6000").replace("steps = 4000", "steps = 60000")
    description.write_text(longer)
    checkpoint = tmp_path / "fits" / "bench" / "chain.checkpoint"
    with served(tmp_path) as app, visiting(chromium, app) as visit:
        page = visit.page
        page.goto(f"{visit.root}/data/bench")
        page.get_by_role("button", name="Fit", exact=True).click()
        page.get_by_text("sampling with").wait_for(timeout=180_000)
        page.get_by_role("button", name="Cancel").click()
        page.get_by_text("It was cancelled").wait_for()
        assert checkpoint.is_file()
        page.get_by_role("button", name="Resume").click()
        page.locator(".stage .clock").wait_for()
        app.process.kill()
    with served(tmp_path) as app, visiting(chromium, app) as visit:
        page = visit.page
        page.get_by_text("Interrupted; it can be resumed.").wait_for()
        page.get_by_role("link", name="Open", exact=True).click()
        page.get_by_role("button", name="Resume").click()
        page.locator("#answer-text").wait_for(timeout=240_000)
    assert bf.load(tmp_path / "fits" / "bench").converged


@pytest.mark.extended
def test_two_tabs_show_the_same_and_every_page_can_be_read(chromium, tmp_path, quick_results):
    write_bench(tmp_path / "bench", 0.75)
    shutil.copytree(quick_results, tmp_path / "fits" / "on-body")
    with served(tmp_path) as app, visiting(chromium, app, width=390, color_scheme="dark") as visit:
        page, other = visit.page, visit.page.context.new_page()
        watch(visit, other, app)
        assert faults_of(page) == []
        page.get_by_role("button", name="New data set").click()
        page.get_by_text("Or type or paste a table").click()
        page.get_by_label("Row 1, column 1", exact=True).fill("20")
        page.get_by_label("Row 1, column 2", exact=True).fill("many")
        page.keyboard.press("Tab")
        page.get_by_label("By which angle").fill("180 deg")
        page.keyboard.press("Tab")
        page.get_by_text("cells that cannot be read").wait_for()
        cell = page.get_by_label("Row 1, column 2", exact=True)
        cell.and_(page.locator('[aria-invalid="true"]')).wait_for()  # which may arrive after the sentence
        assert cell.input_value() == "many"
        assert page.get_by_label("Row 1, column 1", exact=True).input_value() == "20"
        assert faults_of(page) == []
        other.goto(page.url)
        other.get_by_text("'many' is not a number").first.wait_for()
        other.goto(f"{visit.root}/fit/on-body")
        other.locator("#arrives p").first.wait_for()
        assert faults_of(other) == []
        other.goto(f"{visit.root}/fit/..%2F..")
        assert other.locator("[role=alert]").count() == 1 or "Not Found" in other.content()
        visit.console.remove("Failed to load resource: the server responded with a status of 404 (Not Found)")


@pytest.mark.slow
def test_two_cables_stand_side_by_side_and_a_bench_is_watched(chromium, tmp_path):
    for name, share in (("worn", 0.70), ("new", 0.80)):
        write_bench(tmp_path / name, share)
        bf.fit(tmp_path / name, output=tmp_path / "fits" / name, seed=1, figures=False)
    with served(tmp_path) as app, visiting(chromium, app) as visit:
        page = visit.page
        page.get_by_role("link", name="Compare two fits").click()
        page.locator("#comparison .uplot").wait_for()
        assert "new minus worn" in page.inner_text("#comparison")
        assert "different (higher) with probability" in page.inner_text("#comparison")
        _, *shown = shlex.split(page.text_content("#compare-command"))  # of Python, as no command compares two cables
        done = subprocess.run([sys.executable, *shown], capture_output=True, text=True, check=True, cwd=tmp_path)
        for sentence in done.stdout.splitlines():
            assert sentence in page.inner_text("#comparison").replace("\N{NO-BREAK SPACE}", " ")
        assert faults_of(page) == []
        page.goto(f"{visit.root}/live/worn")
        page.get_by_role("button", name="Watch the bench").click()
        page.locator("#live-answer", has_text="5 mountings: mu").wait_for(timeout=180_000)
        mount(tmp_path / "worn", 0.70, 5)
        page.locator("#live-answer", has_text="6 mountings: mu").wait_for(timeout=180_000)
        assert faults_of(page) == []
        page.get_by_role("button", name="Stop watching").click()
        page.get_by_role("button", name="Watch the bench").wait_for()
