"""Faults of a bench that its channels reveal: each is named with its size and time, and its healthy twin raises no alarm.

The benches are those of `recorded_benches`, which shares no code with the package.
"""

from dataclasses import replace

import numpy as np
import pytest
from creeping_rope import Truth, record
from recorded_benches import RecordedBench, channels, draw_bench, write
from swinging_rope import swing

import bowdenfit as bf
from bowdenfit.description import Preparation
from bowdenfit.recordings.bench_faults import describe_bench_fault, find_bench_fault, shows_creep
from bowdenfit.recordings.preparation import prepare
from bowdenfit.recordings.recording import RawRecording, Recording
from bowdenfit.recordings.strokes import find_strokes

NONE = np.zeros(0)
BENCHES = [
    {"wave": "sine", "load": 1.0, "rate": 50},
    {"wave": "triangle", "load": 1e4, "rate": 100, "period": 10.0},
    {"wave": "random", "load": 100.0, "rate": 20, "period": 8.0},
]


def recording(bench, seed=0):
    columns = channels(bench, np.random.default_rng(seed))
    return read(*(columns[name] for name in ("time_s", "input_force_N", "output_force_N")))


def read(time, *forces):
    blocks, account = prepare(RawRecording("s", "s.csv", time, forces[0], time, forces[1]), Preparation())
    return Recording("s", "s.csv", "s", np.nan, NONE, NONE, blocks, find_strokes(blocks, "s.csv", "s"), account)


@pytest.mark.parametrize("usual", BENCHES)
@pytest.mark.parametrize("end", ["input", "output"])
def test_a_zero_that_jumps_is_named_with_its_size_and_time(usual, end):
    bench = RecordedBench(length=60, **usual, **{f"{end}_jump": 0.1})
    fault = find_bench_fault(recording(bench))
    assert fault.kind == f"{end}_zero"
    assert fault.size == pytest.approx(0.1 * bench.load, rel=0.1)
    assert fault.time == pytest.approx(30, abs=3)
    assert fault.exponent == pytest.approx(bench.exponent, rel=0.05)
    assert f"the zero of {end}_force jumps by" in describe_bench_fault(fault, "s.csv")


@pytest.mark.parametrize("usual", BENCHES)
def test_friction_that_changes_half_way_is_named_with_both_exponents(usual):
    fault = find_bench_fault(recording(RecordedBench(length=60, other_friction=0.5, **usual)))
    assert fault.kind == "friction"
    assert 1 + fault.size == pytest.approx(0.5, abs=0.05)
    assert fault.time == pytest.approx(30, abs=3)
    assert "friction changes at about" in describe_bench_fault(fault, "s.csv")


@pytest.mark.parametrize("usual", [BENCHES[0], {"wave": "chirp", "load": 1e4, "rate": 41}])
def test_crosstalk_is_named_by_what_the_output_moves_after_each_reversal(usual):
    fault = find_bench_fault(recording(RecordedBench(length=60, crosstalk=0.05, noise=0.001, **usual)))
    assert fault.kind == "crosstalk"
    assert fault.size == pytest.approx(0.05, abs=0.025)
    assert "right after each reversal" in describe_bench_fault(fault, "s.csv")


@pytest.mark.parametrize("usual", BENCHES)
def test_a_drag_is_named_unless_the_fit_has_one(usual):
    bench = RecordedBench(length=60, drag=0.15, **usual)
    fault = find_bench_fault(recording(bench))
    assert fault.kind == "drag"
    assert fault.size == pytest.approx(0.15 * bench.load, rel=0.3)
    assert fault.exponent == pytest.approx(bench.exponent, rel=0.05)
    assert find_bench_fault(recording(bench), expects_drag=True) is None


@pytest.mark.parametrize("usual", BENCHES)
@pytest.mark.parametrize("seed", range(3))
def test_a_healthy_bench_has_no_fault(usual, seed):
    assert find_bench_fault(recording(RecordedBench(length=60, **usual), seed)) is None


@pytest.mark.parametrize(("highest", "exponent", "period"), [(1.5, 0.3, 5.0), (2.0, 0.4, 5.0), (2.0, 0.5, 20.0)])
@pytest.mark.parametrize("sd", [0.001, 0.005])
@pytest.mark.parametrize("seed", range(4))
def test_no_zero_jumps_where_the_rope_only_sticks_before_it_or_after_it(seed, sd, highest, exponent, period):
    """The level at which the output sticks has the noise of the one block in which the rope stopped."""
    time = np.arange(0.0, 20.0, 0.01)
    force, output = swing(time, highest, exponent, period)
    noise = sd * force.max() * np.random.default_rng(seed).standard_normal((2, len(time)))
    fault = find_bench_fault(read(time, force + noise[0], output + noise[1]))
    assert fault is None or "zero" not in fault.kind


@pytest.mark.parametrize(("exponent", "crosstalk"), [(0.1, 0.0), (0.3, 0.05)])
def test_few_blocks_after_a_reversal_are_not_taken_for_crosstalk(exponent, crosstalk):
    """Of a rope that sticks for a block or two, so that the next one holds both sticking and sliding."""
    bench = RecordedBench(rate=220, length=42, period=0.872, wave="trapezoid", exponent=exponent, correlated=0.01, delay=0.02)
    fault = find_bench_fault(recording(replace(bench, crosstalk=crosstalk), 81))
    assert (fault.kind if fault else "") == ("crosstalk" if crosstalk else "")


@pytest.mark.parametrize("stiffness", [10.0, 25.0])
@pytest.mark.parametrize("exponent", [0.2, 0.4])
def test_a_rope_that_creeps_is_no_crosstalk_and_crosstalk_is_no_creep(stiffness, exponent):
    assert find_bench_fault(record(Truth(exponent, stiffness), 100.0, 1)) is None
    crossed = RecordedBench(length=60, rate=50, wave="sine", load=1.0, crosstalk=0.05, noise=0.001)
    assert find_bench_fault(recording(crossed)).kind == "crosstalk"


STIFF = (
    (Truth(0.385, 50.0), 14.0),
    (Truth(0.21, 52.0, damping=0.012, stribeck=0.16, stribeck_speed=9.6, viscous=0.008, reference_speed=20.0), 29.0),
    (Truth(0.18, 14.2, damping=0.013, stribeck=0.1, stribeck_speed=10.6, reference_speed=20.0), 100.0),
)


@pytest.mark.parametrize(("rope", "rate"), STIFF)
def test_a_rope_that_creeps_is_told_from_crosstalk_with_few_blocks_and_with_friction_of_another_kind(rope, rate):
    assert find_bench_fault(record(rope, rate, 1)) is None


def test_crosstalk_that_a_filter_makes_look_like_creep_is_named():
    bench = replace(draw_bench(8), rate=122.0, length=200.0, mountings=1, crosstalk=0.05)
    assert find_bench_fault(recording(bench, 8), expects_drag=True).kind == "crosstalk"


def test_friction_that_falls_with_the_speed_is_no_friction_that_changes_half_way():
    """The strokes of this rope become faster in the course of the recording."""
    rope = Truth(0.41, 42.0, damping=0.007, stribeck=0.47, stribeck_speed=5.2, viscous=-0.001, reference_speed=20.0)
    assert find_bench_fault(record(rope, 168.0, 1)) is None


def test_a_rope_that_creeps_shows_it_and_a_bench_with_or_without_crosstalk_does_not():
    assert shows_creep(record(Truth(0.22, 13.0), 100.0, 1))
    for crosstalk in (0.0, 0.05):
        assert not shows_creep(recording(RecordedBench(length=60, rate=200, wave="sine", crosstalk=crosstalk)))


@pytest.mark.extended
def test_noise_that_blocks_do_not_average_out_is_named_and_the_same_bench_with_less_is_trusted(tmp_path):
    bench = RecordedBench(rate=170, length=166, period=5.72, exponent=0.6, noise=0.03, correlated=0.1, mountings=3)
    noisy = bf.fit(write(bench, tmp_path / "noisy", 48), mcmc=False, seed=1).verdict()
    assert any("likeliest cause is noise: that of input_force in m0" in reason for reason in noisy.reasons)
    assert bf.fit(write(replace(bench, noise=0.01), tmp_path / "quiet", 48), mcmc=False, seed=1).verdict().trusted


def test_a_zero_that_drifts_is_no_jump():
    assert find_bench_fault(recording(RecordedBench(length=60, drift=0.1, rate=50))) is None


@pytest.mark.extended
def test_check_warns_of_it_and_the_verdict_ends_with_the_same_sentence(tmp_path):
    bench = RecordedBench(length=60, rate=50, output_jump=0.1)
    healthy = bf.check(write(replace(bench, output_jump=0.0), tmp_path / "healthy", 0))
    assert not healthy.warnings
    folder = write(bench, tmp_path / "bench", 0)
    (warning,) = bf.check(folder).warnings
    assert "r0.csv: the zero of output_force jumps by" in warning
    fit = bf.fit(folder, mcmc=False, seed=1)
    assert not fit.verdict().trusted
    assert warning in fit.verdict().reasons


@pytest.mark.extended
def test_the_verdict_knows_that_a_loop_is_off_center_by_the_sentence_of_check(run, tmp_path):
    folder = write(RecordedBench(length=60, rate=50), tmp_path / "bench", 0)
    description = folder / "cable.toml"
    wrong_gain = description.read_text() + "\n[sensors]\noutput_ratio = 0.9\n"
    description.write_text(wrong_gain)
    data = bf.check(folder)
    (warning,) = data.warnings
    assert "the hysteresis loop is off center by +10" in warning
    assert " ".join(run("check", folder)[1].split()).count("the hysteresis loop is off center by +10") == 1
    assert warning in bf.fit(folder, mcmc=False, seed=1).verdict().reasons
    description.write_text(wrong_gain + "input_gain_error_sd = 0.1\noutput_gain_error_sd = 0.1\n")
    assert not bf.check(folder).warnings


@pytest.mark.slow
def test_none_of_200_healthy_benches_unlike_each_other_has_a_fault():
    alarms = []
    for seed in range(200):
        bench = draw_bench(seed)
        bench = replace(bench, rate=min(bench.rate, 200.0))
        fault = find_bench_fault(recording(bench, seed), expects_drag=bench.drag > 0)
        alarms += [(seed, fault)] if fault else []
    assert len(alarms) <= 1, alarms
