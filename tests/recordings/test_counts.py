"""Channels of counts, with gain and offset; and channels that say at which bend or length a recording was made."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.recordings.recording import Recordings

TIME = np.arange(0.0, 20.0, 0.01)
FORCE = 30.0 + 20.0 * np.sin(TIME)
EXPONENT = 0.4
INPUT = '{ name = "ai3", gain = 0.00223, offset = 7970, unit = "kN" }'
OUTPUT = '{ name = "ai4", gain = -0.01, offset = 120, unit = "N" }'
ROUTE = '[route]\nvariable = "cable_length"\nunit = "mm"\nrange = [400, 500]\nchoices = [450]\n'
TOML = """name = "counts"
{route}
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = {angle}
[tables.recordings]
files = "run.csv"
[tables.recordings.channels]
input_force = {input}
output_force = {output}
{more}
"""


def held_back(force):
    """Output of a rope that friction holds."""
    y, output = np.log(force[0]), []
    for x in np.log(force):
        y = min(max(y, x - EXPONENT), x + EXPONENT)
        output.append(y)
    return np.exp(output)


@pytest.fixture
def counts(tmp_path):
    """Writes a recording in counts, with a channel beside its forces."""
    generator = np.random.default_rng(1)
    noise = 0.1 * generator.standard_normal((2, len(TIME)))
    ends = [7970 + (FORCE + noise[0]) / 2.23, 120 - (held_back(FORCE) + noise[1]) / 0.01]

    def write(head, extra, input_force=INPUT, output_force=OUTPUT, more="", angle='{ column = "wrap_angle" }', route=""):
        table = np.column_stack([TIME, *ends, extra])
        np.savetxt(tmp_path / "run.csv", table, "%.4f", ",", header=f"time_s,ai3,ai4,{head}", comments="")
        text = TOML.format(input=input_force, output=output_force, more=more, angle=angle, route=route)
        (tmp_path / "cable.toml").write_text(text)
        return tmp_path

    return write


def only(folder):
    """The one recording of a data set."""
    (recording,) = bf.read(folder).measurements.table(Recordings).items
    return recording


def bend(degrees=90.0, noise=0.1):
    return degrees + noise * np.random.default_rng(2).standard_normal(len(TIME))


def test_counts_become_forces_by_gain_and_offset_and_the_bend_is_read_from_its_channel(counts):
    recording = only(counts("wrap_angle_deg", bend()))
    assert recording.blocks.input_force.min() == pytest.approx(10.0, abs=0.5)
    assert recording.blocks.input_force.max() == pytest.approx(50.0, abs=0.5)
    assert recording.strokes.exponent == pytest.approx(EXPONENT, abs=0.01)
    assert np.rad2deg(recording.own_angle[0]) == pytest.approx(90.0, abs=0.1)


def test_a_channel_of_the_bend_may_be_in_counts_too(counts):
    named = 'wrap_angle = { name = "encoder", gain = 0.0879, offset = 512, unit = "deg" }'
    recording = only(counts("encoder", 512 + bend() / 0.0879, more=named))
    assert np.rad2deg(recording.own_angle[0]) == pytest.approx(90.0, abs=0.1)


def test_a_channel_of_the_length_places_a_recording(counts):
    constant = '{ value = 90, unit = "deg" }'
    recording = only(counts("cable_length_cm", 0 * TIME + 45.0, angle=constant, route=ROUTE))
    assert recording.route == 450.0


def test_a_fit_with_counts_is_stored_and_read_back(counts, tmp_path):
    fit = bf.fit(counts("wrap_angle_deg", bend()), mcmc=False, output=tmp_path / "fit", figures=False)
    again = bf.load(tmp_path / "fit")
    assert again.dataset.description == fit.dataset.description
    assert fit.least_squares.estimates["mu"].value == pytest.approx(EXPONENT / (np.pi / 2), rel=0.05)


REFUSED = {
    "a gain without unit": ({"input_force": '{ name = "ai3", gain = 0.00223 }'}, ["gain = 0.00223", "unit"]),
    "a gain of nothing": ({"input_force": '{ name = "ai3", gain = 0, unit = "N" }'}, ["a gain of 0"]),
    "a gain that is no number": ({"input_force": '{ name = "ai3", gain = inf, unit = "N" }'}, ["finite"]),
    "another key": ({"input_force": '{ name = "ai3", scale = 2, unit = "N" }'}, ["unknown key", "scale"]),
    "a bend that is no channel": ({"more": 'wrap_angle = { name = "nix", unit = "deg" }'}, ["no channel 'nix'"]),
    "a bend in mm": ({"more": 'wrap_angle = { name = "ai3", unit = "mm" }'}, ["does not measure an angle"]),
    "a bend without unit": ({"more": 'wrap_angle = { name = "ai3" }'}, ["does not state its unit"]),
    "a bend by a changing channel": (
        {"more": 'wrap_angle = { name = "ai3", unit = "deg" }'},
        ["changes from", "where ="],
    ),
    "a quantity that there is not": ({"more": 'wrap_angel = { name = "ai3" }'}, ["did you mean 'wrap_angle'"]),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_with_a_remedy(counts, refuse, case):
    changed, message = REFUSED[case]
    sentence = refuse("check", counts("encoder_deg", bend(), **changed))
    assert all(part in sentence for part in message), sentence


def test_a_bend_that_changes_or_is_said_twice_is_refused(counts, refuse):
    assert "changes from" in refuse("check", counts("wrap_angle_deg", np.linspace(90.0, 120.0, len(TIME))))
    more = 'wrap_angle = { name = "wrap_angle_deg", unit = "deg" }'
    folder = counts("wrap_angle_deg", bend(), more=more)
    with (folder / "cable.toml").open("a") as file:
        file.write('[[recording]]\nfile = "run.csv"\nwrap_angles = { wrap_angle = { value = 90, unit = "deg" } }\n')
    assert "keep one of the two" in refuse("check", folder)
