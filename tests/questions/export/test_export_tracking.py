"""Friction followed online, in Python and in C: what is learned, how wide intervals are, and when it cannot tell."""

import itertools
import math
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exported_cables import CASES, CREEPING, cable, module_of

from bowdenfit.questions.export.c import c_header
from bowdenfit.questions.export.sensors import SensorErrors
from bowdenfit.questions.export.tables import LEVELS
from bowdenfit.recordings.rope_strokes import fit_loop

ROOT = Path(__file__).parents[3]
COMPILERS = [
    pytest.param(name, marks=pytest.mark.skipif(shutil.which(name) is None, reason=f"{name} is not installed"))
    for name in ("gcc", "clang")
]

STEP, NOISE = 0.005, 0.1  # s, N


def _recorded(exponent_at, seconds=60.0, seed=1, period=3.0, late=0):
    """Time, input and output force of a rope that is pulled to and fro, its friction exponent a function of time.

    The output is measured some samples late.
    """
    generator, time = np.random.default_rng(seed), np.arange(0, seconds, STEP)
    force, exponent = 55 - 35 * np.cos(2 * np.pi * time / period), exponent_at(time)
    y, output = np.log(force[0]), []
    for x, band in zip(np.log(force).tolist(), exponent.tolist(), strict=True):
        y = min(max(y, x - band), x + band)
        output.append(y)
    noise = NOISE * generator.standard_normal((2, len(time)))
    delayed = np.concatenate([np.full(late, output[0]), output[: len(output) - late]])
    return time, force + noise[0], np.exp(delayed) + noise[1]


def _track(tracker, force, output, speed=0.0):
    """Exponent, ends of its interval and whether the rope slid, after each sample."""
    rows = []
    for f, g in zip(force.tolist(), output.tolist(), strict=True):
        exponent = tracker.update(f, g, STEP, speed)
        rows.append((exponent, *tracker.interval, float(tracker.sliding)))
    return np.array(rows).T


def _steady(time):
    """0.3, as `_fitted` has it."""
    return np.full_like(time, 0.3)


def _fitted(case="rope"):
    """The module of a rope whose friction exponent is 0.3 as fitted, in any mounting 0.25 to 0.35."""
    tables = cable(case)
    exponents = dict(zip(LEVELS, (0.29, 0.3, 0.31, 0.25, 0.35), strict=True))
    levels = (replace(level, exponent=0 * level.exponent + exponents.get(level.name, 0.3)) for level in tables.levels)
    return module_of(replace(tables, levels=tuple(levels)))


def _ramp(time):
    """0.3, from 20 to 40 s up to 0.45: the route is bent more."""
    return np.interp(time, [20.0, 40.0], [0.3, 0.45])


@pytest.mark.extended
def test_the_estimate_goes_where_fits_of_windows_go_while_the_route_changes():
    time, force, output = _recorded(_ramp)
    tracker = module_of(cable("rope")).Tracker(1.0, 0.01, NOISE)
    exponent, low, high, slid = _track(tracker, force, output)
    for start in (6.0, 12.0, 42.0, 48.0, 54.0):  # windows in which the route stays
        window = slice(int(start / STEP), int((start + 6.0) / STEP), 4)
        batch = fit_loop(force[window], output[window]).exponent
        index = int((start + 6.0) / STEP) - 1
        assert low[index] - 0.003 < batch < high[index] + 0.003
        assert abs(exponent[index] - batch) < 0.006
    after = time > 3.0
    assert np.max(np.abs(exponent - _ramp(time))[after]) < 0.03  # it lags by a standing phase of the ramp
    inside = (low <= _ramp(time)) & (_ramp(time) <= high)
    assert inside[after].mean() > 0.7
    assert 0.2 < slid.mean() < 0.8


@pytest.mark.extended
def test_intervals_hold_the_exponent_of_a_route_that_wanders_as_was_said():
    held = []
    for seed in range(20):
        generator = np.random.default_rng(seed)
        walk = 0.3 + np.cumsum(0.02 * np.sqrt(STEP) * generator.standard_normal(int(15 / STEP)))
        _, force, output = _recorded(lambda _, walk=walk: walk, 15.0, seed)
        _, low, high, _ = _track(module_of(cable("rope")).Tracker(1.0, 0.02, NOISE), force, output)
        held.append((low <= walk) & (walk <= high))
    assert 0.8 < np.mean(np.array(held)[:, 600::100]) < 0.97


def test_when_nothing_slides_the_estimate_stays_and_its_interval_widens():
    """Forces that stand still, that move inside the friction band, that are no forces, or that are noise."""
    generator = np.random.default_rng(2)
    for force, output in (
        (np.full(800, 50.0), np.full(800, 40.0)),
        (50.0 + 5.0 * np.sin(np.arange(800) / 50), np.full(800, 40.0)),
        (np.full(800, np.nan), np.full(800, 40.0)),
        (np.full(800, 50.0), np.zeros(800)),
        (50.0 + NOISE * generator.standard_normal(800), 40.0 + NOISE * generator.standard_normal(800)),
    ):
        tracker = module_of(cable("rope")).Tracker(1.0, 0.01, NOISE)
        initial, variance = tracker.exponent, tracker.variance
        exponent, low, high, slid = _track(tracker, force, output)
        assert not slid.any() and np.all(exponent == initial)
        assert np.all(np.diff(high - low) >= 0) and tracker.variance == pytest.approx(variance + 0.01**2 * 800 * STEP)


def test_it_begins_at_the_posterior_of_any_one_mounting():
    tables = cable("rope")
    tracker = module_of(tables).Tracker(1.5, 0.01, NOISE)
    route_points = {level.name: float(np.interp(1.5, tables.points.values, level.exponent[0])) for level in tables.levels}
    assert tracker.exponent == pytest.approx(route_points["q50"], rel=1e-12)
    half = (route_points["mounting_q95"] - route_points["mounting_q05"]) / 2
    assert tracker.interval[1] == pytest.approx(route_points["q50"] + half, rel=1e-12)


def test_it_begins_with_the_sensors_of_the_fit_and_refuses_what_is_not_known():
    sensors = SensorErrors(0.2, 0.01, 0.014, 0.05, 0.003)
    module = module_of(replace(cable("rope"), sensors=sensors))
    tracker = module.Tracker(1.0, 0.01)
    assert (tracker.force_sd, tracker.noise_time, tracker.gain_sd, *tracker.considered) == (0.2, 0.01, 0.014, 0.05, 0.05, 0.003)
    assert module.Tracker(1.0, 0.01, 0.1, gain_sd=0.0).gain_sd == 0.0
    for arguments in ((0.0, 0.1), (0.01, 0.0), (0.01, math.nan)):
        with pytest.raises(ValueError, match="must be above 0"):
            module.Tracker(1.0, *arguments)
    with pytest.raises(ValueError, match="must be above 0"):
        module_of(cable("rope")).Tracker(1.0, 0.01)  # whose fit has no recording
    with pytest.raises(ValueError, match="must be 0 or more"):
        module.Tracker(1.0, 0.01, latency_sd=-1.0)


def test_the_update_is_that_of_a_kalman_filter_and_shifts_are_its_derivatives():
    """Against covariances as whole matrices (Joseph's form), and against the same readings with an error in each."""
    module, generator = module_of(cable("rope")), np.random.default_rng(3)
    estimate, shifted = (module._Estimate(0.3, [1.0, 0.01, 1e-4]) for _ in range(2))
    mean, covariance = np.array([0.0, 0.3, 0.0]), np.diag([1.0, 0.01, 1e-4])
    error = np.array([0.3, -0.2, 0.1])  # the considered errors of the shifted readings
    for _ in range(50):
        row, considered = generator.standard_normal(3), generator.standard_normal(3)
        reading, noise = generator.standard_normal(), generator.uniform(0.1, 1.0)
        for other in (estimate, shifted):
            other.wait(0.01, 0.02, 0.02, 0.01)
        decay = math.exp(-0.5)
        change = np.diag([decay, 1.0, 1.0])
        mean, covariance = change @ mean, change @ covariance @ change + np.diag([1 - decay**2, 0.02**2 * 0.01, 0.0])
        conditional = estimate.d[2]  # as gains age
        covariance[2, 2] = conditional
        covariance[:2, 2] = covariance[2, :2] = [estimate.u[i][2] * conditional for i in range(2)]
        covariance[:2, :2] = [[_covariance(estimate, i, j) for j in range(2)] for i in range(2)]
        gain = covariance @ row / (row @ covariance @ row + noise)
        keep = np.eye(3) - np.outer(gain, row)
        mean, covariance = mean + gain * (reading - row @ mean), keep @ covariance @ keep.T + noise * np.outer(gain, gain)
        estimate.learn(row, considered, reading, noise, (0.0, 0.0, 0.0))
        shifted.learn(row, considered, reading + considered @ error, noise, (0.0, 0.0, 0.0))
        np.testing.assert_allclose(estimate.mean, mean, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose([[_covariance(estimate, i, j) for j in range(3)] for i in range(3)], covariance, atol=1e-12)
        np.testing.assert_allclose(
            np.array(shifted.mean) - estimate.mean, error @ np.array(estimate.shift), rtol=1e-9, atol=1e-12
        )


def _covariance(estimate, i, j):
    """An element of U D U'."""
    u = np.array(estimate.u) + np.eye(3)
    return float(u[i] * estimate.d @ u[j])


@pytest.mark.extended
def test_strokes_to_and_fro_tell_the_gain_of_a_cell_from_friction():
    time, force, output = _recorded(_steady, 24.0)
    tracker = _fitted().Tracker(1.0, 0.01, NOISE, gain_sd=0.014)
    _, low, high, _ = _track(tracker, force, 1.02 * output)
    assert tracker.counted.mean[2] == pytest.approx(0.02, abs=0.005)
    assert np.mean((low <= 0.3) & (high >= 0.3)) > 0.8 and not tracker.cannot_tell


@pytest.mark.extended
@pytest.mark.parametrize(("latency_sd", "contains"), [(0.0, False), (0.015, True)])
def test_a_late_output_is_inside_the_interval_if_it_may_be_late(latency_sd, contains):
    time, force, output = _recorded(_steady, 24.0, late=3)
    _, low, high, _ = _track(_fitted().Tracker(1.0, 0.01, NOISE, latency_sd=latency_sd), force, output)
    inside = (low <= 0.3) & (high >= 0.3)
    assert (inside[time > 1.0].mean() > 0.95) == contains


@pytest.mark.extended
@pytest.mark.parametrize("fault", ["none", "filtered noise", "gain"])
def test_it_says_that_it_cannot_tell_where_samples_contradict_what_was_stated(fault):
    time, force, output = _recorded(_steady, 30.0)
    if fault == "filtered noise":
        generator, noise = np.random.default_rng(4), np.zeros((2, len(time)))
        for k in range(1, len(time)):
            noise[:, k] = 0.95 * noise[:, k - 1] + math.sqrt(1 - 0.95**2) * NOISE * generator.standard_normal(2)
        force, output = force + noise[0], output + noise[1]
    tracker = _fitted().Tracker(1.0, 0.003, 2**0.5 * NOISE if fault == "filtered noise" else NOISE)
    flags, inside = [], []
    for f, g in zip(force.tolist(), (1.05 * output if fault == "gain" else output).tolist(), strict=True):
        tracker.update(f, g, STEP)
        flags.append(tracker.cannot_tell)
        inside.append(tracker.interval[0] <= 0.3 <= tracker.interval[1])
    late = time > 9.0
    assert np.mean(np.array(flags)[late]) == (0.0 if fault == "none" else 1.0)
    assert np.mean(np.array(inside)[late]) > 0.75


def _forces(module, place, force, share, speed=None):
    """Output forces of a cable whose friction is a share of the fitted one at each sample, by the exported operator."""
    motion, output = module.Motion("q50", place), []
    fitted, speed = motion.level, np.zeros_like(force) if speed is None else speed
    for f, x, v in zip(force.tolist(), share.tolist(), speed.tolist(), strict=True):
        motion.level = fitted | {name: tuple(y * x for y in fitted[name]) for name in ("pull", "return", "taut_loss")}
        output.append(motion.step(f, v, STEP))
    return np.array(output)


@pytest.mark.extended
@pytest.mark.parametrize("case", ["load", "rate", "stroke", *CREEPING])
def test_every_kind_of_friction_is_followed(case):
    """Near a reversal friction that rises as the speed falls makes a rope stick, which must not count as less friction."""
    module, time = _fitted(case), np.arange(0, 30.0, STEP)
    tracker = module.Tracker(1.0, 0.01, NOISE, gain_sd=0.014, zero_sd=0.09, latency_sd=0.01)
    phase, share = 2 * np.pi * time / 3.0, 1.0 + 0.1 * np.sin(time / 4)
    force, speed, exponent = 55 - 35 * np.cos(phase), 1.0 + 25 * np.abs(np.sin(phase)), tracker.exponent * share
    noise = NOISE * np.random.default_rng(6).standard_normal((2, len(time)))
    force, output, inside = force + noise[0], _forces(module, 1.0, force, share, speed) + noise[1], []
    for f, g, v, x in zip(force.tolist(), output.tolist(), speed.tolist(), exponent.tolist(), strict=True):
        tracker.update(f, g, STEP, v)
        inside.append(tracker.interval[0] <= x <= tracker.interval[1])
    assert np.mean(inside) > 0.93 and not tracker.cannot_tell


@pytest.mark.extended
@pytest.mark.parametrize("preload", [5.0, 100.0])  # it goes slack, or stays taut
def test_what_a_loop_loses_is_followed_too(preload):
    tables = cable("loop")
    levels = tuple(replace(level, taut_loss=2 * preload * level.exponent[0]) for level in tables.levels)
    tables = replace(tables, levels=levels)
    place, time = float(np.median(tables.points.values)), np.arange(0, 30.0, STEP)
    tracker = module_of(tables).Tracker(place, 0.01, NOISE, gain_sd=0.014, zero_sd=0.05, latency_sd=0.002)
    share, force = np.interp(time, [10.0, 20.0], [1.1, 1.4]), -80.0 * np.cos(2 * np.pi * time / 3.0)
    exponent, noise = tracker.exponent * share, NOISE * np.random.default_rng(5).standard_normal((2, len(time)))
    output = _forces(module_of(tables), place, force, share)
    estimate, low, high, slid = _track(tracker, force + noise[0], output + noise[1])
    assert np.mean((low <= exponent) & (exponent <= high)) > 0.9 and not tracker.cannot_tell
    assert abs(estimate[-1] / exponent[-1] - 1) < 0.05 and slid.mean() > 0.4


TRACKS = r"""
#include <stdio.h>
#include "bowden.h"

int main(void)
{
    double in[3], out[5];
    bowden_tracker tracker;
    bowden_sensors none = bowden_fitted_sensors;

    none.force_sd = NAN;
    if (bowden_track_start(&tracker, 1.5, 0.0, 0.1) != BOWDEN_INVALID
        || bowden_track_start_with(&tracker, 1.5, 0.01, &none) != BOWDEN_INVALID
        || bowden_track_start(&tracker, 1.5, 0.01, 0.1)) {
        return 1;
    }
    while (fread(in, sizeof *in, 3, stdin) == 3) {
        out[0] = bowden_track(&tracker, in[0], in[1], in[2], 0.005);
        out[4] = bowden_track_interval(&tracker, out + 1, out + 2) == BOWDEN_CANNOT_TELL;
        out[3] = tracker.sliding;
        fwrite(out, sizeof *out, 5, stdout);
        if (!(tracker.next.d[0] >= 0 && tracker.next.d[1] > 0 && tracker.next.d[2] >= 0)) {
            return 2;
        }
    }
    return 0;
}
"""
SENSORS = {"ideal": SensorErrors(0.1), "usual": SensorErrors(0.1, 0.02, 0.014, 0.09, 0.01)}


def _track_in_c(tables, rows, folder, compiler, *options):
    """Exponent, ends of its interval, whether the rope slid, and the flag, after each sample, by the C header."""
    (folder / "bowden.h").write_text(c_header(tables))
    (folder / "track.c").write_text(TRACKS)
    strict = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O2")
    call = [compiler, *strict, *options, "-o", "track", "track.c", "-lm"]
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    replied = subprocess.run([folder / "track"], input=rows.tobytes(), capture_output=True, check=True).stdout
    return np.frombuffer(replied).reshape(-1, 5).T


@pytest.mark.extended
@pytest.mark.parametrize(
    ("case", "sensors"), [("rope", "ideal"), *((case, "usual") for case in (*CASES, *CREEPING) if case != "one place")]
)
@pytest.mark.parametrize("compiler", COMPILERS)
def test_c_follows_friction_as_python_does(case, sensors, compiler, tmp_path):
    tables = replace(cable(case), sensors=SENSORS[sensors])
    _, force, output = _recorded(_ramp, 15.0)
    if case == "loop":
        force, output = force - 50.0, output - 50.0
    force[500:520], output[700] = np.nan, 0.0
    answers = _track_in_c(tables, np.column_stack([np.full_like(force, 25.0), force, output]), tmp_path, compiler)
    tracker = module_of(tables).Tracker(1.5, 0.01, 0.1)
    expected, flags = [], []
    for f, g in zip(force.tolist(), output.tolist(), strict=True):
        expected.append((tracker.update(f, g, STEP, 25.0), *tracker.interval, tracker.sliding))
        flags.append(tracker.cannot_tell)
    np.testing.assert_allclose(answers[:4], np.array(expected, dtype=float).T, rtol=1e-8, atol=1e-11)
    np.testing.assert_array_equal(answers[4], flags)
    assert np.mean(answers[3]) > 0.05


@pytest.mark.extended
@pytest.mark.parametrize("compiler", COMPILERS)
def test_single_precision_is_as_good(compiler, tmp_path):
    """Also over 20 minutes, in which learned variances become small."""
    tables = replace(cable("rope"), sensors=SENSORS["usual"])
    _, force, output = _recorded(lambda time: 0.3 + 0.05 * np.sin(time / 40), 1200.0)
    rows = np.column_stack([np.zeros_like(force), force, output])
    double, single = (
        _track_in_c(tables, rows, tmp_path, compiler, *options) for options in ((), ("-DBOWDEN_REAL=float",))
    )
    np.testing.assert_allclose(single[:3], double[:3], atol=2e-4)
    np.testing.assert_array_equal(single[3:], double[3:])


@pytest.mark.slow
def test_intervals_contain_the_exponent_with_sensors_that_are_not_ideal(monkeypatch, tmp_path):
    """The table of scripts/check_tracking.py: 0.85 or more in each row, on 12 recordings of 12 s that never change."""
    monkeypatch.syspath_prepend(ROOT / "scripts")
    import check_tracking

    laboratory = check_tracking.Laboratory(tmp_path, "gcc")
    for fault, drift in itertools.product(check_tracking.FAULTS.values(), check_tracking.DRIFTS):
        sensors = check_tracking.usual_sensors(check_tracking.Bench(), fault)
        row = laboratory.cover(check_tracking.Bench(), sensors, fault, drift, range(12))
        assert row.inside >= check_tracking.LEAST and row.flagged < 0.02
