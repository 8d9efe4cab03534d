"""Everything that is wrong is said at once, each fault once with its remedy, and none that another brings about."""

import re

import pytest

import bowdenfit as bf
from bowdenfit.description.file import PLACEHOLDERS
from bowdenfit.errors import DatasetError, Faults, combine_errors

CABLE = """
schema = 1
name = "bench"
[route]
unit = "mm"
range = [400, 500]
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { curve = "gaussian", column = "sheath_angle" }
[tables]
angles = { file = "angles.csv" }
forces = { files = ["one.csv", "two.csv"] }
efficiencies = { file = "efficiencies.csv" }
"""
ANGLES = "cable_length_mm,sheath_angle_deg\n400,10\n430,20\n460,40\n500,80\n"
FORCES = "cable_length_mm,input_force_N,output_force_N\n430,50,40\n460,50,38\n"
EFFICIENCIES = "cable_length_mm,efficiency\n430,0.8\n460,0.75\n"


@pytest.fixture
def bench(tmp_path):
    """Writes a bench, with some of its files spoiled."""

    def made(**changed):
        files = {"cable.toml": CABLE, "angles.csv": ANGLES, "one.csv": FORCES, "two.csv": FORCES}
        files |= {"efficiencies.csv": EFFICIENCIES} | {name.replace("_", "."): text for name, text in changed.items()}
        folder = tmp_path / "bench"
        folder.mkdir()
        for name, text in files.items():
            (folder / name).write_text(text)
        return folder

    return made


def test_the_bench_is_right_where_nothing_is_spoiled(bench):
    assert bf.read(bench()).measurements.tables


def test_every_file_every_row_and_every_column_is_named_at_once(bench, refuse):
    folder = bench(
        angles_csv="cable_length_mm,sheath_angle_deg\n400,x\n430,-20\n460,40\n500,80\n",
        one_csv="cable_length_mm,input_force_N,output_force_N\n430,-50,40\n460,50,none\n",
        two_csv="cable_length_mm,input_force,output_force_lb\n430,50,40\n",
        efficiencies_csv="cable_length_mm,efficiency\n430,80\n460,\n",
    )
    message = refuse("check", folder, faults=8)
    for place in (
        "angles.csv, row 2, column 'sheath_angle_deg': 'x' is not a number",
        "angles.csv, row 3, column 'sheath_angle_deg': '-20' is negative",
        "one.csv, row 2, column 'input_force_N': '-50' is not positive",
        "one.csv, row 3, column 'output_force_N': the cell is blank",
        "two.csv: the column 'input_force' does not state its unit",
        "'output_force_lb'",
        "efficiencies.csv, row 2, column 'efficiency': an efficiency of '80' is above 1",
        "efficiencies.csv, row 3, column 'efficiency': the cell is blank",
    ):
        assert place in message, message


def test_fit_refuses_with_the_same_list_as_check(bench, refuse, run):
    folder = bench(one_csv=FORCES.replace("38", "x"), efficiencies_csv=EFFICIENCIES.replace("0.75", "-1"))
    assert refuse("check", folder, faults=2) == refuse("fit", folder, faults=2)


def test_the_same_fault_of_many_rows_is_said_once_with_its_rows(bench, refuse):
    rows = "".join(f"430,{-50 - i},40\n" for i in range(30))
    message = refuse("check", bench(one_csv="cable_length_mm,input_force_N,output_force_N\n" + rows))
    assert "row 2, column 'input_force_N': '-50' is not positive" in message
    assert message.rstrip().endswith("The same in rows 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14 and 17 more.")


def test_of_many_different_faults_twenty_are_said_and_the_rest_counted():
    faults = Faults([DatasetError(f"file {i} is missing; add it.") for i in range(32)])
    with pytest.raises(DatasetError) as error:
        faults.refuse()
    lines = str(error.value).splitlines()
    assert (lines[0], len(lines), lines[-1]) == ("32 things are wrong:", 22, "- and 12 more.")
    assert len(error.value.faults) == 32
    assert len(combine_errors([error.value, DatasetError("one more.")]).faults) == 33


def test_a_column_that_is_missing_is_one_fault_however_many_rows_need_it(bench, refuse):
    message = refuse("check", bench(one_csv="cable_length_mm,input_force_N\n430,50\n460,50\n"))
    assert "one.csv has no column output_force" in message


def test_keys_of_the_description_are_refused_together(bench, refuse):
    spoiled = CABLE.replace('friction = "mu"', "").replace("range = [400, 500]", "range = [500, 400]")
    spoiled = spoiled.replace("[tables]", "[sensors]\nforce_nose = 1\n[tables]")
    message = refuse("check", bench(cable_toml=spoiled), faults=3)
    for name in ("contact.0.friction", "[lowest, highest]", "force_nose"):
        assert name in message


def test_a_misspelled_key_is_not_missing_as_well(bench, refuse):
    message = refuse("check", bench(cable_toml=CABLE.replace("[[contact]]", "[[contatc]]")))
    assert "did you mean 'contact'?" in message


def test_contradictions_of_a_description_are_said_together(bench, refuse):
    spoiled = CABLE.replace("[route]", 'geometry = "published"\nstudent_degrees_of_freedom = 6\n[route]')
    spoiled = spoiled.replace('{ curve = "gaussian", column', "{ column").replace('angles = { file = "angles.csv" }\n', "")
    message = refuse("check", bench(cable_toml=spoiled + '[friction.mi]\nfixed = 0.1\n'), faults=3)
    for words in ("needs contacts with a curve", "student_degrees_of_freedom", "friction.mi"):
        assert words in message


def test_tables_are_looked_at_too_where_a_key_is_wrong_that_they_do_not_ask_for(bench, refuse):
    spoiled = CABLE.replace('"bench"', '"NAME OF THE CABLE"') + "[sampler]\nn_walker = 3\n[sensors]\noffset_sd = 3\n"
    message = refuse("check", bench(cable_toml=spoiled, two_csv=FORCES.replace("50,40", "50,y")), faults=4)
    for words in ("line 3: 'NAME OF THE CABLE' is left from the template", "n_walker", "a number needs its unit", "'y'"):
        assert words in message


def test_rows_outside_the_range_and_contacts_without_angles_are_all_named(bench, refuse):
    outside = FORCES.replace("430,", "600,").replace("460,", "700,")
    message = refuse("check", bench(one_csv=outside))
    assert "row 2, column 'cable_length': 600 mm lies outside" in message and "The same in row 3." in message


def test_readings_that_a_bad_table_needs_bring_no_faults_of_their_own(bench, refuse):
    (message,) = [refuse("check", bench(angles_csv=ANGLES.replace("sheath_angle_deg", "sheath_angle")))]
    assert "does not state its unit" in message


def test_every_placeholder_of_the_template_is_refused_with_its_line(run, refuse, tmp_path):
    folder = tmp_path / "cable"
    run("init", folder)
    lines = (folder / "cable.toml").read_text().splitlines()
    message = refuse("check", folder, faults=5)
    for number, line in enumerate(lines, start=1):
        for word in PLACEHOLDERS:
            if f'"{word}"' in line.partition("#")[0]:
                assert f"cable.toml, line {number}: '{word}'" in message
    assert refuse("fit", folder, faults=5) == message


def test_whatever_stands_in_capitals_in_the_template_is_a_placeholder(run, tmp_path):
    run("init", tmp_path / "cable")
    text = (tmp_path / "cable" / "cable.toml").read_text()
    capitals = re.findall(r'"([A-Z][A-Z ,]+)"', "\n".join(line.partition("#")[0] for line in text.splitlines()))
    assert set(capitals) == set(PLACEHOLDERS)
