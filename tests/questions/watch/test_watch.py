"""A bench that is watched: one line a mounting, wrong rows refused in a sentence, and the advice to stop."""

import json
import os
import subprocess
import sys
import threading
from dataclasses import replace

import pytest
from conftest import ROOT

import bowdenfit as bf
from bowdenfit.errors import DescriptionError, UsageError
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.next.answer import TargetQuantity
from bowdenfit.questions.summary.verdict import assess_fit
from bowdenfit.questions.watch import (
    History,
    UnreadableFiles,
    WatchedAnswer,
    history_figure,
    watch_answers,
    watch_lines,
)
from bowdenfit.questions.watch.fitting import GrowingFit
from bowdenfit.questions.watch.watching import read_until

INTERVAL = Interval(0.121, 0.005, 0.1212, 0.114, 0.1295)
ANSWER = WatchedAnswer("bench", 5, 5, "mu", "mu", "", INTERVAL, False, "", clock="12:04:31")
STOP = "You may stop: mu is known to ± 0.005, and ± 0.005 was asked for."
SHOWN = "12:04:31  5 mountings: mu 0.121 (90 % interval 0.114 to 0.130), ± 0.005; "


def printed(*answers) -> list[str]:
    return "".join(watch_lines(answers, "bench")).splitlines()


def test_the_verdict_stands_behind_the_answer():
    assert printed(ANSWER, replace(ANSWER, troubles={})) == ["Watching bench; Ctrl-C ends it.", f"{SHOWN}trusted"]


def test_a_line_whose_verdict_did_not_come_says_so():
    more = replace(ANSWER, mountings=6, readings=6)
    lines = printed(ANSWER, more, replace(more, troubles={}))
    assert lines[1:] == [f"{SHOWN}not checked, since more was measured", f"{SHOWN.replace('5 mount', '6 mount')}trusted"]


def test_more_readings_of_a_mounting_are_printed_once_they_are_checked():
    more = replace(ANSWER, readings=8)
    lines = printed(ANSWER, replace(ANSWER, troubles={}), more, more, replace(more, troubles={}))
    assert lines[1:] == [f"{SHOWN}trusted"] * 2


def test_why_not_to_trust_a_fit_is_said_once():
    bad = replace(ANSWER, troubles={"contradictory": ("Rows disagree.",)}, warning="DO NOT USE THESE NUMBERS: so.")
    lines = printed(ANSWER, bad, replace(ANSWER, mountings=6), replace(bad, mountings=6))
    assert [line for line in lines if "Rows disagree" in line] == ["  - Rows disagree."]
    assert sum("DO NOT USE" in line for line in lines) == 2


def test_the_advice_to_stop_is_said_once_and_refusals_stand_on_lines_of_their_own():
    enough = replace(ANSWER, may_stop=True, stop=STOP)
    checked, next_one = replace(enough, troubles={}), replace(enough, mountings=6)
    lines = printed(enough, UnreadableFiles("Row 3 is wrong."), enough, checked, next_one, replace(next_one, troubles={}))
    assert lines.count(STOP) == 1
    assert "Row 3 is wrong." in lines


def test_until_is_in_the_unit_of_the_answer():
    length = TargetQuantity("optimal-length", "the best cable length", "mm", INTERVAL)
    assert [read_until(value, length) for value in (10, (10.0, "mm"), (1.0, "cm"))] == [10, 10, pytest.approx(10)]
    assert read_until((2.0, "%"), TargetQuantity("efficiency", "the efficiency", "points", INTERVAL)) == 2
    with pytest.raises(UsageError, match=r"--until 3N: the best cable length is known in mm, such as --until 10mm"):
        read_until((3.0, "N"), length)
    with pytest.raises(UsageError, match="without a unit"):
        read_until((3.0, "mm"), TargetQuantity("mu", "mu", "", INTERVAL))
    with pytest.raises(UsageError, match="must be above 0"):
        read_until(0.0, length)


def test_what_cannot_be_watched_is_refused_at_once(run, tmp_path):
    with pytest.raises(DescriptionError, match="does not exist"):
        next(iter(bf.watch(tmp_path / "nowhere")))
    code, _, err = run("watch", str(tmp_path), "--until", "tight")
    assert code == 2
    assert "tight" in err


@pytest.mark.extended
def test_the_history_is_drawn_and_written(tmp_path):
    answers = [
        replace(ANSWER, mountings=n, interval=Interval(0.12, 0.02 / n, 0.12, 0.12 - 0.03 / n, 0.12 + 0.03 / n),
                troubles={} if n != 4 else None, may_stop=n > 5, stop=STOP if n > 5 else "")
        for n in range(2, 9)
    ]  # fmt: skip
    history = History()
    for answer in reversed(answers):
        history = history.add(answer)
    assert [answer.mountings for answer in history.answers] == list(range(2, 9))
    assert "mu after 8 mountings" in str(history).splitlines()[0].replace("Mu", "mu")
    figure = history_figure.draw(history)
    assert figure.axes[0].get_xlabel() == "Mountings"
    assert "n = 7 fits" in history_figure.caption(history)
    assert history.to_frame()["trusted"].tolist()[2] is None


@pytest.fixture
def bench(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    from watch_bench import Bench

    yield Bench.simulate(tmp_path / "bench")
    sys.modules.pop("watch_bench", None)


@pytest.mark.extended
def test_a_growing_table_is_fitted_by_programs_compiled_once(bench):
    fits = GrowingFit(0)
    for count in (3, 9):
        bench.write(count)
        record = fits.draw(bf.read(bench.folder))
        assert record.converged
    assert len(fits.samplers) == len(fits.programs) == 1
    by_hand = bf.fit(bench.folder, seed=1)
    assert record.parameter_of_draws("mu").median == pytest.approx(by_hand.parameter_of_draws("mu").median, abs=0.0005)
    assert record.parameter_of_draws("mu").sd == pytest.approx(by_hand.parameter_of_draws("mu").sd, rel=0.1)
    assert assess_fit(fits.complete(record)).troubles == by_hand.verdict().troubles


FIT_A_GROWING_BENCH = """
import gc, sys, tempfile
from pathlib import Path
import jax
import bowdenfit as bf
from bowdenfit.questions.watch.fitting import GrowingFit
from watch_bench import Bench
with tempfile.TemporaryDirectory() as folder:
    bench, fits = Bench.simulate(Path(folder) / "bench", mountings=18), GrowingFit(0)
    for count in range(4, 19):
        bench.write(count)
        record = fits.draw(bf.read(bench.folder))
        fits.complete(record)
        fits.release_programs(record)
gc.collect()
print(len(jax.devices()[0].client.live_executables()))
"""


@pytest.mark.extended
def test_programs_of_earlier_mountings_are_not_kept_in_memory():
    surroundings = os.environ | {"PYTHONPATH": str(ROOT / "scripts")}
    command = [sys.executable, "-c", FIT_A_GROWING_BENCH]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=200, env=surroundings)
    assert int(done.stdout) <= 12  # 8 steps of least squares, and a few of the last mounting; all of them were 17


@pytest.mark.extended
def test_a_bench_is_watched_from_a_wrong_row_to_the_advice_to_stop(bench, tmp_path, run):
    table = bench.folder / "forces.csv"
    good = table.read_text()
    table.write_text(good + "m3,pull,20,a lot\n")
    closed, answers = threading.Event(), []
    for answer in watch_answers(bench.folder, until=0.006, is_stopped=closed.is_set):
        answers.append(answer)
        if isinstance(answer, UnreadableFiles):
            bench.write(2)
        elif answer.trusted is not None:
            bench.write(12)
    assert isinstance(answers[0], UnreadableFiles)
    assert "forces.csv" in answers[0].why and "a lot" in answers[0].why and str(tmp_path) not in answers[0].why
    last = answers[-1]
    assert (last.mountings, last.trusted, last.may_stop) == (12, True, True)
    code, out, err = run("watch", str(bench.folder), "--until", "0.006", "-o", str(tmp_path / "history"))
    assert code == 0, err
    assert "12 mountings: mu 0.1" in out
    assert "You may stop: mu is known to" in out
    assert json.loads((tmp_path / "history" / "history.json").read_text())["answers"][0]["trusted"] is True
    assert (tmp_path / "history" / "history.png").exists()


@pytest.mark.slow
def test_each_of_twelve_mountings_is_in_the_answer_within_three_seconds(bench):
    from watch_bench import main

    assert main(["--until", "0.003", "--by-hand"]) == 0
