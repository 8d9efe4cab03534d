"""The page that compares every number of both papers: it fails where a number no longer comes out."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "papers.py"


@pytest.fixture(scope="module")
def papers():
    spec = importlib.util.spec_from_file_location("papers", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules["papers"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["papers"]


@pytest.mark.parametrize(
    ("printed", "result", "agrees"),
    [("475", "475.25", True), ("-8.25", "-8.3", True), ("5902", "5893.3", False), ("1.8", "1.92", False)],
)
def test_numbers_agree_within_the_rounding_of_both(papers, printed, result, agrees):
    assert papers.agree(printed, result) == agrees


def test_a_row_that_comes_out_otherwise_than_it_says_is_a_fault(papers):
    numbers = (("72.59", "430 mm ([0-9.]+)"),)
    right, wrong = (papers.Row("figure 9", "72.59 %", "-", f"430 mm {n} %", numbers) for n in ("72.59", "71.02"))
    assert (right.verdict, right.fault) == ("yes", "")
    assert wrong.fault == "figure 9: 72.59 printed, 71.02 found"
    explained = papers.Row("figure 9", "72.59 %", "-", "430 mm 71.02 %", numbers, "it is another cable")
    assert explained.verdict == "**72.59 (71.02): no**; it is another cable"
    assert not explained.fault
    assert papers.Row("figure 9", "72.59 %", "-", "430 mm 72.59 %", numbers, "it is another cable").fault


@pytest.mark.extended
def test_the_numbers_of_the_on_body_paper_come_out_as_the_page_says():
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--only", "on-body"], capture_output=True, text=True, check=False, timeout=300
    )
    assert (done.returncode, done.stderr) == (0, "")
