"""Recordings of a motor's current in place of a load cell at the input: fitted with the gear, or refused."""

import pytest
from motor_benches import EFFICIENCY, FRICTION, MU, RADIUS, folder_of_recordings

import bowdenfit as bf
from bowdenfit.dataset import load_dataset
from bowdenfit.errors import BowdenfitError
from bowdenfit.recordings.recording import Recordings


def test_currents_become_forces_of_a_gear_that_loses_nothing(tmp_path):
    table = load_dataset(folder_of_recordings(tmp_path, (0, 90))).measurements.table(Recordings)
    largest = 1.5 * 2.05 / RADIUS
    assert table.items[0].blocks.input_force.max() == pytest.approx(largest, rel=0.01)


@pytest.mark.extended
def test_recordings_tell_the_cable_from_the_gear(tmp_path):
    fit = bf.fit(folder_of_recordings(tmp_path / "data"), seed=1)
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
        load_dataset(folder_of_recordings(tmp_path, bends, **keywords))
