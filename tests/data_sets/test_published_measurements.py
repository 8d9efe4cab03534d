"""Other people's measurements: the verdicts follow from their rule, and the page says what the fits say."""

import csv
import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

import bowdenfit as bf

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "published_measurements.py"
with (ROOT / "datasets" / "published" / "printed.csv").open(encoding="utf-8", newline="") as table:
    ROWS = list(csv.DictReader(table))
FOLDERS = sorted(path.parent for path in (ROOT / "datasets" / "published").glob("*/cable.toml"))


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("published_measurements", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules["published_measurements"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["published_measurements"]


@pytest.mark.parametrize(
    ("interval", "trusted", "verdict"),
    [
        ((0.20, 0.19, 0.21), True, "agrees"),
        ((0.20, 0.15, 0.25), True, "wider"),
        ((0.30, 0.21, 0.35), True, "differs"),
        ((0.10, 0.05, 0.19), True, "differs"),
        ((0.20, 0.19, 0.21), False, "differs"),
        (None, True, "no value"),
        (None, False, "differs"),
    ],
)
def test_the_verdict_follows_from_the_interval_and_what_is_printed(script, interval, trusted, verdict):
    printed = {
        "data_set": "a",
        "parameter": "mu",
        "printed": "0.20",
        "low": "0.195",
        "high": "0.205",
        "verdict": "wider",
    }
    comparison = script.Comparison(printed, interval, trusted)
    assert comparison.verdict == verdict
    assert comparison.fault == ("" if verdict == "wider" else f"a mu: {verdict}, where wider is expected")


def test_a_printed_range_is_met_where_any_value_is_in_common(script):
    printed = {"printed": "0.28 to 0.31", "low": "0.28", "high": "0.31"}
    assert script.Comparison(printed, (0.27, 0.25, 0.29), True).verdict == "agrees"
    assert script.Comparison(printed, (0.25, 0.24, 0.27), True).verdict == "differs"


def test_every_data_set_has_a_source_and_rows_of_what_its_authors_print(script):
    assert {row["data_set"] for row in ROWS} == set(script.TABLES)
    assert {f"published/{folder.name}" for folder in FOLDERS} == {name for name in script.TABLES if "/" in name}
    for folder in FOLDERS:
        assert bf.read(folder).description.source
    for row in ROWS:
        first, _, last = row["printed"].partition(" to ")
        assert not row["parameter"] or float(row["low"]) <= float(first) <= float(last or first) <= float(row["high"])


def test_the_page_has_every_comparison_with_the_expected_verdict():
    page = (ROOT / "docs" / "evidence" / "measurements.md").read_text(encoding="utf-8")
    for name in {row["data_set"] for row in ROWS}:
        section = page.partition(f"Data set `datasets/{name}`.")[2].partition("\n## ")[0]
        cells = [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("| ")][2:]
        expected = [(row["printed"], row["verdict"]) for row in ROWS if row["data_set"] == name]
        assert [line[-1].removesuffix(" (not trusted)") for line in cells] == [verdict for _, verdict in expected]
        assert all(line[1].startswith(printed) for line, (printed, _) in zip(cells, expected, strict=True))


def test_a_fit_gives_the_verdict_that_is_expected():
    command = [sys.executable, str(SCRIPT), "--only", "published/paracord"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.slow
def test_all_other_fits_give_the_verdicts_that_are_expected(script):
    command = [sys.executable, str(SCRIPT), "--only", *(name for name in script.TABLES if name != "published/paracord")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    assert (done.returncode, done.stderr) == (0, "")
