"""What laboratories write over their columns: every spelling is read as the same forces, and doubt is refused."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.errors import DatasetError, DescriptionError
from bowdenfit.files import spellings
from bowdenfit.files.spellings import parse_heading
from bowdenfit.kinds.forces.table import ForceTable

pytestmark = pytest.mark.extended

FORCE_IN, FORCE_OUT = np.array([20.5, 40.25, 61.0, 80.5]), np.array([15.25, 30.5, 45.25, 61.0])
SPELLINGS = [  # of the force at the motor and of that at the load
    ("input_force_N", "output_force_N"),
    ("Input force (N)", "Output force (N)"),
    ("Force input (N)", "Force output (N)"),
    ("Force (input) [N]", "Force (output) [N]"),
    ("force_in_N", "force_out_N"),
    ("Force in (N)", "Force out (N)"),
    ("F_in [N]", "F_out [N]"),
    ("Fin [N]", "Fout [N]"),
    ("F_in / N", "F_out / N"),
    ("F_i (N)", "F_o (N)"),
    ("FIn (N)", "FOut (N)"),
    ("T_in (N)", "T_out (N)"),
    ("T1 (N)", "T2 (N)"),
    ("T_1 [N]", "T_2 [N]"),
    ("F1 (N)", "F2 (N)"),
    ("Tension 1 (N)", "Tension 2 (N)"),
    ("tension_proximal (N)", "tension_distal (N)"),
    ("tension_proximal_N", "tension_distal_N"),
    ("Proximal tension [N]", "Distal tension [N]"),
    ("Tension (N) proximal", "Tension (N) distal"),
    ("pull (N)", "load (N)"),
    ("Pull force [N]", "Load [N]"),
    ("Motor (N)", "Load (N)"),
    ("Motor side (N)", "Load side (N)"),
    ("Force motor side (N)", "Force load side (N)"),
    ("Actuator force (N)", "End effector force (N)"),
    ("Cable tension at motor (N)", "Cable tension at load (N)"),
    ("Load cell input (N)", "Load cell output (N)"),
    ("Loadcell motor [N]", "Loadcell load side [N]"),
    ("Measured input force [N]", "Measured output force [N]"),
    ("InputForce (N)", "OutputForce (N)"),
    ("Mean force in (N)", "Mean force out (N)"),
    ("Kraft Eingang [N]", "Kraft Ausgang [N]"),
    ("Eingangskraft in N", "Ausgangskraft in N"),
    ("Kraft_ein_N", "Kraft_aus_N"),
    ("Seilkraft Motorseite [N]", "Seilkraft Lastseite [N]"),
    ("Zugkraft Antrieb (N)", "Zugkraft Abtrieb (N)"),
    ("Antriebskraft [N]", "Abtriebskraft [N]"),
    ("Force entrée (N)", "Force sortie (N)"),
    ("Force d'entrée [N]", "Force de sortie [N]"),
    ("Tension entrée en N", "Tension sortie en N"),
    ("Fuerza entrada [N]", "Fuerza salida [N]"),
    ("Fuerza de entrada (N)", "Fuerza de salida (N)"),
    ("Forza ingresso (N)", "Forza uscita (N)"),
]
NOT_FORCES = (
    "Kraft in N", "Force in N", "Force (N)", "T", "Load cell 1 (N)", "Input position (mm)", "T_in (degC)", "Motor current (A)",
    "Target force in (N)", "Input/output (N)", "Max. Kraft Eingang [N]", "Motor", "Zeit [s]",
)  # fmt: skip


def test_a_standard_deviation_of_a_force_is_none_of_the_forces():
    spelling = parse_heading("Force in, sd (N)")
    assert spelling is not None and (spelling.quantity, spelling.unit) == ("input_force_sd", "N")


def write(folder, headings, *columns, name="table.csv"):
    rows = zip(*(columns or (FORCE_IN, FORCE_OUT)), strict=True)
    lines = [";".join(headings), *(";".join(map(str, row)) for row in rows)]
    (folder / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder / name


def forces(path, **reading):
    table = bf.read(path, wrap_angle=(180, "deg"), **reading).measurements.table(ForceTable)
    return table.input_force, table.output_force


def test_the_table_of_spellings_has_sixty_and_no_one_twice():
    every = [heading for pair in SPELLINGS for heading in pair]
    assert len(every) == len(set(every)) >= 60


@pytest.mark.parametrize("headings", SPELLINGS, ids=lambda pair: pair[0])
def test_every_spelling_gives_the_same_forces_in_either_order_of_columns(tmp_path, headings):
    for path in (write(tmp_path, headings), write(tmp_path, headings[::-1], FORCE_OUT, FORCE_IN, name="turned.csv")):
        found_in, found_out = forces(path)
        np.testing.assert_array_equal(found_in, FORCE_IN)
        np.testing.assert_array_equal(found_out, FORCE_OUT)


def test_coefficients_do_not_depend_on_the_spelling(tmp_path):
    fits = [
        bf.fit(write(tmp_path, SPELLINGS[i], name=f"{i}.csv"), wrap_angle=(180, "deg"), mcmc=False, seed=1)
        for i in (0, 12, 20, 33)
    ]
    first, *remaining = [fit.least_squares.estimates["mu"].value for fit in fits]
    assert remaining == [first] * 3


def test_what_only_a_pair_says_is_remarked_on_with_the_options_that_turn_it_round(tmp_path):
    path = write(tmp_path, ("T1 (N)", "T2 (N)"))
    (message,) = [
        remark for remark in bf.read(path, wrap_angle=(180, "deg")).measurements.remarks if "'T1 (N)' is taken" in remark
    ]
    assert message.endswith("--column input_force='T2 (N)' --column output_force='T1 (N)'.")
    turned = write(tmp_path, ("T1 (N)", "T2 (N)"), FORCE_OUT, FORCE_IN, name="turned.csv")
    computed, _ = forces(turned, columns=["input_force=T2 (N)", "output_force=T1 (N)"])
    np.testing.assert_array_equal(computed, FORCE_IN)


@pytest.mark.parametrize("unit", ["kN", "lbf", "mN"])
def test_the_unit_of_another_spelling_counts(tmp_path, unit):
    factor = {"kN": 1e3, "lbf": 4.4482216152605, "mN": 1e-3}[unit]
    computed, _ = forces(write(tmp_path, (f"Kraft Eingang [{unit}]", f"Kraft Ausgang ({unit})")))
    np.testing.assert_allclose(computed, FORCE_IN * factor, rtol=1e-12)


@pytest.mark.parametrize("heading", NOT_FORCES)
def test_what_does_not_say_an_end_of_the_cable_is_taken_for_no_force_of_one(heading):
    heading_parts = parse_heading(heading)
    assert heading_parts is None or heading_parts.pair == "said" or "force" not in heading_parts.quantity


@pytest.mark.parametrize("headings", [("T1 (N)", "Force (N)"), ("T1 (N)", "F_out (N)"), ("load (N)", "hold (N)")])
def test_half_a_pair_says_nothing(tmp_path, headings):
    with pytest.raises(DatasetError, match=r"no column (in|out)put_force.*--column"):
        forces(write(tmp_path, headings))


@pytest.mark.parametrize(
    ("headings", "quantity"),
    [
        (("F_in (N)", "Force input (N)", "F_out (N)"), "input_force"),
        (("input_force_N", "Kraft Ausgang (N)", "output_force_N"), "output_force"),
        (("T1 (N)", "pull (N)", "T2 (N)", "load (N)"), "input_force"),
    ],
)
def test_two_columns_for_one_force_are_refused_with_the_option_that_settles_it(tmp_path, headings, quantity):
    columns = [FORCE_IN, FORCE_IN, FORCE_OUT, FORCE_OUT][: len(headings)]
    path = write(tmp_path, headings, *columns)
    with pytest.raises(DatasetError, match=rf"both look like {quantity}; say which, --column {quantity}='"):
        forces(path)
    named = [f"input_force={headings[0]}", f"output_force={headings[2]}"]
    np.testing.assert_array_equal(forces(path, columns=named)[1], FORCE_OUT)


def test_a_unit_that_no_heading_says_is_given_behind_a_colon_and_never_guessed(tmp_path):
    path = write(tmp_path, ("F_in", "F_out"))
    with pytest.raises(DatasetError, match=r"'F_in' does not state its unit.*--column input_force=F_in:N"):
        forces(path)
    computed, _ = forces(path, columns=["input_force=F_in:kN", "output_force=F_out:kN"])
    np.testing.assert_array_equal(computed, FORCE_IN * 1000)


def test_a_column_may_have_a_colon_in_its_heading(tmp_path):
    path = write(tmp_path, ("cell 1: N", "cell 2: N"))
    computed, _ = forces(path, columns=["input_force=cell 1: N:N", "output_force=cell 2: N:N"])
    np.testing.assert_array_equal(computed, FORCE_IN)


def test_of_several_tables_the_one_must_be_named(on_body):
    with pytest.raises(DescriptionError, match=r"--column angles\.efficiency=.*of angles and efficiencies"):
        bf.read(on_body, columns=["efficiency=efficiency_percent:%"])
    bf.read(on_body, columns=["efficiencies.efficiency=efficiency_percent:%"])
    with pytest.raises(DescriptionError, match="no table 'forces' with columns; it has angles and efficiencies"):
        bf.read(on_body, columns=["forces.input_force=a:N"])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("input_force", "not of the form QUANTITY=COLUMN:UNIT"),
        ("input_force=nothing", "no column 'nothing'"),
        ("inputforce=F_in (N)", "did you mean input_force"),
    ],
)
def test_a_column_that_cannot_be_is_refused_in_a_sentence(tmp_path, text, says):
    with pytest.raises(DatasetError, match=says):
        forces(write(tmp_path, ("F_in (N)", "F_out (N)")), columns=[text])


def test_no_word_says_two_things():
    words = [word for sentence in spellings._WORDS.values() for word in sentence.split()]
    names = [name for sentence in spellings._NAMES.values() for name in sentence.split("|")]
    assert len(words) == len(set(words))
    assert len(names) == len(set(names))
    assert not {*names} & {*spellings._GUESSES}


def test_strokes_are_read_in_five_languages_and_other_words_are_refused(tmp_path):
    words = ("Ziehen", "zurück", "tirer", "relâcher", "soltar", "rilascio", "loading", "return")
    columns = [40.0] * 8, [30, 50, 30, 50, 50, 50, 30, 50], words
    path = write(tmp_path, ("Kraft ein (N)", "Kraft aus (N)", "Richtung"), *columns)
    table = bf.read(path, wrap_angle=(180, "deg")).measurements.table(ForceTable)
    assert table.stroke.tolist() == [1, -1, 1, -1, -1, -1, 1, -1]
    path = write(tmp_path, ("F_in (N)", "F_out (N)", "direction"), FORCE_IN, FORCE_OUT, ["left"] * 4)
    with pytest.raises(DatasetError, match=r"'left' is not a stroke; .* rename a column that holds something else"):
        forces(path)
