"""What is asked most of a finished fit is read back: quickly, exactly as it would be worked out, and of that fit alone."""

import inspect
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from forged_fits import edit_sealed

import bowdenfit as bf
from bowdenfit.questions import figures
from bowdenfit.questions.figures import FIGURES, collect_figure_data, read_figure_data
from bowdenfit.questions.length.verb import VERB as LENGTH
from bowdenfit.questions.predict.verb import VERB as PREDICT
from bowdenfit.questions.summary import figure_files
from bowdenfit.results import answer_cache
from bowdenfit.results.answer_cache import SCHEMA, read_answers, write_answers
from bowdenfit.results.folder import ANSWERS, FIGURE_DATA
from bowdenfit.results.folder import FIGURES as FIGURES_FOLDER
from bowdenfit.results.serialization import serialize

HEAVY = {
    "jax",
    "scipy",
    "pandas",
    "xarray",
    "arviz_base",
    "arviz_stats",
    "matplotlib",
    "pydantic",
    "pint",
    "h5py",
    "h5netcdf",
}
REFUSING = """
import sys

refused = set(sys.argv[1].split(","))

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in refused:
            raise SystemExit(f"{name} was imported")

sys.meta_path.insert(0, Refuse())
from bowdenfit.cli import main
sys.argv[0:2] = ["bowdenfit"]
main()
"""


@pytest.fixture(scope="module")
def results(quick_results):
    """A quick, converged fit with everything in its folder."""
    return quick_results


@pytest.fixture(scope="module")
def bare(results, tmp_path_factory):
    """The same folder, as if nothing had been kept."""
    copy = shutil.copytree(results, tmp_path_factory.mktemp("bare") / "fit")
    (copy / ANSWERS).unlink()
    (copy / FIGURE_DATA).unlink()
    return copy


@pytest.fixture(scope="module")
def undrawn(results, tmp_path_factory):
    """The same folder without its figures."""
    copy = shutil.copytree(results, tmp_path_factory.mktemp("undrawn") / "fit")
    shutil.rmtree(copy / FIGURES_FOLDER)
    return copy


def without(heavy, *arguments):
    """The command line in a process of its own, in which some libraries cannot be imported."""
    command = [sys.executable, "-c", REFUSING, ",".join(sorted(heavy)), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "arguments",
    [
        ("summary", "RESULTS"),
        ("summary", "RESULTS", "--json"),
        ("length", "RESULTS"),
        ("length", "RESULTS", "--json"),
        ("predict", "RESULTS"),
        ("predict", "RESULTS", "450", "470", "--json"),
        ("identify", "RESULTS"),
    ],
    ids=" ".join,
)
def test_what_needs_no_new_physics_loads_nothing_heavy(results, arguments):
    done = without(HEAVY, *(results if part == "RESULTS" else part for part in arguments))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout


def test_help_loads_no_arrays_and_reading_tables_neither_jax_nor_pint(on_body):
    assert without(HEAVY | {"numpy"}, "--help").returncode == 0
    done = without(HEAVY - {"pydantic"}, "check", on_body)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_figure_is_drawn_again_without_a_model(results, undrawn, tmp_path):
    done = without(HEAVY - {"matplotlib"}, "plot", undrawn, "--figure", "efficiency", "-o", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["captions.txt", "efficiency.png"]
    assert (tmp_path / "efficiency.png").read_bytes() == (results / "figures" / "efficiency.png").read_bytes()


@pytest.mark.extended
def test_the_program_draws_the_figures_that_the_library_does(results, undrawn, tmp_path):
    command = [sys.executable, "-m", "bowdenfit", "plot", undrawn, "-o", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    files = sorted(path.name for path in (results / "figures").iterdir())
    assert len(files) > 7
    assert sorted(path.name for path in tmp_path.iterdir()) == files
    assert sorted(Path(line).name for line in done.stdout.splitlines()) == files
    for name in files:
        assert (tmp_path / name).read_bytes() == (results / "figures" / name).read_bytes(), name


@pytest.mark.extended
@pytest.mark.parametrize("chosen", [(), ("--figure", "pairs", "--figure", "wrap_angles", "--format", "png")])
def test_figures_that_the_fit_drew_are_copied(results, undrawn, run, tmp_path, chosen):
    done = without(HEAVY | {"numpy"}, "plot", results, "-o", tmp_path / "copied", *chosen)
    assert (done.returncode, done.stderr) == (0, "")
    code, printed, _ = run("plot", undrawn, "-o", tmp_path / "drawn", *chosen)
    assert (code, printed) == (0, done.stdout.replace("copied", "drawn"))
    names = sorted(path.name for path in (tmp_path / "drawn").iterdir())
    assert sorted(path.name for path in (tmp_path / "copied").iterdir()) == names
    for name in names:
        assert (tmp_path / "copied" / name).read_bytes() == (tmp_path / "drawn" / name).read_bytes(), name


def edit_drawing(folder, monkeypatch):
    path = folder / FIGURES_FOLDER / "efficiency.png"
    path.write_bytes(path.read_bytes() + b"\n")


def put_a_folder_there(folder, monkeypatch):
    (folder / FIGURES_FOLDER / "efficiency.png").unlink()
    (folder / FIGURES_FOLDER / "efficiency.png").mkdir()


def edit_fit(folder, monkeypatch):
    (folder / "fit.json").write_text((folder / "fit.json").read_text() + "\n")


def update_matplotlib(folder, monkeypatch):
    monkeypatch.setattr(answer_cache, "installed_version", lambda _: "99.0")


def leave_unnamed(folder, monkeypatch):
    def change(page):
        del page["answers"]["drawn"]["files"]["efficiency.png"]

    edit_sealed(folder / ANSWERS, change)


@pytest.mark.parametrize("change", [edit_drawing, put_a_folder_there, edit_fit, update_matplotlib, leave_unnamed, None])
def test_a_figure_is_drawn_anew_where_it_is_not_as_the_fit_drew_it(results, tmp_path, monkeypatch, change):
    copy = shutil.copytree(results, tmp_path / "copy")
    if change is not None:
        change(copy, monkeypatch)
    drawing = []
    monkeypatch.setattr(figure_files, "write_figure_files", lambda name, *_: drawing.append(name))
    bf.plot(copy, tmp_path / "drawn", figures=["efficiency"], formats=["png"])
    assert drawing == ([] if change is None else ["efficiency"])
    bf.plot(copy, tmp_path / "wide", figures=["pairs"], width=(5, "in"))
    assert drawing[-1] == "pairs"


def test_figures_of_a_fit_that_could_not_draw_one_are_drawn_anew(on_body, tmp_path, monkeypatch):
    write = figures.write_all

    def failing(figure, folder, name, formats):
        if name == "residuals":
            raise RuntimeError("no")
        return write(figure, folder, name, formats)

    monkeypatch.setattr(figures, "write_all", failing)
    with pytest.warns(UserWarning, match="figure residuals could not be drawn"):
        bf.fit(on_body, output=tmp_path / "fit", mcmc=False, seed=1)
    assert "efficiency.png" in {path.name for path in (tmp_path / "fit" / FIGURES_FOLDER).iterdir()}
    monkeypatch.undo()
    assert "residuals" in {path.stem for path in bf.plot(tmp_path / "fit", tmp_path / "drawn", formats=["svg"])}


@pytest.mark.parametrize(
    "arguments", [("predict", "RESULTS", "455.25"), ("identify", "RESULTS", "--json")], ids=" ".join
)
def test_new_physics_needs_jax(results, arguments):
    """So the tests above can fail."""
    done = without({"jax"}, *(results if part == "RESULTS" else part for part in arguments))
    assert done.returncode == 1
    assert "was imported" in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("length",),
        ("length", "--json"),
        ("predict",),
        ("predict", "--json"),
        ("predict", "--csv"),
        ("identify",),
    ],
    ids=" ".join,
)
def test_what_is_read_back_is_what_would_be_worked_out(results, bare, run, arguments):
    verb, *options = arguments
    again = run(verb, results, *options)
    assert again[0] == 0
    assert again == run(verb, bare, *options)


def test_some_of_the_lengths_that_can_be_bought_are_predicted_as_they_are_alone(results, bare, run):
    once, again = (
        json.loads(run("predict", folder, "470", "440", "--json")[1]) for folder in (results, bare)
    )
    for first, other in zip(once, again, strict=True):
        assert list(first) == list(other)
        assert first.pop("note") == other.pop("note") == ""
        np.testing.assert_allclose(list(first.values()), list(other.values()), rtol=1e-13)


@pytest.mark.parametrize(
    "other",
    [
        {"lengths": (455.25,)},
        {"lengths": (450.0, 455.25)},
        {"stroke": "return"},
        {"input_force": (100.0, "N")},
        {"output_force": (100.0, "N")},
        {"quantity": "output-force"},
        {"wrap_angles": [(90.0, "deg")]},
        {"preload": (20.0, "N")},
        {"friction_limit": (5.0, "N")},
    ],
    ids=str,
)
def test_another_question_is_not_answered_by_what_was_kept(results, other):
    request = {name: parameter.default for name, parameter in inspect.signature(PREDICT.function).parameters.items()}
    answers = read_answers(results)
    assert PREDICT.kept(answers, request) is not None
    assert PREDICT.kept(answers, request | other) is None


def _edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def _spoil_draws(folder):
    page = bytearray((folder / "posterior.nc").read_bytes())
    page[len(page) // 2] ^= 1
    (folder / "posterior.nc").write_bytes(page)


@pytest.mark.parametrize(
    "change",
    [
        lambda f: _edit(f / "fit.json", '"converged": true', '"converged": false'),
        _spoil_draws,
        lambda f: (f / "posterior.nc").unlink(),
        lambda f: _edit(f / ANSWERS, '"variable": "cable_length"', '"variable": "cable_length "'),
        lambda f: _edit(f / ANSWERS, f'"schema": {SCHEMA}', '"schema": 0'),
        lambda f: _edit(f / ANSWERS, '"version": "', '"version": "0.0'),
        lambda f: (f / ANSWERS).write_text("{}"),
        lambda f: (f / ANSWERS).write_text("["),
        lambda f: (f / ANSWERS).write_text("[]"),
        lambda f: (f / ANSWERS).write_bytes(b"\xff"),
    ],
    ids=["verdict", "draws", "no draws", "answer", "schema", "version", "empty", "cut off", "list", "no text"],
)
def test_nothing_is_read_back_of_a_folder_that_was_changed(results, tmp_path, change):
    copy = shutil.copytree(results, tmp_path / "copy")
    assert read_answers(copy)
    change(copy)
    assert read_answers(copy) == {}


@pytest.mark.extended
@pytest.mark.parametrize("verb", ["length", "predict", "identify"])
def test_an_answer_that_was_kept_in_another_shape_is_worked_out(results, tmp_path, run, verb):
    copy = shutil.copytree(results, tmp_path / "copy")
    other = read_answers(copy) | {"length": {"unit": "mm"}, "predict": [430.0], "identify": {"groups": {}}}
    write_answers(copy, other, (copy / "fit.json").read_text())
    assert read_answers(copy) == other
    assert run(verb, copy) == run(verb, results)


def test_an_answer_of_missing_draws_is_refused(results, tmp_path, run):
    copy = shutil.copytree(results, tmp_path / "copy")
    (copy / "posterior.nc").unlink()
    code, out, err = run("length", copy)
    assert (code, out) == (2, "")
    assert "posterior.nc is missing" in err


def test_a_changed_fit_is_answered_anew(results, tmp_path, run):
    copy = shutil.copytree(results, tmp_path / "copy")
    edit_sealed(copy / "fit.json", lambda page: page.update(verdict={"converged": False, "reasons": ["changed"]}))
    code, _, err = run("length", copy)
    assert code == 3
    assert err.startswith("Warning: this fit is not converged")


@pytest.mark.extended
def test_a_fit_that_is_not_to_be_trusted_says_so_beside_what_is_read_back(on_body, tmp_path, run):
    few = ("sampler.n_walkers=32", "sampler.max_steps=200")
    bf.fit(on_body, output=tmp_path / "fit", seed=1, settings=few, figures=False)
    assert LENGTH.kept is not None and read_answers(tmp_path / "fit")["troubles"]
    code, out, err = run("length", tmp_path / "fit")
    (tmp_path / "fit" / ANSWERS).unlink()
    assert code == 3
    assert (code, out, err) == run("length", tmp_path / "fit")
    assert err.startswith("Warning: this fit is not converged")


def test_figures_show_what_they_would_show_if_it_were_worked_out(results):
    worked_out, again = dict(collect_figure_data(bf.load(results))), read_figure_data(results)
    assert list(again) == list(worked_out)
    for name, data in worked_out.items():
        assert type(again[name]) is type(data), name
        assert serialize(again[name]) == serialize(data), name


def test_figures_that_were_changed_are_not_drawn_again(results, tmp_path):
    copy = shutil.copytree(results, tmp_path / "copy")
    page = bytearray((copy / FIGURE_DATA).read_bytes())
    page[len(page) // 2] ^= 1
    (copy / FIGURE_DATA).write_bytes(page)
    assert read_figure_data(copy) == {}
    assert read_answers(copy)


@pytest.mark.parametrize(
    ("name", "says"),
    [("efficency", "did you mean 'efficiency'"), ("stretch", "nothing to show in the figure 'stretch'")],
)
def test_a_figure_that_does_not_exist_is_refused_in_a_sentence(results, refuse, tmp_path, name, says):
    assert says in refuse("plot", results, "--figure", name, "-o", tmp_path / "figures")


def test_figures_have_names_that_plot_takes(results, run, tmp_path):
    assert run("plot", results, "-o", tmp_path, "--figure", "pairs", "--figure", "wrap_angles")[0] == 0
    assert {path.stem for path in tmp_path.iterdir()} == {"pairs", "wrap_angles", "captions"} <= {*FIGURES, "captions"}
    printed = (tmp_path / "captions.txt").read_text(encoding="utf-8").split("\n\n")
    assert [paragraph.partition(":")[0] for paragraph in printed] == ["wrap_angles", "pairs"]
