"""Too little memory, or too few addresses: a sentence at the start, since libraries crash or wait for ever later."""

import os
import subprocess
import sys

import pytest

LIMITED = (
    "import os, resource as r, sys; r.setrlimit(getattr(r, sys.argv[1]), (int(sys.argv[2]) << 20,) * 2); "
    "os.execv(sys.executable, [sys.executable, *sys.argv[3:]])"
)


@pytest.mark.parametrize(("kind", "limit"), [("RLIMIT_AS", 1500), ("RLIMIT_DATA", 500)])
def test_a_fit_under_too_low_a_limit_is_refused_at_the_start(on_body, tmp_path, kind, limit):
    fit = ["-m", "bowdenfit.cli", "fit", str(on_body), "-o", str(tmp_path / "fit"), "--seed", "3"]
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, kind, str(limit), *fit],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("Error: there are not the") and len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "fit").exists()


def test_the_command_line_lets_linear_algebra_take_no_memory_for_threads():
    program = (
        "import os, sys; from bowdenfit import cli; sys.argv = ['bowdenfit', '--version']; "
        "os._exit = lambda code: print(os.environ['OPENBLAS_NUM_THREADS'], 'numpy' in sys.modules); cli.start()"
    )
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.stdout.splitlines()[-1] == "1 False"
