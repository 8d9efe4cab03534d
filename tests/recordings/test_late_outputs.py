"""An output that is later than filters make it: found from the forces, or asked about where the motion repeats itself.

The benches are those of `recorded_benches`, which shares no code with the package.
"""

import numpy as np
import pytest
from recorded_benches import RecordedBench, channels

from bowdenfit.description import Preparation
from bowdenfit.errors import DatasetError
from bowdenfit.recordings.preparation import inspect_recording
from bowdenfit.recordings.recording import RawRecording


def inspected(seed=0, first=0, **bench):
    columns = channels(RecordedBench(rate=50, length=60, **bench), np.random.default_rng(seed))
    time, *forces = (columns[name][first:] for name in ("time_s", "input_force_N", "output_force_N"))
    return inspect_recording(RawRecording("s", "s.csv", time, forces[0], time, forces[1]), Preparation())


@pytest.mark.parametrize("wave", ["triangle", "sine", "chirp", "random"])
@pytest.mark.parametrize("load", [1.0, 1e4])
def test_an_output_that_is_late_by_a_quarter_of_the_period_is_found(wave, load):
    delay = inspected(wave=wave, load=load, delay=1.5).delay
    assert delay.value == pytest.approx(1.5, abs=0.05)
    assert "the output is 1.5" in delay.remark and "s later than the input" in delay.remark


@pytest.mark.parametrize("bench", [("triangle", 8.0, 0.3), ("sine", 20.0, 0.5), ("random", 4.0, 0.35), ("sine", 8.0, 0.2)])
def test_an_output_that_is_late_by_a_small_part_of_the_period_is_found(bench):
    """The search ended at 0.25 s, and a later output left too little unexplained for the scan of all shifts."""
    wave, period, late = bench
    for seed in range(3):
        delay = inspected(seed, wave=wave, period=period, delay=late).delay
        assert delay.value == pytest.approx(late, abs=0.03) and delay.sd < 0.03
        assert ("s later than the input" in delay.remark) == (late > 0.25)


def test_an_output_that_is_late_by_more_than_a_quarter_of_the_period_is_not_searched_for_there():
    delay = inspected(wave="sine", period=1.0, noise=0.02, delay=0.45).delay
    assert delay.value == 0.0 and "the end of the range that was searched" in delay.remark


def test_an_input_that_is_late_is_found():
    delay = inspected(wave="chirp", delay=-0.8).delay
    assert delay.value == pytest.approx(-0.8, abs=0.05)
    assert "earlier" in delay.remark


@pytest.mark.parametrize("wave", ["triangle", "sine", "chirp", "random"])
def test_a_healthy_output_stays_as_it_is(wave):
    delay = inspected(wave=wave, delay=0.02).delay
    assert delay.value == pytest.approx(0.02, abs=0.05)
    assert "later" not in delay.remark


def test_half_a_period_of_equal_cycles_is_asked_about_with_the_option_that_states_it():
    with pytest.raises(DatasetError) as refused:
        inspected(wave="sine", delay=3.0, first=1000)
    for part in ("about as well", "repeats itself", "--set 'tables.recordings.prepare.delay={value=", 'unit="s"}'):
        assert part in str(refused.value)


@pytest.mark.parametrize("share", [0.4, 0.6])
def test_a_cell_that_is_tared_in_between_is_no_late_output(share):
    """Shifted by whole periods the part before the jump explains all of the output that is left."""
    columns = channels(RecordedBench(rate=50, length=60, wave="sine", period=6.0), np.random.default_rng(0))
    time, force, output = (columns[name] for name in ("time_s", "input_force_N", "output_force_N"))
    force = force - 0.1 * np.ptp(force) * (time > share * 60)
    delay = inspect_recording(RawRecording("s", "s.csv", time, force, time, output), Preparation()).delay
    assert abs(delay.value) < 0.25 and "later than the input, which" not in delay.remark
