"""The mean of a run is what was measured, however noisy: weights do not hang on the noise of what they weigh."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hand_bench import Readings, pull, write

from bowdenfit.dataset import load_dataset
from bowdenfit.kinds.sliding_rows import expected_forces
from bowdenfit.models import build_model

EFFICIENCY, ROWS = 0.6, 200_000
LOADS = {"one load": (50.0,), "three loads": (35.0, 50.0, 80.0), "six loads": tuple(np.linspace(30.0, 90.0, 6))}


def _mean(rows: Readings, noise_ratio: float) -> float:
    """Efficiency of all rows as one run [%], from what they together say of their forces."""
    expected = expected_forces(rows.force_in, rows.force_out, np.zeros(len(rows.place), dtype=int), noise_ratio, None)
    weight = 1 / ((noise_ratio / expected.input_force) ** 2 + 1 / expected.output_force**2)
    ratio = rows.stroke * (np.log(rows.force_in / rows.force_out) - expected.log_ratio_error)
    return 100 * float(np.exp(-np.sum(weight * ratio) / np.sum(weight)))


@pytest.mark.parametrize("stroke", [1, -1])
@pytest.mark.parametrize("noise_ratio", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("loads", LOADS)
def test_the_mean_of_a_noisy_run_is_unbiased(loads, noise_ratio, stroke):
    """Weights of noisy outputs gave 0.7 points too much here; 0.05 is 3.5 standard errors of 200,000 readings or more."""
    sd, points = 0.088 * EFFICIENCY * 50.0, LOADS[loads]
    rows = pull(
        np.random.default_rng(11), [0.0], [-np.log(EFFICIENCY)], points, strokes=(stroke,), repeats=ROWS // len(points),
        noise=(noise_ratio * sd, sd),
    )  # fmt: skip
    assert _mean(rows, noise_ratio) == pytest.approx(100 * EFFICIENCY, abs=0.05)
    if noise_ratio == 0 and stroke == 1:
        ratio, weight = np.log(rows.force_in / rows.force_out), rows.force_out**2
        as_before = 100 * np.exp(-np.sum(weight * ratio) / np.sum(weight))
        assert as_before - 100 * EFFICIENCY > 0.3  # so the test can fail


@pytest.mark.parametrize("drag", [0.0, 8.0])
def test_forces_without_noise_are_expected_as_they_are(drag):
    rows = pull(np.random.default_rng(0), [0.0], [0.4], (20.0, 30.0, 40.0, 50.0, 60.0, 70.0), strokes=(1,), drag=drag)
    expected = expected_forces(rows.force_in, rows.force_out, np.zeros(6, dtype=int), 1.0, None)
    np.testing.assert_allclose(expected.input_force, rows.force_in, rtol=1e-9)
    np.testing.assert_allclose(expected.output_force, rows.force_out, rtol=1e-9)
    np.testing.assert_allclose(expected.log_ratio_error, 0.0, atol=1e-15)


def test_hidden_tension_bends_the_line_of_noisy_readings():
    rows = pull(
        np.random.default_rng(1),
        [0.0],
        [0.5],
        (15.0, 25.0, 40.0, 60.0, 90.0),
        strokes=(1,),
        repeats=40,
        drag=10.0,
        noise=(0.5, 0.5),
    )
    expected = expected_forces(rows.force_in, rows.force_out, np.zeros(len(rows.place), dtype=int), 1.0, None)
    true = (expected.input_force + 10.0) * np.exp(-0.5) - 10.0
    np.testing.assert_allclose(expected.output_force, true, atol=0.15)


WEIGHT = "[sensors]\ninput_force_noise = 0\n"


def _term(folder):
    model = build_model(load_dataset(folder))
    return model, model.terms[0]


@pytest.mark.extended
def test_a_hung_weight_has_no_noise_in_the_likelihood_nor_in_what_is_simulated(tmp_path, accept):
    sd = 0.5
    rows = pull(
        np.random.default_rng(2), [180.0] * 4, [0.3] * 4, (20.0, 40.0), strokes=(1,), repeats=400, noise=(0.0, sd)
    )
    model, term = _term(write(tmp_path / "weight", rows, more=WEIGHT))
    values = model.space.constrain(jnp.zeros(model.space.size)) | {
        "tau": jnp.asarray(1e-3),
        "mu": jnp.asarray(0.3 / np.pi),
    }

    def best(term):
        grid = np.linspace(0.3, 0.8, 201)
        log_values = jax.jit(jax.vmap(lambda s: jnp.sum(term.log_likelihood(values | {"sigma_F": s}, term.data))))
        return grid[int(np.argmax(log_values(jnp.asarray(grid))))]

    assert best(term) == pytest.approx(sd, rel=0.05)  # 3200 readings: 1.25 % is one standard error
    _, as_cells = _term(write(tmp_path / "cells", rows))
    assert best(as_cells) < 0.9 * sd  # shared between two cells, of which only one is noisy
    assert "none" in next(p.meaning for p in model.space.parameters if p.name == "sigma_F")
    assert "of hung weights without noise" in accept("check", tmp_path / "weight")
    assert "of hung weights" not in accept("check", tmp_path / "cells")


def test_a_ratio_of_noises_needs_that_of_both_cells(tmp_path, accept, refuse):
    rows = pull(np.random.default_rng(3), [180.0], [0.3], (20.0, 40.0), noise=(0.1, 0.5))
    input_alone = '[sensors]\ninput_force_noise = { value = 0.1, unit = "N" }\n'
    assert "force_noise as well" in refuse("check", write(tmp_path / "alone", rows, more=input_alone))
    both = f'{input_alone}force_noise = {{ value = 500, unit = "mN" }}\n'
    accept("check", write(tmp_path / "both", rows, more=both))
    assert load_dataset(tmp_path / "both").description.sensors.noise_ratio == pytest.approx(0.2)
    assert "needs its unit" in refuse(
        "check", write(tmp_path / "bare", rows, more="[sensors]\ninput_force_noise = 0.1\n")
    )


def test_swapped_rows_of_a_group_leave_its_other_rows_alone():
    """One reading that is grossly wrong must not correct all the others."""
    rows = pull(np.random.default_rng(4), [0.0], [0.4], (20.0, 40.0, 60.0), strokes=(1,), repeats=20, noise=(0.2, 0.2))
    wrong = replace(rows, force_out=np.where(np.arange(60) == 7, 5 * rows.force_out, rows.force_out))
    errors = [
        expected_forces(r.force_in, r.force_out, np.zeros(60, dtype=int), 1.0, None).log_ratio_error
        for r in (rows, wrong)
    ]
    assert np.median(np.abs(errors[1])) < 30 * np.median(np.abs(errors[0])) < 0.01
