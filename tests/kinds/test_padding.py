"""Arrays made longer, so that one program serves many tables: the density stays, and few shapes are left."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from conftest import ROOT

import bowdenfit
from bowdenfit.dataset import Dataset
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.term import round_up_count
from bowdenfit.models import build_model
from bowdenfit.questions.simulate.tables import resimulate

pytestmark = pytest.mark.extended

WHOLE = "tables.recordings.likelihood=whole"
CASES = {
    "angles too small to detect": ("on-body-exoskeleton", {}),
    "a slack rope": ("synthetic-haptic-loop", {}),
    "cells by load": ("synthetic-bench", {"friction": "drag"}),
    "every block of recordings": ("synthetic-recordings", {"friction": "drag", "settings": [WHOLE]}),
}


@cache
def measured(case: str) -> Dataset:
    name, keywords = CASES[case]
    return bowdenfit.read(ROOT / "datasets" / name, **keywords)


def longer(case: str) -> tuple[LogDensity, list[jax.Array]]:
    """A posterior whose padded data have other shapes, and z near the prior medians and farther from them."""
    posterior = LogDensity(build_model(measured(case)))
    assert jax.tree.map(np.shape, posterior.data) != jax.tree.map(np.shape, posterior.padded)
    spread = np.array([[0.1], [0.7]])
    return posterior, list(
        jnp.asarray(spread * np.random.default_rng(1).standard_normal((2, posterior.model.space.size)))
    )


@pytest.mark.parametrize("case", CASES)
def test_padded_data_have_the_log_density_of_the_data_themselves(case):
    posterior, places = longer(case)
    density = jax.jit(posterior.log_density)
    for z in places:
        shapes = posterior.data, posterior.padded, posterior.with_spare_rows
        value, padded, spare = (float(density(z, data)) for data in shapes)
        assert np.isfinite(value)
        assert padded == pytest.approx(value, rel=1e-12)
        assert spare == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("case", ["angles too small to detect", pytest.param("a slack rope", marks=pytest.mark.slow)])
def test_readings_that_are_not_there_leave_the_gradient_as_it_is(case):
    posterior, places = longer(case)
    gradient = jax.jit(jax.grad(posterior.log_density))
    for z in places:
        slope, padded = (np.asarray(gradient(z, data)) for data in (posterior.data, posterior.padded))
        np.testing.assert_allclose(padded, slope, rtol=1e-10, atol=1e-10 * np.max(np.abs(slope)))


def test_tables_with_other_angles_too_small_to_detect_are_padded_to_one_shape():
    dataset = measured("angles too small to detect")
    model, shapes, padded = build_model(dataset), set(), set()
    for seed in range(4):
        z = 0.5 * jax.random.normal(jax.random.key(seed), (model.space.size,))
        values = {name: float(value) for name, value in model.space.constrain(z).items()}
        again = LogDensity(build_model(resimulate(dataset, values, jax.random.key(seed))))
        shapes.add(str(jax.tree.map(np.shape, again.data)))
        padded.add(str(jax.tree.map(np.shape, again.padded)))
    assert len(shapes) > 1
    assert len(padded) == 1


def test_counts_are_rounded_up_to_few_and_by_a_quarter_at_most():
    counts = range(1, 2000)
    rounded = [round_up_count(count) for count in counts]
    assert rounded[:12] == [1, 2, 3, 4, 5, 6, 7, 8, 10, 10, 12, 12]
    assert all(count <= more <= 1.25 * count for count, more in zip(counts, rounded, strict=True))
    assert len(set(rounded)) < 45
