"""What is said of a table of efficiencies that hardly is what it says: fractions where percentages should be."""

import shutil

import pytest

import bowdenfit as bf

REFUSED = [  # efficiencies in percent, and which is refused
    ((78, 0.76, 81, 70), "row 4, column 'efficiency_percent': '0.76' is 0.76 %, and the other efficiencies are 70 to 81 %"),
    ((78, 0.76, 81, 0.7), "row 4, column 'efficiency_percent': '0.76' is 0.76 %, and the other efficiencies are 78 to"),
    (("0.78%", "76%", "81%", "70%"), "row 3, column 'efficiency_percent': '0.78%' is 0.78 %"),
]


def write(on_body, tmp_path, readings, heading="efficiency_percent"):
    """The on-body data set with these efficiencies."""
    folder = shutil.copytree(on_body, tmp_path / "cable")
    rows = [f"{length},{value}" for length, value in zip((440, 470, 510, 550), readings, strict=True)]
    (folder / "efficiencies.csv").write_text("\n".join(["# measured", f"cable_length_mm,{heading}", *rows]) + "\n")
    return folder


@pytest.mark.parametrize(("readings", "message"), REFUSED)
def test_a_fraction_among_percentages_is_refused_by_its_row(on_body, tmp_path, readings, message):
    with pytest.raises(bf.DatasetError) as caught:
        bf.read(write(on_body, tmp_path, readings))
    assert message in str(caught.value)
    assert "a fraction among percentages" in str(caught.value)


def test_fractions_are_named_before_runs_of_several_rows(tmp_path):
    rows = [f"{run},{90 * run},{100 * eta if run < 4 else eta}" for run, eta in enumerate((0.8, 0.7, 0.6, 0.5), 1)]
    path = tmp_path / "mixed.csv"
    path.write_text("\n".join(["run,wrap_angle_deg,efficiency_percent", *rows, *rows]) + "\n")
    with pytest.raises(bf.DatasetError, match="write 50"):
        bf.fit(path)


@pytest.mark.parametrize(
    ("readings", "message"),
    [
        ((0.78, 0.76, 0.81, 0.7), "row 3: every efficiency is at most 1 %; the usual cause is a fraction under a heading"),
        ((78, 76, 81, 70), ""),
        ((78, 0.2, 81, 70), "row 4: 1 efficiency is at most 1 %"),
        ((3, 2, 1.2, 1.5), ""),
    ],
)
def test_percentages_that_may_be_right_are_only_pointed_out(on_body, tmp_path, readings, message):
    text = " ".join(str(bf.check(write(on_body, tmp_path, readings))).split())
    assert (message in text) if message else "fraction under a heading" not in text


def test_small_fractions_are_what_they_are(on_body, tmp_path):
    folder = write(on_body, tmp_path, (0.008, 0.007, 0.006, 0.009), "efficiency")
    assert "fraction under a heading" not in str(bf.check(folder))
