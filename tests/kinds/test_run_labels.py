"""A run that is written in two ways is one mounting, or is named; it is never two mountings without a word."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hand_bench import BENDS, pull, write

import bowdenfit as bf
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.rows import unify_labels
from bowdenfit.recordings.recording import Recordings

RECORDED = Path(__file__).parents[2] / "datasets" / "synthetic-recordings"
LABELS = ("7", "2", "11")


def _bench(folder, again):
    """Three mountings at one bend, each read twice; the second time under other labels."""
    rows = pull(
        np.random.default_rng(5), [180.0] * 3, [0.3] * 3, [20, 40, 60], labels=LABELS, repeats=2, noise=(0.2, 0.2),
        scatter=0.02,
    )  # fmt: skip
    labels = rows.label.astype(object)
    labels[1::2] = [again[LABELS.index(label)] for label in labels[1::2]]
    path = write(folder, replace(rows, label=labels)) / "forces.csv"
    moved = [",".join([*line.split(",")[1:], line.split(",")[0]]) for line in path.read_text().splitlines()]
    path.write_text("\n".join(moved) + "\n")  # a row that begins with # is a comment
    return folder


def _run_names(folder):
    table = bf.read(folder).measurements.table(ForceTable)
    assert table is not None
    return table.run_names


def test_numbers_that_are_written_differently_are_one_mounting(tmp_path):
    twin = _run_names(_bench(tmp_path / "twin", LABELS))
    assert _run_names(_bench(tmp_path / "written", ("7.0", "+2", "011"))) == twin == LABELS


def test_a_label_behind_a_sign_beside_the_label_itself_is_refused_with_both_rows(tmp_path, refuse):
    printed = refuse("check", _bench(tmp_path, ("7", "2", "#11")))
    assert "forces.csv, column 'run': '#11' in row 27 and '11' in row 26 are two labels that may mean the same" in printed


@pytest.mark.parametrize(
    "labels",
    [
        ("run07", "run7", "7"), ("1.1", "1.10", "11"), ("-2", "2", "3"), ("2a", "2b", "2"), ("#1", "#2", "#3"), ("A", "a", "b"),
        ("trial 1", "trial 2", "1"), ("(no run)", "1", "2"), ("7", "70", "77"), ("7_1", "71", "7"), ("0.5", "5", "05.5"),
    ],
)  # fmt: skip
def test_labels_that_are_no_spellings_of_one_number_stay_mountings_of_their_own(labels):
    assert unify_labels(labels, labels, "here") == list(labels)


def test_whole_numbers_are_called_as_they_are_written_first():
    labels = ["07", "7", "7.", "7,00", "+7", "-7", "−7", "0", "0.0"]
    assert unify_labels(labels, labels, "here") == ["07"] * 5 + ["-7"] * 2 + ["0"] * 2


def test_a_label_that_several_files_have_is_said_to_be_a_mounting_of_its_own_in_each(tmp_path, accept):
    folder = _bench(tmp_path, LABELS)
    heading, *rows = (folder / "forces.csv").read_text().splitlines()
    for name, lines in (("a", rows), ("b", [f"{row}.0" for row in rows if row.endswith(",7")])):
        (folder / f"{name}.csv").write_text("\n".join([heading, *lines]) + "\n")
    (folder / "forces.csv").unlink()
    (folder / "cable.toml").write_text(BENDS.replace('file = "forces.csv"', 'files = ["a.csv", "b.csv"]'))
    printed = " ".join(accept("check", folder).split())
    assert "runs are counted file by file: 7 is in several of the 2 files of forces" in printed
    (folder / "b.csv").write_text((folder / "b.csv").read_text().replace(",7.0\n", ",8\n"))
    assert "file by file" not in accept("check", folder)


def test_recordings_of_a_run_that_is_written_differently_are_of_one_mounting(tmp_path):
    folder = tmp_path / "recorded"
    shutil.copytree(RECORDED, folder)
    text = (RECORDED / "cable.toml").read_text()

    def runs(first, other):
        renamed = text.replace('"440 mm, 20 r/min"', f'"{first}"').replace('"470 mm, 20 r/min"', f'"{other}"')
        (folder / "cable.toml").write_text(renamed)
        table = bf.read(folder).measurements.table(Recordings)
        assert table is not None
        return table.runs

    assert runs("7", "7.0")[0] == "7" and len(runs("7", "7.0")) == len(runs("7", "8")) - 1
    with pytest.raises(DatasetError, match=r"'#7' in 470mm_20rpm\.csv and '7' in 440mm_20rpm\.csv are two labels"):
        runs("7", "#7")
