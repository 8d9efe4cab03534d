"""Data are seen before a fit: a click on a point shows its row, which is left out with a reason, and taken in again."""

import tomllib

import pytest
from app_in_browser import faults_of, serious_findings, served, visiting
from half_turn_bench import describe_half_turn
from recorded_benches import RecordedBench, write

import bowdenfit as bf
from bowdenfit.recordings.recording import Recordings

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


def click_on_line(page, figure, x):
    """Click down a chart at a place of its axis, twice in each row of pixels that a line may cross, until the form follows."""
    box = page.locator(f"{figure} .u-over").first.bounding_box()
    low, high = map(float, page.locator(f"{figure} .chart").first.get_attribute("data-shown").split())
    unchanged = page.locator("#leave-out").inner_html()
    for y in range(4, int(box["height"]), 12):
        page.mouse.click(box["x"] + box["width"] * (x - low) / (high - low), box["y"] + y)
        page.wait_for_timeout(60)
        if page.locator("#leave-out").inner_html() != unchanged:
            return
    raise AssertionError(f"no line at {x}")


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_a_stretch_of_a_recording_is_left_out_by_two_clicks_and_a_whole_one_by_a_button(chromium, tmp_path, width, scheme):
    folder = write(RecordedBench(rate=100.0, length=60.0, mountings=2), tmp_path / "bench", seed=4)
    original = (folder / "cable.toml").read_text()
    with served(tmp_path) as app, visiting(chromium, app, width=width, color_scheme=scheme) as visit:
        page, figure = visit.page, "#figure-data-recordings"
        page.goto(f"{visit.root}/data/bench")
        page.locator(f"{figure} .uplot").first.wait_for()
        for time in (20, 26):
            page.locator(figure).scroll_into_view_if_needed()
            click_on_line(page, figure, time)
        start, end = (float(page.locator(f"#part-{key}").input_value()) for key in ("start", "end"))
        assert abs(start - 20) < 1 and abs(end - 26) < 1 and faults_of(page) == []
        page.get_by_label("Why?").fill("leaned on <i>it</i>")
        page.get_by_role("button", name="Leave it out").click()
        name = f"{start:.12g} to {end:.12g} s"
        page.get_by_text(f"1 stretch left out by the user: r0.csv, {name} (leaned on <i>it</i>).", exact=True).wait_for()
        page.get_by_text("Left out by the user", exact=True).first.wait_for()
        page.get_by_role("button", name="Leave all of it out: r1.csv").click()
        page.get_by_role("button", name="Leave it out").click()
        page.get_by_text("write why all is left out").wait_for()
        page.get_by_label("Why is all of r1.csv left out?").fill("the clamp slipped")
        page.get_by_role("button", name="Leave it out").click()
        again = page.get_by_role("button", name="Use it again: all of r1.csv")
        again.wait_for()
        assert [item.file for item in bf.read(folder).measurements.table(Recordings).items] == ["r0.csv"]
        assert faults_of(page) == []
        again.click()
        again.wait_for(state="detached")
        page.get_by_role("button", name=f"Use it again: {name} of r0.csv").click()
        page.get_by_text("Left out by the user", exact=True).wait_for(state="detached")
        assert (folder / "cable.toml").read_text() == original


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


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_a_negative_wrap_angle_is_left_out_while_files_are_added(chromium, axe, tmp_path, width, scheme):
    rows = ROWS.replace("run", "run,wrap_angle_deg").replace(",1\n", ",1,90\n").replace(",2\n", ",2,180\n")
    with served(tmp_path) as app, visiting(chromium, app, width=width, color_scheme=scheme) as visit:
        page = visit.page
        page.get_by_role("button", name="New data set").click()
        spoiled = rows.replace("40,30.9,2,180", "40,30.9,2,-180")
        page.set_input_files("input[type=file]", {"name": "b.csv", "mimeType": "text/csv", "buffer": spoiled.encode()})
        leave_out = page.get_by_role("button", name="Leave out: row 6 of b.csv")
        leave_out.wait_for()
        assert "'-180' is negative" in page.locator("tr.refused").inner_text()
        assert [*serious_findings(page, axe), *faults_of(page)] == []
        leave_out.focus()
        page.keyboard.press("Enter")
        page.wait_for_function("document.activeElement.id === 'reason'")
        page.keyboard.type("sensor <b>upside</b> down")
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        page.get_by_text("1 reading left out by the user: b.csv, row 6 (sensor <b>upside</b> down).", exact=True).wait_for()
        page.locator("#figure-data-forces .uplot").wait_for()
        assert [*serious_findings(page, axe), *faults_of(page)] == []
        page.get_by_role("button", name="Write the data set").click()
        page.wait_for_url("**/data/b")
        settings = tomllib.loads((tmp_path / "b" / "cable.toml").read_text())["tables"]["forces"]
        assert settings["exclude"] == [{"rows": [6], "reason": "sensor <b>upside</b> down"}]
        assert len(bf.read(tmp_path / "b").measurements.tables[0].run) == 5


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_a_recording_that_is_refused_is_drawn_while_files_are_added(chromium, axe, tmp_path, width, scheme):
    path = write(RecordedBench(rate=100.0, length=60.0), tmp_path / "bench", seed=4) / "r0.csv"
    head, *lines = path.read_text().splitlines()
    inverted = [",-".join(line.rsplit(",", 1)) for line in lines]
    with served(tmp_path) as app, visiting(chromium, app, width=width, color_scheme=scheme) as visit:
        page = visit.page
        page.get_by_role("button", name="New data set").click()
        for name, rows in (("slip.csv", [*lines[:999], "9.99,50,slip", *lines[1000:]]), ("sign.csv", inverted)):
            content = "\n".join([head, *rows, ""]).encode()
            page.set_input_files("input[type=file]", {"name": name, "mimeType": "text/csv", "buffer": content})
            if name == "sign.csv":
                page.get_by_label("By which angle").fill("180 deg")
                page.keyboard.press("Tab")
                page.get_by_text("are negative, down to").wait_for()
            chart = page.get_by_role("figure").filter(has_text=name)
            chart.locator(".uplot").wait_for()
            assert chart.get_by_text("row 1001", exact=True).count() == (name == "slip.csv")
            assert [*serious_findings(page, axe), *faults_of(page)] == []
            if name == "slip.csv":
                page.get_by_role("button", name="Leave slip.csv out").click()
        page.get_by_label("Unit of output_force_N").select_option("-N")
        page.get_by_text("Everything could be read").first.wait_for()


DRAW_BOX = """() => {
  document.querySelector("[data-key=probe]")?.remove();
  const box = Object.assign(document.createElement("input"), { type: "text" });
  box.dataset.key = "probe";
  box.addEventListener("change", event => { globalThis.sent = event.target.value; });
  globalThis.sent = null;
  document.querySelector("main").append(box);
}"""


def test_what_is_being_typed_stays_when_a_part_is_drawn_again_and_is_told_when_it_is_left(chromium, tmp_path):
    with served(tmp_path) as app, visiting(chromium, app) as visit:
        page, box = visit.page, visit.page.locator("[data-key=probe]")
        page.evaluate(DRAW_BOX)
        box.press_sequentially("180")
        page.evaluate(DRAW_BOX)
        page.wait_for_function("document.activeElement.value === '180'")
        assert page.evaluate("globalThis.sent") is None
        page.keyboard.press("Tab")
        page.wait_for_function("globalThis.sent === '180'")
        box.focus()
        page.evaluate(DRAW_BOX)
        drawn_again = "document.activeElement.dataset.key === 'probe' && document.activeElement.value === ''"
        page.wait_for_function(drawn_again)  # what was told is not kept
