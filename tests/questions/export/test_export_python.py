"""The Python module against the package's own equations, and friction followed online in Python and in C."""

import shutil
import subprocess
import sys
import types

import numpy as np
import pytest
from exported_cables import (
    CASES,
    CREEPING,
    HOSTILE,
    cable,
    changing_speed,
    crept,
    followed,
    motion,
    of_equations,
    points,
)

from bowdenfit.questions.export.c import c_header
from bowdenfit.questions.export.python import python_module
from bowdenfit.recordings.rope_strokes import fit_loop


def module_of(computed) -> types.ModuleType:
    """The exported module, loaded."""
    module = types.ModuleType("exported_cable")
    exec(compile(python_module(computed), "exported_cable.py", "exec"), module.__dict__)
    return module


@pytest.mark.extended
@pytest.mark.parametrize("case", [*CASES, *CREEPING])
def test_python_says_what_the_equations_say(case):
    tables = cable(case)
    module, inputs = module_of(tables), points(tables, 300, seed=3)
    names = [level.name for level in tables.levels]
    rows = list(zip(*(inputs[name] for name in ("level", "place", "force", "stroke", "speed")), strict=True))
    answers = [module.output(names[level], *more) for level, *more in rows]
    np.testing.assert_allclose(answers, of_equations(tables, inputs), rtol=1e-12, atol=1e-12)
    needed = [module.input_force(names[level], *more) for level, *more in rows]
    np.testing.assert_allclose(needed, of_equations(tables, inputs, inverse=True), rtol=1e-12, atol=1e-12)
    assert module.is_outside(tables.points.values[-1] + 1) == (case != "one place")


@pytest.mark.extended
@pytest.mark.parametrize("case", [*CASES, *CREEPING])
def test_python_follows_any_motion(case):
    tables, place = cable(case), float(np.mean(cable(case).points.values)) + 0.01
    force, follow = motion(tables, 4000)[::4], module_of(tables).Motion("q95", place)
    speed = changing_speed(len(force)) if case in CREEPING else np.full(len(force), 31.0)
    output = np.array([follow.step(f, v, 0.01) for f, v in zip(force, speed, strict=True)])
    reference = crept(tables, 2, place, speed, force, 0.01) if case in CREEPING else followed(tables, 2, place, 31.0, force)
    np.testing.assert_allclose(output, reference, rtol=1e-10, atol=1e-9)


def test_hostile_names_are_harmless_in_python_and_what_is_no_number_is_refused():
    module = module_of(cable("rope", name=HOSTILE))
    for value in (lambda: module.output("q50", 1.0, float("nan"), 1), lambda: module.Motion("q50", float("nan")).step(1.0)):
        with pytest.raises(ValueError, match="is not a number"):
            value()
    with pytest.raises(ValueError, match="single ropes only"):
        module_of(cable("loop")).Tracker(1.0, 0.01, 0.1)
    with pytest.raises(ValueError, match="must be above 0"):
        module.Tracker(1.0, 0.0, 0.1)


# Friction followed online -----------------------------------------------------------------------------------------

STEP, NOISE = 0.005, 0.1  # s, N


def _recorded(exponent_at, seconds=60.0, seed=1, period=3.0):
    """Time, input and output force of a rope that is pulled to and fro, its friction exponent a function of time."""
    generator, time = np.random.default_rng(seed), np.arange(0, seconds, STEP)
    force, exponent = 55 - 35 * np.cos(2 * np.pi * time / period), exponent_at(time)
    y, output = np.log(force[0]), []
    for x, band in zip(np.log(force).tolist(), exponent.tolist(), strict=True):
        y = min(max(y, x - band), x + band)
        output.append(y)
    noise = NOISE * generator.standard_normal((2, len(time)))
    return time, force + noise[0], np.exp(output) + noise[1]


def _track(tracker, force, output, speed=0.0):
    """Exponent, ends of its interval and whether the rope slid, after each sample."""
    rows = []
    for f, g in zip(force.tolist(), output.tolist(), strict=True):
        exponent = tracker.update(f, g, STEP, speed)
        rows.append((exponent, *tracker.interval, float(tracker.sliding)))
    return np.array(rows).T


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


TRACKS = r"""
#include <stdio.h>
#include "bowden.h"

int main(void)
{
    double in[3], out[4];
    bowden_tracker tracker;

    if (bowden_track_start(&tracker, 1.5, 0.0, 0.1) != BOWDEN_INVALID || bowden_track_start(&tracker, 1.5, 0.01, 0.1)) {
        return 1;
    }
    while (fread(in, sizeof *in, 3, stdin) == 3) {
        out[0] = bowden_track(&tracker, in[0], in[1], in[2], 0.005);
        bowden_track_interval(&tracker, out + 1, out + 2);
        out[3] = tracker.sliding;
        fwrite(out, sizeof *out, 4, stdout);
    }
    return 0;
}
"""


@pytest.mark.extended
@pytest.mark.parametrize("case", ["rope", "dahl", "lugre", "stroke"])
@pytest.mark.parametrize(
    "compiler",
    [pytest.param(c, marks=pytest.mark.skipif(shutil.which(c) is None, reason=f"{c} is not here")) for c in ("gcc", "clang")],
)
def test_c_follows_friction_as_python_does(case, compiler, tmp_path):
    tables = cable(case)
    (tmp_path / "bowden.h").write_text(c_header(tables))
    (tmp_path / "track.c").write_text(TRACKS)
    strict = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O2")
    call = [compiler, *strict, "-o", "track", "track.c", "-lm"]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    _, force, output = _recorded(_ramp, 24.0)
    force[500:520], output[700] = np.nan, 0.0
    rows = np.column_stack([np.full_like(force, 25.0), force, output])
    replied = subprocess.run([tmp_path / "track"], input=rows.tobytes(), capture_output=True, check=True).stdout
    expected = _track(module_of(tables).Tracker(1.5, 0.01, 0.1), force, output, 25.0)
    np.testing.assert_allclose(np.frombuffer(replied).reshape(-1, 4).T, expected, rtol=1e-9, atol=1e-12)
    assert expected[3].mean() > 0.05


def test_the_module_needs_nothing_but_python(tmp_path):
    (tmp_path / "bowden.py").write_text(python_module(cable("lugre")))
    program = "import sys, bowden; print(bowden.output('q50', 1.0, 10.0, 1), 'numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {program}"],
                          capture_output=True, text=True)  # fmt: skip
    assert done.returncode == 0 and done.stdout.endswith("False\n"), done.stderr
