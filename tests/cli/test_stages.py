"""What is shown while work takes long: on a terminal one line with a clock, with --verbose a line a stage, else nothing."""

import io
import logging
import re
import time
from contextlib import redirect_stderr

from bowdenfit.cli.stage_line import say_beside_stages, show_stages
from bowdenfit.run.verb import WATCH
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
    class Progress:
        steps, sampler, r_hat, ess = 300, "emcee", None, None

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
    assert stages[0] == "reading table.csv"
    assert {"compiling least squares", "fitting by least squares", "working out the answers"} <= {*stages}
    assert "reading table.csv" not in out
