"""Recordings whose output cell reads another force than the rope has: refused with the ratio, or fitted where it is stated.

The benches are simulated here, by the play operator of a rope in a bend of 180 deg, and share nothing with the reader.
"""

from collections.abc import Mapping

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.recordings.recording import Recording, Recordings

MU = 0.12
HEADING = "Time (s),Input force (N),Output force (N)"


def write_recording(path, ratio, mu=MU, shape="triangle", load=200.0):
    """Three pulls and returns, whose output cell reads the force on the rope times a ratio."""
    rng, time = np.random.default_rng(7), np.arange(0, 60, 0.02)
    phase = time / 20 % 1
    drive = 1 - np.abs(2 * phase - 1) if shape == "triangle" else 0.5 - 0.5 * np.cos(2 * np.pi * phase)
    force_in = load * (0.1 + 0.9 * drive)
    loss = np.exp(mu * np.pi)
    force_out, rope = np.empty_like(force_in), force_in[0] / loss
    for i, force in enumerate(force_in):
        rope = float(np.clip(rope, force / loss, force * loss))
        force_out[i] = rope
    noise = rng.normal(0, 0.0015 * load, (2, len(time)))
    columns = np.column_stack([time, force_in + noise[0], ratio * force_out + noise[1]])
    np.savetxt(path, columns, delimiter=",", header=HEADING, comments="", fmt="%.6g")
    return path


def recording_of(path, settings: Mapping[str, float] = {}) -> Recording:
    dataset = bf.read(path, wrap_angle="180deg", settings=[f"sensors.{name}={value}" for name, value in settings.items()])
    table = dataset.measurements.table(Recordings)
    assert table is not None
    return table.items[0]


@pytest.mark.parametrize("shape", ["triangle", "sine"])
@pytest.mark.parametrize("load", [2.0, 8000.0])
@pytest.mark.parametrize("ratio", [0.25, 0.5, 2.0, 4.45])
def test_a_loop_about_another_ratio_is_refused_with_that_ratio(tmp_path, ratio, load, shape):
    path = write_recording(tmp_path / "log.csv", ratio, shape=shape, load=load)
    with pytest.raises(bf.BowdenfitError, match="follows a reversing input in a loop about") as refusal:
        recording_of(path)
    stated_ratio = float(str(refusal.value).split("sensors.output_ratio=")[1].split(" ")[0])
    assert stated_ratio == pytest.approx(1 / ratio, rel=0.05)


@pytest.mark.parametrize("ratio", [0.25, 0.5, 2.0])
def test_a_stated_ratio_of_the_output_gives_the_friction(tmp_path, ratio):
    path = write_recording(tmp_path / "log.csv", ratio)
    assert recording_of(path, {"output_ratio": 1 / ratio}).strokes.exponent == pytest.approx(MU * np.pi, rel=0.03)


def test_a_stated_ratio_of_the_input_gives_the_friction(tmp_path):
    path = write_recording(tmp_path / "log.csv", 0.5)
    recording = recording_of(path, {"input_ratio": 0.5})
    assert recording.strokes.exponent == pytest.approx(MU * np.pi, rel=0.03)
    assert recording.blocks.input_force.max() == pytest.approx(100, rel=0.02)


@pytest.mark.parametrize("mu", [0.05, MU, 0.5])
@pytest.mark.parametrize("ratio", [0.95, 1.0, 1.05])
def test_cells_that_differ_by_a_few_percent_are_left_to_the_fit(tmp_path, ratio, mu):
    path = write_recording(tmp_path / "log.csv", ratio, mu)
    assert recording_of(path).strokes.exponent == pytest.approx(mu * np.pi, rel=0.05)


def test_a_table_of_forces_is_multiplied_by_its_ratios(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("input_force_N,output_force_N\n10,4\n20,8\n30,12\n")
    table = bf.read(path, wrap_angle="180deg", settings=["sensors.output_ratio=2", "sensors.input_ratio=1.5"])
    forces = table.measurements.table(ForceTable)
    assert forces is not None
    assert forces.input_force.tolist() == [15, 30, 45]
    assert forces.output_force.tolist() == [8, 16, 24]


@pytest.mark.parametrize("ratio", ["0", "-2", "nan"])
def test_a_ratio_that_cannot_be_is_refused(tmp_path, ratio):
    path = tmp_path / "table.csv"
    path.write_text("input_force_N,output_force_N\n10,8\n20,16\n30,24\n")
    with pytest.raises(bf.BowdenfitError, match="output_ratio"):
        bf.read(path, wrap_angle="180deg", settings=[f"sensors.output_ratio={ratio}"])
