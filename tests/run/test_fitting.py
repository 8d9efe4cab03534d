"""One way to run a fit, for the library, notebooks and the command line."""

import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import QUICK

import bowdenfit as bf
from bowdenfit.results.record import cached_per_fit

IN_A_PROGRAM = """
import sys
import bowdenfit as bf

bf.fit(sys.argv[1], seed=11, settings=sys.argv[3:], output=sys.argv[2], figures=False)
"""


@pytest.mark.extended
def test_a_program_that_guards_nothing_gets_the_same_fit_as_the_command_line(on_body, quick_results, tmp_path):
    command = [sys.executable, "-c", IN_A_PROGRAM, str(on_body), str(tmp_path / "fit"), *QUICK]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert (done.stdout, done.stderr) == ("", "")
    fit, other = bf.load(tmp_path / "fit"), bf.load(quick_results)
    for name, draws in other.posterior.values.items():
        assert np.array_equal(fit.posterior.values[name], draws)
    assert fit.verdict() == other.verdict()


def test_a_question_is_worked_out_once_for_each_record(quick_fit, on_body_squares):
    calls = []

    @cached_per_fit
    def question(fit):
        calls.append(fit)
        return len(calls)

    assert [question(quick_fit), question(quick_fit), question(on_body_squares), question(quick_fit)] == [1, 1, 2, 1]


KEEPS = "from bowdenfit.inference.resources import keep_compiled_programs as keep; keep(); import jax; "
SHOWS = KEEPS + "print(jax.config.jax_compilation_cache_dir)"


def _cache_folder(**environment):
    variables = {name: value for name, value in os.environ.items() if not name.startswith("JAX_")}
    done = subprocess.run(
        [sys.executable, "-c", SHOWS], env=variables | environment, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_compiled_programs_are_kept_in_the_users_cache_unless_a_setting_says_otherwise(tmp_path):
    usual = _cache_folder(XDG_CACHE_HOME=str(tmp_path))
    assert usual.startswith(str(tmp_path)) or sys.platform != "linux"
    assert "bowdenfit" in usual
    assert _cache_folder(JAX_COMPILATION_CACHE_DIR=str(tmp_path / "mine")) == str(tmp_path / "mine")
    assert _cache_folder(JAX_ENABLE_COMPILATION_CACHE="false") == "None"
