"""Whole recordings whose input is noisier than it changes from block to block, of which friction comes out too large."""

import pytest
from conftest import ROOT
from made_again import measured_again

from bowdenfit.kinds.recordings.words import warnings
from bowdenfit.recordings.recording import Recordings


@pytest.mark.parametrize(("likelihood", "noise", "said"), [("whole", 4.0, 1), ("whole", 1.0, 0), ("runs", 4.0, 0)])
def test_noise_that_an_operator_takes_for_motion_is_said_of_whole_recordings(likelihood, noise, said):
    """At 4 N the most likely friction is 1.6 % too large, at 1 N it is right; steps are of about 3 N."""
    changes = [f'tables.recordings.likelihood="{likelihood}"']
    (data,) = measured_again(ROOT / "datasets" / "synthetic-recordings", 1, changes, sigma_block=noise)
    found = warnings(data.measurements.table(Recordings), data.description, data.measurements)
    assert len(found) == said
    assert all("peaks of noise" in sentence and "470 mm, 40 r/min" in sentence for sentence in found)
