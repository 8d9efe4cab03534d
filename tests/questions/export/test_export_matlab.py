"""The MATLAB function against the package's own equations, run by Octave."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exported_cables import CASES, CREEPING, HOSTILE, cable, crept, followed, motion, of_equations, points

from bowdenfit.errors import UsageError
from bowdenfit.questions.export.matlab import function_name, matlab_function
from bowdenfit.questions.export.tables import LEVELS

pytestmark = pytest.mark.extended

OCTAVE = shutil.which("octave-cli")
needs_octave = pytest.mark.skipif(OCTAVE is None, reason="Octave is not installed")
ON_LEAVING = (
    "error: ignoring const execution_exception& while preparing to exit"  # of some builds of Octave, whatever is run
)
SCRIPT = """
1;
function check(f, in)
  k = find(in(:, 1) == in(1, 1))(1:12);
  [one, flag] = f('output', in(1, 1), in(k, 2), in(k, 3), in(k, 4), in(k, 5));
  for shape = {[1, 12], [3, 4], [2, 3, 2]}
    as = @(column) reshape(in(k, column), shape{1});
    [out, flags] = f('output', in(1, 1), as(2), as(3), as(4), as(5));
    assert(out, reshape(one, shape{1}));
    assert(flags, reshape(flag, shape{1}));
    state = f('step', in(1, 1), as(2), 0, 10, 0, NaN);
    assert(size(state), shape{1});
    assert(all(isfinite(state(:))));
    assert(f('step', in(1, 1), as(2), 0, 10, 0, state), state);
  end
end
for name = {%s}
  f = str2func(name{1});
  in = dlmread([name{1} '.csv']);
  check(f, in);
  out = zeros(rows(in), 4);
  for level = unique(in(:, 1))'
    k = in(:, 1) == level;
    [out(k, 1), out(k, 4)] = f('output', level, in(k, 2), in(k, 3), in(k, 4), in(k, 5));
    out(k, 2) = f('input', level, in(k, 2), in(k, 3), in(k, 4), in(k, 5));
    out(k, 3) = f('compensation', 0, in(k, 2), in(k, 3), in(k, 4), in(k, 5));
  end
  dlmwrite([name{1} '.out'], out, 'precision', '%%.17g');
  force = dlmread([name{1} '.motion']);
  state = NaN;
  for i = 2:numel(force)
    state = f('step', force(1), in(1, 2), 31, force(i), 0, state);
    force(i) = state;
  end
  dlmwrite([name{1} '.stepped'], force(2:end), 'precision', '%%.17g');
end
"""


@needs_octave
def test_octave_says_what_the_equations_say_and_follows_the_play_operator(tmp_path):
    requests, names = {}, [f"bowden_{case.replace(' ', '_')}" for case in CASES]
    for case, name in zip(CASES, names, strict=True):
        tables = cable(case, name=HOSTILE if case == "rope" else "plain")
        requests[case] = points(tables, 1000, seed=4)
        (tmp_path / f"{name}.m").write_text(matlab_function(tables, name))
        columns = [
            requests[case][key] + (1 if key == "level" else 0) for key in ("level", "place", "speed", "force", "stroke")
        ]
        np.savetxt(tmp_path / f"{name}.csv", np.column_stack(columns), delimiter=",", fmt="%.17g")
        np.savetxt(tmp_path / f"{name}.motion", [3, *motion(tables, 4000)[::100]], fmt="%.17g")
    (tmp_path / "ask.m").write_text(SCRIPT % ", ".join(f"'{name}'" for name in names))
    assert OCTAVE is not None
    done = subprocess.run([OCTAVE, "--norc", "--quiet", "ask.m"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert set(done.stderr.splitlines()) <= {ON_LEAVING}
    for case, name in zip(CASES, names, strict=True):
        tables, questions = cable(case), requests[case]
        output, needed, compensation, flags = np.loadtxt(tmp_path / f"{name}.out", delimiter=",").T
        np.testing.assert_allclose(output, of_equations(tables, questions), rtol=1e-9, atol=1e-9, err_msg=case)
        np.testing.assert_allclose(needed, of_equations(tables, questions, inverse=True), rtol=1e-9, atol=1e-9)
        least = of_equations(tables, questions | {"level": np.full(1000, LEVELS.index("mounting_q05"))}, inverse=True)
        np.testing.assert_allclose(compensation, least - questions["force"], rtol=1e-9, atol=1e-8)
        route_points = tables.points.values
        outside = ((questions["place"] < route_points[0]) | (questions["place"] > route_points[-1])) & (case != "one place")
        np.testing.assert_array_equal(flags.astype(int) & 1, outside)
        place = float(questions["place"][0])
        expected = followed(tables, 2, place, 31.0, motion(tables, 4000)[::100])
        np.testing.assert_allclose(np.loadtxt(tmp_path / f"{name}.stepped"), expected, rtol=1e-9, atol=1e-9)


def test_a_function_is_named_as_its_file_and_names_stay_comments():
    assert function_name(Path("folder/my_cable.m")) == "my_cable"
    for bad in ("my-cable.m", "1.m", "cable.txt", "_x.m"):
        with pytest.raises(UsageError, match="the name of a function"):
            function_name(Path(bad))
    about = replace(cable("rope").about, cable=HOSTILE)
    top = matlab_function(replace(cable("rope"), about=about), "bowden").splitlines()[1:8]
    assert all(line.startswith("%") for line in top)


CREEPS = """
for name = {%s}
  f = str2func(name{1});
  force = dlmread([name{1} '.motion']);
  state = [];
  for i = 2:numel(force)
    [force(i), flags, state] = f('step', force(1), 1.5, 31 + 25 * sin(i - 2), force(i), 0.01, state);
    assert(flags, 0);
  end
  dlmwrite([name{1} '.stepped'], force(2:end), 'precision', '%%.17g');
  [pair, flags, state] = f('step', force(1), 1.5, 31, [50 NaN; 60 0], 0.01, []);
  assert(flags, [0 4; 0 2]);
  assert(size(state.friction), [2 2]);
end
"""


@needs_octave
def test_octave_follows_a_rope_that_creeps_as_the_package_does(tmp_path):
    for case in CREEPING:
        tables = cable(case)
        (tmp_path / f"{case}.m").write_text(matlab_function(tables, case))
        np.savetxt(tmp_path / f"{case}.motion", [3, *motion(tables, 4000)[::100]], fmt="%.17g")
    (tmp_path / "ask.m").write_text(CREEPS % ", ".join(f"'{name}'" for name in CREEPING))
    assert OCTAVE is not None
    done = subprocess.run([OCTAVE, "--norc", "--quiet", "ask.m"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for case in CREEPING:
        stepped, force = np.loadtxt(tmp_path / f"{case}.stepped"), motion(cable(case), 4000)[::100]
        speed = 31 + 25 * np.sin(np.arange(len(force)))
        np.testing.assert_allclose(stepped, crept(cable(case), 2, 1.5, speed, force, 0.01), rtol=1e-10)
