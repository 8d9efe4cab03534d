"""The process that works beside a fit: answers and errors come back, and it never outlives the fit."""

import ast
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace

import pytest
from conftest import QUICK

from bowdenfit.errors import BowdenfitError
from bowdenfit.results.record import once
from bowdenfit.run.helpers import InAnotherProcess, InThisProcess

# A copy is made only of a process in which nothing runs, so each of these is one of its own.
START = """
import os, sys, time
from bowdenfit.run.helpers import InAnotherProcess

def nothing():
    pass

def two():
    yield os.getpid()
    time.sleep(SECONDS)
    yield 2

helper = InAnotherProcess(True, nothing, False)
first, second = helper.begin(two, answers=2)
print(first.result(), flush=True)
"""


def program(seconds, end):
    return [sys.executable, "-c", START.replace("SECONDS", str(seconds)) + end]


def has_ended(pid):
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        try:
            state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
            if state == "Z":
                return True
        except OSError:
            return True
        time.sleep(0.02)
    return False


needs_linux = pytest.mark.skipif(sys.platform != "linux", reason="processes are copied on Linux alone")


@needs_linux
def test_answers_come_one_by_one_and_the_process_ends_with_its_work():
    done = subprocess.run(
        program(0, "print(second.result(), helper.submit(abs, -3).result()); helper.end()"),
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    pid, answers = done.stdout.splitlines()
    assert answers == "2 3"
    assert has_ended(pid)


@needs_linux
@pytest.mark.parametrize("sent", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_fit_leaves_no_process_behind_not_even_in_the_middle_of_a_job(sent):
    with subprocess.Popen(program(600, "second.result()"), stdout=subprocess.PIPE, text=True) as process:
        pid = int(process.stdout.readline())
        assert pid != process.pid
        process.send_signal(sent)
    ended = has_ended(pid)
    if not ended:
        os.kill(pid, signal.SIGKILL)
    assert ended


@needs_linux
def test_after_a_job_that_fails_the_next_ones_get_their_own_answers():
    end = (
        "second.result()\njobs = [helper.submit(int, 'x'), helper.submit(abs, -3), helper.submit(abs, -4)]\n"
        "print(type(jobs[0].exception()).__name__, jobs[1].result(), jobs[2].result()); helper.end()"
    )
    done = subprocess.run(program(0, end), capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.splitlines()[1] == "ValueError 3 4"


@needs_linux
def test_a_process_that_is_ended_from_outside_is_a_sentence():
    end = "import signal; os.kill(helper.process.pid, signal.SIGKILL)\ntry: second.result()\nexcept Exception as e: print(e)"
    done = subprocess.run(program(600, end), capture_output=True, text=True, check=True, timeout=60)
    assert "memory ran out" in done.stdout


HUNG_UP = """
import time
from multiprocessing import get_context
from bowdenfit.run.helpers import _serve

def nothing():
    pass

context = get_context("fork")
ours, theirs = context.Pipe()
process = context.Process(target=_serve, args=(theirs, (ours,), nothing, False))
process.start()
theirs.close()
ours.send((abs, (-3,)))
while not ours.poll(0.05):
    pass
ours.close()  # with the reply unread, as by a process that is killed
process.join(20)
print(process.exitcode)
"""


@needs_linux
def test_a_process_whose_replies_nobody_reads_any_more_ends_without_a_word():
    done = subprocess.run([sys.executable, "-c", HUNG_UP], capture_output=True, text=True, check=True, timeout=60)
    assert (done.stdout, done.stderr) == ("0\n", "")


def fails():
    yield 1
    raise BowdenfitError("what was seen")


def no_settings():
    """Nothing to set."""


@pytest.mark.parametrize("make", [InThisProcess, lambda: InAnotherProcess(False, no_settings, False)])
def test_an_error_arrives_where_the_answer_is_asked_for(make):
    helper = make()
    first, second = helper.begin(fails, answers=2)
    assert first.result() == 1
    with pytest.raises(BowdenfitError, match="what was seen"):
        second.result()
    if isinstance(helper, InAnotherProcess):
        helper.end()
    helper.thread.shutdown()


IN_WHICHEVER_IS_FREE = """
import os, sys, time
from bowdenfit.run.helpers import InOtherProcesses, LightProcesses

def nothing():
    pass

def begun():
    yield os.getpid(), "jax" in sys.modules

def slow():
    time.sleep(1)
    return os.getpid(), "jax" in sys.modules

light = LightProcesses(True, True)
helper = InOtherProcesses(light, nothing, True)
jobs = [helper.submit(slow), helper.submit(slow), helper.check(slow), *helper.begin(begun, answers=1)]
answers = [job.result() for job in jobs]
print(*answers, sep=chr(10), flush=True)
END
"""


@needs_linux
@pytest.mark.parametrize("end", ["helper.end(); light.end()", "os.kill(os.getpid(), 9)"])
def test_two_processes_work_at_once_without_jax_beside_one_with_it_and_all_end_with_this_one(end):
    command = [sys.executable, "-c", IN_WHICHEVER_IS_FREE.replace("END", end)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    first, second, checking, computing = (ast.literal_eval(line) for line in done.stdout.splitlines())
    assert [jax_there for _, jax_there in (first, second, checking, computing)] == [False, False, False, True], done.stderr
    assert len({first[0], second[0], computing[0]}) == 3
    assert checking[0] in {first[0], second[0]}
    assert all(has_ended(pid) for pid, _ in (first, second, computing))


CHECKS_ELSEWHERE = """
import os, signal, sys
import numpy as np
from bowdenfit.inference.diagnostics import diagnose_all
from bowdenfit.run.fitting import _called
from bowdenfit.run.helpers import InOtherProcesses, LightProcesses

def nothing():
    pass

def is_loaded(name):
    return name in sys.modules

draws = {"mu": np.random.default_rng(0).standard_normal((8, 50))}
light = LightProcesses(False, True)
helper = InOtherProcesses(light, nothing, False)
elsewhere = _called(helper, diagnose_all, draws, 4)
assert "arviz_stats" not in sys.modules
assert not helper.submit(is_loaded, "matplotlib").result()  # nothing is to be drawn
os.kill(light.first.process.pid, signal.SIGKILL)
print(elsewhere == _called(helper, diagnose_all, draws, 4) == diagnose_all(draws, 4))
helper.end()
light.end()
"""


@needs_linux
def test_draws_are_diagnosed_alike_elsewhere_and_here_where_that_process_was_ended():
    done = subprocess.run([sys.executable, "-c", CHECKS_ELSEWHERE], capture_output=True, text=True, check=False, timeout=120)
    assert done.stdout == "True\n", done.stderr


IN_BACKGROUND = """
import sys
import numpy as np
import bowdenfit as bf

fit = bf.fit(sys.argv[1], seed=11, settings=sys.argv[3:], in_background=True)
assert "arviz_stats" not in sys.modules
other = bf.load(sys.argv[2])
print(all(np.array_equal(fit.posterior.values[name], values) for name, values in other.posterior.values.items()))
print(fit.verdict() == other.verdict())
"""


@needs_linux
def test_a_program_that_lets_other_processes_work_gets_the_same_fit(on_body, quick_results):
    command = [sys.executable, "-c", IN_BACKGROUND, str(on_body), str(quick_results), *QUICK]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert (done.stdout, done.stderr) == ("True\nTrue\n", "")


POSTPONED = """
import sys
import numpy
from bowdenfit.run.loading import load

load("emcee", "scipy.special", later=("scipy.stats", "numpy.f2py"))
print("scipy.stats" in sys.modules, "numpy.f2py" in sys.modules, "f2py" in vars(numpy))
from emcee.moves.kde import gaussian_kde
print(gaussian_kde(numpy.array([0.0, 1.0, 2.0])).n, "scipy.stats" in sys.modules, numpy.f2py.__name__)
"""


def test_what_is_loaded_later_is_loaded_once_it_is_called_and_is_then_what_it_always_is():
    done = subprocess.run([sys.executable, "-c", POSTPONED], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == ["False", "False", "False", "3", "True", "numpy.f2py"]


def test_an_answer_that_was_promised_is_taken_and_worked_out_where_the_promise_was_broken(fit_of_nothing):
    kept, broken = Future(), Future()
    kept.set_result("from elsewhere")
    broken.set_exception(BowdenfitError("ended"))
    for promise, answer in ((kept, "from elsewhere"), (broken, "from here")):
        fit_of_nothing._answers[question] = promise
        assert question(fit_of_nothing) == answer
        assert fit_of_nothing._answers[question] == answer


@once
def question(fit):
    return "from here"


@pytest.fixture
def fit_of_nothing():
    return SimpleNamespace(_answers={})
