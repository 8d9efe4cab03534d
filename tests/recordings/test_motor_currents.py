"""Recordings of a motor's current in place of a load cell at the input: fitted with the gear, or refused."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.dataset import load_dataset
from bowdenfit.errors import BowdenfitError
from bowdenfit.recordings.recording import Recordings

MU, EFFICIENCY, FRICTION, RADIUS, RATIO, CONSTANT = 0.12, 0.75, 0.06, 0.015, 26.0, 0.06  # N m, m, 1, N m/A
MOTOR = '[motor]\ntorque_constant = { value = 60, unit = "mNm/A", sd = 1 }\ngear_ratio = 26\n'
BENDS = (0, 45, 90, 135)


def rope_force(torque, pull):
    return (torque * EFFICIENCY - FRICTION) / RADIUS if pull else (torque / EFFICIENCY + FRICTION) / RADIUS


def recorded(bend, seed, heading="input_current (A)", more=""):
    """CSV text: the force on the rope, and behind the cable, stand still while the motor turns around."""
    time, rng, exponent = np.arange(0, 20, 0.005), np.random.default_rng(seed), MU * np.deg2rad(bend)
    torques, output, force, rows = 1.5 * (1.05 - np.cos(2 * np.pi * time / 6)), 0.0, 0.0, []
    for torque in torques:
        force = float(np.clip(force, rope_force(torque, True), rope_force(torque, False)))
        output = float(np.clip(output, force * np.exp(-exponent), force * np.exp(exponent)))
        rows.append((torque / RATIO / CONSTANT, output))
    currents, outputs = np.array(rows).T
    currents, outputs = currents + 0.005 * rng.standard_normal(len(time)), outputs + 0.3 * rng.standard_normal(len(time))
    lines = [f"{t:.3f},{i:.5f},{f:.4f}" for t, i, f in zip(time, currents, outputs, strict=True)]
    return "\n".join([f"time (s),{heading},output_force (N){more}", *lines]) + "\n"


def folder_of(path, bends=BENDS, motor=MOTOR, settings="", **keywords):
    path.mkdir(exist_ok=True)
    entries = []
    for i, bend in enumerate(bends):
        (path / f"{i}.csv").write_text(recorded(bend, i, **keywords))
        entries.append(f'[[recording]]\nfile = "{i}.csv"\nwrap_angles = {{ bend = {{ value = {bend}, unit = "deg" }} }}\n')
    (path / "cable.toml").write_text(
        f'name = "rope"\n[cable]\ninput_pulley_radius = {{ value = 15, unit = "mm" }}\n{motor}'
        '[[contact]]\nname = "sheath"\nfriction = "mu"\nwrap_angle = { column = "bend" }\n'
        f'[tables]\nrecordings = {{ prepare = {{ delay = "none" }}{settings} }}\n{"".join(entries)}'
    )
    return path


def test_currents_become_forces_of_a_gear_that_loses_nothing(tmp_path):
    table = load_dataset(folder_of(tmp_path, (0, 90))).measurements.table(Recordings)
    largest = 1.5 * 2.05 / RADIUS
    assert table.items[0].blocks.input_force.max() == pytest.approx(largest, rel=0.01)


@pytest.mark.extended
def test_recordings_tell_the_cable_from_the_gear(tmp_path):
    fit = bf.fit(folder_of(tmp_path / "data"), seed=1)
    assert fit.verdict().trusted, fit.verdict().reasons
    mu, loss, friction = (fit.parameter(name) for name in ("mu", "gear_loss", "gear_friction"))
    assert mu.q05 < MU < mu.q95
    assert mu.q95 - mu.q05 < 0.02
    assert loss.median == pytest.approx(1 - EFFICIENCY, abs=0.02)
    assert friction.median == pytest.approx(FRICTION, rel=0.1)


@pytest.mark.parametrize(
    ("bends", "keywords", "says"),
    [
        ((90, 90), {}, "all readings have the same wrap angles and gear_efficiency is not stated"),
        ((45, 90), {"motor": ""}, r"has no channel input_force.*is the current of the motor.*describe the \[motor\]"),
        ((45, 90), {"heading": "input_force (N)"}, r"has a \[motor\], which takes the place of one"),
        ((45, 90), {"settings": ', likelihood = "whole"'}, "the gear of a \\[motor\\] has friction of its own"),
    ],
)  # fmt: skip
def test_motors_that_cannot_be_used_are_refused(tmp_path, bends, keywords, says):
    with pytest.raises(BowdenfitError, match=f"(?s){says}"):
        load_dataset(folder_of(tmp_path, bends, **keywords))
