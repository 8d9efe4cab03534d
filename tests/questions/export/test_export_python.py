"""The Python module against the package's own equations."""

import subprocess
import sys

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
    module_of,
    motion,
    of_equations,
    points,
)

from bowdenfit.questions.export.python import python_module


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


def test_the_module_needs_nothing_but_python(tmp_path):
    (tmp_path / "bowden.py").write_text(python_module(cable("lugre")))
    program = "import sys, bowden; print(bowden.output('q50', 1.0, 10.0, 1), 'numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {program}"],
                          capture_output=True, text=True)  # fmt: skip
    assert done.returncode == 0 and done.stdout.endswith("False\n"), done.stderr
