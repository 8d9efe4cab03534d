"""Whatever the library hands out shows itself: a few lines in a console, the answer first in a notebook, a table for pandas."""

import ast
import importlib
import inspect
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from IPython.lib.pretty import pretty

import bowdenfit as bf
import bowdenfit.questions.calibrate.words
from bowdenfit.display import (
    Display,
    Legend,
    Preformatted,
    ResultTable,
    Title,
    render_html,
    render_text,
    separate,
    shorten_lines,
)
from bowdenfit.finished_fit import FigureMethods
from bowdenfit.questions.calibrate.answer import Calibration, CheckedQuantity, Coverage
from bowdenfit.questions.summary.verdict import CONTRADICTORY, NOT_CONVERGED, Verdict
from bowdenfit.results.record import Record

pytestmark = pytest.mark.extended

MOST_LINES, MOST_BYTES, MOST_IN_A_NOTEBOOK = 10, 1000, 2000
PLAIN_ROOMS = ("bowdenfit.inference", "bowdenfit.parameters", "bowdenfit.cable", "bowdenfit.kinds")
PLAIN = {np.ndarray, str, bool, NoneType, Path, FigureMethods, dict[str, Any]}  # a JSON Schema, and what needs no page


def known_to(module) -> dict[str, Any]:
    """Names of a module, with those that it imports for type checkers alone."""
    names = dict(vars(module))
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {
                a.asname or a.name: getattr(importlib.import_module(node.module), a.name, None) for a in node.names
            }
    return names


def returned(function) -> Any:
    """What a function or property says that it gives."""
    function = inspect.unwrap(getattr(function, "fget", None) or getattr(function, "func", None) or function)
    return get_type_hints(function, known_to(inspect.getmodule(function))).get("return", NoneType)


def parts(hint: Any) -> Iterator[Any]:
    """The types that a type may be."""
    origin = get_origin(hint)
    if origin in (None, tuple, list, dict):
        yield hint
    else:
        for part in get_args(hint):
            yield from parts(part)


def public_functions() -> Iterator[tuple[str, Any]]:
    """Functions of the package, and methods and properties of a fit."""
    for name in dir(bf):
        if not inspect.isclass(getattr(bf, name)):
            yield f"bf.{name}", getattr(bf, name)
    for name in dir(bf.Fit):
        value = inspect.getattr_static(bf.Fit, name)
        if not name.startswith("_") and (callable(value) or hasattr(value, "func") or hasattr(value, "fget")):
            yield f"fit.{name}", value.__func__ if isinstance(value, classmethod) else value


RESULTS = {name: list(parts(returned(function))) for name, function in public_functions()}
CLASSES = sorted({part for every in RESULTS.values() for part in every} - PLAIN, key=str)


def test_the_public_functions_are_found_with_what_they_return():
    names = {part.__name__ for part in CLASSES if isinstance(part, type)}
    assert names >= {
        "Calibration", "Checks", "Comparison", "Draws", "Efficiencies", "ElasticAnswers", "Files", "Fit", "Groups",
        "Identifiability", "Interval", "NextMeasurement", "OptimalLength", "Predictions", "Report", "Summary", "Verdict",
    }  # fmt: skip


@pytest.mark.parametrize("result", CLASSES, ids=lambda part: getattr(part, "__name__", str(part)))
def test_every_public_result_shows_itself(result):
    assert isinstance(result, type), (
        f"{result} is no class of its own; {[n for n, p in RESULTS.items() if result in p]}"
    )
    if result.__module__.startswith("bowdenfit"):
        assert issubclass(result, Display)
        assert result.__repr__ is Display.__repr__, "its dataclass writes its own; decorate it with repr=False"
        assert result._repr_html_ is Display._repr_html_


def test_what_makes_an_answer_loads_its_words():
    """Else an answer would show itself without them where nothing else has loaded them: what loads lazily does not count."""
    package = Path(bf.__file__).parent
    words = [path for path in package.rglob("words.py") if "@blocks_of.register" in path.read_text(encoding="utf-8")]
    assert len(words) >= 4
    for path in words:
        name = ".".join(("bowdenfit", *path.relative_to(package).with_suffix("").parts))
        makers = [other for other in path.parent.glob("*.py") if other.name not in {"words.py", "verb.py", "figures.py"}]
        loaded = {module for maker in makers for node in ast.walk(ast.parse(maker.read_text())) for module in imported(node)}
        assert name in loaded, f"{path.parent.name} answers with words that nothing has loaded"


def test_a_comparison_shows_its_words(answers):
    assert repr(answers["compare"]).startswith("The data cannot distinguish a from b: ")


def imported(node) -> list[str]:
    """Modules that a line imports."""
    if isinstance(node, ast.ImportFrom):
        return [node.module or ""]
    return [item.name for item in node.names] if isinstance(node, ast.Import) else []


class Tags(HTMLParser):
    """Checks that tags are closed in order."""

    def __init__(self):
        super().__init__()
        self.open = []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def look_at(value: Any) -> None:
    """Asserts that something is short in a notebook and, if it is a result, begins with its answer and has a table.

    What xarray shows, a tree of all draws for ArviZ, is its own matter.
    """
    if type(value).__module__.startswith("xarray"):
        return
    assert len(pretty(value)) <= MOST_IN_A_NOTEBOOK
    if not isinstance(value, Display):
        return
    text, page = repr(value), value._repr_html_()
    assert text.strip() and len(text.splitlines()) <= MOST_LINES and len(text.encode()) <= MOST_BYTES
    assert "object at 0x" not in text and "array(" not in text
    tags = Tags()
    tags.feed(page)
    assert tags.open == [] and page.startswith(("<p><b>", "<h4>"))
    assert isinstance(value.to_frame().attrs["units"], dict)


def is_plain(value: Any) -> bool:
    """Whether a class of ours computes or is a table of readings, and is displayed by `dataclass`."""
    return type(value).__module__.startswith(PLAIN_ROOMS) and not isinstance(value, Display)


def reachable(value: Any, name: str, seen: dict[int, Any]) -> Iterator[tuple[str, Any]]:
    """Something, and all that attributes and indices lead to from there.

    Arrays and trees, which NumPy and xarray show in their own way, and plain classes are where it ends; so is the fit that an
    answer holds, which is a copy without answers of its own.
    """
    of_library = isinstance(value, np.ndarray) or type(value).__module__.startswith("xarray")
    if id(value) in seen or of_library or is_plain(value) or (seen and isinstance(value, Record)):
        return
    seen[id(value)] = value
    yield name, value
    if isinstance(value, dict | list | tuple):
        for key, item in list(value.items() if isinstance(value, dict) else enumerate(value))[:3]:
            yield from reachable(item, f"{name}[{key!r}]", seen)
    if not type(value).__module__.startswith("bowdenfit"):
        return
    for key in dir(value):
        if key.startswith(("_", "model_")):  # those are pydantic's
            continue
        try:
            item = getattr(value, key)
        except (AttributeError, bf.BowdenfitError):  # which says what there is not
            continue
        if not inspect.isroutine(item) and not inspect.isclass(item):
            yield from reachable(item, f"{name}.{key}", seen)


def look_inside(value: Any, name: str) -> int:
    """Asserts that all results that can be reached from there are short in a notebook; how much is reached."""
    seen: dict[int, Any] = {}
    for location, item in reachable(value, name, seen):
        if isinstance(item, Display):
            assert len(pretty(item)) <= MOST_IN_A_NOTEBOOK, f"{location}: {pretty(item)[:300]}"
            assert len(repr(item).splitlines()) <= MOST_LINES, f"{location}: {item!r}"
            assert item._repr_html_() and (location.endswith("elastic") or "units" in item.to_frame().attrs), location
    return len(seen)


def answers_of(fit: bf.Fit) -> Iterator[tuple[str, Any]]:
    """All that a fit gives to one who says nothing more."""
    for name in dir(fit):
        if name.startswith("_") or name in {"to_frame", "plot"}:
            continue
        value = getattr(fit, name)
        if inspect.ismethod(value):
            needed = [p for p in inspect.signature(value).parameters.values() if p.default is p.empty]
            if needed:
                continue
            value = value()
        yield name, value


@pytest.fixture(scope="module")
def fit(quick_fit):
    return quick_fit


@pytest.fixture(scope="module")
def answers(fit):
    """What verbs answer to one who says nothing more, by their names; no test changes it."""
    verbs = {"identify": bf.identify, "next": bf.next_measurement, "predict": bf.predict}
    return {"compare": bf.compare({"a": fit, "b": fit}), **{name: verb(fit) for name, verb in verbs.items()}}


def test_what_a_fit_gives_is_short_and_begins_with_the_answer(fit):
    seen = {}
    for name, value in answers_of(fit):
        if name != "elastic":  # of which a cable with several contacts has no table
            look_at(value)
        seen[name] = value
    assert {"verdict", "optimal_length", "posterior", "known", "checks", "summary", "least_squares"} <= set(seen)
    within = (
        fit.parameter("mu1"), fit.dataset.description, fit.dataset.measurements, fit.efficiency([]),
    )  # fmt: skip
    for value in (fit, fit.plot, *within):
        look_at(value)
    assert repr(fit).startswith("On-body knee exoskeleton: cut the cable to 470 mm.\n")
    assert repr(fit.verdict()).startswith("You can trust this: ")
    assert "to_frame" in dir(fit) and "draws" in repr(fit.posterior)


def test_what_the_verbs_answer_is_short_and_begins_with_the_answer(fit, answers, on_body, tmp_path):
    remaining = (
        bf.predict(fit, [455]), bf.check(on_body), bf.read(on_body), fit.efficiency([455, 465.5]),
        bf.plot(fit, tmp_path, figures=["efficiency"]),
    )  # fmt: skip
    for answer in (*answers.values(), *remaining):
        look_at(answer)
    assert (
        bf.check(on_body)._repr_html_().startswith("<h4>On-body knee exoskeleton</h4><p><b>Everything could be read.")
    )
    assert bf.predict(fit, [455])[0]["mean"] == pytest.approx(fit.efficiency(455)[0].mean)


def test_all_that_can_be_reached_from_a_result_is_short(fit, answers):
    for name, value in {
        "fit": fit,
        "summary": fit.summary(),
        "optimal_length": fit.optimal_length(),
        **answers,
    }.items():
        assert look_inside(value, name) > 3
    assert look_inside(bf.read("datasets/synthetic-recordings"), "read") > 100
    assert list(answers["compare"].predictions) == ["a", "b"]


def test_efficiencies_say_where_the_curves_do_not_hold(fit):
    outcome = fit.efficiency([470, 550])
    assert [row["in_range"] for row in outcome.rows] == [True, False]
    assert "inside the curves" in str(outcome) and "550 mm: outside the curves, 430 to 530 mm: by the wrap" in str(outcome)
    for nothing in ([np.nan], "455mm", [None], ["a"]):
        with pytest.raises(bf.UsageError, match=r"must be numbers in the unit of the route, such as \[455, 470\]"):
            fit.efficiency(nothing)


def test_tables_have_the_units_of_what_stands_in_them(fit, answers):
    assert fit.optimal_length().to_frame().attrs["units"]["cable_length"] == "mm"
    frame = fit.posterior.to_frame()
    np.testing.assert_array_equal(frame["mu1"], fit.posterior.values["mu1"].ravel())
    assert frame.attrs["units"].items() >= {"mu1": "1", "optimal_length": "mm", "sigma_theta": "deg"}.items()
    rows = fit.to_frame().set_index("parameter")
    assert rows.loc["mu1", "median"] == fit.parameter("mu1").median
    assert fit.least_squares.to_frame().attrs["units"]["sigma_theta"] == "deg"
    predicted = bf.predict(fit, [455], (100, "N")).to_frame()
    assert predicted.attrs["units"].items() >= {"cable_length_mm": "mm", "output_force_N": "N", "q95": "N"}.items()
    assert answers["next"].to_frame().attrs["units"]["sd"] == "mm"
    assert answers["identify"].to_frame().attrs["units"]["mu1"] == "1"
    assert set(fit.efficiency([455, 465]).to_frame()["cable_length_mm"]) == {455.0, 465.0}


def test_a_fit_without_draws_says_in_a_sentence_what_it_has_not(on_body_squares):
    fit = on_body_squares
    assert fit.sampled is None
    with pytest.raises(bf.UsageError, match="fit again without --no-mcmc"):
        fit.posterior.values["mu1"]
    look_at(fit)
    look_at(fit.verdict())
    assert "least squares alone" in repr(fit.verdict())


def test_stretch_and_preload_have_a_table(least_squares_of):
    fit = least_squares_of("synthetic-haptic-loop")
    look_at(fit.elastic)
    assert look_inside(fit, "fit") > 100
    look_at(fit.elastic.preload_window((0.0, 3.0)))
    table = fit.elastic.to_frame()
    assert {"preload", "preload_q95", "stiffness"} <= set(table) and table.attrs["units"]["stiffness"] == "N/mm"


def test_a_calibration_begins_with_its_verdict():
    held = (Coverage(0.5, 0.51, 0.4, 0.6), Coverage(0.9, 0.88, 0.8, 0.97))
    checked = CheckedQuantity("mu", r"$\mu$", (0.5,) * 30, 0.4, 0.8, held, 0.02, 0.1, 0.9)
    outcome = Calibration("Bench", (), 1, 30, (checked,), {}, {}, 0.1)
    look_at(outcome)
    assert repr(outcome).startswith("CALIBRATED: ") and outcome.to_frame()["held_90"][0] == 0.88


def test_what_is_not_to_be_trusted_says_so_first():
    verdict = Verdict({NOT_CONVERGED: ("R-hat is 1.2",), CONTRADICTORY: ("a <b>bold</b> run & another disagree",)})
    assert repr(verdict).startswith("DO NOT USE THESE NUMBERS: ")
    assert verdict._repr_html_().startswith("<p><b>DO NOT USE THESE NUMBERS: ")
    assert "a &lt;b&gt;bold&lt;/b&gt; run &amp; another" in verdict._repr_html_()
    assert list(verdict.to_frame()["trouble"]) == [NOT_CONVERGED, CONTRADICTORY]


def test_what_is_long_is_cut_with_a_word_on_how_to_see_the_rest():
    text = "\n".join(f"line {i} {'x' * 200}" for i in range(50))
    lines = shorten_lines(text).splitlines()
    assert len(lines) == MOST_LINES and all(len(line) <= 90 for line in lines)
    assert lines[-1] == "... and 41 more lines; print() shows them."
    assert shorten_lines("a\nb") == "a\nb"


def test_text_and_html_are_made_from_the_same_blocks():
    rows = [("mu1", "0.084", "sheath\nand rope"), ("tau", "1.0", "scatter <1>")]
    blocks = [
        *separate(
            [Title("Bench"), "Cut it.", "Then wait."],
            ["How it went", ResultTable(("", "value", ""), rows, left=("",)), "and 3 more"],
            ["", *[]],
            ["- one & two", "- three", Legend({"mu1": "friction", "x": ""}), Legend({})],
            [Preformatted("a\n  b")],
        ),
    ]
    assert render_text(blocks) == (
        "Bench\n=====\nCut it.\nThen wait.\n\nHow it went\n     value\n----------\nmu1  0.084  sheath\n            and rope\n"
        "tau    1.0  scatter <1>\nand 3 more\n\n- one & two\n- three\nmu1: friction\n\na\n  b\n"
    )
    page = render_html(blocks)
    assert page.startswith("<h4>Bench</h4><p><b>Cut it.</b></p><p>Then wait.</p><p>How it went</p><table>")
    assert page.count("<th>") == 3 and page.count("<tr>") == 3
    assert ">sheath and rope</td>" in page and ">scatter &lt;1&gt;</td>" in page
    assert "</table><p>and 3 more</p><ul><li>one &amp; two</li><li>three</li></ul><ul><li>mu1: friction</li></ul>" in page
    assert page.endswith("<pre>a\n  b</pre>")
