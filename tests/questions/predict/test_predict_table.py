"""A table of what to predict: each row as asked one by one, and whatever would not be used is refused."""

import pandas as pd
import pytest

import bowdenfit as bf
from bowdenfit.errors import DatasetError, UsageError

HEAD = "cable_length_mm,bracket edge (deg),input_force_N,stroke\n"


@pytest.fixture
def table(tmp_path):
    def write(text):
        path = tmp_path / "rows.csv"
        path.write_text(text)
        return path

    return write


def one_by_one(fit, length, stroke, force, **more):
    (row,) = bf.predict(fit, [length], input_force=(force, "N"), stroke=stroke, **more)
    return row


def test_each_row_is_what_is_predicted_by_itself(quick_fit, table):
    rows = bf.predict(quick_fit, table=table(HEAD + "450,,100,pull\n470,30,50,pull\n470,,50,return\n"))
    single = [
        one_by_one(quick_fit, 450, "pull", 100),
        one_by_one(quick_fit, 470, "pull", 50, wrap_angles={"bracket edge": "30deg"}),
        one_by_one(quick_fit, 470, "return", 50),
    ]
    assert [row["row"] for row in rows] == [2, 3, 4]
    for row, alone in zip(rows, single, strict=True):
        for name in ("output_force_N", "mean", "sd", "q05", "q95", "mounting_q05", "mounting_q95"):
            assert row[name] == pytest.approx(alone[name], rel=1e-9)
    assert (rows[0]["bracket_edge_deg"], rows[1]["bracket_edge_deg"]) == (None, pytest.approx(30))
    frame = pd.DataFrame({"cable_length_mm": [470.0], "bracket_edge": [30.0], "input_force": [50.0]})
    frame.attrs["units"] = {"bracket_edge": "deg", "input_force": "N"}
    assert bf.predict(quick_fit, table=frame)[0]["q05"] == pytest.approx(rows[1]["q05"])


@pytest.mark.extended
def test_efficiencies_and_wanted_forces_and_angles_of_curves(quick_fit, table):
    efficiency = bf.predict(quick_fit, table=table("cable_length_mm,free_sheath_angle_deg\n470,\n470,20\n"))
    assert efficiency[0]["efficiency"] == pytest.approx(bf.predict(quick_fit, [470])[0]["efficiency"])
    alone = bf.predict(quick_fit, [470], wrap_angles={"free sheath": "20deg"})[0]
    assert efficiency[1]["efficiency"] == pytest.approx(alone["efficiency"])
    wanted = bf.predict(quick_fit, table=table("cable_length_mm,output_force_N\n470,40\n"))[0]
    assert wanted["input_force_N"] == pytest.approx(bf.predict(quick_fit, [470], output_force="40N")[0]["input_force_N"])


@pytest.mark.extended
def test_outside_the_curves_a_row_needs_its_own_angles(quick_fit, table):
    setting = "cable_length_mm,free_sheath_angle_deg,squeezed_sheath_angle_deg\n560,20,30\n450,,\n"
    outside, inside = bf.predict(quick_fit, table=table(setting))
    assert "by the wrap angles stated" in outside["note"]
    assert not inside["note"]
    with pytest.raises(UsageError, match="no wrap angle of 'squeezed sheath' was measured there"):
        bf.predict(quick_fit, table=table(setting + "561,20,\n"))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("cable_length_mm,colour\n450,red\n", r"rows.csv: predict does not use 'colour'; it uses cable_length"),
        ("bracket edge (deg)\n30\n", "rows.csv has no column cable_length_mm"),
        (HEAD + "450,,100,hold\n", "must be a stroke in which the rope slides"),
        (HEAD + "450,,-5,pull\n", "row 2.*'-5' is not positive"),
        (HEAD + "450,,,pull\n", "row 2"),
        (HEAD + "450,-3,5,pull\n", "negative"),
        ("cable_length_mm,input_force_N,output_force_N\n450,1,1\n", "keep the one that is known"),
        ("cable_length_mm,bracket edge (deg),bracket_edge_angle_deg\n450,1,1\n", "two columns for the wrap angle"),
    ],
)
def test_what_is_wrong_with_a_table_is_refused(quick_fit, table, text, reason):
    with pytest.raises(DatasetError, match=reason):
        bf.predict(quick_fit, table=table(text))


def test_what_a_table_says_cannot_be_said_beside_it(quick_fit, table):
    path = table(HEAD + "450,,100,return\n")
    for named in ({"lengths": [450]}, {"wrap_angles": "90deg"}, {"quantity": "efficiency"}, {"contact": "bracket edge"}):
        with pytest.raises(UsageError, match="--table says in its rows where to predict"):
            bf.predict(quick_fit, table=path, **named)
    with pytest.raises(UsageError, match="forces are stated in the table"):
        bf.predict(quick_fit, table=path, input_force="50N")
    with pytest.raises(UsageError, match="strokes are stated in the table"):
        bf.predict(quick_fit, table=path, stroke="return")


@pytest.mark.extended
def test_the_command_prints_a_row_each(run, quick_results, table):
    path = table(HEAD + "450,,100,pull\n470,30,50,return\n")
    code, out, err = run("predict", str(quick_results), "--table", str(path))
    assert code in (0, 3), err
    first = out.splitlines()[0]
    assert first.startswith("row  cable length (mm)  bracket edge (deg)  stroke  input force (N)")
    assert "90 % intervals are in brackets." in out
    code, out, err = run("predict", str(quick_results), "--table", str(path), "--csv")
    assert out.splitlines()[0].startswith("row,cable_length_mm,bracket_edge_deg,stroke,input_force_N,output_force_N,mean")
    assert len(out.splitlines()) == 3
