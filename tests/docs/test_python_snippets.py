"""The Python that the pages show runs in a notebook, prints little there, and means something to a strict type checker."""

import ast
import inspect
import json
import os
import pydoc
import re
import shutil
import subprocess
import sys

import nbclient
import nbformat
import pytest
from conftest import ROOT

import bowdenfit
from bowdenfit.reading import Reading

pytestmark = pytest.mark.extended

MOST_TEXT = 2000  # characters of one output
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "notebooks").glob("*.md")])
CELL = re.compile(r"^```(?:python|\{code-cell\}[^\n]*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
OF_JAX = ROOT / "docs" / "model.md"  # whose functions, and BlackJAX's, a strict type checker knows only in part
IN_A_KERNEL = (ROOT / "README.md", ROOT / "docs" / "library.md")
PROGRAMS = {ROOT / "docs" / "fleets.md": "cable-01"}  # and what they print
CALIBRATING = """
from bowdenfit.stage_bar import show_progress_bar
from bowdenfit.questions.calibrate.verb import WATCH

with show_progress_bar(WATCH, None) as report:
    for n in range(200):
        report(n + 1, 200)
"""
CELLS = {page: CELL.findall(page.read_text(encoding="utf-8")) for page in PAGES}


def run_in_a_kernel(cells, monkeypatch, tmp_path):
    """A notebook of cells as it is after they were run in a folder with the data sets, and with the example of the README."""
    (tmp_path / "datasets").symlink_to(ROOT / "datasets")
    (tmp_path / "on-body-exoskeleton").symlink_to(ROOT / "datasets" / "on-body-exoskeleton")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    return notebook


def test_cells_of_the_pages_run_in_a_kernel_and_print_little(monkeypatch, tmp_path):
    cells = [cell for page in IN_A_KERNEL for cell in CELLS[page] if not is_program(cell)]
    shown = [statement for cell in cells for statement in statements(cell)]
    notebook = run_in_a_kernel([*shown, "fit.summary()", CALIBRATING], monkeypatch, tmp_path)
    by_cell = {cell.source: cell.outputs for cell in notebook.cells}
    for source, outputs in by_cell.items():
        for output in outputs:
            text = output.get("text") or output["data"]["text/plain"]
            assert len(text) <= MOST_TEXT, (source, text)
            assert output.get("name") != "stderr", text
    bar = next(outputs[0]["data"]["text/plain"] for source, outputs in by_cell.items() if "bf.fit(" in source)
    assert re.fullmatch(r"sampling with emcee \d+ steps, \d\d:\d\d, R-hat \d+\.\d{3}, \d+ effective draws", bar)
    assert by_cell[CALIBRATING][0]["data"]["text/plain"].startswith("calibrating: 100%") and len(by_cell[CALIBRATING]) == 1
    figures = [output for source, outputs in by_cell.items() if "fit.plot.efficiency()" in source for output in outputs]
    assert len(figures) == len(IN_A_KERNEL) and all("image/png" in figure["data"] for figure in figures)
    page = next(outputs[0]["data"]["text/html"] for source, outputs in by_cell.items() if source.startswith("fit  "))
    assert page.startswith("<p><b>On-body knee exoskeleton: cut the cable to 470 mm.</b></p>")


def is_program(cell):
    """Whether a cell stands in a file of its own, whose helpers import it again."""
    return '__name__ == "__main__"' in cell


def test_every_page_with_python_has_it_run():
    with_python = {page for page, cells in CELLS.items() if cells}
    notebooks = (ROOT / "docs" / "notebooks").glob("*.md")  # run when pages are built
    assert with_python == {*IN_A_KERNEL, OF_JAX, *PROGRAMS, *notebooks}
    assert {page for page, cells in CELLS.items() if any(map(is_program, cells))} == PROGRAMS.keys()
    assert all(page in IN_A_KERNEL or all(map(is_program, CELLS[page])) for page in PROGRAMS)


def test_the_model_is_differentiated_and_sampled_as_its_page_shows(monkeypatch, tmp_path):
    cells = [statement for cell in CELLS[OF_JAX] for statement in statements(cell)]
    notebook = run_in_a_kernel(cells, monkeypatch, tmp_path)
    of_draws = next(cell for cell in notebook.cells if cell.source.startswith("sum(draws)"))
    mean = re.search(r"\d\.\d+", of_draws.outputs[0]["data"]["text/plain"])
    assert mean and 0.17 < float(mean[0]) < 0.27  # the fit says 0.22, with a standard deviation of 0.03


@pytest.mark.parametrize("page", PROGRAMS, ids=lambda page: page.stem)
def test_programs_of_the_pages_run_by_themselves(page, tmp_path):
    """Programs whose helpers import them again cannot be run in a kernel; of the fleet they get two inspections."""
    (tmp_path / "datasets").symlink_to(ROOT / "datasets")
    fleet = shutil.copytree(ROOT / "datasets" / "synthetic-fleet", tmp_path / "synthetic-fleet") / "fleet.csv"
    fleet.write_text("".join(fleet.read_text().splitlines(keepends=True)[:3]))
    for i, cell in enumerate(filter(is_program, CELLS[page])):
        (tmp_path / f"program_{i}.py").write_text(cell, encoding="utf-8")
        command = [sys.executable, f"program_{i}.py"]
        variables = {**os.environ, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(command, cwd=tmp_path, env=variables, capture_output=True, text=True, check=False, timeout=300)
        assert done.returncode == 0, done.stderr
        assert PROGRAMS[page] in done.stdout and len(done.stdout) <= MOST_TEXT


def statements(cell):
    """The statements of a cell one by one, so that each shows what it gives."""
    lines = cell.split("\n")
    return ["\n".join(lines[node.lineno - 1 : node.end_lineno]) for node in ast.parse(cell).body]


def test_snippets_have_no_error_of_types_and_a_misspelt_keyword_is_one(tmp_path):
    for page, cells in [(page, cells) for page, cells in CELLS.items() if page != OF_JAX]:
        files = ["\n".join(cell for cell in cells if not is_program(cell)), *filter(is_program, cells)]
        for i, text in enumerate(files):
            if text:
                (tmp_path / f"{page.stem.replace('-', '_')}_{i}.py").write_text(text, encoding="utf-8")
    (tmp_path / "misspelt.py").write_text('import bowdenfit as bf\n\nbf.fit("bench", sede=1)\n', encoding="utf-8")
    (tmp_path / "no_such_name.py").write_text('import bowdenfit as bf\n\nbf.fitt("bench")\n', encoding="utf-8")
    settings = {"typeCheckingMode": "strict", "extraPaths": [str(ROOT)], "reportUnusedExpression": False}  # as notebooks have
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    command = [sys.executable, "-m", "basedpyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(tmp_path)]
    document = json.loads(subprocess.run(command, capture_output=True, text=True, check=False).stdout)
    assert document["summary"]["filesAnalyzed"] >= 2 + 3 + 2  # README and guides, notebooks, and the two that are wrong
    errors = [diagnostic for diagnostic in document["generalDiagnostics"] if diagnostic["severity"] == "error"]
    complaints = [(error["file"].rpartition("/")[2], error["message"]) for error in errors]
    assert ("misspelt.py", 'No parameter named "sede"') in complaints
    assert {file for file, _ in complaints} == {"misspelt.py", "no_such_name.py"}
    assert [file for file, _ in complaints].count("misspelt.py") == 1


def test_a_misspelt_keyword_is_refused_by_name_with_the_nearest():
    for verb in (bowdenfit.fit, bowdenfit.read, bowdenfit.check, bowdenfit.calibrate, bowdenfit.identify):
        with pytest.raises(bowdenfit.UsageError, match="no keyword 'chanels'; did you mean 'channels'"):
            verb("datasets/on-body-exoskeleton", chanels=("a",))
    with pytest.raises(bowdenfit.UsageError, match="did you mean 'seed'"):
        bowdenfit.fit("datasets/on-body-exoskeleton", sede=1)


def test_help_shows_every_keyword_by_name_and_none_of_its_options():
    functions = {name: getattr(bowdenfit, name) for name in bowdenfit.__all__ if inspect.isroutine(getattr(bowdenfit, name))}
    assert set(functions) >= {"fit", "read", "check", "predict", "calibrate"}
    for name, function in functions.items():
        text = pydoc.plain(pydoc.render_doc(function))
        assert "Parameter(" not in text and "Reader(" not in text and "Annotated" not in text and "**reading" not in text, name
    for name in ("fit", "read", "check", "identify", "calibrate"):
        assert set(Reading.__annotations__) < set(inspect.signature(functions[name]).parameters)
    assert "seed: int | None = None" in pydoc.plain(pydoc.render_doc(bowdenfit.fit))


def test_the_package_says_that_it_has_types():
    assert (ROOT / "bowdenfit" / "py.typed").exists()
