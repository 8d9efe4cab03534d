"""A cable is described in a form and in the text next to it, which say the same, and are saved once nothing is wrong."""

import tomllib

import pytest
from app_in_browser import faults_of, serious_findings, served, visiting
from half_turn_bench import TABLE, describe_half_turn

pytestmark = pytest.mark.extended


@pytest.mark.parametrize(("width", "scheme"), [(1280, "dark"), (390, "light")])
def test_form_and_text_say_the_same_and_are_saved(chromium, axe, tmp_path, width, scheme):
    folder = tmp_path / "bench"
    folder.mkdir()
    (folder / "cable.toml").write_text(f"# </textarea><b>ours</b>\n{describe_half_turn()}")
    (folder / "forces.csv").write_text(TABLE)
    with served(tmp_path) as app, visiting(chromium, app, width=width, color_scheme=scheme) as visit:
        page = visit.page
        page.goto(f"{visit.root}/data/bench")
        page.get_by_role("link", name="Describe the cable").click()
        page.get_by_text("It is as it was saved.").wait_for()
        assert page.input_value("#toml").startswith("# </textarea><b>ours</b>\n")
        page.get_by_text("Load cells").click()
        page.get_by_label("force_noise", exact=True).fill("half")
        page.keyboard.press("Tab")
        field = page.get_by_label("force_noise", exact=True).and_(page.locator('[aria-invalid="true"]'))
        field.wait_for()
        fault, hint = field.get_attribute("aria-describedby").split()
        assert "'half' is not a number with its unit" in page.locator(f"#{fault}").inner_text()
        assert page.locator(f"#{hint}").is_visible()
        assert field.input_value() == "half" and page.input_value("#toml") == (folder / "cable.toml").read_text()
        assert [*serious_findings(page, axe), *faults_of(page)] == []
        page.get_by_role("button", name="Save cable.toml").click()
        page.get_by_text("a field holds what cannot be taken").wait_for()
        page.get_by_role("button", name="Close").click()
        page.locator(".q-notification").wait_for(state="detached")  # whose contrast is none while it fades
        page.get_by_label("offset_sd", exact=True).fill("1 N")
        page.keyboard.press("Tab")
        page.wait_for_function("document.querySelector('#toml').value.includes('offset_sd')")
        assert field.input_value() == "half"
        page.get_by_label("force_noise", exact=True).fill("0.5 N")
        page.keyboard.press("Tab")
        page.get_by_text("It can be saved.").wait_for()
        assert tomllib.loads(page.input_value("#toml"))["sensors"]["force_noise"] == {"value": 0.5, "unit": "N"}
        assert faults_of(page) == []
        page.get_by_text("Table of forces").click()
        page.locator("#key-tables-forces-file").fill("none.csv")
        page.keyboard.press("Tab")
        page.locator("#key-tables-forces-file-fault").get_by_text("none.csv does not exist").wait_for()
        page.get_by_text("The measured files cannot be read as it says.").wait_for()
        assert [*serious_findings(page, axe), *faults_of(page)] == []
        page.locator("#key-tables-forces-file").fill("forces.csv")
        page.keyboard.press("Tab")
        page.locator("#key-tables-forces-file-fault").wait_for(state="detached")
        page.get_by_text("exclude (nothing stated)").focus()
        page.keyboard.press("Enter")
        page.keyboard.press("Tab")
        page.keyboard.type("5")
        page.keyboard.press("Tab")
        page.locator("#key-tables-forces-exclude-0-reason-fault").wait_for()
        assert [*serious_findings(page, axe), *faults_of(page)] == []
        page.keyboard.type("slipped")
        page.keyboard.press("Tab")
        page.get_by_text("It can be saved.").wait_for()
        text = page.input_value("#toml")
        page.fill("#toml", text.replace('name = "bench"', 'name = "bench" x'))
        page.get_by_text("This is no TOML").wait_for()
        page.get_by_role("button", name="Save cable.toml").click(delay=300)  # as long as a hand's: nothing moves meanwhile
        page.get_by_text("cable.toml is as it was.").wait_for()
        page.locator("#key-name:disabled").wait_for()
        page.fill("#toml", text.replace('name = "bench"', 'name = "bench 2"'))
        page.get_by_text("It can be saved.").wait_for()
        page.keyboard.press("Tab")
        page.wait_for_function("document.querySelector('#key-name:enabled')?.value === 'bench 2'")  # the form is drawn again
        page.get_by_role("button", name="Save cable.toml").click()
        page.get_by_text("Everything could be read").first.wait_for()
    saved = tomllib.loads((folder / "cable.toml").read_text())
    assert (saved["name"], saved["sensors"]["force_noise"]["value"]) == ("bench 2", 0.5)
    assert saved["tables"]["forces"]["exclude"] == [{"rows": [5], "reason": "slipped"}]
