"""The entries under `Args:` are the parameters of a function, or the fields of a dataclass, whatever has been renamed."""

import ast
import re

import pytest
from conftest import ROOT

PACKAGE = ROOT / "bowdenfit"
_ENTRY = re.compile(r" {4}(?P<names>\*{0,2}\w+(?:, \w+)*): ")


def documented(docstring: str) -> set[str]:
    """Names under `Args:` in a docstring."""
    _, computed, below = docstring.partition("Args:\n")
    block = re.split(r"\n(?=\S)", below)[0] if computed else ""
    entries = (_ENTRY.match(line) for line in block.splitlines())
    return {name.strip(" *") for entry in entries if entry for name in entry["names"].split(",")}


def declared(node: ast.FunctionDef | ast.ClassDef) -> set[str] | None:
    """Parameters of a function, or fields of a dataclass; None of any other class."""
    if isinstance(node, ast.FunctionDef):
        every = node.args
        named = [*every.posonlyargs, *every.args, *every.kwonlyargs, every.vararg, every.kwarg]
        return {argument.arg for argument in named if argument}
    if not any("dataclass" in ast.unparse(decorator) for decorator in node.decorator_list):
        return None
    return {item.target.id for item in node.body if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)}


@pytest.mark.parametrize("room", sorted(path.name for path in PACKAGE.iterdir() if path.suffix == ".py" or path.is_dir()))
def test_args_entries_name_what_is_declared(room):
    paths = [PACKAGE / room] if room.endswith(".py") else sorted((PACKAGE / room).rglob("*.py"))
    stale = []
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and (names := declared(node)):
                unknown = documented(ast.get_docstring(node) or "") - names
                stale += [f"{path.relative_to(ROOT)}, {node.name}: {name}" for name in sorted(unknown)]
    assert not stale, "\n".join(stale)
