"""The house stays readable: no function longer than a page."""

import ast

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
