"""`init` without a terminal takes the options of `fit` for one file, and its folder is read as `fit` reads that file."""

import nbclient
import nbformat
import numpy as np
import pytest
from conftest import ROOT

import bowdenfit as bf
from bowdenfit.kinds import iterate_tables

TABLE = "Loops,Way,Hanging weight (N),Load cell\n" + "".join(
    f"{turns},{way},{force},{force * np.exp(-sign * 0.12 * turns * 2 * np.pi):.3f}\n"
    for turns in (0.25, 0.5)
    for way, sign in (("up", 1), ("down", -1))
    for force in (20.0, 40.0)
)
COLUMNS = ("wrap_angle=Loops:turn", "stroke=Way", "input_force=Hanging weight (N)", "output_force=Load cell:N")


def recording(folder):
    time = np.arange(0, 24, 0.02)
    force = 30 + 20 * np.sin(2 * np.pi * time / 6)
    output, state = np.empty_like(force), force[0]
    for i, value in enumerate(force):
        state = output[i] = min(max(state, value * np.exp(-0.3)), value * np.exp(0.3))
    rng = np.random.default_rng(1)
    rows = (f"{a + 0.05 * rng.normal():.3f},{b + 0.05 * rng.normal():.3f}\n" for a, b in zip(force, output, strict=True))
    (folder / "log.csv").write_text("ai0,ai1\n" + "".join(rows))
    return folder / "log.csv"


def arrays_of(dataset):
    """All numbers of all tables, flat."""
    tables = [vars(table) for _, table in iterate_tables(dataset.measurements)]
    return [value for table in tables for value in table.values() if isinstance(value, np.ndarray)]


def test_a_table_is_described_by_options_as_fit_reads_it(run, tmp_path):
    path = tmp_path / "post.csv"
    path.write_text(TABLE)
    named = [word for column in COLUMNS for word in ("--column", column)]
    code, out, _ = run("init", tmp_path / "cable", "--from", path, *named, "--set", 'noise="student"')
    assert code == 0
    assert f"Next: bowdenfit fit {tmp_path / 'cable'}" in out
    written, read = bf.read(tmp_path / "cable"), bf.read(path, columns=COLUMNS, settings=['noise="student"'])
    assert written.description == read.description
    for first, other in zip(arrays_of(written), arrays_of(read), strict=True):
        np.testing.assert_array_equal(first, other)


def test_a_recording_is_described_by_options_as_fit_reads_it(run, tmp_path):
    path, channels = recording(tmp_path), ("input_force=ai0:N", "output_force=ai1:N", "time=50Hz")
    named = [word for channel in channels for word in ("--channel", channel)]
    assert run("init", tmp_path / "cable", "--from", path, "--wrap-angle", "180deg", *named)[0] == 0
    (written,), (read,) = (
        next(table for kind, table in iterate_tables(dataset.measurements) if kind.name == "recordings").items
        for dataset in (bf.read(tmp_path / "cable"), bf.read(path, wrap_angle="180deg", channels=channels))
    )
    np.testing.assert_array_equal(written.blocks.output_force, read.blocks.output_force)
    assert written.strokes.exponent == pytest.approx(read.strokes.exponent)


def test_options_without_one_file_are_refused_and_write_nothing(run, tmp_path):
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "b.csv").write_text(TABLE)
    code, _, err = run("init", tmp_path / "cable", "--wrap-angle", "180deg")
    assert (code, "describe one measured file" in err) == (2, True)
    code, _, err = run("init", tmp_path / "cable", "--from", tmp_path / "a.csv", tmp_path / "b.csv", "--wrap-angle", "180deg")
    assert (code, "describe one file, and 2 are named" in err) == (2, True)
    code, _, err = run("init", tmp_path / "cable", "--from", tmp_path / "a.csv", "--column", "wrap_angle=Lops:turn")
    assert code == 2 and "Loops" in err
    assert not (tmp_path / "cable").exists()


@pytest.mark.parametrize("example", ["on-body-exoskeleton", "yarn-on-cylinder"])
def test_an_example_brings_a_notebook_that_fits_it(run, tmp_path, example):
    code, out, _ = run("init", "--example", example, tmp_path / "cable", "--notebook")
    assert (code, "first-fit.ipynb in Jupyter" in out) == (0, True)
    notebook = nbformat.read(tmp_path / "cable" / "first-fit.ipynb", as_version=4)
    nbformat.validate(notebook)
    cells = [cell.source for cell in notebook.cells if cell.cell_type == "code"]
    assert ("fit.optimal_length()" in cells) == (example == "on-body-exoskeleton")


@pytest.mark.extended
@pytest.mark.parametrize("example", ["on-body-exoskeleton", "yarn-on-cylinder"])
def test_the_notebook_of_an_example_runs_without_a_checkout(run, tmp_path, example, monkeypatch):
    run("init", "--example", example, tmp_path / "cable", "--notebook")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    notebook = nbformat.read(tmp_path / "cable" / "first-fit.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path / "cable")}}).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert all(output.output_type != "error" for output in outputs)
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 1


def test_a_notebook_goes_with_the_data_set_of_one_cable(run, tmp_path):
    code, _, err = run("init", "--example", "synthetic-fleet", tmp_path / "fleet", "--notebook")
    assert (code, "which the notebook fits" in err) == (2, True)
    code, _, err = run("init", tmp_path / "cable", "--notebook")
    assert (code, "goes with an example" in err) == (2, True)
    assert list(tmp_path.iterdir()) == []
