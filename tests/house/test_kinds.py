"""Nobody outside kinds/ knows which kinds of measurement there are: what is said of one is a method of that kind."""

import ast
from pathlib import Path

import bowdenfit
from bowdenfit.kinds import KINDS

PACKAGE = Path(bowdenfit.__file__).parent


def kinds_named(tree: ast.Module) -> set[str]:
    """Kinds that code names as a whole string, or by a class or a folder that it imports; no attribute is called so."""
    documentation = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    words, classes = set[str](), {kind.table.__name__: name for name, kind in KINDS.items()}
    for node in ast.walk(tree):
        match node:
            case ast.Constant(value=str(text)) if id(node) not in documentation:
                words.add(text)
            case ast.alias(name=name) if name in classes:
                words.add(classes[name])
            case ast.ImportFrom(module=str(module)) if module.startswith("bowdenfit.kinds."):
                words.add(module.split(".")[2])
    return words & set(KINDS)


def test_nobody_outside_kinds_names_three_kinds_of_measurement():
    files = {
        path.relative_to(PACKAGE).as_posix(): kinds
        for path in PACKAGE.rglob("*.py")
        if "kinds" not in path.relative_to(PACKAGE).parts
        and len(kinds := kinds_named(ast.parse(path.read_text(encoding="utf-8")))) >= 3
    }
    assert not files, {name: sorted(kinds) for name, kinds in files.items()}


def test_the_search_finds_names_of_kinds_wherever_code_may_have_them():
    code = '''
"""stretch"""
from bowdenfit.kinds.tables import LoopTable
from bowdenfit.recordings.recording import Recordings
def forces(): return tables["preload"], "a sentence on recordings"
'''
    assert kinds_named(ast.parse(code)) == {"loop", "preload", "recordings"}
