"""What is said of a table of efficiencies that can be read but hardly is what it says."""

import shutil

import pytest

import bowdenfit as bf

CASES = [  # efficiencies in percent, what is said of them
    ((0.78, 0.76, 0.81, 0.7), "row 3: every efficiency is at most 1 %"),
    ((78, 0.76, 81, 70), "row 4: 1 efficiency is at most 1 %"),
    ((78, 0.76, 81, 0.7), "row 4: 2 efficiencies are at most 1 %"),
    ((78, 76, 81, 70), ""),
    (("0.78%", "76%", "81%", "70%"), "row 3: 1 efficiency is at most 1 %"),
]


@pytest.mark.parametrize(("readings", "message"), CASES)
def test_fractions_under_a_heading_of_percent_are_pointed_out(on_body, tmp_path, readings, message):
    folder = shutil.copytree(on_body, tmp_path / "cable")
    rows = [f"{length},{value}" for length, value in zip((440, 470, 510, 550), readings, strict=True)]
    (folder / "efficiencies.csv").write_text("\n".join(["# measured", "cable_length_mm,efficiency_percent", *rows]) + "\n")
    computed = bf.check(folder)
    text = " ".join(str(computed).split())
    assert (message in text) if message else "fraction under a heading" not in text


def test_small_fractions_are_what_they_are(on_body, tmp_path):
    folder = shutil.copytree(on_body, tmp_path / "cable")
    (folder / "efficiencies.csv").write_text("cable_length_mm,efficiency\n440,0.008\n470,0.007\n510,0.006\n550,0.009\n")
    assert "fraction under a heading" not in str(bf.check(folder))
