"""Ctrl-C at any moment is one line: while the program is still loading, too."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from bowdenfit.cli.interrupts import line_of

INTERRUPT_WHILE_LOADING = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests may have made this deaf
class Finder:
    def find_spec(self, name, *_):
        if name == {module!r}:
            try:
                os.kill(os.getpid(), signal.SIGINT)
            except KeyboardInterrupt:
                os._exit(77)  # as what is compiled ends the process where something is raised while it is loaded
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
    assert (done.returncode, done.stderr.strip()) == (130, "Interrupted.")


def test_without_the_first_moments_an_interrupt_is_raised_while_something_is_loaded(on_body):
    """So the test above can fail."""
    assert _interrupted("bowdenfit.cli", "click", str(on_body)).returncode == 77


def test_nothing_is_loaded_before_the_program_hears_an_interrupt():
    """Until then one is a traceback of Python's, as it is while Python itself starts."""
    code = "import sys; before = {*sys.modules}; import bowdenfit.__main__; print(*sorted({*sys.modules} - before))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert {*done.stdout.split()} <= {"bowdenfit", "bowdenfit.__main__", "_signal"}


INTERRUPT_IN_A_LIBRARY = """
import os, signal, sys, time, tomllib
signal.signal(signal.SIGINT, signal.default_int_handler)
{library}
tomllib.loads = tomllib.load = loads
sys.argv = ["bowdenfit", "check", {folder!r}]
from bowdenfit.__main__ import start
start()
"""
SWALLOWED = """
class Deaf:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
def loads(*_, **__):
    Deaf()
    time.sleep(30)
"""
TURNED = """
def loads(*_, **__):
    try:
        os.kill(os.getpid(), signal.SIGINT)
    except KeyboardInterrupt:
        raise RuntimeError("an error of a library's own")
"""
DEAF = """
import ctypes, threading
def loads(*_, **__):
    lock, mutex = ctypes.CDLL(None).pthread_mutex_lock, ctypes.create_string_buffer(64)
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    lock(mutex), lock(mutex)  # as while something is compiled, Python gets no step in the main thread
"""
STUCK = """
class Finder:
    def find_spec(self, name, *_):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(30)
def loads(*_, **__):
    sys.meta_path.insert(0, Finder())
    import a_module_on_a_disk_that_hangs
"""


@pytest.mark.parametrize(
    "library",
    [SWALLOWED, TURNED, STUCK, DEAF],
    ids=["swallows it", "turns it into an error", "hangs while it is loaded", "hears nothing"],
)
def test_an_interrupt_that_a_library_swallows_is_heard_all_the_same(library, on_body):
    code = INTERRUPT_IN_A_LIBRARY.format(library=library, folder=str(on_body))
    begun = time.monotonic()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "Interrupted.\n")
    assert time.monotonic() - begun < 25


def test_an_interrupt_just_before_the_terminal_is_read_is_heard_without_another_key():
    """Another thread takes the signal here, so that nothing wakes the system where it waits for a key."""
    keyboard, screen = os.openpty()
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    late = threading.Timer(20, os.write, (keyboard, b"a key\n"))
    threading.Timer(0.2, lambda: signal.pthread_kill(threading.get_ident(), signal.SIGINT)).start()
    late.start()
    try:
        with os.fdopen(screen) as terminal, pytest.raises(KeyboardInterrupt):
            line_of(terminal)
        assert late.is_alive(), "no sooner than the next key"
    finally:
        late.cancel()
        os.close(keyboard)
        signal.signal(signal.SIGINT, before)


def test_a_line_is_read_as_it_is_typed_and_an_ended_input_is_empty():
    keyboard, screen = os.openpty()
    with os.fdopen(screen) as terminal:
        os.write(keyboard, "Größe 1\nanother\n".encode())
        assert [line_of(terminal), line_of(terminal)] == ["Größe 1\n", "another\n"]
        os.write(keyboard, b"\x04")
        assert line_of(terminal) == ""
    os.close(keyboard)
