"""The C header against the package's own equations, by two compilers that find nothing to complain about."""

import re
import shutil
import subprocess
from dataclasses import replace

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
from bowdenfit.questions.export.tables import LEVELS

pytestmark = pytest.mark.extended

STRICT = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror")
DRIVER = r"""
#include <stdio.h>
#include "bowden.h"

int main(int n_arguments, char **arguments)
{
    double in[6], out[5];
#if BOWDEN_PRESLIDING
    bowden_state state = BOWDEN_START;
#else
    double state = NAN;
#endif
    (void)arguments;
    while (fread(in, sizeof *in, 5, stdin) == 5) {
        int flags = 0, more = 0;
        if (n_arguments > 1) {
#if BOWDEN_PRESLIDING
            out[0] = bowden_move((int)in[0], in[1], in[2], in[3], in[4], &state, &flags);
            out[1] = state.output_force;
#else
            out[0] = bowden_step((int)in[0], in[1], in[2], in[3], &state, &flags);
            out[1] = state;
#endif
            out[2] = out[3] = 0.0;
        } else {
            out[0] = bowden_output((int)in[0], in[1], in[2], in[3], (int)in[4], &flags);
            out[1] = bowden_input((int)in[0], in[1], in[2], in[3], (int)in[4], 0);
            out[2] = bowden_input((int)in[0], in[1], in[2], out[0], (int)in[4], &more);
            out[3] = bowden_compensation(in[1], in[2], in[3], (int)in[4], 0);
        }
        out[4] = flags;
        fwrite(out, sizeof *out, 5, stdout);
    }
    return 0;
}
"""
COMPILERS = [
    pytest.param(name, marks=pytest.mark.skipif(shutil.which(name) is None, reason=f"{name} is not installed"))
    for name in ("gcc", "clang")
]


@pytest.fixture(params=COMPILERS)
def build(request, tmp_path):
    """Compile the header of a cable with a program that asks it."""

    def make(computed):
        (tmp_path / "bowden.h").write_text(c_header(computed))
        (tmp_path / "driver.c").write_text(DRIVER)
        program = tmp_path / "driver"
        done = subprocess.run(
            [request.param, *STRICT, "-O2", "-o", program, tmp_path / "driver.c", "-lm"], capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        assert done.stderr == ""

        def ask(request, *mode):
            names = ("level", "place", "speed", "force", "stroke")
            rows = np.column_stack([np.asarray(request[name], dtype=float) for name in names])
            replied = subprocess.run([program, *mode], input=rows.tobytes(), capture_output=True, check=True).stdout
            return np.frombuffer(replied).reshape(-1, 5).T

        return ask

    return make


@pytest.mark.parametrize("case", CASES)
def test_c_says_what_the_equations_say_at_twenty_thousand_points(case, build):
    tables = cable(case)
    inputs = points(tables, 20_000, seed=3)
    output, needed, back, compensation, flags = build(tables)(inputs)
    np.testing.assert_allclose(output, of_equations(tables, inputs), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(needed, of_equations(tables, inputs, inverse=True), rtol=1e-12, atol=1e-12)
    there = output != 0
    np.testing.assert_allclose(back[there], inputs["force"][there], rtol=1e-9)
    least = of_equations(tables, inputs | {"level": np.full(20_000, LEVELS.index("mounting_q05"))}, inverse=True)
    np.testing.assert_allclose(compensation, least - inputs["force"], rtol=1e-12, atol=1e-10)
    route_points = tables.points.values
    outside = ((inputs["place"] < route_points[0]) | (inputs["place"] > route_points[-1])) & (case != "one place")
    np.testing.assert_array_equal(flags.astype(int) & 1, outside)
    np.testing.assert_array_equal((flags.astype(int) & 2) == 2, (output == 0) & (not tables.is_loop))


@pytest.mark.parametrize("case", CASES)
def test_c_follows_twenty_thousand_steps_as_the_play_operator_does(case, build):
    tables, n = cable(case), 20_000
    force, ask = motion(tables, n), build(tables)
    for level in (1, 4, 6):
        place, speed = float(np.mean(tables.points.values)) + 0.01, 31.0
        same = {"level": level, "place": place, "speed": speed, "stroke": 1.0}
        inputs = {name: np.full(n, value) for name, value in same.items()} | {"force": force}
        stepped, state, *_ = ask(inputs, "step")
        np.testing.assert_allclose(stepped, followed(tables, level, place, speed, force), rtol=1e-12, atol=1e-11)
        np.testing.assert_array_equal(stepped, state)
        assert np.ptp(stepped) > 50  # it moved, and stood still
        assert np.mean(np.diff(stepped) == 0) > 0.02


@pytest.mark.parametrize("case", CREEPING)
def test_c_follows_a_rope_that_creeps_as_the_package_does(case, build):
    tables, n, step = cable(case), 20_000, 0.001
    force, ask = motion(tables, n), build(tables)
    for level in (1, 4, 6):
        place, speed = float(np.mean(tables.points.values)), changing_speed(n)
        same = {"level": level, "place": place, "stroke": step}
        inputs = {name: np.full(n, value) for name, value in same.items()} | {"force": force, "speed": speed}
        stepped, state, *_ = ask(inputs, "step")
        np.testing.assert_allclose(stepped, crept(tables, level, place, speed, force, step), rtol=1e-10, atol=1e-9)
        np.testing.assert_array_equal(stepped, state)
        assert np.ptp(stepped) > 50 and np.mean(np.diff(stepped) == 0) < 0.02


def test_a_rope_that_creeps_recovers_from_what_is_no_number_and_from_slack(build):
    tables = cable("dahl")
    force = np.array([50.0, np.nan, 60.0, 0.0, 40.0, 80.0])
    inputs = {"level": [1] * 6, "place": [1.0] * 6, "speed": [0.0] * 6, "force": force, "stroke": [0.0] * 6}
    stepped, state, _, _, flags = build(tables)(inputs, "step")
    np.testing.assert_array_equal(flags, [0, 4, 0, 2, 0, 0])
    assert np.isnan(stepped[1]) and state[1] == state[0] and stepped[3] == 0.0
    assert np.all(np.isfinite(stepped[[0, 2, 4, 5]])) and stepped[5] > stepped[4] > 0


def test_c_tells_what_it_cannot_answer(build):
    tables = cable("load")
    inputs = {
        "level": [1, 99, -1, 1], "place": [np.nan, 1.0, 1.0, 1.0], "speed": [0.0] * 4, "force": [10.0, 10.0, 10.0, np.nan],
        "stroke": [1] * 4,
    }  # fmt: skip
    output, *_, flags = build(tables)(inputs)
    assert np.all(np.isnan(output))
    assert np.all(flags == 4)


def test_hostile_names_are_harmless_in_c(build):
    tables = cable("rope", name=HOSTILE)
    about = replace(tables.about, group=HOSTILE, distrust=HOSTILE, version=HOSTILE, created=HOSTILE)
    table_points = replace(tables.points, variable=HOSTILE, unit=HOSTILE)
    output, *_ = build(replace(tables, about=about, points=table_points))(points(tables, 10, seed=1))
    assert np.all(np.isfinite(output))


def test_the_header_allocates_nothing_and_says_where_it_is_from():
    text = c_header(cable("loop"))
    assert not re.search(r"\b(malloc|calloc|realloc|free|static double)\b", text)
    assert "seed 7" in text and "bowdenfit 0.1.0" in text and "Range: wrap_angle" in text
    assert max(map(len, text.splitlines())) < 130
