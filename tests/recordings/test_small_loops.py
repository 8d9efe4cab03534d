"""Loops that are hardly wider than the play: after the first pull the rope slides in moments only, and never back."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.recordings.recording import Recordings

EXPONENT = 0.377


def recorded(path, force, noise, seed=0):
    """Strokes and forces of a rope's recording at 50 Hz."""
    level, output = force[0] * np.exp(-EXPONENT), []
    for value in force:
        level = min(max(level, value * np.exp(-EXPONENT)), value * np.exp(EXPONENT))
        output.append(level)
    columns = np.stack([force, output]) + np.random.default_rng(seed).normal(0, noise, (2, len(force)))
    table = np.column_stack([np.arange(len(force)) / 50, *columns])
    np.savetxt(path, table, "%.7g", ",", header="time_s,input_force_N,output_force_N", comments="")
    (recording,) = bf.read(path, wrap_angle="180deg").measurements.table(Recordings).items
    return recording


@pytest.mark.parametrize("load", [1.0, 60.0, 1e4])
def test_friction_of_a_small_loop_is_that_of_the_blocks_in_which_the_operator_slides(load, tmp_path):
    """These fits gave 10 to 20 % less: blocks in which both forces rose before the rope slid were taken for a pull."""
    time = np.arange(0, 48, 0.02)
    turns = [10, 38, 24, 40, 26, 39, 28, 42, 25, 41, 27, 43, 30]
    force = np.interp(time, np.arange(0, 52, 4), turns)
    force = np.convolve(np.pad(force, 10, mode="edge"), np.ones(21) / 21, "valid")
    recording = recorded(tmp_path / "r.csv", load / 60 * force, load / 60 * 0.15)
    used = recording.strokes.used_sliding
    ratio = np.log(recording.blocks.input_force / recording.blocks.output_force)[used]
    assert used.sum() >= 10
    assert np.mean(ratio) == pytest.approx(EXPONENT, rel=0.03)


def test_a_pull_with_a_stop_is_still_a_pull(tmp_path):
    """Without a reversal the operator knows nothing of its band, and that both forces rise says where the rope slides."""
    time = np.arange(0, 20, 0.02)
    recording = recorded(tmp_path / "r.csv", 10 + 2.5 * np.minimum(time, 8) + 2.5 * np.maximum(time - 12, 0), 0.05)
    assert recording.strokes.exponent == pytest.approx(EXPONENT, rel=0.02)
    assert recording.strokes.used_sliding.sum() > 50
