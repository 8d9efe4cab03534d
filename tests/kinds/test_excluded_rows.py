"""Readings that a description leaves out are not read, and are named with their reason wherever data are described."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from figure_words import assert_readable
from half_turn_bench import describe_half_turn

import bowdenfit as bf
from bowdenfit.errors import DatasetError, DescriptionError
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.plots.style import LEFT_OUT
from bowdenfit.questions.check.data_set_words import describe_data_set
from bowdenfit.questions.figures import FIGURES, collect_figure_data
from bowdenfit.questions.length.efficiency_figure import make_efficiency_chart
from bowdenfit.questions.summary import forces_figure
from bowdenfit.questions.summary.brief import summary_text

DATASETS = Path(__file__).parents[2] / "datasets"
HEAD = "input_force_N,output_force_N,run\n"
ROWS = ["20,15.2,1", "40,30.1,1", "60,45.6,1", "20,15.0,2", "40,30.9,2", "60,46.0,2", "20,14.8,3", "40,29.9,3", "60,44.6,3"]


@pytest.fixture
def bench(tmp_path):
    """Write a bench whose description leaves rows out."""

    def write(exclude, rows=ROWS, files=("forces.csv",)):
        listed = f'file = "{files[0]}"' if len(files) == 1 else f"files = {list(files)}"
        (tmp_path / "cable.toml").write_text(describe_half_turn(f"{listed}, exclude = [{exclude}]"))
        for file in files:
            (tmp_path / file).write_text(HEAD + "\n".join([*rows, ""]))
        return tmp_path

    return write


def forces_of(folder):
    """The forces that are read."""
    table = bf.read(folder).measurements.table(ForceTable)
    return np.column_stack([table.input_force, table.output_force, table.run, table.origin.row])


def test_excluded_rows_are_left_out_as_if_they_were_not_there(bench):
    read = forces_of(bench('{ rows = [3, 8], reason = "the rope jumped" }'))
    whole = forces_of(bench(""))
    assert np.array_equal(read, np.delete(whole, [1, 6], axis=0))


def test_they_are_named_with_their_reason_by_check_and_by_a_fit(bench):
    sentence = "2 readings left out by the user: forces.csv, rows 3 and 8 (the rope jumped)."
    folder = bench('{ rows = [8, 3], reason = "the rope jumped" }')
    text = " ".join(describe_data_set(bf.check(folder)).split())
    assert sentence in text and "Not used: rows 3 and 8: left out by the user: the rope jumped." in text
    fit = bf.fit(folder, mcmc=False)
    assert sentence in " ".join(summary_text(fit).split())
    assert sentence in fit.dataset.measurements.remarks


def test_an_excluded_row_may_hold_anything(bench):
    rows = [*ROWS[:-1], "60,slipped,3"]
    with pytest.raises(DatasetError, match="'slipped' is not a number"):
        bf.read(bench("", rows))
    assert len(forces_of(bench('{ rows = [10], reason = "slipped" }', rows))) == len(ROWS) - 1


@pytest.mark.parametrize(
    ("exclude", "words"),
    [
        ('{ rows = [1], reason = "x" }', "exclude names row 1, where no reading is to be left out"),
        ('{ rows = [11], reason = "x" }', "rows were added or deleted above since"),
        ("{ rows = [2, 3, 4, 5, 6, 7, 8, 9, 10], reason = 'x' }", "exclude names every row of readings"),
    ],
)
def test_rows_that_are_not_there_are_refused(bench, exclude, words):
    with pytest.raises(DatasetError, match=words):
        bf.read(bench(exclude))


@pytest.mark.parametrize("exclude", ["{ rows = [3] }", '{ rows = [], reason = "x" }', '{ rows = [3], reason = "" }'])
def test_without_rows_or_a_reason_nothing_is_left_out(bench, exclude):
    with pytest.raises(DescriptionError, match="exclude"):
        bf.read(bench(exclude))


def test_a_missing_reason_is_asked_for(bench):
    with pytest.raises(DescriptionError, match=r"exclude\.0\.reason: missing; say which rows are left out and why"):
        bf.read(bench("{ rows = [3] }"))


def test_of_several_files_the_entry_says_which(bench):
    files = ("a.csv", "b.csv")
    with pytest.raises(DescriptionError, match="exclude must say of which file its rows are"):
        bf.read(bench('{ rows = [3], reason = "x" }', files=files))
    with pytest.raises(DescriptionError, match=r"the table has no file 'c\.csv'"):
        bf.read(bench('{ rows = [3], reason = "x", file = "c.csv" }', files=files))
    read = forces_of(bench('{ rows = [3], reason = "x", file = "b.csv" }', files=files))
    assert np.array_equal(read, np.delete(forces_of(bench("", files=files)), 10, axis=0))


def test_figures_of_a_fit_show_them_gray_also_when_it_is_read_back(bench, tmp_path):
    folder = bench('{ rows = [3, 8, 10], reason = "the rope jumped" }', [*ROWS[:-1], "60,slipped,3"])
    made = bf.fit(folder, mcmc=False, output=tmp_path / "fit", figures=False)
    for fit in (made, bf.load(tmp_path / "fit")):
        assert [(r.file, r.row) for r in fit.dataset.measurements.excluded["forces"]] == [("forces.csv", n) for n in (3, 8, 10)]
        data = forces_figure.data(fit)
        assert data.left_out.T.tolist() == [[40, 30.1], [20, 14.8]]
        assert LEFT_OUT in forces_figure.draw(data).axes[0].get_legend_handles_labels()[1]
        assert "2 readings left out by the user" in forces_figure.caption(data)


@pytest.mark.extended
def test_each_figure_of_a_table_shows_those_of_the_table(tmp_path):
    shown = {}
    for name in ("on-body-exoskeleton", "synthetic-haptic-loop"):
        folder = shutil.copytree(DATASETS / name, tmp_path / name)
        text = (folder / "cable.toml").read_text()
        left_out = 'exclude = [{ rows = [4], reason = "the rope jumped" }]'
        text = re.sub(r'(file = "(efficiencies|angles|stretch|preload|loop).csv")', rf"\1, {left_out}", text)
        (folder / "cable.toml").write_text(text)
        names = ("efficiency", "wrap_angles", "stretch", "preload", "loops")
        shown |= dict(collect_figure_data(bf.fit(folder, mcmc=False), names))
    assert_readable(shown, "cable")
    for name, data in shown.items():
        figure, words = FIGURES[name].draw(data), FIGURES[name].caption(data)
        entries = [entry for axes in figure.axes for entry in axes.get_legend_handles_labels()[1]]
        assert LEFT_OUT in entries and "1 reading left out by the user" in words, name
    (chart,) = make_efficiency_chart(shown["efficiency"])
    assert [series.color for group in chart.groups for series in group.series if series.label == LEFT_OUT] == ["gray"]


def test_they_are_forces_on_the_rope_whatever_was_read(bench):
    folder = bench('{ rows = [3], reason = "x" }')
    text = (folder / "cable.toml").read_text()
    (folder / "cable.toml").write_text(f"{text}[sensors]\ninput_ratio = 2\n")
    (reading,) = bf.read(folder).measurements.excluded["forces"]
    assert reading.values["input_force"] == 80 and reading.values["output_force"] == 30.1
    (folder / "forces.csv").write_text((folder / "forces.csv").read_text().replace("input_force_N", "input_torque_Nm"))
    (folder / "cable.toml").write_text(f'{text}[cable]\ninput_pulley_radius = {{ value = 500, unit = "mm" }}\n')
    (reading,) = bf.read(folder).measurements.excluded["forces"]
    assert reading.values["input_force"] == pytest.approx(80)
