"""Ctrl-C at any moment is one line: while the program is still loading, too."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from conftest import QUICK

from bowdenfit.cli import running
from bowdenfit.cli.running import refuse_interrupted, run_interruptibly
from bowdenfit.verb import NOT_TRUSTED

pytestmark = pytest.mark.extended

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


@pytest.mark.parametrize("module", ["cyclopts", "bowdenfit.words", "bowdenfit.verbs", "bowdenfit.dataset", "numpy"])
def test_an_interrupt_while_something_is_loaded_is_one_line(module, on_body):
    done = _interrupted("bowdenfit.__main__", module, str(on_body))
    assert (done.returncode, done.stderr.strip()) == (130, "Interrupted.")


def test_without_the_first_moments_an_interrupt_is_raised_while_something_is_loaded(on_body):
    """So the test above can fail."""
    assert _interrupted("bowdenfit.cli", "cyclopts", str(on_body)).returncode == 77


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
    started = time.monotonic()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "Interrupted.\n")
    assert time.monotonic() - started < 25


def test_a_command_runs_in_the_surroundings_of_whoever_calls_it_and_gives_back_what_it_returns_or_raises():
    assert run_interruptibly(lambda: 3) == 3
    with pytest.raises(LookupError, match="what went wrong"):
        run_interruptibly(lambda: {}["what went wrong"])


def test_a_loop_that_looks_at_the_flag_ends_by_itself():
    ended = []

    def loop():
        threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
        try:
            while True:
                refuse_interrupted()
                time.sleep(0.01)
        finally:
            ended.append(True)

    previous_handler = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            run_interruptibly(loop)
    finally:
        signal.signal(signal.SIGINT, previous_handler)
        running.requested.clear()
    assert ended


AT_A_PROMPT = """
import sys
from bowdenfit.cli.running import run_interruptibly
run_interruptibly(sys.stdin.readline)
"""


def test_an_interrupt_at_a_prompt_needs_no_further_key():
    keyboard, screen = os.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)" + AT_A_PROMPT],
        stdin=screen, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        _, output = process.communicate(timeout=20)
    os.close(keyboard)
    os.close(screen)
    assert (process.returncode, output) == (130, "Interrupted.\n")


def test_what_python_frees_after_helpers_that_were_ended_is_no_warning_below_our_words():
    """It warns in a process of its own, which outlives the program."""
    late = "import warnings; warnings.warn('resource_tracker: There appear to be 5 leaked semaphores'); warnings.warn('x')"
    program = (
        "import subprocess, sys; import bowdenfit.cli as cli; "
        f"cli.main = lambda: subprocess.run([sys.executable, '-c', {late!r}]); cli.start()"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60)
    assert "semaphore" not in done.stderr and "UserWarning: x" in done.stderr


INTERRUPT_WHILE_WRITING = """
import os, signal, sys, time
from pathlib import Path
from bowdenfit.cli.running import run_interruptibly
from bowdenfit.outputs import replace_atomically, temporary_folder
from bowdenfit.results.folder import fill_folder_atomically
signal.signal(signal.SIGINT, signal.default_int_handler)
folder = Path(sys.argv[1])
def write():
    with {opened} as temporary:
        {begin}
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(30)  # as inside compiled code, where nothing asks whether to stop
run_interruptibly(write)
"""


@pytest.mark.parametrize(
    ("opened", "begin"),
    [
        ("replace_atomically(folder / 'posterior.nc')", "temporary.write_text('half')"),
        ("fill_folder_atomically(folder / 'figures')", "(temporary / 'a.png').write_text('half')"),
        ("fill_folder_atomically(folder)", "(temporary / 'a.png').write_text('half')"),
        ("temporary_folder()", "(temporary / 'a.csv').write_text('half')"),
    ],
    ids=["a file", "a new folder", "files of a folder", "a copy of a bench"],
)
def test_an_interrupt_while_something_is_written_leaves_nothing_unfinished(tmp_path, opened, begin):
    target = tmp_path / "elsewhere"
    target.write_text("of somebody")
    written_by_another = tmp_path / ".posterior.nc.0123456789abcdef.partial"
    written_by_another.symlink_to(target)
    contents = sorted(tmp_path.iterdir())
    program = INTERRUPT_WHILE_WRITING.format(opened=opened, begin=begin)
    command = [sys.executable, "-c", program, str(tmp_path)]
    surroundings = os.environ | {"TMPDIR": str(tmp_path)}
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60, env=surroundings)
    assert (done.returncode, done.stderr) == (130, "Interrupted.\n")
    assert sorted(tmp_path.iterdir()) == contents
    assert target.read_text() == "of somebody"


FIT = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.argv = ["bowdenfit", "fit", *sys.argv[1:]]
from bowdenfit.__main__ import start
start()
"""


def test_an_interrupt_while_figures_are_drawn_leaves_a_whole_fit_whose_answer_is_printed(on_body, tmp_path, run):
    folder = tmp_path / "fit"
    quick = [part for setting in QUICK for part in ("--set", setting)]
    command = [sys.executable, "-c", FIT, str(on_body), *quick, "--seed", "1", "--output", str(folder), "--verbose"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert any("drawing" in line for line in process.stderr)
        assert (folder / "fit.json").exists() and not (folder / "report.html").exists()
        process.send_signal(signal.SIGINT)
        printed, noted = process.communicate(timeout=60)
    assert process.returncode == 130
    assert noted.splitlines()[-1].startswith(f"Interrupted; {folder} holds the whole fit: ")
    assert printed == (folder / "summary.txt").read_text()
    for verb in ("summary", "identify", "length", "predict", "plot", "report"):
        code, _, error = run(verb, folder, *(["470mm"] if verb == "predict" else []))
        assert code in (0, NOT_TRUSTED), (verb, error)
    assert (folder / "report.html").exists() and list((folder / "figures").glob("*.png"))


def test_once_what_is_unfinished_was_removed_no_thread_begins_another_file(tmp_path):
    program = """
import sys, threading, time
from pathlib import Path
from bowdenfit.outputs import remove_unfinished, write_text
remove_unfinished()
threading.Thread(target=write_text, args=(Path(sys.argv[1]) / "a", "late"), daemon=True).start()
time.sleep(0.5)
"""
    subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=True, timeout=60)
    assert not list(tmp_path.iterdir())
