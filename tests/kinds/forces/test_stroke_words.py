"""Words for strokes: pairs of opposites are told apart by the forces, and refused where these do not tell."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.forces.table import ForceTable


def table(tmp_path, words, factors=(0.73, 1.37), runs=(1, 2)):
    """Write a table of two strokes, in which these shares of the input arrive."""
    noise = iter(np.random.default_rng(5).normal(0, 0.1, 100))
    rows = [
        f"{run},{word},{load},{factor * load + next(noise):.2f}"
        for run in runs
        for word, factor in zip(words, factors, strict=True)
        for load in (20, 40, 60)
    ]
    (tmp_path / "t.csv").write_text("\n".join(["run,stroke,input_force_N,output_force_N", *rows]) + "\n", encoding="utf-8")
    return tmp_path / "t.csv"


def strokes(path):
    """The strokes of the first run's six readings, and what is remarked on the words."""
    measured = bf.read(path, wrap_angle=(180, "deg")).measurements
    remarks = [remark for remark in measured.remarks if "is taken for pull" in remark]
    return measured.table(ForceTable).stroke.tolist()[:6], remarks


PAIRS = ["up down", "Forward backward", "in OUT", "hin her", "↑ ↓", "F R", "Auf ab", "upstroke downstroke", "+ -", "cw ccw"]


@pytest.mark.parametrize("words", PAIRS)
def test_the_stroke_that_loses_force_is_the_pull(tmp_path, words):
    first, second = words.split()
    for pair, factors in (((first, second), (0.73, 1.37)), ((first, second), (1.37, 0.73))):
        sign = 1 if factors[0] < 1 else -1
        read, remarks = strokes(table(tmp_path, pair, factors))
        assert read == [sign] * 3 + [-sign] * 3
        assert len(remarks) == 1 and f"the stroke {pair[0 if sign > 0 else 1]!r} is taken" in remarks[0]


@pytest.mark.parametrize("words", ["pull push", "hin zurück", "out return", "pull relax"])
def test_one_known_word_says_what_its_opposite_is(tmp_path, words):
    assert strokes(table(tmp_path, words.split())) == ([1] * 3 + [-1] * 3, [])
    with pytest.raises(bf.BowdenfitError, match="pull and return are swapped"):
        strokes(table(tmp_path, words.split(), (1.37, 0.73)))


def test_forces_that_do_not_tell_the_pull_are_said(tmp_path):
    with pytest.raises(bf.DatasetError, match="'up' does not say whether the rope is pulled, and the forces do not either"):
        strokes(table(tmp_path, ("up", "down"), (0.73, 0.73)))


@pytest.mark.parametrize("words", ["up left", "up up", "A B", "steel nylon"])
def test_words_that_are_no_opposites_are_refused(tmp_path, words):
    with pytest.raises(bf.DatasetError, match=f"'{words.split()[0]}' is not a stroke; write pull"):
        strokes(table(tmp_path, words.split()))
