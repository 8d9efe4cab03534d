"""The scripts that a person runs are in CONTRIBUTING, and the faults that one of them puts into the package are noticed."""

import re
import runpy

import pytest
from conftest import ROOT

SEEDED = runpy.run_path(str(ROOT / "scripts" / "check_faults.py"))
FAULTS = {fault.description: fault for fault in SEEDED["FAULTS"]}


def test_every_script_that_is_run_by_hand_is_in_contributing():
    page = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    runnable = [path.name for path in (ROOT / "scripts").glob("*.py") if "__main__" in path.read_text("utf-8")]
    assert sorted(name for name in runnable if name not in page) == []


def test_every_script_that_contributing_names_exists():
    page = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    names = set(re.findall(r"(?:scripts/|`)((?:check|benchmark|certify|publish|compare|watch|papers|index)\w*\.py)", page))
    assert names
    assert sorted(name for name in names if not (ROOT / "scripts" / name).exists()) == []


@pytest.mark.parametrize("description", FAULTS)
def test_a_seeded_fault_has_its_place(description):
    fault = FAULTS[description]
    assert fault.wrong in SEEDED["replace_line"](fault, ROOT)
    assert all((ROOT / tests).exists() for tests in fault.tests)


@pytest.mark.slow
@pytest.mark.parametrize("description", FAULTS)
def test_default_tests_notice_a_seeded_fault(description, tmp_path):
    assert SEEDED["noticed_by"](FAULTS[description], SEEDED["copy_tree"](tmp_path / "copy"))
