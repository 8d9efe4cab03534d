"""Data are seen before a fit: a click on a point shows its row, which is left out with a reason, and taken in again."""

import pytest
from app_in_browser import faults_of, served, visiting
from half_turn_bench import describe_half_turn

import bowdenfit as bf

ROWS = "input_force_N,output_force_N,run\n20,15.2,1\n40,30.1,1\n60,45.6,1\n20,15.0,2\n40,30.9,2\n60,46.0,2\n"
pytestmark = pytest.mark.extended


def click_at(page, figure, x):
    """Click down a chart at a place of its axis until a point is met."""
    chart = page.locator(f"{figure} .chart")
    low, high = map(float, chart.get_attribute("data-shown").split())
    box = page.locator(f"{figure} .u-over").bounding_box()
    for y in range(4, int(box["height"]), 8):
        page.mouse.click(box["x"] + box["width"] * (x - low) / (high - low), box["y"] + y)
        if page.locator("tr.picked").count():
            return
    raise AssertionError(f"no point at {x}")


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_a_point_shows_its_row_which_is_left_out_and_taken_in_again(chromium, tmp_path, width, scheme):
    folder = tmp_path / "bench"
    folder.mkdir()
    (folder / "cable.toml").write_text(describe_half_turn())
    (folder / "forces.csv").write_text(ROWS)
    with served(tmp_path) as app, visiting(chromium, app, width=width, color_scheme=scheme) as visit:
        page = visit.page
        page.goto(f"{visit.root}/data/bench")
        page.locator("#figure-data-forces .uplot").wait_for()
        page.locator("#figure-data-forces").scroll_into_view_if_needed()
        click_at(page, "#figure-data-forces", 60)
        row = page.locator("tr.picked")
        number = row.get_attribute("data-row-key").split()[0]
        assert number in {"4", "7"} and row.is_visible()
        assert faults_of(page) == []
        page.get_by_role("button", name=f"Leave out: row {number} of forces.csv").click()
        page.get_by_role("button", name=f"Leave row {number} out").click()
        page.get_by_text(f"write why row {number} is left out").wait_for()
        page.get_by_label(f"Why is row {number}").fill("the rope <b>jumped</b>")
        page.get_by_role("button", name=f"Leave row {number} out").click()
        sentence = f"1 reading left out by the user: forces.csv, row {number} (the rope <b>jumped</b>)."
        page.get_by_text(sentence, exact=True).wait_for()
        page.get_by_text("Left out by you", exact=True).wait_for()
        assert len(bf.read(folder).measurements.tables[0].run) == 5
        assert faults_of(page) == []
        page.get_by_role("button", name=f"Use it again: row {number} of forces.csv").click()
        page.get_by_text("Left out by you", exact=True).wait_for(state="detached")
        assert (folder / "cable.toml").read_text() == describe_half_turn()


def test_files_are_drawn_while_they_are_added_and_refused_rows_are_red(chromium, tmp_path):
    with served(tmp_path) as app, visiting(chromium, app) as visit:
        page = visit.page
        page.get_by_role("button", name="New data set").click()
        spoiled = ROWS.replace("60,46.0", "60,slip")
        page.set_input_files("input[type=file]", {"name": "b.csv", "mimeType": "text/csv", "buffer": spoiled.encode()})
        page.locator("#figure-sketch-0 .uplot").wait_for()
        page.get_by_label("By which angle").fill("180 deg")
        page.keyboard.press("Tab")
        page.locator("#figure-data-forces .uplot").wait_for()
        refused = page.locator("tr.refused")
        refused.wait_for()
        assert refused.get_attribute("data-row-key") == "7 b.csv" and "'slip' is not a number" in refused.inner_text()
        assert faults_of(page) == []
