"""The house stays readable: no function longer than a page, and tests lie as what they test does."""

import ast

import pytest
from conftest import ROOT

LONGEST = 60  # lines, docstring included


def test_no_function_is_longer_than_a_page():
    long = [
        f"{path.relative_to(ROOT)}, {node.name}: {node.end_lineno - node.lineno + 1}"
        for path in (ROOT / "bowdenfit").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.end_lineno - node.lineno >= LONGEST
    ]
    assert not long


@pytest.mark.parametrize("room", ["questions", "kinds"])
def test_tests_lie_in_folders_of_the_names_of_what_they_test(room):
    for folder in {path.parent for path in (ROOT / "tests" / room).glob("*/test_*.py")}:
        assert (ROOT / "bowdenfit" / room / folder.name).is_dir(), folder
