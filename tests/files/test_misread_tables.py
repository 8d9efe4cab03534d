"""Tables that were once misread without a word: each is refused in a sentence that names the row, or read rightly."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.files.tables import read_csv
from bowdenfit.kinds.efficiencies.kind import EfficiencyTable
from bowdenfit.kinds.forces.table import ForceTable

HEADING = "input_force_N,output_force_N\n"


def refused(tmp_path, text, name="table.csv"):
    """The sentence with which a table is refused as it is read or checked."""
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(bf.BowdenfitError) as refusal:
        bf.read(tmp_path / name, wrap_angle=(180.0, "deg"))
    return str(refusal.value)


def numbers(tmp_path, text):
    """The numbers of a table, row by row."""
    (tmp_path / "table.csv").write_text(text, encoding="utf-8")
    return [[cell.number() for cell in row] for row in read_csv(tmp_path / "table.csv").rows]


def test_a_row_that_ends_before_a_column_of_numbers_is_refused(tmp_path):
    assert "table.csv, row 4: 1 cell where the headings have 2" in refused(tmp_path, HEADING + "10,8\n20,16\n30\n")


def test_a_row_may_end_before_columns_that_hold_remarks_or_nothing(tmp_path):
    text = "input_force_N,output_force_N,remark,\n10,8,first,\n20,16\n30,24,,\n"
    (tmp_path / "table.csv").write_text(text)
    assert len(read_csv(tmp_path / "table.csv").rows) == 3


@pytest.mark.parametrize("separator", [";", "\t", "|", "quoted"])
@pytest.mark.parametrize("last", [True, False])
def test_a_reading_with_other_separators_is_no_remark(tmp_path, separator, last):
    rows = [f"A,pull,{10 * i},{8 * i}.5" for i in range(1, 9)]
    odd = '"A,pull,90,72.5"' if separator == "quoted" else "A,pull,90,72.5".replace(",", separator)
    rows.insert(8 if last else 4, odd)
    (tmp_path / "table.csv").write_text("run,stroke,input_force_N,output_force_N\n" + "\n".join(rows) + "\n")
    with pytest.raises(bf.DatasetError, match=f"row {2 + rows.index(odd)}: .* looks like a row of readings"):
        read_csv(tmp_path / "table.csv")


def test_remarks_between_and_below_the_rows_are_left_out_as_before(tmp_path):
    text = HEADING + "10,8\nrope changed here\n20,16\n30,24\n\nmeasured on Monday, by hand\n"
    assert numbers(tmp_path, text) == [[10, 8], [20, 16], [30, 24]]


@pytest.mark.parametrize("thousand", ["1.000", "1,000"])
def test_three_digits_behind_a_mark_beside_whole_numbers_are_ambiguous(tmp_path, thousand):
    text = f"input_force_N;output_force_N\n200;140\n400;271\n600;411\n800;546\n{thousand};686\n"
    assert f"'{thousand}' may mean 1000 or 1.000" in refused(tmp_path, text)


def test_a_whole_column_in_thousands_beside_whole_numbers_is_ambiguous(tmp_path):
    text = "input_force_N;output_force_N\n1.000;686\n1.200;823\n1.400;961\n"
    sentence = refused(tmp_path, text)
    assert "'1.000' may mean 1000 or 1.000" in sentence and sentence.endswith("The same in rows 3 and 4.")


@pytest.mark.parametrize(
    "rows",
    [
        ["450;10.000;7.654", "460;20.000;15.308"],  # three decimals throughout, as loggers write
        ["450;10.0;7.5", "460;1.125;0.9"],
        ["450;12;9.125", "460;24;18.250"],
    ],
)
def test_three_decimals_are_decimals_where_the_column_has_no_whole_numbers(tmp_path, rows):
    text = "cable_length_mm;input_force_N;output_force_N\n" + "\n".join(rows) + "\n"
    assert numbers(tmp_path, text)[1][1] in (20.0, 1.125, 24.0)


def test_an_output_of_seven_times_the_input_is_refused_among_few_rows(tmp_path):
    text = HEADING + "200,140\n400,271\n600,411\n800,546\n100,686\n"
    assert "686 N at input_force 100 N" in refused(tmp_path, text)


def test_invisible_characters_make_no_other_run(tmp_path):
    text = "run,input_force_N,output_force_N\nA,10,8\nA\u200e,20,16\n\ufeffA,30,24\n"
    (tmp_path / "table.csv").write_text(text, encoding="utf-8")
    assert {row[0].text for row in read_csv(tmp_path / "table.csv").rows} == {"A"}


def measured_rows():
    """Sixteen rows at four wrap angles, with a noise of many last digits."""
    noise = iter(np.random.default_rng(3).normal(0, 0.1, 32))
    settings = [(angle, load) for angle in (45, 90, 180, 270) for load in (12, 23, 34, 45)]
    return [f"{a},{load + next(noise):.3f},{load * np.exp(-0.002 * a) + next(noise):.3f}" for a, load in settings]


@pytest.mark.parametrize(("copied", "location"), [(slice(0, 16), "rows 18 to 33"), (slice(4, 12), "rows 18 to 25")])
def test_rows_that_were_pasted_again_are_called_copies(tmp_path, run, copied, location):
    rows = measured_rows()
    text = "wrap_angle_deg,input_force_N,output_force_N\n" + "\n".join([*rows, *rows[copied]])
    (tmp_path / "t.csv").write_text(text + "\n")
    _, out, _ = run("check", tmp_path / "t.csv")
    first = f"rows {copied.start + 2} to {copied.stop + 1}"
    assert f"{location} of t.csv are copies of {first}" in " ".join(out.split()).replace("Rows", "rows")


def test_equal_readings_of_a_converter_with_coarse_steps_are_no_copies(tmp_path):
    """A cell with steps of 0.0488 N shows three decimals, and the same number again wherever noise is smaller than a step."""
    rows = [f"180,{load},{0.0488 * round(0.767 * load / 0.0488):.3f}" for load in range(12, 132, 12)]
    (tmp_path / "t.csv").write_text("wrap_angle_deg,input_force_N,output_force_N\n" + "\n".join(rows * 2) + "\n")
    assert "copies" not in str(bf.check(tmp_path / "t.csv"))


ANGLES = [
    "bend", "Bend (deg)", "curve", "curvature (deg)", "elbow (deg)", "Total direction change (deg)", "configuration (deg)",
    "theta", "Winkel", "deg", "Turns", "Wraps", "Umlenkwinkel [°]", "bend_rad", "Cable angle (deg)", "x (rad)",
]  # fmt: skip


@pytest.mark.parametrize("heading", ANGLES)
def test_a_column_that_may_be_wrap_angles_is_asked_about_and_never_passed_over(tmp_path, heading, run):
    (tmp_path / "t.csv").write_text(f"{heading},Input force (N),Output force (N)\n0.5,20,18\n1.0,40,33\n2.0,60,40\n")
    with pytest.raises(bf.DatasetError, match="likely to hold the wrap angle of each row"):
        bf.read(tmp_path / "t.csv", wrap_angle=(180.0, "deg"))
    code, out, _ = run("check", tmp_path / "t.csv")
    assert code == 2
    assert "--wrap-angle 180deg \\" not in out and "--column wrap_angle=" in out


def test_a_column_with_one_angle_in_every_row_is_asked_about(tmp_path, run):
    (tmp_path / "t.csv").write_text("bend_deg,Input force (N),Output force (N)\n90,20,18\n90,40,33\n90,60,40\n")
    with pytest.raises(bf.DatasetError, match="likely to hold the wrap angle of each row"):
        bf.read(tmp_path / "t.csv", wrap_angle=(180.0, "deg"))
    assert "--column wrap_angle=bend_deg" in run("check", tmp_path / "t.csv")[1]


OTHERS = ["Motor angle (deg)", "joint_angle_deg", "Temperature (degC)", "configuration", "angle_sd_deg"]


@pytest.mark.parametrize("heading", OTHERS)
def test_other_angles_and_labels_are_not_taken_for_wrap_angles(tmp_path, heading):
    (tmp_path / "t.csv").write_text(f"{heading},Input force (N),Output force (N)\n1,20,18\n2,40,33\n3,60,40\n")
    assert "3 force readings" in str(bf.check(tmp_path / "t.csv", wrap_angle=(180.0, "deg")))


def test_fractions_of_a_turn_are_numbers(tmp_path):
    assert numbers(tmp_path, "Turns,input_force_N\n1/4,10\n2 1/4,20\n0,30\n")[:2] == [[0.25, 10], [2.25, 20]]


def test_a_held_reading_in_the_first_row_can_be_checked(tmp_path, run):
    (tmp_path / "t.csv").write_text("stroke,input_force_N,output_force_N\nhold,15,13\npull,20,13.7\npull,40,27.4\n")
    code, out, err = run("check", tmp_path / "t.csv")
    assert code == 0, err
    assert "stroke hold" in out


@pytest.mark.parametrize("named", ["Input force (kN):N", "Input force (kN):lbf"])
def test_a_unit_that_contradicts_its_heading_is_refused(tmp_path, run, named):
    (tmp_path / "t.csv").write_text("Input force (kN),Output force (kN)\n1,0.682\n2,1.367\n3,2.064\n")
    code, _, err = run("check", tmp_path / "t.csv", "--column", f"input_force={named}", "--wrap-angle", "180deg")
    assert code == 2 and "its heading says kN" in err
    assert run("check", tmp_path / "t.csv", "--column", "input_force=Input force (kN):kN", "--wrap-angle", "180deg")[0] == 0


def test_a_known_quantity_in_an_unknown_unit_is_named(tmp_path):
    (tmp_path / "t.csv").write_text("wrap_angle_deg,wrap_angle [bit] (mean),input_force_N,output_force_N\n90,3,10,8\n")
    with pytest.raises(bf.DatasetError, match="is not just a unit; state the unit that its numbers are in"):
        bf.read(tmp_path / "t.csv")


def in_two_encodings(path, first, second, rows):
    """Write rows of which the second half is in another encoding."""
    half = len(rows) // 2
    path.write_bytes(("\n".join(rows[:half]) + "\n").encode(first) + ("\n".join(rows[half:]) + "\n").encode(second))
    return half + 1


@pytest.mark.parametrize(
    ("first", "second"),
    [("utf-16", "utf-8"), ("utf-8", "utf-16-le"), ("utf-8-sig", "utf-16"), ("utf-16", "utf-16-be"), ("utf-16", "cp1252")],
)
@pytest.mark.parametrize("separator", [",", "\t"])
@pytest.mark.parametrize("many", [40, 600])
def test_a_file_in_two_encodings_is_refused(tmp_path, run, first, second, separator, many):
    rows = [f"180,{10 + i % 50},{0.7 * (10 + i % 50):.1f}" for i in range(many)]
    head = "time_s" if many == 600 else "wrap_angle_deg"
    rows = [row.replace(",", separator) for row in [f"{head},input_force_N,output_force_N", *rows]]
    row = in_two_encodings(tmp_path / "t.csv", first, second, rows)
    code, out, err = run("check", tmp_path / "t.csv")
    words = " ".join((out + err).split())
    assert code == 2 and (("in UTF-" in words and f"row {row}" in words) or "not a text file" in words), words


def test_a_file_in_utf_16_that_is_cut_inside_a_letter_is_refused(tmp_path):
    text = HEADING + "10,8\n20,16\n30,24\n40,32"
    (tmp_path / "t.csv").write_bytes(text.encode("utf-16")[:-1])
    with pytest.raises(bf.DatasetError, match="breaks off inside a letter"):
        read_csv(tmp_path / "t.csv")


@pytest.mark.parametrize("remark", ["これはばねのちからのけいそくです", "मापन केबल के साथ", "在實驗室測量的力", "+ – … †‡ €"])
def test_a_file_in_utf_16_may_have_remarks_in_any_language(tmp_path, remark):
    text = f"# {remark}\ninput_force_N,output_force_N,{remark.replace(',', '')}\n10,8,{remark}\n20,16,\n30,24,\n"
    (tmp_path / "t.csv").write_text(text, encoding="utf-16")
    assert len(read_csv(tmp_path / "t.csv").rows) == 3


RUNS = ["run,stroke,input_force_N,output_force_N", *(f"{i},pull,{10 * i},{7 * i}.5" for i in range(1, 7))]


OTHER_ORDER = ["stroke,run,output_force_N,input_force_N", *(f"pull,{i},{7 * i}.5,{10 * i}" for i in range(7, 10))]


@pytest.mark.parametrize("below", [OTHER_ORDER, ["one,two,three,four", *RUNS[1:3]]])
def test_readings_below_other_headings_are_refused(tmp_path, below):
    assert "table.csv, row 8: every column has words" in refused(tmp_path, "\n".join([*RUNS, *below]) + "\n")


def test_readings_above_the_headings_of_most_rows_are_refused(tmp_path):
    text = "\n".join([*OTHER_ORDER, *RUNS]) + "\n"
    assert "table.csv, row 2: a row of a table ('pull 7 49.5 70') is above the headings in row 5" in refused(tmp_path, text)


def test_headings_may_come_again_in_another_spelling(tmp_path):
    again = ["Run,Stroke,Input force N,Output Force [N]", "8,pull,80,56.5", "9,pull,90,63.5"]
    (tmp_path / "table.csv").write_text("\n".join([*RUNS, *again]) + "\n")
    assert len(read_csv(tmp_path / "table.csv").rows) == 8


def test_a_column_that_pandas_numbered_is_not_passed_over(tmp_path, run):
    (tmp_path / "t.csv").write_text("input_force_N,output_force_N,output_force_N.1\n20,15,14\n40,31,30\n60,46,44\n")
    code, out, _ = run("check", tmp_path / "t.csv")
    assert code == 2 and "'output_force_N' and 'output_force_N.1' both look like output_force" in " ".join(out.split())
    code, out, _ = run("check", tmp_path / "t.csv", "--column", "output_force=output_force_N.1")
    assert code == 0 and "output_force_N 14.000" in out


def test_forces_that_pandas_numbered_are_proposed_in_their_order(tmp_path, run):
    rows = "\n".join(f"{stroke},{f},{factor * f}" for f in (20, 40, 60) for stroke, factor in (("pull", 0.7), ("return", 1.4)))
    (tmp_path / "t.csv").write_text(f"stroke,Force (N),Force (N).1\n{rows}\n")
    _, out, _ = run("check", tmp_path / "t.csv")
    assert "--column input_force='Force (N)' --column output_force='Force (N).1'" in " ".join(out.replace("\\", "").split())
    named = ["--column", "input_force=Force (N)", "--column", "output_force=Force (N).1"]
    assert run("check", tmp_path / "t.csv", *named)[0] == 0


def test_a_column_that_is_read_already_is_not_proposed_for_another_quantity(tmp_path):
    assert "is it" not in refused(tmp_path, "Input force (N),Loss (X)\n20,5\n40,9\n")


def efficiencies(tmp_path, text):
    (tmp_path / "t.csv").write_text(text)
    return bf.read(tmp_path / "t.csv").measurements.table(EfficiencyTable).efficiency.tolist()


@pytest.mark.parametrize(
    ("heading", "cells"),
    [("Loss (%)", ("20", "35")), ("Verlust", ("0.2", "0.35")), ("loss", ("20 %", "35 %")), ("Output/Input (%)", ("80", "65")),
     ("F_out/F_in", ("0.8", "0.65")), ("force ratio [%]", ("80", "65"))],
)  # fmt: skip
def test_losses_and_ratios_are_read_as_efficiencies(tmp_path, heading, cells):
    assert np.allclose(efficiencies(tmp_path, f"wrap_angle_deg,{heading}\n90,{cells[0]}\n180,{cells[1]}\n"), [0.8, 0.65])


@pytest.mark.parametrize(
    ("text", "case"),
    [
        ("wrap_angle_deg,loss\n90,20\n180,35\n", "if it is in percent, name the column loss_percent"),
        ("wrap_angle_deg,Loss (N)\n90,2\n180,3\n", "'N' does not measure a ratio"),
        ("run,wrap_angle_deg,efficiency\nA,90,0.8\nA,90,0.81\nB,180,0.7\n", "run 'A' has an efficiency in row 2 too"),
        ("stroke,wrap_angle_deg,efficiency\npull,90,0.8\nreturn,90,0.81\n", "'return' is not pulling"),
    ],
)
def test_efficiencies_that_would_be_misread_are_refused(tmp_path, text, case):
    with pytest.raises(bf.DatasetError, match=case):
        efficiencies(tmp_path, text)


def test_runs_of_efficiencies_may_come_back_at_another_bend(tmp_path):
    text = "run,stroke,wrap_angle_deg,efficiency\nA,pull,90,0.8\nA,pull,180,0.71\nB,pull,180,0.7\n"
    assert efficiencies(tmp_path, text) == [0.8, 0.71, 0.7]


@pytest.mark.parametrize("code", ["-9999", "-999.9", "-999.0", "-99", "-32768"])
def test_a_code_for_a_missing_reading_in_a_table_is_named(tmp_path, code):
    refusal = refused(tmp_path, f"{HEADING}20,15\n40,{code}\n60,46\n")
    assert f"row 3, column 'output_force_N': '{code}' is a code that programs write where a reading is missing" in refusal


@pytest.mark.parametrize(("digits", "computed"), [(10, True), (6, True), (2, False)])
def test_forces_without_any_noise_are_said_to_be_computed(tmp_path, digits, computed):
    rows = [f"{a},{f},{f * np.exp(-0.002 * a):.{digits}f}" for a in (45, 90, 135) for f in (10, 20, 30)]
    (tmp_path / "t.csv").write_text("\n".join(["wrap_angle_deg,input_force_N,output_force_N", *rows]) + "\n")
    remarks = bf.read(tmp_path / "t.csv").measurements.remarks
    assert any("these forces were computed" in remark for remark in remarks) == computed


BY_ANGLE = "10,9.2,8.5,7.3\n20,18.5,17,14.6\n30,27.7,25.6,21.9\n"
BY_LOAD = "45,9.2,18.5,27.7\n90,8.5,17,25.6\n180,7.3,14.6,21.9\n"


@pytest.mark.parametrize(
    ("heading", "body"),
    [
        ("Input force (N),45°,90°,180°", BY_ANGLE),
        ("F_in [N];45 deg;90 deg;180 deg", BY_ANGLE.replace(",", ";")),
        ("Wrap angle (deg),10 N,20 N,30 N", BY_LOAD),
    ],
)
def test_a_pivot_table_of_output_forces_is_read_cell_by_cell(tmp_path, heading, body):
    (tmp_path / "t.csv").write_text(f"{heading}\n{body}", encoding="utf-8")
    data = bf.read(tmp_path / "t.csv")
    rows = data.measurements.table(ForceTable)
    readings = sorted(zip(np.rad2deg(rows.own.angle[:, 0]).round(), rows.input_force, rows.output_force, strict=True))
    assert readings == [
        (45, 10, 9.2), (45, 20, 18.5), (45, 30, 27.7), (90, 10, 8.5), (90, 20, 17), (90, 30, 25.6), (180, 10, 7.3),
        (180, 20, 14.6), (180, 30, 21.9),
    ]  # fmt: skip
    assert any("over columns are taken as" in sentence for sentence in data.measurements.remarks)


@pytest.mark.parametrize(
    ("heading", "body"),
    [
        ("F_in (N),45,90,180", BY_ANGLE),  # angles, but in which unit?
        ("Load,45°,90°,180°", BY_ANGLE),
        ("Output force (N),45°,90°,180°", BY_ANGLE),
        ("Input force (N),45°,90°,180°", "10,0.92,0.85,0.73\n20,0.92,0.85,0.73\n30,0.92,0.85,0.73\n"),
    ],
)
def test_another_pivot_table_is_answered_with_how_to_write_it(tmp_path, run, heading, body):
    (tmp_path / "t.csv").write_text(f"{heading}\n{body}", encoding="utf-8")
    code, out, _ = run("check", tmp_path / "t.csv")
    printed = " ".join(out.split())
    assert code == 2 and "as in a pivot table" in printed
    assert "write one row for each reading" in printed and "NAME" not in printed


def test_a_table_of_wrap_angles_by_length_is_said_to_be_one(tmp_path, run):
    (tmp_path / "angles.csv").write_text("cable_length_mm,free_angle_deg,squeezed_angle_deg\n430,0,90\n480,25,70\n530,50,60\n")
    code, out, _ = run("check", tmp_path / "angles.csv")
    printed = " ".join(out.split())
    assert code == 0 and "a table of wrap angles at 3 lengths" in printed
    assert '[tables] angles = { file = "angles.csv" }' in printed
    assert "NAME" not in printed


def test_ambiguous_thousands_are_said_once_a_column(tmp_path):
    refusal = refused(tmp_path, HEADING + '"1,000",730\n"1,200",876\n"1,400","1,022"\n')
    assert "'1,000' may mean 1000 or 1.000" in refusal and "The same in rows 3 and 4." in refusal


@pytest.mark.parametrize(("heading", "below"), [("Output force (N)", "[N]"), ("Output force (kg)", "kgf"), ("F_out", "N")])
def test_a_unit_below_a_heading_that_agrees_with_it_is_read(tmp_path, heading, below):
    (tmp_path / "t.csv").write_text(f"Input force (N),{heading}\nN,{below}\n10,1\n20,2\n30,3\n")
    assert len(read_csv(tmp_path / "t.csv").rows) == 3


@pytest.mark.parametrize("behind", ["N", "kN", "lbf"])
def test_a_named_column_keeps_the_unit_behind_its_heading(tmp_path, run, behind):
    (tmp_path / "t.csv").write_text(f"F_in_{behind},cell_B_{behind}\n10,8\n20,16\n30,24\n")
    columns = ["--column", f"input_force=F_in_{behind}", "--column", f"output_force=cell_B_{behind}"]
    assert run("check", tmp_path / "t.csv", *columns, "--wrap-angle", "180deg")[0] == 0
    columns[1] += ":mN"
    code, _, err = run("check", tmp_path / "t.csv", *columns, "--wrap-angle", "180deg")
    assert code == 2 and f"its heading says {behind}" in err
