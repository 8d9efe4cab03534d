"""The app as people use it: in a browser, from an empty page to an answer."""

import http.client
import shutil
import subprocess
import sys

import pytest
from app_in_browser import served, visiting
from reading_room import browser

import bowdenfit as bf

QUICK = "[sampler]\nn_walkers = 64\ntarget_ess = 200\ntarget_r_hat = 1.05\nmax_steps = 4000\n"
ROWS = ("20,15.2,1", "40,30.1,1", "60,45.6,1", "20,15.0,2", "40,30.9,2", "60,46.0,2", "20,14.8,3", "40,29.9,3", "60,44.6,3")
TABLE = "\n".join(["F_in (N),F_out (N),run", *ROWS, ""])


@pytest.fixture(scope="module")
def chromium():
    """A browser; tests are skipped where there is none."""
    with browser() as program:
        yield program


@pytest.fixture(scope="module")
def bench(tmp_path_factory, quick_results):
    """A folder with a fit, and the app that serves it."""
    folder = tmp_path_factory.mktemp("bench")
    shutil.copytree(quick_results, folder / "fits" / "on-body")
    with served(folder) as app:
        yield folder, app


def printed_by(*arguments):
    """What the command line prints."""
    command = [sys.executable, "-m", "bowdenfit", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout


def words_of(page, selector):
    """The words on a part of a page, whatever separates them."""
    return page.inner_text(selector).replace("\N{NO-BREAK SPACE}", " ").split()


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
        page.get_by_text("Everything could be read").wait_for()
    assert bf.check(folder / "bench-1").description.name == "bench 1"
    assert (folder / "bench-1" / "bench 1.csv").read_text() == TABLE


@pytest.mark.extended
def test_the_answer_is_that_of_the_command_line(chromium, bench):
    folder, app = bench
    with visiting(chromium, app) as visit:
        visit.page.goto(f"{app.root}/fit/on-body")
        visit.page.locator("#answer-text table").wait_for()
        printed = [word for word in printed_by("summary", folder / "fits" / "on-body").split() if set(word) != {"-"}]
        assert words_of(visit.page, "#answer-text") == printed
        visit.page.locator("#figure-efficiency .uplot").wait_for()


@pytest.mark.extended
def test_who_asks_without_the_key_or_from_elsewhere_gets_a_sentence(bench):
    _, app = bench
    refused = (({}, "whole address"), ({"Host": "evil.example"}, "this machine alone"), ({"Origin": "http://a.b"}, "site"))
    for headers, words in refused:
        for path in ("/", "/kept/on-body/report.html", "/_nicegui_ws/socket.io/?EIO=4&transport=polling"):
            connection = http.client.HTTPConnection("127.0.0.1", app.port)
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
        page.locator("#answer-text table").wait_for(timeout=180_000)
        answer = words_of(page, "#answer-text")
        with page.context.expect_page() as opened:
            page.get_by_role("link", name="Report").click()
        assert "Coefficient of friction" in opened.value.inner_text("main")
    again = printed_by("fit", tmp_path / "bench", "--seed", "3", "--output", tmp_path / "again", "--no-figures")
    assert answer == [word for word in again.split() if set(word) != {"-"}]
