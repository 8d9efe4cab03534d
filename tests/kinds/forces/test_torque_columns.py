"""Tables of forces whose columns are torques of pulleys: read over the radii, or refused."""

import numpy as np
import pytest

from bowdenfit.dataset import load_dataset
from bowdenfit.errors import BowdenfitError
from bowdenfit.kinds.forces.table import ForceTable

ROWS = [(90, 20.0, 17.1), (90, 40.0, 34.0), (180, 20.0, 14.8), (180, 40.0, 29.4)]
RADII = 'input_pulley_radius = { value = 15, unit = "mm" }\noutput_pulley_radius = { value = 1.2, unit = "cm" }'


def folder_of(path, headings, scales, cable):
    lines = [f"wrap_angle_deg,{headings},stroke"]
    lines += [f"{angle},{scales[0] * row:.8g},{scales[1] * other:.8g},pull" for angle, row, other in ROWS]
    (path / "forces.csv").write_text("\n".join(lines) + "\n")
    (path / "cable.toml").write_text(
        f'name = "rope"\n[cable]\n{cable}\n[[contact]]\nname = "sheath"\nfriction = "mu"\n'
        'wrap_angle = { column = "wrap_angle" }\n[tables]\nforces = { file = "forces.csv" }\n'
    )
    return path


@pytest.mark.parametrize(
    ("headings", "scales"),
    [
        ("input_torque_N_m,output_torque_N_m", (0.015, 0.012)),
        ("input_torque_N_mm,output_force_N", (15.0, 1.0)),
        ("input_force_N,Output torque [mN*m]", (1.0, 12.0)),
    ],
)
def test_torques_over_the_radii_are_forces(tmp_path, headings, scales):
    table = load_dataset(folder_of(tmp_path, headings, scales, RADII)).measurements.table(ForceTable)
    np.testing.assert_allclose(table.input_force, [row[1] for row in ROWS], rtol=1e-7)
    np.testing.assert_allclose(table.output_force, [row[2] for row in ROWS], rtol=1e-7)


@pytest.mark.parametrize(
    ("headings", "scales", "cable", "says"),
    [
        ("input_torque_N_m,output_force_N", (0.015, 1.0), "", r"the radius of that pulley is not known.*input_pulley_radius"),
        ("input_torque_N_m,output_torque_N_m", (-0.015, 0.012), RADII, r"'-0.3' is not positive"),
        ("input_torque_N_m,input_force_N", (0.015, 1.0), RADII, r"(?s)both input_force and input_torque.*no column"),
        ("input_torque_N,output_force_N", (0.015, 1.0), RADII, r"torque"),
    ],
)  # fmt: skip
def test_torques_that_cannot_be_read_are_refused(tmp_path, headings, scales, cable, says):
    with pytest.raises(BowdenfitError, match=says):
        load_dataset(folder_of(tmp_path, headings, scales, cable))
