"""What a refusal advises is right: done as it says, the data are read, and give the friction they were made with."""

import shlex

import numpy as np
import pytest

import bowdenfit as bf

MU, ANGLE = 0.12, np.pi
LOADS = np.array([10.0, 20.0, 30.0, 40.0, 50.0])


def write(folder, headings, *columns):
    rows = [",".join(map(str, row)) for row in zip(*columns, strict=True)]
    (folder / "t.csv").write_text("\n".join([headings, *rows]) + "\n")
    return folder / "t.csv"


def pulls_and_returns(ratio, seed=1):
    """Return strokes, input and output forces [N] of a bend of 180 deg, whose output cell reads the force over a ratio."""
    generator = np.random.default_rng(seed)
    stroke = np.repeat([1, -1], 2 * len(LOADS))
    force_in = np.tile(LOADS, 4) * (1 + 0.003 * generator.normal(size=len(stroke)))
    force_out = force_in * np.exp(-stroke * MU * ANGLE) / ratio * (1 + 0.003 * generator.normal(size=len(stroke)))
    return stroke, force_in.round(3), force_out.round(3)


def coefficient(path, **reading):
    """Return the coefficient of friction by least squares."""
    return bf.fit(path, mcmc=False, seed=1, **reading).least_squares.estimates["mu"].value


@pytest.mark.parametrize("ratio", [2.0, 5.0, 12.0, 0.5])
def test_a_ratio_of_a_table_with_both_strokes_is_estimated_and_stating_it_mends_the_fit(tmp_path, ratio):
    path = write(tmp_path, "stroke,input_force_N,output_force_N", *pulls_and_returns(ratio))
    with pytest.raises(bf.DatasetError, match="a lever, a pulley or a drum") as refusal:
        bf.read(path, wrap_angle="180deg")
    advised = float(str(refusal.value).partition("sensors.output_ratio=")[2].rstrip("."))
    assert advised == pytest.approx(ratio, rel=0.02)
    assert coefficient(path, wrap_angle="180deg", settings=[f"sensors.output_ratio={ratio}"]) == pytest.approx(MU, rel=0.02)


@pytest.mark.parametrize(("ratio", "units"), [(4.448, "lbf and N"), (9.807, "kgf and N"), (1 / 9.807, "kgf and N")])
def test_a_ratio_that_is_that_of_two_units_names_them(tmp_path, ratio, units):
    path = write(tmp_path, "stroke,input_force_N,output_force_N", *pulls_and_returns(ratio))
    with pytest.raises(bf.DatasetError, match=f"the unit in one heading, {units} mistaken"):
        bf.read(path, wrap_angle="180deg")


def test_a_table_of_one_stroke_with_more_out_than_in_is_told_of_ratios_too(tmp_path):
    force_in = np.tile(LOADS, 3)
    path = write(tmp_path, "input_force_N,output_force_N", force_in, (force_in * 1.9).round(2))
    with pytest.raises(bf.DatasetError, match=r"columns input_force and output_force are swapped.*sensors.output_ratio"):
        bf.read(path, wrap_angle="60deg")


def test_an_output_in_millinewtons_under_a_heading_in_newtons_is_named_by_its_unit(tmp_path):
    angle, force_in = np.repeat([90, 180, 270], 5), np.tile(LOADS, 3)
    force_out = (1000 * force_in * np.exp(-MU * np.radians(angle))).round()
    path = write(tmp_path, "wrap_angle_deg,input_force_N,output_force_N", angle, force_in, force_out)
    with pytest.raises(bf.DatasetError, match=r"15 of 15 rows.*unit in one heading.*N and mN"):
        bf.read(path)
    assert coefficient(write(tmp_path, "wrap_angle_deg,input_force_N,output_force_mN", angle, force_in, force_out)) == (
        pytest.approx(MU, rel=0.01)
    )


@pytest.mark.parametrize("heading", ["Bends", "No. of 90 deg bends", "Number of bends"])
def test_a_count_of_bends_is_not_taken_for_an_angle(tmp_path, run, heading):
    count = np.repeat([1, 2, 3], 5)
    force_in = np.tile(LOADS, 3)
    force_out = (force_in * np.exp(-MU * count * np.pi / 2)).round(3)
    code, text, _ = run("check", write(tmp_path, f"{heading},input_force_N,output_force_N", count, force_in, force_out))
    assert code == 2
    assert "--column" not in text
    assert "headed wrap_angle_deg" in " ".join(text.split())
    path = write(tmp_path, f"{heading},wrap_angle_deg,input_force_N,output_force_N", count, 90 * count, force_in, force_out)
    assert coefficient(path) == pytest.approx(MU, rel=0.01)


def test_loops_without_a_unit_are_proposed_as_turns(tmp_path, run):
    turns, force_in = np.repeat([0.25, 0.5, 1.0], 5), np.tile(LOADS, 3)
    force_out = (force_in * np.exp(-MU * turns * 2 * np.pi)).round(3)
    path = write(tmp_path, "Loops,input_force_N,output_force_N", turns, force_in, force_out)
    _, text, _ = run("check", path)
    assert "--column wrap_angle=Loops:turn" in text
    assert coefficient(path, columns=["wrap_angle=Loops:turn"]) == pytest.approx(MU, rel=0.01)


def test_two_columns_of_bends_are_said_to_add_up(tmp_path, run):
    near, far, force_in = np.repeat([30, 60, 90], 5), np.tile([0, 45, 90, 0, 45], 3), np.tile(LOADS, 3)
    force_out = (force_in * np.exp(-MU * np.deg2rad(near + far))).round(3)
    path = write(tmp_path, "Proximal bend (deg),Distal bend (deg),input_force_N,output_force_N", near, far, force_in, force_out)
    _, text, _ = run("check", path)
    assert "not one of several bends, whose angles add up" in " ".join(text.split())


def test_a_multiple_of_a_unit_is_not_read_and_no_option_is_proposed_for_it(tmp_path, run):
    force_in = np.tile(LOADS, 3)
    force_out = (force_in * np.exp(-MU * ANGLE)).round(3)
    path = write(tmp_path, "Input force (x10 N),Output force (N)", (force_in / 10).round(3), force_out)
    code, text, _ = run("check", path)
    text = " ".join(text.split())
    assert code == 2
    assert "multiply the numbers by 10 and write N" in text
    assert "--column" not in text


def test_a_table_of_wrap_angles_alone_is_right_as_it_stands(tmp_path, run):
    path = write(tmp_path, "Cable length (mm),Upper sheath angle (deg)", [380, 400, 420, 440], [22, 60, 110, 150])
    code, text, _ = run("check", path)
    assert code == 0
    assert "a table of wrap angles at 4 lengths" in text


def test_a_gain_that_splits_pull_from_return_is_named_before_friction_that_differs(run, tmp_path):
    """A cell that reads 13 % too little looks like friction that is larger on the pull; fitted as a gain, mu is right."""
    time, force_in, output = np.arange(0, 24, 0.02), [], []
    generator = np.random.default_rng(4)
    force_in = 30 + 20 * np.sin(2 * np.pi * time / 6)
    output, state = np.empty_like(force_in), force_in[0] * np.exp(-MU * ANGLE)
    for i, force in enumerate(force_in):
        state = min(max(state, force * np.exp(-MU * ANGLE)), force * np.exp(MU * ANGLE))
        output[i] = 0.87 * state
    noisy = [(force + 0.05 * generator.normal(size=len(time))).round(3) for force in (force_in, output)]
    path = write(tmp_path, "time_s,input_force_N,output_force_N", time.round(3), *noisy)
    code, text, _ = run("fit", path, "--wrap-angle", "180deg", "--no-mcmc", "--no-figures", "--output", tmp_path / "fit")
    text = " ".join(text.split())
    assert code == 3
    assert text.index("sensors.output_gain_error_sd=0.1") < text.index("--friction stroke-dependent")
    settings = ["sensors.input_gain_error_sd=0.1", "sensors.output_gain_error_sd=0.1"]
    assert coefficient(path, wrap_angle="180deg", settings=settings) == pytest.approx(MU, rel=0.03)


@pytest.mark.parametrize("unit", ["Nm", "Ncm", "N*m", "mNm"])
def test_a_torque_is_proposed_as_one_with_the_radius_of_its_pulley(tmp_path, run, unit):
    per_newton = 0.015 / {"Ncm": 0.01, "mNm": 0.001}.get(unit, 1.0)  # at 15 mm, as the command states
    stroke, force_in, force_out = pulls_and_returns(1.0)
    path = write(tmp_path, f"stroke,Motor torque ({unit}),output_force_N", stroke, force_in * per_newton, force_out)
    code, text, _ = run("check", path)
    assert code == 2
    printed = text.partition("To fit it once that is corrected:\n")[2].partition("This assumes")[0]
    command = shlex.split(printed.replace("\\\n", " "))
    assert run(*command[1:], "--no-mcmc", "--no-figures", "-o", tmp_path / "fit")[0] == 0
    assert bf.load(tmp_path / "fit").least_squares.estimates["mu"].value == pytest.approx(MU, rel=0.02)
