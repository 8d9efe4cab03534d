"""The retired private language stays retired: in names, and in sentences that users read (docs/glossary.md has the words)."""

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MODULES = {str(path.relative_to(ROOT)): ast.parse(path.read_text("utf-8")) for path in (ROOT / "bowdenfit").rglob("*.py")}
BESIDES = {
    str(path.relative_to(ROOT)): ast.parse(path.read_text("utf-8"))
    for folder in ("tests", "scripts")
    for path in (ROOT / folder).rglob("*.py")
}
# Names that say nothing of the thing; as names of what other modules see, and of variables.
PUBLIC = {"found", "told", "said", "asked", "given", "mine", "begun", "each", "drawn"}
LOCAL = {"found", "told", "said", "asked", "mine"}
POINTING = {  # pronouns and adverbs: right in a sentence, and no name for a thing
    *("at", "before", "beside", "here", "kept", "known", "one", "others", "own", "since", "stated", "what", "where", "why"),
}
CEILINGS = {  # variables of each folder that still have such a name: lower them whenever there are fewer
    "bowdenfit": {"retired": 4, "pointing": 848},
    "tests": {"retired": 0, "pointing": 0},
    "scripts": {"retired": 0, "pointing": 0},
}
RETIRED = {  # in sentences, with what is said instead
    r"\bhang(s|ing)? together": "are correlated",
    r"\b(leans?|leant|leaning) on\b": "influential: the answer would change without it",
    r"\b(has|have|had) (not )?(yet )?settled": "converged",
    r"\bless p\b|\b(measured|estimate) less\b": "minus",
    r"\btold (by|from|apart)\b|\bhardly tells?\b|\bnot tell\b": "determined by, separated from",
    r"\bnobody (says|knows)\b": "is not stated, is not known",
    r"\bhands off\b": "without a hand on the device",
    r"\bunlike the rest\b": "is an outlier",
    r"\bsays? nothing of\b": "says nothing about",
    r"\bstands twice\b": "appears twice",
    r"\bhold(s)? the truth as often\b": "contain the truth as often",
    r"\bNone of 1\b|\breadings? (is|are) off\b": "is an outlier",
    r"\bhow far the fit\b|\bunknowns\b": "influential, parameters",
    r"\bworth \S+ independent": "effective sample size",
    r"(?<!\bthere )\b(is|are) no (whole number|number|length|stroke|parameter|folder|unit|text)s?\b": "is not a, must be a",
}
ANY = re.compile("|".join(RETIRED))


def test_no_module_class_function_parameter_or_field_has_a_retired_name():
    assert not sorted(set(_public_names()))


def test_no_variable_has_a_retired_name():
    assert not sorted({f"{place}, line {line}: {name}" for place, line, name in _variables(MODULES) if name in LOCAL})


def test_no_function_or_class_of_tests_and_scripts_has_a_retired_name():
    named = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    nodes = ((place, node) for place, module in BESIDES.items() for node in ast.walk(module) if isinstance(node, named))
    retired = (PUBLIC | POINTING) - {"at"}  # what every curve calls its value at a length
    assert not sorted(f"{place}, line {node.lineno}: {node.name}" for place, node in nodes if node.name in retired)


@pytest.mark.parametrize("folder", CEILINGS)
def test_variables_with_retired_or_pointing_names_only_become_fewer(folder):
    modules = {place: module for place, module in (MODULES | BESIDES).items() if Path(place).parts[0] == folder}
    variables = sorted(_variables(modules))
    for kind, names in (("retired", PUBLIC | {"rest"}), ("pointing", POINTING)):
        worst = [f"{place}, line {line}: {name}" for place, line, name in variables if name in names]
        assert len(worst) <= CEILINGS[folder][kind], f"{len(worst)} {kind} names:\n" + "\n".join(worst)


def test_no_two_public_classes_share_a_name():
    places: dict[str, list[str]] = {}
    for place, node in _nodes():
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            places.setdefault(node.name, []).append(place)
    assert not {name: there for name, there in places.items() if len(there) > 1}


def test_no_sentence_has_a_retired_phrase():
    wrong = [
        f"{place}, line {line}: {phrase[0]!r} (say: {instead})"
        for place, line, text in _sentences()
        if ANY.search(" ".join(text.split()))
        for pattern, instead in RETIRED.items()
        if (phrase := re.search(pattern, " ".join(text.split())))
    ]
    assert not wrong, "\n".join(wrong)


def _nodes() -> Iterator[tuple[str, ast.AST]]:
    """Every node of every module, with its place."""
    return ((place, node) for place, module in MODULES.items() for node in ast.walk(module))


def _public_names() -> Iterator[str]:
    """Retired names of what other modules see, each with its place."""
    yield from (place for place in MODULES if PUBLIC & set(Path(place).with_suffix("").parts))
    for place, node in _nodes():
        names = []
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names.append(node.name)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not node.name.startswith("_"):
            parameters = node.args
            names += [p.arg for p in (*parameters.posonlyargs, *parameters.args, *parameters.kwonlyargs)]
        if isinstance(node, ast.ClassDef):
            fields = (line.target for line in node.body if isinstance(line, ast.AnnAssign))
            names += [field.id for field in fields if isinstance(field, ast.Name)]
        yield from (f"{place}, line {node.lineno}: {name}" for name in names if name in PUBLIC)  # type: ignore[attr-defined]


def _variables(modules: Mapping[str, ast.Module]) -> Iterator[tuple[str, int, str]]:
    """Place, line and name of everything that is assigned, looped over or passed in."""
    for place, node in ((place, node) for place, module in modules.items() for node in ast.walk(module)):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield place, node.lineno, node.id
        if isinstance(node, ast.arg):
            yield place, node.lineno, node.arg


def _sentences() -> Iterator[tuple[str, int, str]]:
    """Place, line and text of strings that users may read: all but docstrings of modules, classes and functions."""
    for place, module in MODULES.items():
        silent = {id(statement.value) for statement in ast.walk(module) if isinstance(statement, ast.Expr)}
        silent |= {id(part) for node in ast.walk(module) if isinstance(node, ast.JoinedStr) for part in node.values}
        for node in ast.walk(module):
            if isinstance(node, ast.JoinedStr):
                yield place, node.lineno, "".join(_text_of_part(part) for part in node.values)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in silent:
                yield place, node.lineno, node.value
        yield from _help_texts(place, module)


def _text_of_part(part: ast.expr) -> str:
    return str(part.value) if isinstance(part, ast.Constant) else "{}"


def _help_texts(place: str, module: ast.Module) -> Iterator[tuple[str, int, str]]:
    """Docstrings of functions of a module `verb`, which are the help of the command line."""
    for node in module.body if Path(place).stem == "verb" else ():
        if isinstance(node, ast.FunctionDef) and (text := ast.get_docstring(node)):
            yield place, node.lineno, text
