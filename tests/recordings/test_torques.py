"""Recordings of a loop whose load cells tell torques: read over the radii of the pulleys, or refused."""

import numpy as np
import pytest
from loop_benches import folder_of, recorded

from bowdenfit.dataset import load_dataset
from bowdenfit.errors import DatasetError
from bowdenfit.recordings.named_channels import parse_channels
from bowdenfit.recordings.recording import Recordings

IN_RADIUS = 'input_pulley_radius = { value = 15, unit = "mm" }'
OUT_RADIUS = 'output_pulley_radius = { value = 1.2, unit = "cm" }'


def as_torques(columns, input_radius=15.0, output_radius=12.0, unit="N_m"):
    scale = {"N_m": 1e-3, "N_mm": 1.0}[unit]
    return {
        "time_s": columns["time_s"],
        f"input_torque_{unit}": columns["input_force_N"] * input_radius * scale,
        f"output_torque_{unit}": columns["output_force_N"] * output_radius * scale,
    }


def test_torques_over_the_radii_are_forces(tmp_path):
    columns = recorded(seconds=6.0)
    (tmp_path / "a").mkdir()
    forces = load_dataset(folder_of(tmp_path, [columns])).measurements.table(Recordings)
    torques = folder_of(tmp_path / "a", [as_torques(columns, unit="N_mm")], cable=f"{IN_RADIUS}\n{OUT_RADIUS}")
    found = load_dataset(torques).measurements.table(Recordings)
    assert forces is not None and found is not None
    for end in ("input_force", "output_force"):
        one, other = (getattr(r.each[0].blocks, end) for r in (forces, found))
        np.testing.assert_allclose(one, other, atol=1e-6)


def test_a_torque_at_one_end_only_and_a_named_channel_are_read(tmp_path):
    columns = recorded(seconds=6.0)
    mixed = {
        "time_s": columns["time_s"],
        "motor": -15.0 * columns["input_force_N"],
        "output_force_N": columns["output_force_N"],
    }
    path = folder_of(tmp_path, [mixed], cable=IN_RADIUS)
    found = load_dataset(path, channels=parse_channels(["input_torque=motor:-N*mm"])).measurements.table(Recordings)
    assert found is not None
    assert found.each[0].blocks.input_force.max() == pytest.approx(columns["input_force_N"].max(), abs=2.0)


@pytest.mark.parametrize(
    ("cable", "channels", "says"),
    [
        (OUT_RADIUS, [], r"gives input_torque, but the radius .* \[cable\] input_pulley_radius = "),
        (IN_RADIUS, [], r"gives output_torque, but the radius .* \[cable\] output_pulley_radius = "),
        (f"{IN_RADIUS}\n{OUT_RADIUS}", ["input_torque=time_s:N*m", "input_force=time_s:N"], "both input_force .* input_torque"),
        (f"{IN_RADIUS}\n{OUT_RADIUS}", ["input_torque=input_torque_N_m:N"], "does not measure a torque"),
    ],
)  # fmt: skip
def test_torques_that_cannot_be_read_are_refused(tmp_path, cable, channels, says):
    path = folder_of(tmp_path, [as_torques(recorded(seconds=3.0))], cable=cable)
    with pytest.raises(DatasetError, match=says):
        load_dataset(path, channels=parse_channels(channels))


def test_a_file_with_both_force_and_torque_is_refused(tmp_path):
    columns = recorded(seconds=3.0)
    path = folder_of(tmp_path, [columns | as_torques(columns)], cable=f"{IN_RADIUS}\n{OUT_RADIUS}")
    with pytest.raises(DatasetError, match=r"both input_force .* and input_torque .*say which is meant"):
        load_dataset(path)


def test_a_torque_of_a_single_rope_is_refused(tmp_path):
    path = folder_of(tmp_path, [as_torques(recorded(seconds=3.0))])
    text = (path / "cable.toml").read_text().replace('kind = "loop"', 'kind = "single"')
    (path / "cable.toml").write_text(text)
    with pytest.raises(DatasetError, match=r'named for a single rope.*kind = "loop"'):
        load_dataset(path, channels=parse_channels(["input_torque=input_torque_N_m:N*m"]))
