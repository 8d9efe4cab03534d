"""Ctrl-C at any moment is one line: while the program is still loading, too."""

import subprocess
import sys

import pytest

INTERRUPT_WHILE_LOADING = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests may have made this deaf
class Finder:
    def find_spec(self, name, *_):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
sys.argv = ["bowdenfit", "check", {folder!r}]
from {program} import start
start()
"""


def _interrupted(program: str, module: str, folder: str) -> subprocess.CompletedProcess[str]:
    code = INTERRUPT_WHILE_LOADING.format(program=program, module=module, folder=folder)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60)


@pytest.mark.parametrize("module", ["click", "bowdenfit.words", "bowdenfit.verbs", "bowdenfit.dataset", "numpy"])
def test_an_interrupt_while_something_is_loaded_is_one_line(module, on_body):
    done = _interrupted("bowdenfit.__main__", module, str(on_body))
    assert (done.returncode, done.stdout, done.stderr.strip()) == (130, "", "Interrupted.")


def test_without_the_first_moments_an_interrupt_is_a_traceback(on_body):
    """So the test above can fail."""
    assert "Traceback" in _interrupted("bowdenfit.cli", "click", str(on_body)).stderr
