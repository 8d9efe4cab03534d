"""What people see of a motor's readings: forces on the rope and efficiencies of the cable, the gear taken off."""

import numpy as np
import pytest
from motor_benches import MU, currents, folder_of, folder_of_recordings, rope_force

import bowdenfit as bf
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.questions.motor_gear import GEAR_NOTE, find_median_gear, gear_factors, rope_measurements
from bowdenfit.questions.summary.details import details_text
from bowdenfit.recordings.recording import Recordings

BENDS = (0, 45, 90, 180, 270)


@pytest.fixture(scope="module")
def fit(tmp_path_factory):
    return bf.fit(folder_of(tmp_path_factory.mktemp("motor") / "data", currents(BENDS)), mcmc=False, seed=1)


def test_forces_on_the_rope_follow_the_capstan_equation(fit):
    table = rope_measurements(fit).table(ForceTable)
    exponent = MU * np.deg2rad(np.array(BENDS))[table.run]
    assert np.log(table.input_force / table.output_force) * table.stroke == pytest.approx(exponent, abs=5e-3)
    assert not np.allclose(fit.dataset.measurements.table(ForceTable).input_force, table.input_force, rtol=0.1)


def test_efficiencies_are_those_of_the_cable_and_a_note_says_so(fit):
    (term,) = fit.model.terms
    efficiency = gear_factors(fit, term) * term.observed()
    assert efficiency == pytest.approx(np.exp(-MU * np.deg2rad(np.array(BENDS))), abs=5e-3)
    assert GEAR_NOTE in " ".join(details_text(fit).split())


def test_without_a_motor_nothing_is_taken_off(quick_fit):
    assert find_median_gear(quick_fit) is None
    assert rope_measurements(quick_fit) is quick_fit.dataset.measurements
    assert all(np.all(gear_factors(quick_fit, term) == 1) for term in quick_fit.model.terms)


def test_the_force_on_the_rope_stands_still_while_the_motor_turns_around(tmp_path):
    fit = bf.fit(folder_of_recordings(tmp_path / "data"), mcmc=False, seed=1)
    (first, *_), (shown, *_) = (part.table(Recordings).items for part in (fit.dataset.measurements, rope_measurements(fit)))
    torque = first.blocks.input_force * 0.015  # behind the ratio of the gear
    expected, force = [], 0.0
    for value in torque:
        force = float(np.clip(force, rope_force(value, True), rope_force(value, False)))
        expected.append(force)
    assert shown.blocks.input_force[20:] == pytest.approx(np.array(expected)[20:], abs=1.0)
    assert np.abs(shown.strokes.exponent) < 0.02 < first.strokes.exponent  # without the cable
