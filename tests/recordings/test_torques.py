"""Recordings of a loop whose load cells tell torques: read over the radii of the pulleys, or refused."""

import numpy as np
import pytest
from loop_benches import folder_of, recorded

from bowdenfit.dataset import load_dataset
from bowdenfit.errors import DatasetError
from bowdenfit.recordings.named_channels import parse_channels
from bowdenfit.recordings.recording import Recordings

pytestmark = pytest.mark.extended

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
    table = load_dataset(torques).measurements.table(Recordings)
    assert forces is not None and table is not None
    for end in ("input_force", "output_force"):
        first, other = (getattr(r.items[0].blocks, end) for r in (forces, table))
        np.testing.assert_allclose(first, other, atol=1e-6)


def test_a_torque_at_one_end_only_and_a_named_channel_are_read(tmp_path):
    columns = recorded(seconds=6.0)
    mixed = {
        "time_s": columns["time_s"],
        "motor": -15.0 * columns["input_force_N"],
        "output_force_N": columns["output_force_N"],
    }
    path = folder_of(tmp_path, [mixed], cable=IN_RADIUS)
    table = load_dataset(path, channels=parse_channels(["input_torque=motor:-N*mm"])).measurements.table(Recordings)
    assert table is not None
    assert table.items[0].blocks.input_force.max() == pytest.approx(columns["input_force_N"].max(), abs=2.0)


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


def of_a_rope(folder, columns, cable=""):
    """The same bench, called one rope."""
    path = folder_of(folder, [columns], cable=cable)
    text = (path / "cable.toml").read_text().replace('kind = "loop"', 'kind = "single"')
    (path / "cable.toml").write_text(text)
    return path


def pulled():
    """Forces at both ends of one rope that is pulled to and fro and never slack."""
    columns = recorded(seconds=6.0)
    force = 60 + 0.5 * columns["input_force_N"]
    bounds = force * np.exp(-0.3), force * np.exp(0.3)
    output, held = np.zeros(len(force)), 0.0
    for i, (low, high) in enumerate(zip(*bounds, strict=True)):
        output[i] = held = min(max(held, low), high)
    return columns | {"input_force_N": force, "output_force_N": output}


def test_torques_of_a_single_rope_are_forces_over_the_radii_too(tmp_path):
    for name in ("forces", "torques"):
        (tmp_path / name).mkdir()
    forces = load_dataset(of_a_rope(tmp_path / "forces", pulled())).measurements.table(Recordings)
    path = of_a_rope(tmp_path / "torques", as_torques(pulled(), unit="N_mm"), f"{IN_RADIUS}\n{OUT_RADIUS}")
    table = load_dataset(path).measurements.table(Recordings)
    assert forces is not None and table is not None
    for end in ("input_force", "output_force"):
        first, other = (getattr(r.items[0].blocks, end) for r in (forces, table))
        np.testing.assert_allclose(first, other, atol=1e-6)


def test_a_torque_of_a_single_rope_without_a_radius_is_refused(tmp_path):
    path = of_a_rope(tmp_path, as_torques(recorded(seconds=3.0)))
    with pytest.raises(DatasetError, match=r"gives input_torque, but the radius .* input_pulley_radius = "):
        load_dataset(path, channels=parse_channels([f"{end}_torque={end}_torque_N_m:N*m" for end in ("input", "output")]))
