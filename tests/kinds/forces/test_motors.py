"""A motor's current in place of a load cell at the input: read, fitted with its gear, or refused."""

import numpy as np
import pytest
from motor_benches import CABLE, CONSTANT, EFFICIENCY, FRICTION, MOTOR, MU, STATED, currents, folder_of

import bowdenfit as bf
from bowdenfit.cable.sensors import Gear
from bowdenfit.dataset import load_dataset
from bowdenfit.errors import BowdenfitError
from bowdenfit.kinds.forces.table import ForceTable


def test_currents_become_forces_of_a_gear_that_loses_nothing(tmp_path):
    rows = ["1,pull,90,2.5,100", "1,return,90,2.0,300"]
    table = load_dataset(folder_of(tmp_path, rows, MOTOR + STATED)).measurements.table(ForceTable)
    np.testing.assert_allclose(table.input_force, [2.5 * 0.06 * 26 / 0.015, 2.0 * 0.06 * 26 / 0.015], rtol=1e-12)


def test_the_torque_of_a_motor_passes_its_gear(tmp_path):
    rows = ["1,pull,90,0.15,100", "1,return,90,0.12,300"]
    motor = "[motor]\ngear_ratio = 26\n" + STATED
    table = load_dataset(folder_of(tmp_path, rows, motor, heading="input_torque_N_m")).measurements.table(ForceTable)
    np.testing.assert_allclose(table.input_force, [0.15 * 26 / 0.015, 0.12 * 26 / 0.015], rtol=1e-12)


def test_a_gear_is_its_own_inverse_and_takes_force_both_ways():
    gear, stroke = Gear(0.3, 6.0), np.array([1.0, -1.0])
    rope = gear.rope_force(np.array([100.0, 100.0]), stroke)
    np.testing.assert_allclose(rope, [0.7 * 100 - 6, 100 / 0.7 + 6], rtol=1e-12)
    np.testing.assert_allclose(gear.motor_force(rope, stroke), [100, 100], rtol=1e-12)


@pytest.mark.parametrize("bends", [(0, 45, 90, 180, 270), (45, 90, 180, 270)])
def test_exact_readings_give_the_cable_and_the_gear(tmp_path, bends):
    fit = bf.fit(folder_of(tmp_path / "data", currents(bends)), mcmc=False, seed=1)
    estimates = fit.least_squares.estimates
    assert estimates["mu"].value == pytest.approx(MU, rel=2e-3)
    assert estimates["gear_loss"].value == pytest.approx(1 - EFFICIENCY, abs=2e-3)
    assert estimates["gear_friction"].value == pytest.approx(FRICTION, rel=1e-2)


@pytest.mark.extended
def test_intervals_contain_the_cable_at_one_bend_only_as_well_as_the_gear_is_stated(tmp_path):
    rows = currents((180,) * 5, 0.005, 4, constant=CONSTANT * 1.02, scatter=0.01)
    widths = []
    for sd in ("0.03", "0.001"):
        motor = MOTOR + STATED.replace("sd = 0.03", f"sd = {sd}").replace("0.72", "0.70")
        fit = bf.fit(folder_of(tmp_path / sd, rows, motor), seed=1)
        mu = fit.parameter("mu")
        assert mu.q05 < MU < mu.q95
        widths.append(mu.q95 - mu.q05)
    assert widths[0] > 1.5 * widths[1]


@pytest.mark.parametrize(
    ("bends", "keywords", "says"),
    [
        ((90, 90), {}, "all readings have the same wrap angles and gear_efficiency is not stated"),
        ((90, 90), {"motor": MOTOR + "gear_efficiency = 0.7\n", "loads": (50,)}, "gear_friction is not stated"),
        ((90, 180), {"motor": ""}, r"nothing says what torque a current makes.*\[motor\] torque_constant"),
        ((90, 180), {"motor": "[motor]\n"}, r"nothing says what torque a current makes"),
        ((90, 180), {"cable": ""}, r"\[motor\] needs the radius of its pulley"),
        ((90, 180), {"heading": "input_force_N"}, r"has a \[motor\], which takes the place of one"),
        ((90, 180), {"heading": "motor"}, r"has no column input_current;.*Name the column input_current_A or input_torque_N_m"),
        ((90, 180), {"heading": "input_current_N"}, "current"),
        ((90, 180), {"motor": MOTOR + "gear_efficiency = 80\n"}, "write 0.8 for 80 %"),
        ((90, 180), {"motor": MOTOR + 'gear_friction = { value = 0.1, unit = "N" }\n'}, "does not measure a torque"),
        ((90, 180), {"motor": MOTOR.replace("mNm/A", "mNm")}, "does not measure a torque constant"),
        ((90, 180), {"cable": CABLE + 'kind = "loop"\n'}, "is that of a single rope"),
        ((90, 180), {"more": 'friction_model = "dahl"'}, "of the turns of the motion"),
        ((90, 180), {"tables": 'efficiencies = { file = "e.csv" }\n'}, r"the table efficiencies needs the force at the input"),
    ],
)  # fmt: skip
def test_motors_that_cannot_be_used_are_refused(tmp_path, bends, keywords, says):
    rows = currents(bends, loads=keywords.pop("loads", (20, 60, 100)))
    with pytest.raises(BowdenfitError, match=f"(?s){says}"):
        load_dataset(folder_of(tmp_path, rows, **keywords))


@pytest.mark.parametrize(
    ("row", "says"),
    [("2,hold,90,2,100", "some readings are held"), ("2,return,90,-0.01,20", "push its gear back.*leave such a return out")],
)
def test_rows_that_say_nothing_of_the_rope_are_refused(tmp_path, row, says):
    with pytest.raises(BowdenfitError, match=says):
        load_dataset(folder_of(tmp_path, [*currents((90, 180)), row]))


def test_a_plan_with_a_motor_is_simulated_in_currents_that_are_read_again(tmp_path):
    plan = tmp_path / "plan.toml"
    plan.write_text(
        f'name = "rope"\n{CABLE}{MOTOR}[[contact]]\nname = "sheath"\nfriction = "mu"\nwrap_angle = {{ column = "bend" }}\n'
        '[tables]\nforces = { file = "forces.csv" }\n[truth]\nmu = 0.1\ntau = 0.001\nsigma_F = 0.01\ngain_error = 0.0\n'
        "gear_loss = 0.25\ngear_friction = 0.05\n[design]\nruns = [1, 2, 3]\ninput_forces = [20, 60, 100]\n"
        "[design.own_angles]\nbend = [0, 90, 180]\n"
    )
    bf.simulate(plan, output=tmp_path / "data", seed=2)
    head, first, *_ = (tmp_path / "data" / "forces.csv").read_text().splitlines()
    assert head.split(",")[-2:] == ["input_current_A", "output_force_N"]
    current = float(first.split(",")[-2])
    assert current * 0.06 * 26 / 0.015 == pytest.approx((20 + 0.05 / 0.015) / 0.75, rel=0.01)
    fit = bf.fit(tmp_path / "data", mcmc=False, seed=1)
    assert fit.least_squares.estimates["mu"].value == pytest.approx(0.1, rel=0.03)
    assert fit.least_squares.estimates["gear_loss"].value == pytest.approx(0.25, abs=0.01)


def test_the_command_for_a_lone_file_names_its_current_and_its_motor(tmp_path, run):
    path = tmp_path / "bench.csv"
    lines = ["run,stroke,bend_deg,Motor current (A),Load cell (N)", *currents((45, 90, 180, 270), 0.003)]
    path.write_text("\n".join(lines) + "\n")
    code, out, _ = run("check", path)
    words = " ".join(out.replace("\\\n", "").split())
    assert code == 2
    assert "--column input_current='Motor current (A)' --set 'motor.torque_constant={value=0.05,unit=\"N*m/A\"}'" in words
    options = ["--column", "wrap_angle=bend_deg", "--column", "input_current=Motor current (A)"]
    options += ["--column", "output_force=Load cell (N)", "--set", 'motor.torque_constant={value=60,unit="mN*m/A"}']
    options += ["--set", 'cable.input_pulley_radius={value=15,unit="mm"}', "--set", "motor.gear_ratio=26"]
    code, out, _ = run("fit", path, *options, "--no-mcmc", "--no-figures", "-o", tmp_path / "fit")
    assert code == 0, out


def test_check_says_what_is_stated_of_a_motor_and_what_is_learned(tmp_path, run):
    motor = MOTOR + 'gear_friction = { value = 0.1, unit = "N*m", sd = 0.03 }\n'
    code, out, _ = run("check", folder_of(tmp_path / "data", currents((45, 90)), motor))
    assert code == 0
    for line in ("torque constant: 60 ± 1 mNm/A", "gear ratio: 26", "gear efficiency: learned from the readings",
                 "gear friction: 0.1 ± 0.03 N*m"):  # fmt: skip
        assert line in out


def test_a_wrong_motor_is_the_only_thing_that_is_said_to_be_wrong(tmp_path):
    with pytest.raises(BowdenfitError, match="gear_ratio") as caught:
        load_dataset(folder_of(tmp_path, currents((45, 90)), MOTOR.replace("26", "-3")))
    assert "2 things are wrong" not in str(caught.value)


def test_two_currents_are_signals_of_load_cells_and_not_of_a_motor(tmp_path, run):
    path = tmp_path / "bench.csv"
    rows = (f"{i / 100},{8 + i % 50 / 10},{7 + i % 50 / 12}" for i in range(200))
    path.write_text("time (s),front (mA),rear (mA)\n" + "\n".join(rows) + "\n")
    _, out, _ = run("check", path)
    assert "motor" not in out and "input_current" not in out
    assert "--channel input_force=" in out and "--channel output_force=" in out
