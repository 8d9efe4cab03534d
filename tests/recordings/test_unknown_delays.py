"""The verdict knows what the preparation could not find out, where it matters to the friction, and only there."""

import numpy as np
import pytest
from recorded_benches import RecordedBench, write

import bowdenfit as bf
from bowdenfit.questions.summary.verdict import NOT_DESCRIBED

pytestmark = pytest.mark.extended

EXPONENT = 0.12 * np.pi


def fitted(folder, *, cycle=4.0, late=0.0, only_pulls=False, clipped=np.inf):
    """A fit of nine uneven cycles [s] of which the output is late [s], of pulls alone, or cut off [N]; and its page."""
    generator, knots = np.random.default_rng(5), np.linspace(0, 9 * cycle, 19)
    levels = np.where(np.arange(19) % 2, 60 * (1 - 0.12 * generator.random(19)), 20 * (1 + 0.25 * generator.random(19)))
    time = np.arange(0, 9 * cycle, cycle / 400)
    part = np.clip(np.searchsorted(knots, time, "right") - 1, 0, 17)
    force = levels[part] + np.diff(levels)[part] * (0.5 - 0.5 * np.cos(np.pi * (time - knots[part]) / knots[1]))
    if only_pulls:
        force, time = np.linspace(15, 60, 900), np.arange(900) * cycle / 400
    log_output, outputs = np.log(force[0]) - EXPONENT, []
    for log_input in np.log(force):
        log_output = min(max(log_output, log_input - EXPONENT), log_input + EXPONENT)
        outputs.append(np.exp(log_output))
    output = np.minimum(np.interp(time - late, time, outputs), clipped)
    force, output = (f + 0.08 * generator.standard_normal(len(time)) for f in (force, output))
    output = np.minimum(output, clipped)
    rows = [f"{t:.4f},{a:.3f},{b:.3f}" for t, a, b in zip(time, force, output, strict=True)]
    (folder / "log.csv").write_text("\n".join(["time_s,input_force_N,output_force_N", *rows]) + "\n")
    fit = bf.fit(folder / "log.csv", wrap_angle="180deg", mcmc=False, seed=1)
    return fit, " ".join(str(fit.summary()).split())


def test_an_output_that_is_later_than_is_looked_for_is_not_trusted_where_that_matters(tmp_path):
    """Without the delay mu is 0.156 for 0.12 in cycles of 4 s, and 0.245 for 0.095 in three noisy ones, which leave it open."""
    for cycle in (4.0, 60.0):
        fit, page = fitted(tmp_path, late=0.3, cycle=cycle)
        assert fit.verdict().trusted and "each 10 ms" not in page
        assert fit.least_squares.estimates["mu"].value == pytest.approx(0.12, rel=0.01)
    short = RecordedBench(rate=50, length=6, wave="sine", period=2.0, noise=0.02, delay=0.3)
    (sentence,) = bf.fit(write(short, tmp_path / "short", 0), mcmc=False, seed=1).verdict().troubles[NOT_DESCRIBED]
    assert "0.25 s or more later or earlier" in sentence


def test_a_delay_that_pulls_alone_cannot_show_is_part_of_the_verdict_where_they_are_fast(tmp_path):
    fit, page = fitted(tmp_path, only_pulls=True, cycle=1.0)
    assert fit.verdict().trusted and "each 10 ms of it would change the friction by" in page
    assert "each 10 ms" not in fitted(tmp_path, only_pulls=True, cycle=40.0)[1]
    both, page = fitted(tmp_path)
    assert both.verdict().trusted and "each 10 ms" not in page and "decide" not in page


def test_a_recording_most_of_which_is_cut_off_says_how_few_samples_decide(tmp_path):
    fit, page = fitted(tmp_path, clipped=30.0)
    used = fit.dataset.measurements.tables[0].items[0].account.counts["used"]
    assert f"so that {used} decide" in page
    assert "decide;" not in fitted(tmp_path, clipped=39.0)[1]
