"""Pages without serious findings of axe-core, and a walk from the start to a fit by the keyboard alone."""

import shutil
from pathlib import Path

import pytest
from app_in_browser import faults_of, serious_findings, served, visiting

DATASETS = Path(__file__).parents[3] / "datasets"
_FOCUS = """() => {
  const focused = document.activeElement, style = getComputedStyle(focused);
  const isSeen = focused === document.body || (style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1);
  return [focused.innerText || focused.getAttribute("aria-label") || focused.labels?.[0]?.innerText || focused.tagName, isSeen];
}"""


@pytest.mark.extended
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_no_page_has_a_serious_finding(chromium, axe, tmp_path, quick_results, width, scheme):
    shutil.copytree(quick_results, tmp_path / "fits" / "on-body")
    shutil.copytree(DATASETS / "on-body-exoskeleton", tmp_path / "on-body")
    places = {
        "/": "text=See the answer", "/data/on-body": "#charts .uplot", "/describe/on-body": "#toml",
        "/table/on-body?file=efficiencies.csv": "text=More rows", "/fit/on-body": "#arrives p",
        "/try/on-body?fit=on-body": "#trial-charts .uplot", "/live/on-body": "text=Watch the bench", "/compare": "h1",
    }  # fmt: skip
    findings = []
    with served(tmp_path) as app, visiting(chromium, app, width=width, color_scheme=scheme) as visit:
        page = visit.page

        def look(place):
            page.evaluate("() => document.querySelectorAll('details').forEach(part => { part.open = true; })")
            page.wait_for_timeout(300)
            findings.extend((place, finding) for finding in (*serious_findings(page, axe), *faults_of(page)))

        for place, shown in places.items():
            page.goto(f"{visit.root}{place}")
            page.locator(shown).first.wait_for()
            look(place)
        page.goto(f"{visit.root}/")
        page.get_by_role("button", name="New data set").click()
        page.set_input_files("input[type=file]", sorted(tmp_path.glob("on-body/*.csv")))
        page.locator("#questions").wait_for()
        look("new")
    assert findings == []


@pytest.mark.extended
def test_the_keyboard_alone_leads_from_the_start_to_a_fit(chromium, tmp_path):
    with served(tmp_path) as app, visiting(chromium, app) as visit:
        page = visit.page
        _press_enter_on(page, "Copy the example")
        page.get_by_role("button", name="Fit", exact=True).wait_for()
        _press_enter_on(page, "Fit")
        page.locator(".stage .clock").wait_for()
        _press_enter_on(page, "Cancel")
        page.get_by_text("It was cancelled").wait_for()


def _press_enter_on(page, name):
    """Go to a control by the tab key, and press Enter; where the focus is must be seen all the way."""
    for _ in range(60):
        page.keyboard.press("Tab")
        focused, is_seen = page.evaluate(_FOCUS)
        assert is_seen, f"the focus is not seen on {focused!r}"
        if focused == name:
            page.keyboard.press("Enter")
            return
    raise AssertionError(f"no Tab leads to {name!r}")
