"""Friction that differs between pulling and returning: found where it is, the same in tables and in whole recordings."""

import hand_bench
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.cable.conditions import Conditions
from bowdenfit.cable.drive import RopeDrive
from bowdenfit.cable.friction import FrictionModel
from bowdenfit.cable.friction_options import STROKE_DIFFERENCE

DIFFERENCE, EXPONENT = 0.2, 0.12 * np.pi
VALUES = {STROKE_DIFFERENCE: jnp.asarray(DIFFERENCE)}


@pytest.fixture
def friction():
    return FrictionModel(("stroke-dependent",), Conditions(50.0, 20.0, (20.0, 20.0), "mm/s"))


def test_output_forces_are_those_of_each_strokes_own_coefficient(friction):
    with jax.enable_x64(True):
        force, exponent = jnp.asarray([10.0, 100.0]), jnp.asarray([0.1, 0.5])
        pulled = friction.output_force(VALUES, force, exponent, jnp.ones(()))
        returned = friction.output_force(VALUES, force, exponent, -jnp.ones(()))
    np.testing.assert_allclose(pulled, force * np.exp(-exponent * (1 + DIFFERENCE / 2)), rtol=1e-14)
    np.testing.assert_allclose(returned, force * np.exp(exponent * (1 - DIFFERENCE / 2)), rtol=1e-14)


def test_a_followed_rope_slides_with_each_strokes_own_coefficient(friction):
    """Up, and down again far enough to slide back."""
    with jax.enable_x64(True):
        force = jnp.asarray(np.concatenate([np.linspace(20, 80, 30), np.linspace(80, 20, 30)]))[:, None]
        rope = RopeDrive(friction, VALUES, jnp.asarray([EXPONENT]), jnp.ones_like(force))
        start = rope.scaled(force[0]) - EXPONENT
        out, slope = rope.follow(force, jnp.zeros(1), start)
    assert float(out[29, 0]) == pytest.approx(80 * np.exp(-EXPONENT * (1 + DIFFERENCE / 2)), rel=1e-12)
    assert float(out[59, 0]) == pytest.approx(20 * np.exp(EXPONENT * (1 - DIFFERENCE / 2)), rel=1e-12)
    assert float(slope[29, 0]) == pytest.approx(-(1 + DIFFERENCE / 2))
    assert float(slope[59, 0]) == pytest.approx(1 - DIFFERENCE / 2)


@pytest.mark.extended
def test_the_difference_is_found_and_without_it_the_model_is_said_not_to_describe(tmp_path):
    """A bench that pulls with a tenth more than the mean and returns with a tenth less, noise of 0.3 N."""
    generator, loads = np.random.default_rng(4), np.repeat([20.0, 50.0, 80.0], 6)
    parts = []
    for stroke in (1, -1):
        loss = EXPONENT * (1 + stroke * DIFFERENCE / 2)
        parts.append(hand_bench.pull(generator, [180.0] * 3, [loss] * 3, loads, strokes=(stroke,), noise=(0.3, 0.3)))
    rows = hand_bench.Readings(*(np.concatenate([getattr(p, name) for p in parts]) for name in vars(parts[0])))
    folder = hand_bench.write(tmp_path, rows)
    plain, free = (bf.fit(folder, mcmc=False, friction=model) for model in ("capstan", "stroke-dependent"))
    assert "--friction stroke-dependent" in " ".join(plain.verdict().reasons)
    assert free.verdict().trusted
    estimates = free.least_squares.estimates
    assert abs(estimates[STROKE_DIFFERENCE].value - DIFFERENCE) < 3 * estimates[STROKE_DIFFERENCE].standard_error < 0.05
    assert abs(estimates["mu"].value - 0.12) < 0.002
