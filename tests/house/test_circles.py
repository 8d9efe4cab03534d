"""No file of the package imports, by however many steps, a file that imports it: lazy imports and those for types count."""

import ast
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "bowdenfit"


def modules() -> dict[str, Path]:
    """Every file of the package by the name it is imported by."""
    paths = {path.relative_to(PACKAGE.parent).with_suffix(""): path for path in PACKAGE.rglob("*.py")}
    return {".".join(p.parts).removesuffix(".__init__"): path for p, path in paths.items()}


def imported(path: Path, modules_by_name: dict[str, Path]) -> set[str]:
    """Names of the package's files that a file imports, anywhere in it."""
    result: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            result |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports by a relative name"
            # A name may be a file of its own; otherwise it is something inside the file.
            result |= {name if (name := f"{node.module}.{a.name}") in modules_by_name else str(node.module) for a in node.names}
    return result & set(modules_by_name)


def circles(arrows: dict[str, set[str]]) -> list[set[str]]:
    """Groups of nodes that reach each other, and single ones that reach themselves, along arrows."""
    reached = {node: _reached(node, arrows) for node in arrows}
    groups = {frozenset(b for b in reached[a] if a in reached[b]) for a in arrows}
    return [set(group) for group in groups if group]


def _reached(start: str, arrows: dict[str, set[str]]) -> set[str]:
    """Nodes at the end of any path of one step or more."""
    result: set[str] = set()
    todo = list(arrows[start])
    while todo:
        node = todo.pop()
        if node not in result:
            result.add(node)
            todo += arrows[node]
    return result


def test_circles_are_found():
    result = circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"d"}, "e": set()})
    assert sorted(map(sorted, result)) == [["b", "c"], ["d"]]


def test_no_files_import_each_other():
    modules_by_name = modules()
    arrows = {name: imported(path, modules_by_name) for name, path in modules_by_name.items()}
    assert [sorted(group) for group in circles(arrows)] == []
