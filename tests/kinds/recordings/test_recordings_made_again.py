"""Recordings measured again on the computer: what calibrations of recordings rest on."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from conftest import ROOT

from bowdenfit.dataset import load_dataset
from bowdenfit.kinds.recordings.term import make_recordings_term, number_shared_errors, replace_forces
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.kinds.terms import draw_readings
from bowdenfit.models import build_model
from bowdenfit.recordings.preparation.hysteresis import smooth_input
from bowdenfit.recordings.recording import Recordings

pytestmark = pytest.mark.extended

TIMES = 12


@pytest.mark.parametrize("correlation", [1.0, 1.16, 1.3, 1.63, 1.95, 2.0, 2.4, 5.5])
def test_means_of_errors_that_blocks_share_scatter_as_those_of_fewer_readings(correlation):
    """Exactly: variance of the mean of N blocks over that of N independent ones is the mean of squares of the groups."""
    shared = number_shared_errors(4000, correlation)
    assert np.all(np.diff(shared) >= 0)
    assert np.sum(np.bincount(shared) ** 2) / 4000 == pytest.approx(correlation, rel=2e-3)


def test_an_input_that_may_have_been_rises_and_falls_by_turns_as_what_was_read():
    """Two strokes of 100 blocks with noise as large as a change of one block; a small real turn in the first."""
    pull = np.linspace(20.0, 120.0, 100)
    true = np.concatenate([pull, pull[::-1]])
    true[40:60] -= 25 * np.sin(np.linspace(0, np.pi, 20))
    likely = smooth_input(true + np.random.default_rng(1).standard_normal(200))
    steps = np.sign(np.diff(likely))
    assert np.sum(np.diff(steps[steps != 0]) != 0) == 3
    assert np.abs(likely - true)[np.r_[5:35, 65:95, 105:195]].max() < 2.5
    assert likely[38:46].max() - likely[45:55].min() > 10


def test_a_force_that_never_changes_is_its_own():
    np.testing.assert_allclose(smooth_input(np.full(20, 7.0)), 7.0)


@pytest.fixture(scope="module")
def pulls():
    """Slopes of the log likelihood along the delay's error at the truth, in their standard deviations."""
    with jax.enable_x64(True):
        folder = ROOT / "datasets" / "synthetic-recordings"
        dataset = load_dataset(folder)
        model, tables = build_model(dataset), dataset.measurements
        truth = json.loads((folder / "truth.json").read_text())["truth"]
        recordings, angles = tables.table(Recordings), tables.table(AngleTable)
        draw = jax.jit(lambda named, key: draw_readings(model.cable, tables, named, key)["recordings"])

        def pull(seed: int, **values: float) -> float:
            page = {p.name: truth.get(p.name, 0.0) / p.shown_scale for p in model.space.parameters} | values
            named = {name: jnp.asarray(value) for name, value in page.items()}
            draws = {name: np.asarray(array) for name, array in draw(named, jax.random.key(seed)).items()}
            term = make_recordings_term(model.cable, replace_forces(dataset.description, recordings, draws), angles)

            def log_likelihood(delay: jax.Array) -> jax.Array:
                return jnp.sum(term.log_likelihood(named | {"delay_error": delay}, term.data))

            step = 1e-5
            less, middle, more = jax.vmap(log_likelihood)(jnp.asarray(page["delay_error"] + step * np.arange(-1, 2)))
            return float((more - less) / 2 / np.sqrt(2 * middle - less - more))

        yield lambda **values: np.array([pull(seed, **values) for seed in range(TIMES)])


SMOOTH = {"mu1": 0.095, "mu2": 0.144, "mu3": 0.032, "tau": 0.0185, "sigma_block": 0.023, "delay_error": 0.0021}


@pytest.mark.parametrize("values", [SMOOTH, {"sigma_block": 1.0, "delay_error": -0.003}], ids=["little noise", "noise"])
def test_the_likelihood_of_recordings_made_again_points_at_the_delay_they_were_made_with(pulls, values):
    """A right likelihood fails with one in 10 000 seeds (4 standard errors).

    With the noise of the measured input taken for motion, the mean was 4.1 at little noise.
    """
    computed = pulls(**values)
    assert abs(np.mean(computed)) < 4 / np.sqrt(TIMES)
    assert np.sum(computed**2) < 42.6  # chi square of twelve at 2.5e-5
