"""What the summary says is wrong, the verdict says too."""

import re
import shutil
from dataclasses import replace

import jax
import numpy as np
import pytest
from hand_bench import pull, write
from terminal_pages import faults

import bowdenfit as bf
from bowdenfit.dataset import Dataset, load_dataset
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.tables import Measurements
from bowdenfit.questions.summary.brief import summary_text
from bowdenfit.questions.summary.details import details_text
from bowdenfit.questions.summary.sections import answer_section
from bowdenfit.questions.summary.verdict import (
    IMPOSSIBLE,
    NOT_CONVERGED,
    NOT_DESCRIBED,
    NOT_IDENTIFIABLE,
)

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=400", "sampler.target_r_hat=1.03", "sampler.max_steps=4000")
HALF_TURN = """
schema = 1
name = "bench"
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { value = 180, unit = "deg" }
[tables]
forces = { file = "forces.csv" }
[sampler]
n_walkers = 32
max_steps = 1500
target_ess = 100
target_r_hat = 1.05
"""


def _bench(folder, runs: int, seed: int = 0, scatter: float = 0.01) -> Dataset:
    rows = pull(
        np.random.default_rng(seed), [180.0] * runs, [0.3] * runs, (20.0, 40.0, 60.0), strokes=(1,), repeats=5,
        noise=(0.3, 0.3), scatter=scatter,
    )  # fmt: skip
    return load_dataset(write(folder, rows, HALF_TURN))


def _swapped(data: Dataset) -> Dataset:
    """As readings come that no table's check has seen: input and output exchanged."""
    (table,) = data.measurements.tables
    assert isinstance(table, ForceTable)
    return replace(
        data,
        measurements=Measurements((replace(table, input_force=table.output_force, output_force=table.input_force),)),
    )


def _told(fit) -> str:
    with jax.enable_x64(True):
        return " ".join(details_text(fit).split())


@pytest.mark.extended
@pytest.mark.parametrize("mcmc", [True, False])
@pytest.mark.parametrize("runs", [1, 5])
def test_efficiencies_above_1_are_no_fit_to_trust(tmp_path, runs, mcmc):
    fit = bf.fit(_swapped(_bench(tmp_path, runs)), seed=1, mcmc=mcmc)
    assert IMPOSSIBLE in fit.verdict().troubles
    with jax.enable_x64(True):
        page = summary_text(fit)
    assert faults(page) == [] and "DO NOT USE THESE NUMBERS" in page.splitlines()[0]
    message = _told(fit)
    assert "IMPOSSIBLE READINGS" in message and "swapped" in message and "run 1 13" in message
    if mcmc and "determine no coefficient by itself" in message:
        assert NOT_IDENTIFIABLE in fit.verdict().troubles
    if mcmc and runs == 5:
        assert NOT_IDENTIFIABLE in fit.verdict().troubles
        assert "hold 0 of 5" not in message or NOT_DESCRIBED in fit.verdict().troubles


@pytest.mark.extended
@pytest.mark.parametrize("runs", [1, pytest.param(2, marks=pytest.mark.slow), 5])
def test_a_healthy_bench_is_trusted(tmp_path, runs):
    fit = bf.fit(_bench(tmp_path, runs, seed=runs), seed=1)
    assert set(fit.verdict().troubles) <= {NOT_CONVERGED}, fit.verdict().reasons  # the chain here is short


def _bends_of(folder, degrees: float, shown: float, settings=()):
    """Three mountings at a bend that is written down as another."""
    loss = 0.12 * np.deg2rad(degrees)
    rows = pull(np.random.default_rng(0), [shown] * 3, [loss] * 3, (20.0, 40.0), repeats=4, noise=(0.2, 0.2))
    return bf.fit(write(folder, rows), mcmc=False, settings=settings)


@pytest.mark.parametrize(("degrees", "shown"), [(180.0, np.pi), (30.0, np.rad2deg(30.0))])
def test_friction_that_no_sheath_has_is_no_fit_to_trust(tmp_path, degrees, shown):
    """Radians headed deg, and degrees headed rad where they are few."""
    verdict = _bends_of(tmp_path, degrees, shown).verdict()
    assert list(verdict.troubles) == [IMPOSSIBLE]
    assert "the unit of the wrap angles" in verdict.reasons[0] and "lognormal" in verdict.reasons[0]
    setting = "friction.mu.prior.lognormal={median=1.0, log_sd=3.0}"
    assert _bends_of(tmp_path, degrees, shown, [setting]).verdict().trusted
    assert _bends_of(tmp_path, degrees, degrees).verdict().trusted


@pytest.mark.slow
@pytest.mark.extended
def test_a_reading_far_out_is_a_trouble_unless_the_noise_may_have_such(on_body, tmp_path):
    """An angle of 28 deg written as 82: with normal noise the verdict names it, with Student noise it hardly counts."""
    slipped = tmp_path / "slipped"
    shutil.copytree(on_body, slipped)
    angles = (slipped / "angles.csv").read_text()
    (slipped / "angles.csv").write_text(angles.replace("480,17,28", "480,17,82"))
    assert "480,17,82" in (slipped / "angles.csv").read_text()
    normal, student = (bf.fit(slipped, noise=noise, seed=1, settings=QUICK) for noise in ("normal", "student"))
    assert "free_sheath_angle at 480 mm: so far out" in " ".join(normal.verdict().reasons)
    page = summary_text(normal)
    assert faults(page) == [] and "Off: 1 of 26 readings" in page and re.search(r"82(\.0)? deg", page)
    assert student.verdict().trusted
    assert student.verdict().doubts == ("free_sheath_angle at 480 mm lies far from what the other readings predict",)
    assert answer_section(student).context["doubtful"]
    for text in (summary_text(student), repr(student.verdict())):
        assert "against the model, but free_sheath_angle at 480 mm lies far from" in " ".join(text.split())
        assert "the readings agree with the model" not in " ".join(text.split())
    assert student.parameter("mu3").q05 > normal.parameter("mu3").q05 + 0.02


@pytest.mark.parametrize(("stated_value", "message"), [(0.03, True), (0.003, False)])
def test_readings_that_scatter_far_less_than_was_stated_are_not_said_to_agree(stated_value, message, tmp_path):
    """Sixteen efficiencies that scatter by 0.3 %, and a standard deviation of 3 % or 0.3 % beside each."""
    rng, rows = np.random.default_rng(1), ["wrap_angle_deg,efficiency,efficiency_sd"]
    for angle in 30 + 15 * np.arange(16):
        rows.append(f"{angle},{np.exp(-0.12 * np.deg2rad(angle) + 0.003 * rng.standard_normal()):.5f},{stated_value}")
    (tmp_path / "efficiencies.csv").write_text("\n".join(rows) + "\n")
    fit = bf.fit(tmp_path / "efficiencies.csv", seed=1, settings=QUICK)
    text = " ".join(summary_text(fit).split())
    assert fit.verdict().trusted
    assert ("but the readings of efficiencies scatter less than the fit predicts" in text) == message
    assert ("Next: look at the noise that is stated" in text) == message
    assert ("the readings agree with the model" in text) != message


def test_least_squares_that_runs_to_no_friction_at_all_is_no_fit_to_trust(on_body, on_body_squares, tmp_path):
    """Two efficiencies exchanged leave a coefficient anywhere from 0 to 1; none of 88 healthy benches did."""
    exchanged = tmp_path / "exchanged"
    shutil.copytree(on_body, exchanged)
    table = (exchanged / "efficiencies.csv").read_text()
    assert "510,75.3\n550,67.8" in table
    (exchanged / "efficiencies.csv").write_text(table.replace("510,75.3\n550,67.8", "510,67.8\n550,75.3"))
    verdict = bf.fit(exchanged, mcmc=False).verdict()
    assert list(verdict.troubles) == [NOT_IDENTIFIABLE]
    assert "do not determine mu2" in verdict.reasons[0]
    assert on_body_squares.verdict().trusted
