"""Tables of one force and a position: what is read, what is refused and said, which turns each reading comes after."""

import numpy as np
import pytest
from catheters import TRUTH, Catheter, bench, cycles
from spoiled_input import copied, spoil

import bowdenfit as bf
from bowdenfit.kinds.displacement.table import DisplacementTable, follow_motor
from bowdenfit.kinds.rows import describe_range, format_fixed
from bowdenfit.questions.check.data_set_words import describe_data_set

NAMES = ("cable.toml", "displacement.csv")
TOML, CSV = NAMES
SLIDING = """wrap_angle_deg,stroke,displacement_mm,force_N
180,pull,4,1.9
180,pull,8,4.1
180,pull,12,6.2
180,return,12,3.1
180,return,8,2.0
"""
STOP = ('end = "spring"', 'end = "stop", stop = { value = 12, unit = "mm" }')


@pytest.fixture
def catheter(on_body, tmp_path):
    """A copy of the synthetic catheter to spoil."""
    return copied(on_body.parent / "synthetic-catheter", NAMES, tmp_path / "cable")


def test_the_synthetic_catheter_is_what_its_simulator_makes(on_body):
    folder = on_body.parent / "synthetic-catheter"
    assert (folder / CSV).read_text() == bench(2026)
    assert all(f'"{name}": {value}' in (folder / "truth.json").read_text() for name, value in TRUTH.items())


def test_every_row_is_a_reading_or_said_to_be_unused(catheter):
    data = bf.read(catheter)
    table = data.measurements.table(DisplacementTable)
    assert len(table.used) == data.accounts[0].read == 147
    text = " ".join(describe_data_set(data).split())
    assert f"{table.used.sum()} forces against displacement in 3 runs" in text
    assert f"{147 - table.used.sum()} of 147 rows are not used" in text
    assert 120 < table.used.sum() < 147
    assert "turns of the motor" in text
    assert "a spring whose stiffness is fitted" in text


SPOILED = [
    (CSV, "force_N", "force", ["'force'", "does not state its unit"]),
    (CSV, "displacement_mm", "displacement_N", ["'displacement_N'", "does not measure a length"]),
    (CSV, "displacement_mm", "angle_of_motor", ["no column displacement", "displacement_mm"]),
    (CSV, "180,2.", "180,x2.", ["row 2", "plain number"]),
    (CSV, "wrap_angle_deg", "wrap_deg", ["wrap_angle", "sheath"]),
    (TOML, 'end = "spring"', 'end = "wall"', ["tables.displacement.end", "spring"]),
    (TOML, 'end = "spring"', 'stop = { value = 3, unit = "mm" }', ["where a stop is", 'end = "stop"']),
    (TOML, 'end = "spring"', 'end = "stop", stop = { value = 3, unit = "N" }', ["does not measure a length"]),
    (TOML, 'end = "spring"', 'end = "stop", stop = { value = 30, unit = "mm" }', ["30 mm", "never reached", "pull on"]),
    (TOML, 'end = "spring"', 'rows = "sliding"', ["no stroke column", 'rows = "in order"']),
    (TOML, "[tables]", '[cable]\nkind = "loop"\n[tables]', ["a loop has two", "one rope alone"]),
    (TOML, "[[contact]]", 'friction_model = "drag"\n[[contact]]', ["capstan", "leave it out"]),
]


@pytest.mark.parametrize(("name", "old", "new", "message"), SPOILED)
def test_bad_input_is_refused_with_a_remedy(catheter, refuse, name, old, new, message):
    path = catheter / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    sentence = refuse("check", catheter)
    assert all(part in sentence for part in message), sentence


def with_columns(catheter, change):
    """The table with its numbers changed."""
    lines = (catheter / CSV).read_text().splitlines()
    rows = change(np.array([line.split(",") for line in lines[1:]], dtype=float))
    (catheter / CSV).write_text("\n".join([lines[0], *(",".join(f"{x:.4f}" for x in row) for row in rows)]) + "\n")


CHANGES = {
    "a dead cell": (lambda rows: np.column_stack([rows[:, :2], 0.3 + 0 * rows[:, 2]]), ["does not follow", "dead"]),
    "a displacement counted the other way": (lambda rows: rows * [1, -1, 1], ["falls while the displacement grows"]),
    "a force with the other sign": (lambda rows: rows * [1, 1, -1], ["negative", "sign convention"]),
    "rows the wrong way round": (
        lambda rows: np.concatenate([np.column_stack([p[:33, :2], p[32::-1, 2]]) for p in np.split(rows, 3)]),
        ["the return takes more force", "wrong way round"],
    ),
    "a stop that is never reached": (
        lambda rows: np.column_stack([rows[:, :2], 0.1 + 0.01 * np.sin(7 * np.arange(len(rows)))]),
        ["never reached"],
    ),
}


@pytest.mark.parametrize("case", CHANGES)
def test_forces_that_no_rope_with_a_spring_has_are_refused(catheter, refuse, case):
    change, message = CHANGES[case]
    with_columns(catheter, change)
    sentence = refuse("check", catheter)
    assert all(part in sentence for part in message), sentence


def test_a_run_of_one_reading_is_refused_unless_it_is_said_where_its_displacement_begins(catheter, refuse):
    """A wrap angle ten times too large made a run of its own, whose zero was 500 mm off, and all was said to be well."""
    lines = (catheter / CSV).read_text().splitlines()
    lines[41] = lines[41].replace("180,", "1800,", 1)
    (catheter / CSV).write_text("\n".join(lines))
    sentence = refuse("check", catheter)
    assert all(
        part in sentence for part in ("row 42 (1800 deg)", "a run of one reading", "slipped digit", "leave the row out")
    )
    with (catheter / TOML).open("a") as toml:
        toml.write("\n[prior.displacement_zero_2]\nfixed = 0.4\n")
    assert len(bf.read(catheter).measurements.table(DisplacementTable).run_names) == 4


def test_a_second_force_is_refused_and_two_names_of_one_column_too(catheter, refuse):
    (catheter / CSV).write_text("wrap_angle_deg,displacement_mm,force_N,output_force_N\n180,1,2,1\n180,2,4,3\n")
    assert "tables.forces" in refuse("check", catheter)
    (catheter / CSV).write_text("wrap_angle_deg,displacement_mm,position_mm,force_N\n180,1,1,2\n180,2,2,4\n")
    assert "both read as displacement" in refuse("check", catheter)


def test_rows_with_strokes_are_taken_while_all_of_the_rope_slides(catheter, refuse):
    (catheter / CSV).write_text(SLIDING)
    data = bf.read(catheter)
    table = data.measurements.table(DisplacementTable)
    assert table.sliding and table.used.all() and table.motion.slides.all()
    text = describe_data_set(data)
    assert 'rows = "in order"' in text
    assert "only to a factor of two" in text
    spoil(catheter / CSV, "pull,8", "hold,8")
    assert "held reading" in refuse("check", catheter)


def test_a_free_spring_without_a_closed_loop_is_warned_of(catheter):
    with_columns(catheter, lambda rows: np.concatenate([part[:17] for part in np.split(rows, 3)]))
    assert "friction cannot be separated from the stiffness" in describe_data_set(bf.read(catheter))


def test_rows_before_a_stop_are_counted_and_left_out(catheter):
    spoil(catheter / TOML, *STOP)
    data = bf.read(catheter)
    table = data.measurements.table(DisplacementTable)
    initial = int(np.sum(table.displacement <= 12))
    assert not np.any(table.used & (table.displacement <= 12))
    assert "rows lie before the stop" in describe_data_set(data) and initial > 10


PLAN = """name = "planned"
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { column = "wrap_angle" }
[tables]
displacement = { file = "tip.csv" }
[design.displacement]
displacements = [2, 5, 8, 11, 14, 17, 20]
wrap_angles = [180, 360]
[truth]
mu = 0.1
end_spring = 0.5
rope_give = 0.1
tau = 0
sigma_F = 0.01
sigma_x = 0
input_offset = 0
displacement_zero_1 = 1
displacement_zero_2 = 1
"""


def test_a_plan_is_simulated_row_by_row_as_friction_at_every_place_has_it(tmp_path, accept):
    (tmp_path / "bench.toml").write_text(PLAN)
    accept("simulate", tmp_path / "bench.toml", "-o", tmp_path / "out", "--seed", 1)
    text = describe_data_set(bf.read(tmp_path / "out"))
    assert "in 2 runs" in text
    rows = np.loadtxt(tmp_path / "out" / "tip.csv", delimiter=",", skiprows=1, usecols=(0, 2, 3))
    for bend in (180, 360):
        x, force = rows[rows[:, 0] == bend, 1:].T
        reference = Catheter(0.1 * np.deg2rad(bend), 0.5, 5.0, 1.0).pulled(x)
        np.testing.assert_allclose(force[7:], reference[7:], atol=0.06)  # the first stroke is from a slack rope


def test_of_a_long_table_some_rows_are_used_and_all_turns(catheter):
    motion = cycles(2.0, 24.0, 1000, 2)
    force = Catheter(0.5, 0.6, 9.0).pulled(motion[::50])
    rows = zip(motion, np.interp(np.arange(len(motion)), np.arange(0, len(motion), 50), force), strict=True)
    lines = ["wrap_angle_deg,displacement_mm,force_N", *(f"180,{x},{f}" for x, f in rows)]
    (catheter / CSV).write_text("\n".join(lines) + "\n")
    data = bf.read(catheter)
    table = data.measurements.table(DisplacementTable)
    assert 300 < table.used.sum() <= 600 and len(table.motion.turns.at) == 4
    assert "is used" in describe_data_set(data)


def test_turns_are_remembered_and_forgotten_once_they_are_passed():
    points = np.array([0, 10, 20, 30, 20, 10, 15, 20, 25, 22, 25, 29, 31, 30, 0, -5], dtype=float)
    motion = follow_motor(points, np.zeros(len(points), dtype=int))
    assert motion.turns.at.tolist() == [0, 30, 10, 25, 22, 31]
    came_after = motion.turns.at[motion.after].tolist()
    #                     pull, back from 30, pull from 10, back from 25, pull from 22, from 10 again, from 0, back from 31
    assert came_after == [0, 0, 0, 0, 30, 30, 10, 10, 10, 25, 10, 10, 0, 31, 0, 0]
    assert motion.slides.tolist() == [False] * 14 + [True] * 2
    assert motion.first.sum() == 4
    jitter = follow_motor(np.array([0, 10, 20.05, 20, 20.06, 30, 20], dtype=float), np.zeros(7, dtype=int))
    assert jitter.turns.at.tolist() == [0, 30]


def test_forces_of_any_size_are_written_with_their_digits():
    """Files of `simulate`, and the rows that `check` shows."""
    assert format_fixed([12.3456, 2.0], 3) == ["12.346", "2.000"]
    assert format_fixed([0.0, 2.5242e-5, np.nan], 4) == ["0.000000000", "0.000025242", "nan"]
    assert describe_range(np.array([9079.0, 226412.0]), "N") == "9079 to 226400 N"
