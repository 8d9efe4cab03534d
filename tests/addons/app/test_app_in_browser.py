"""The app as people use it: in a browser, from an empty page to an answer."""

import http.client
import re
import shlex
import shutil
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from app_in_browser import served, visiting
from half_turn_bench import describe_half_turn

import bowdenfit as bf

DATASETS = Path(__file__).parents[3] / "datasets"
QUICK = "[sampler]\nn_walkers = 64\ntarget_ess = 200\ntarget_r_hat = 1.05\nmax_steps = 4000\n"
ROWS = ("20,15.2,1", "40,30.1,1", "60,45.6,1", "20,15.0,2", "40,30.9,2", "60,46.0,2", "20,14.8,3", "40,29.9,3", "60,44.6,3")
PASTE = """(cell, words) => {
  const data = new DataTransfer();
  data.setData("text", words);
  cell.dispatchEvent(new ClipboardEvent("paste", { clipboardData: data, bubbles: true, cancelable: true }));
}"""
TABLE = "\n".join(["F_in (N),F_out (N),run", *ROWS, ""])


@pytest.fixture(scope="module")
def bench(tmp_path_factory, quick_results):
    """A folder with a fit, and the app that serves it."""
    folder = tmp_path_factory.mktemp("bench")
    shutil.copytree(quick_results, folder / "fits" / "on-body")
    shutil.copytree(DATASETS / "on-body-exoskeleton", folder / "on-body-exoskeleton")
    with served(folder) as app:
        yield folder, app


def printed_by(*arguments):
    """What the command line prints."""
    command = [sys.executable, "-m", "bowdenfit", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout


def printed_by_shown(page, verb, folder):
    """What a command prints that a page shows as equivalent."""
    shown = shlex.split(page.text_content(f"#{verb}-command"))
    assert shown[0] == "bowdenfit"
    command = [sys.executable, "-P", "-m", *shown]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder).stdout


def text_on(page, selector):
    """The text on a part of a page, where numbers may stand beside their units without a break."""
    return page.inner_text(selector).replace("\N{NO-BREAK SPACE}", " ").strip()


@pytest.mark.extended
def test_files_become_a_data_set_that_the_command_line_takes(chromium, bench):
    folder, app = bench
    with visiting(chromium, app) as visit:
        page = visit.page
        page.get_by_role("button", name="New data set").click()
        page.set_input_files("input[type=file]", {"name": "bench 1.csv", "mimeType": "text/csv", "buffer": TABLE.encode()})
        page.get_by_label("By which angle").fill("180 deg")
        page.keyboard.press("Tab")
        page.get_by_role("button", name="Write the data set").click()
        page.get_by_role("heading", name="bench-1").wait_for()
        page.get_by_text("Everything could be read").first.wait_for()
        page.get_by_text("Name and seed").click()
        page.get_by_label("Seed").fill("many")
        page.get_by_role("button", name="Fit", exact=True).click()
        page.locator("#seed-fault").wait_for()
        assert page.inner_text("#seed-fault") == "seed = 'many' must be a whole number from 0 to 2147483647."
        page.get_by_role("link", name="Add rows to bench 1.csv").click()
        for heading, typed in (("F_in (N)", "20"), ("F_out (N)", "many"), ("run", "4")):
            page.get_by_label(f"{heading}, new row 1", exact=True).fill(typed)
        page.keyboard.press("Tab")
        page.get_by_text("'many' is not a number").wait_for()
        cell = page.get_by_label("F_out (N), new row 1", exact=True)
        assert (cell.get_attribute("aria-invalid"), cell.input_value()) == ("true", "many")
        assert (folder / "bench-1" / "bench 1.csv").read_text() == TABLE
        pasted = "F_in (N)\tF_out (N)\trun\n20\t15.1\t4\n40\t30.5\t4"
        page.get_by_label("F_in (N), new row 1", exact=True).evaluate(PASTE, pasted)
        page.get_by_role("button", name="Add 2 rows").click()
        page.get_by_role("heading", name="bench-1").wait_for()
        page.get_by_text("4 runs").first.wait_for()
        page.goto(visit.root + "/")
        page.get_by_role("button", name="New data set").click()
        page.set_input_files("input[type=file]", sorted((DATASETS / "on-body-exoskeleton").glob("*.[ct]*")))
        page.get_by_label("Name of the folder").fill("brought")
        page.get_by_role("button", name="Write the data set").click()
        page.get_by_role("heading", name="brought").wait_for()
    assert bf.read(folder / "brought").sha256 == bf.read(DATASETS / "on-body-exoskeleton").sha256
    assert not (folder / "fits" / "bench-1").exists()
    assert bf.check(folder / "bench-1").description.name == "bench 1"
    assert (folder / "bench-1" / "bench 1.csv").read_text() == f"{TABLE}20,15.1,4\n40,30.5,4\n"


@pytest.mark.extended
def test_what_a_stranger_hides_among_measured_files_neither_arrives_nor_runs(chromium, tmp_path):
    trap = tmp_path / "TRAP"
    stranger = {
        "cable.toml": describe_half_turn(name="scipy"), "forces.csv": TABLE, "__init__.py": f"open({str(trap)!r}, 'w')",
        "notes.csv": "PK\3\4",
    }  # fmt: skip
    files = [{"name": name, "mimeType": "text/plain", "buffer": content.encode()} for name, content in stranger.items()]
    (tmp_path / "bench").mkdir()
    with served(tmp_path / "bench", cwd=tmp_path / "bench") as app, visiting(chromium, app) as visit:
        page = visit.page
        page.get_by_role("button", name="New data set").click()
        page.set_input_files("input[type=file]", files)
        page.get_by_text("'__init__.py' is left out").wait_for()
        page.get_by_text("extension says: 'notes.csv'").wait_for()
        assert page.input_value("#folder") == "scipy-cable"
        page.get_by_label("Name of the folder").fill("scipy")
        page.get_by_role("button", name="Write the data set").click()
        page.get_by_text("'scipy' is also the name of a Python module").wait_for()
        page.get_by_label("Name of the folder").fill("scipy-cable")
        page.get_by_role("button", name="Write the data set").click()
        page.get_by_role("button", name="Fit", exact=True).click()
        page.locator(".stage .clock").wait_for()
        page.get_by_role("button", name="Cancel").click()
        page.get_by_text("It was cancelled").wait_for()
        visit.console = [line for line in visit.console if "status of 422" not in line]  # of what was refused
    assert sorted(path.name for path in (tmp_path / "bench" / "scipy-cable").iterdir()) == ["cable.toml", "forces.csv"]
    assert not trap.exists()


@pytest.mark.extended
def test_every_number_of_a_fit_is_that_of_the_command_line(chromium, bench):
    folder, app = bench
    results = folder / "fits" / "on-body"
    with visiting(chromium, app) as visit:
        page = visit.page
        page.goto(f"{visit.root}/fit/on-body")
        page.locator("#printed").evaluate("printed => printed.closest('details').open = true")
        assert text_on(page, "#printed") == printed_by("summary", results).strip()
        page.locator("#arrives p").first.wait_for()
        page.locator("#dial-0").press("ArrowRight")
        page.locator("#dial-1").press("ArrowRight")
        page.wait_for_timeout(500)
        page.wait_for_function("document.querySelector('#arrives').innerText.includes(document.querySelector('output').innerText)")
        length, force = (page.inner_text(f"output[for=dial-{number}]") for number in (0, 1))
        assert [float(page.input_value(f"#dial-{number}")) for number in (0, 1)] == [float(length), float(force)]
        command = f"bowdenfit predict fits/on-body {length} --input-force {force}N"
        page.wait_for_function("words => document.querySelector('#predict-command').textContent === words", arg=command)
        assert text_on(page, "#arrives").split() == printed_by_shown(page, "predict", folder).split()
        page.get_by_role("button", name="Rank what could be measured next").click()
        page.locator("#ranking table").wait_for()
        page.get_by_role("link", name="Add rows to efficiencies.csv").wait_for()
        advice = printed_by_shown(page, "next", folder).split("\n\n")[0].split()
        shown = " ".join(text_on(page, "#ranking").split())
        for sentence in re.split(r"(?<=[a-z]\.) ", " ".join(advice)):  # what is said of stopping stands first
            assert sentence in shown
        for name in ("efficiency", "pairs", "coefficients", "residuals", "loss"):
            page.locator(f"#figure-{name} .uplot").wait_for(state="attached")
        answer = page.request.get(f"{visit.root}/export/on-body/csv")
        printed_by("export", results, "--to", "csv", "--output", folder / "table.csv")
        assert answer.body() == (folder / "table.csv").read_bytes()


@pytest.mark.extended
def test_who_asks_without_the_key_or_from_elsewhere_gets_a_sentence(bench):
    _, app = bench
    refused = (({}, "printed last"), ({"Host": "evil.example"}, "this machine alone"), ({"Origin": "http://a.b"}, "site"))
    for headers, words in refused:
        for path in ("/", "/kept/on-body/report.html", "/_nicegui_ws/socket.io/?EIO=4&transport=polling"):
            with closing(http.client.HTTPConnection("127.0.0.1", app.port)) as connection:
                connection.request("GET", path, headers=headers)
                answer = connection.getresponse()
                assert (answer.status, words in answer.read().decode()) == (403, True)


@pytest.mark.slow
def test_from_an_empty_page_to_a_report(chromium, tmp_path):
    with served(tmp_path) as app, visiting(chromium, app) as visit:
        page = visit.page
        page.get_by_role("button", name="New data set").click()
        page.set_input_files("input[type=file]", {"name": "bench.csv", "mimeType": "text/csv", "buffer": TABLE.encode()})
        page.get_by_label("By which angle").fill("180 deg")
        page.keyboard.press("Tab")
        page.get_by_role("button", name="Write the data set").click()
        page.get_by_role("button", name="Fit", exact=True).wait_for()
        description = tmp_path / "bench" / "cable.toml"
        description.write_text(f"{description.read_text()}\n{QUICK}")
        page.get_by_text("Name and seed").click()
        page.get_by_label("Seed").fill("3")
        page.get_by_role("button", name="Fit", exact=True).click()
        page.locator(".stage .clock").wait_for()
        page.reload()  # in the middle of the fit
        page.locator(".stage .clock").wait_for()
        page.locator("#answer-text").wait_for(timeout=180_000)
        page.locator("#printed").evaluate("printed => printed.closest('details').open = true")
        answer = text_on(page, "#printed")
        page.locator("#arrives p").first.wait_for()
        with page.context.expect_page() as opened:
            page.get_by_role("link", name="Report", exact=True).click()
        assert "Coefficient of friction" in opened.value.inner_text("main")
    again = printed_by("fit", tmp_path / "bench", "--seed", "3", "--output", tmp_path / "again", "--no-figures")
    assert answer == again.strip()
