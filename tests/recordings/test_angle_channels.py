"""A channel of a recording that is likely to hold the wrap angle is asked about, and no other angle is."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.files import read_channels
from bowdenfit.recordings.angle_channels import find_angle_channels, refuse_other_angle
from bowdenfit.units import ColumnSource

SAMPLES = 600
FORCE = 30 + 20 * np.sin(np.linspace(0, 12 * np.pi, SAMPLES))
OUTPUT = np.where(np.gradient(FORCE) > 0, 0.7, 1.4) * FORCE
NOISE = np.random.default_rng(5).normal(0, 0.3, SAMPLES)
HALVES = np.where(np.arange(SAMPLES) < 300, 90.0, 180.0)
MOTION = np.cumsum(np.gradient(FORCE))


def recording(tmp_path, heading, angle, name="log.csv"):
    """A file of six cycles with one more channel."""
    angle = np.broadcast_to(angle, SAMPLES)
    rows = [f"{0.02 * i:.2f},{FORCE[i]:.3f},{OUTPUT[i]:.3f},{angle[i]:.6g}" for i in range(SAMPLES)]
    (tmp_path / name).write_text("\n".join([f"time_s,input_force_N,output_force_N,{heading}", *rows]) + "\n", encoding="utf-8")
    return tmp_path / name


def refused(path, stated_value):
    """The sentence with which a stated angle in degrees is refused; empty where it is not."""
    try:
        refuse_other_angle(read_channels(path), {}, FORCE, np.deg2rad(stated_value))
    except bf.DatasetError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("heading", "angle", "number", "unit"),
    [
        ("bend_deg", 90, 90, "deg"), ("wrap_angle_deg", 90, 90, "deg"), ("Umlenkwinkel [°]", 90, 90, "deg"),
        ("bend", 90, 90, "deg"), ("angle (rad)", 1.571, 1.571, "rad"), ("q1 [deg]", 45, 45, "deg"), ("turns", 0.25, 90, "deg"),
        ("bend_deg", 90 + NOISE, 90, "deg"), ("Umschlingungswinkel (°)", 90, 90, "deg"),
    ],
)  # fmt: skip
def test_an_angle_that_contradicts_the_stated_one_is_refused_and_proposed(tmp_path, heading, angle, number, unit):
    path = recording(tmp_path, heading, angle)
    assert "throughout, which is likely to be the wrap angle, and 180 deg is stated" in refused(path, 180)
    (channel,) = find_angle_channels(read_channels(path), {}, FORCE)
    assert channel.option[-3:] == unit and abs(float(channel.option[:-3]) / number - 1) < 0.01
    assert not refused(path, np.rad2deg(number) if unit == "rad" else number)


@pytest.mark.parametrize("heading", ["bend_deg", "wrap_angle_deg", "Umlenkwinkel [°]", "angle (deg)"])
def test_an_angle_that_changes_inside_a_recording_is_where_the_file_is_to_be_split(tmp_path, heading):
    refusal = refused(recording(tmp_path, heading, HALVES), 90)
    assert "changes from 90 to 180 deg at sample 301" in refusal and "split the file there" in refusal


def test_check_proposes_the_angle_of_a_channel_and_fit_refuses_another(tmp_path, run):
    path = recording(tmp_path, "bend_deg", 90)
    code, out, _ = run("check", path)
    assert code == 0 and "--wrap-angle 90deg" in out and "as the channel 'bend_deg' says" in " ".join(out.split())
    with pytest.raises(bf.DatasetError, match="'bend_deg' is 90deg throughout"):
        bf.read(path, wrap_angle=(180.0, "deg"))


@pytest.mark.parametrize(
    ("heading", "angle"),
    [
        ("motor angle (deg)", 90), ("theta_motor (rad)", 1.0), ("position (deg)", 30), ("joint_angle_deg", HALVES),
        ("theta (rad)", MOTION / 20), ("angle_deg", 120 + MOTION / 40), ("x (deg)", 0), ("bends", 2), ("Temp (deg C)", 21.5),
        ("elbow (deg)", 60 + 2 * MOTION), ("bend_deg", 60 + MOTION), ("bend_deg", 179), ("45 deg", OUTPUT),
    ],
)  # fmt: skip
def test_other_angles_and_one_that_agrees_are_not_asked_about(tmp_path, heading, angle):
    assert not refused(recording(tmp_path, heading, angle), 180)


def test_a_channel_that_the_user_names_for_something_is_not_asked_about(tmp_path):
    file = read_channels(recording(tmp_path, "bend", 90))
    assert not find_angle_channels(file, {"velocity": ColumnSource(name="bend", unit="mm/s")}, FORCE)


@pytest.mark.parametrize("angle", ["value = 180, unit = 'deg'", "column = 'theta'"])
def test_an_angle_that_contradicts_the_description_is_refused(tmp_path, angle):
    recording(tmp_path, "bend_deg", 90)
    setting = 'wrap_angles = { theta = { value = 180, unit = "deg" } }' if "column" in angle else ""
    (tmp_path / "cable.toml").write_text(
        f"schema = 1\nname = 'bench'\n[[contact]]\nname = 'sheath'\nfriction = 'mu'\nwrap_angle = {{ {angle} }}\n"
        f"[tables]\nrecordings = {{}}\n[[recording]]\nfile = 'log.csv'\n{setting}\n"
    )
    with pytest.raises(bf.BowdenfitError, match="'bend_deg' is 90deg throughout"):
        bf.read(tmp_path)
