"""Columns that nothing reads: the verdict names one that explains the residuals, and none that was calculated from forces."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.plausibility import choose_unused_columns
from bowdenfit.questions.check.lack_of_fit import describe_lack_of_fit

MU, NOISE = 0.12, 0.01


def write_table(path, peg_turns_the_cable: bool, load: float, efficiencies: bool = False):
    """Write 24 readings at six pegs in random order, with what people calculate from them; each peg may have its own bend."""
    rng = np.random.default_rng(5)
    peg = rng.permutation(np.repeat(np.arange(1, 7), 4))
    bend = np.deg2rad(30) * (peg if peg_turns_the_cable else 3)
    force_in = load * rng.choice([1, 2, 3, 4], len(peg)) * (1 + NOISE * rng.standard_normal(len(peg)))
    force_out = force_in * np.exp(-MU * bend) * (1 + NOISE * rng.standard_normal(len(peg)))
    rows = [
        f"{f:.6g},{g:.6g},{p},{g / f:.2f},{100 * (1 - g / f):.0f}" for f, g, p in zip(force_in, force_out, peg, strict=True)
    ]
    heading = "Input force (N),Output force (N),Peg,eta,Lost percent"
    if efficiencies:
        rows, heading = [f"{row.split(',')[3]},{row.split(',')[2]}" for row in rows], "efficiency,Peg"
    path.write_text("\n".join([heading, *rows]) + "\n")
    return path


def sentences_of(path, tmp_path):
    dataset = bf.read(path, wrap_angle="90deg")
    return describe_lack_of_fit(bf.fit(dataset, output=tmp_path / "fit", mcmc=False, figures=False, seed=1))


@pytest.mark.parametrize(("load", "efficiencies"), [(0.5, False), (2000.0, False), (1.0, True)])
def test_a_column_that_explains_the_residuals_is_named(tmp_path, load, efficiencies):
    first = sentences_of(write_table(tmp_path / "bench.csv", True, load, efficiencies), tmp_path)[0]
    assert "does not use the column 'Peg'" in first


def test_texts_that_explain_the_residuals_are_named_with_what_they_say(tmp_path):
    path = write_table(tmp_path / "bench.csv", True, 20.0)
    head, *rows = path.read_text().splitlines()
    dry = {f"{peg}": "dry" if peg > 3 else "" for peg in range(1, 7)}
    rows = [",".join([*row.split(",")[:2], dry[row.split(",")[2]]]) for row in rows]
    path.write_text("\n".join([head.replace("Peg,eta,Lost percent", "Rope"), *rows]) + "\n")
    first = sentences_of(path, tmp_path)[0]
    assert "where 'Rope' is 'blank' the loss is" in first
    assert "where it is 'dry'" in first
    assert "--column group=Rope --friction by-group" in first
    assert describe_lack_of_fit(bf.load(tmp_path / "fit"))[0] == first


def test_a_column_that_says_nothing_of_the_residuals_is_not_named(tmp_path):
    assert sentences_of(write_table(tmp_path / "bench.csv", False, 20.0), tmp_path) == ()


def test_what_was_calculated_from_the_forces_says_nothing_new():
    rng = np.random.default_rng(2)
    force_in = 20 * rng.integers(1, 5, 30) * (1 + NOISE * rng.standard_normal(30))
    angle = rng.choice([30.0, 60.0, 90.0, 120.0], 30)
    force_out = force_in * np.exp(-MU * np.deg2rad(angle)) * (1 + NOISE * rng.standard_normal(30))
    lost = force_in - force_out
    columns = {
        "volts": np.round(0.013 * force_out + 2.5, 4),
        "lost (N)": np.round(lost),
        "loss (%)": np.round(100 * lost / force_in, 1),
        "angle": angle,
        "set": np.full(30, 3.0),
        "rope": np.array(["old", "new"] * 15),
        "remark": np.array([f"reading {i}" for i in range(30)]),
    }
    readings = (force_in, force_out, lost, force_out / force_in, lost / force_in)
    assert list(choose_unused_columns(columns, *readings)) == ["angle", "rope"]
