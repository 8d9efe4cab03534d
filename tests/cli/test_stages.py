"""What is shown while work takes long: on a terminal one line with a clock, with --verbose a line a stage, else nothing."""

import io
import logging
import re
import time
from contextlib import redirect_stderr

import pytest

from bowdenfit import stage_bar
from bowdenfit.cli.stage_line import say_beside_stages, show_stages
from bowdenfit.run.verb import WATCH
from bowdenfit.stage_bar import show_progress_bar
from bowdenfit.stages import LOGGER, announce_stage

TABLE = "wrap_angle_deg,input_force_N,output_force_N\n" + "".join(
    f"{angle},{force},{force * 2.718281828 ** (-0.12 * angle * 0.0174533) * (1 + 0.004 * (i % 3 - 1)):.4f}\n"
    for i, (angle, force) in enumerate((a, f) for a in (45, 90, 135, 180) for f in (20, 40, 60))
)


class Terminal(io.StringIO):
    def isatty(self):
        return True

    def lines(self):
        return [part.strip() for part in self.getvalue().split("\r") if part.strip()]


def test_the_clock_of_a_stage_runs_and_its_line_goes_in_the_end():
    terminal = Terminal()
    with redirect_stderr(terminal), show_stages(None):
        announce_stage("reading my-cable")
        time.sleep(2.6)
    lines = terminal.lines()
    assert len(set(lines)) >= 2
    assert all(re.fullmatch(r"reading my-cable, 00:0\d", line) for line in lines)
    assert re.search(r"\r +\r$", terminal.getvalue())
    assert LOGGER.getEffectiveLevel() > logging.INFO


def test_progress_takes_the_line_and_the_next_stage_takes_it_back():
    terminal = Terminal()
    with redirect_stderr(terminal), show_stages(WATCH) as report:
        announce_stage("compiling the posterior")
        time.sleep(1.8)
        report(Progress)
        announce_stage("drawing efficiency")
        time.sleep(0.8)
    shown = " ".join(terminal.lines())
    in_order = r"compiling the posterior, 00:01.*sampling with emcee 300 steps, 00:0\d.*drawing efficiency, 00:0\d"
    assert re.search(in_order, shown)


def test_a_sentence_beside_a_stage_has_a_line_of_its_own():
    terminal = Terminal()
    with redirect_stderr(terminal), show_stages(None):
        announce_stage("drawing efficiency")
        time.sleep(1.8)
        say_beside_stages("Its figure could not be drawn.")
        time.sleep(0.8)
    assert re.search(r"\r +\rIts figure could not be drawn\.\n\r?drawing efficiency, 00:0\d", terminal.getvalue())


def test_a_quick_command_shows_nothing():
    terminal = Terminal()
    with redirect_stderr(terminal), show_stages(None):
        announce_stage("reading my-cable")
    assert terminal.lines() == []


class Output(list):
    """What a notebook shows in one place, one text after the other."""

    def update(self, data, raw):
        assert raw
        self.append(data["text/plain"])


@pytest.fixture
def outputs(monkeypatch):
    """Places in which a notebook shows something, where this program is its kernel."""
    places = []

    def display(data, **_):
        places.append(Output([data["text/plain"]]))
        return places[-1]

    monkeypatch.setattr("IPython.display.display", display)
    monkeypatch.setattr(stage_bar, "is_notebook", lambda: True)
    monkeypatch.setattr(stage_bar, "DELAY", 0.05)
    monkeypatch.setattr(stage_bar, "_TICK", 0.02)
    return places


class Progress:
    steps, sampler, r_hat, ess, seconds_left = 300, "emcee", None, None, 180.0


def test_a_notebook_shows_stages_and_progress_in_one_line_and_the_last_progress_in_the_end(outputs):
    with show_progress_bar(WATCH, None) as report, show_progress_bar(None, None) as inner:
        announce_stage("compiling the posterior")
        time.sleep(0.3)
        report(Progress)
        announce_stage("drawing efficiency")
        time.sleep(0.3)
    assert inner is None and len(outputs) == 1  # what runs inside of other work has no line of its own
    in_order = r"compiling the posterior, 00:00.*sampling with emcee 300 steps, 00:00.*drawing efficiency, 00:00.*"
    assert re.search(in_order, " ".join(outputs[0]))
    assert outputs[0].count("drawing efficiency, 00:00") > 1  # its clock runs
    assert outputs[0][-1] == "sampling with emcee 300 steps, 00:00, at least 3 min left"
    assert LOGGER.getEffectiveLevel() > logging.INFO and LOGGER.propagate


def test_a_notebook_shows_at_which_stage_work_has_ended_or_stopped(outputs):
    with show_progress_bar(None, None):
        announce_stage("sampling the population")
        time.sleep(0.2)
    with pytest.raises(KeyboardInterrupt), show_progress_bar(WATCH, None):
        announce_stage("compiling the posterior")
        time.sleep(0.2)
        raise KeyboardInterrupt
    assert [output[-1] for output in outputs] == ["done, 00:00", "stopped while compiling the posterior, 00:00"]


def test_quick_work_in_a_notebook_and_any_in_a_program_shows_nothing(outputs, monkeypatch, capsys):
    with show_progress_bar(WATCH, None):
        announce_stage("reading my-cable")
    monkeypatch.setattr(stage_bar, "is_notebook", lambda: False)
    with show_progress_bar(WATCH, None) as report:
        announce_stage("reading my-cable")
        time.sleep(0.2)
    assert report is None and outputs == [] and capsys.readouterr() == ("", "")


def test_in_a_pipe_there_is_nothing_but_with_verbose_every_stage_with_its_time(run, tmp_path):
    (tmp_path / "table.csv").write_text(TABLE)
    fit = ("fit", tmp_path / "table.csv", "--no-mcmc", "--no-figures", "--force", "--output", tmp_path / "fit")
    _, _, err = run(*fit)
    assert err.splitlines() == [f"Wrote {tmp_path / 'fit'}."]
    try:
        _, out, err = run(*fit, "-v")
    finally:
        for handler in [*LOGGER.handlers]:
            LOGGER.removeHandler(handler)
        LOGGER.setLevel(logging.NOTSET)
        LOGGER.propagate = True
    stages = [line.partition(" ")[2] for line in err.splitlines() if re.match(r"\d\d:\d\d:\d\d ", line)]
    assert stages[:2] == ["reading table.csv", "starting the fit"]
    assert {"compiling least squares", "fitting by least squares", "working out the answers"} <= {*stages}
    assert "reading table.csv" not in out
