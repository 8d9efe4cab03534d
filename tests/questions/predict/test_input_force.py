"""What input force a wanted output force takes: the inverse of every prediction of an output force."""

from itertools import product
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from slow_cases import some_slow

import bowdenfit as bf
from bowdenfit.errors import UsageError
from bowdenfit.inference.draws import output_force_at
from bowdenfit.models import build_model
from bowdenfit.physics.loop import loop_input_force, loop_output_force
from bowdenfit.reading import read

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=100", "sampler.target_r_hat=1.1", "sampler.max_steps=1000")


@pytest.fixture(scope="module")
def table(tmp_path_factory) -> Path:
    """Three bends at two loads, pulled and returned."""
    path = tmp_path_factory.mktemp("bench") / "bench.csv"
    rows = [(90, 50, 43.1), (90, 100, 86.0), (180, 50, 36.4), (180, 100, 74.2), (270, 50, 31.3), (270, 100, 63.0)]
    pulls = [f"{bend},{force},{out},pull" for bend, force, out in rows]
    returns = [f"{bend},{force},{force**2 / out:.2f},return" for bend, force, out in rows]
    path.write_text("\n".join(["wrap_angle_deg,input_force_N,output_force_N,stroke", *pulls, *returns]) + "\n")
    return path


@pytest.fixture(scope="module")
def fit(table):
    """A quick fit of it."""
    return bf.fit(table, seed=1, settings=QUICK)


@pytest.mark.extended
@pytest.mark.parametrize(
    ("friction", "stroke"),
    some_slow(
        product(("capstan", "drag", "load-dependent", "stroke-dependent", "drag+load-dependent"), (1, -1)),
        [("capstan", 1), ("drag", 1), ("load-dependent", 1), ("stroke-dependent", -1), ("drag+load-dependent", -1)],
    ),
)
def test_the_input_force_for_an_output_force_gives_that_output_force(friction, stroke, table):
    model = build_model(read(table, friction=friction))
    z = 0.5 * np.random.default_rng(1).standard_normal((20, model.space.size))
    mounting = np.linspace(-0.05, 0.05, len(z))
    with jax.enable_x64(True):
        (needed,) = output_force_at(model, z, np.zeros(1), 70.0, stroke, (mounting,), inverse=True)
        for row in (0, 7, 19):
            rows = slice(row, row + 1)
            (back,) = output_force_at(model, z[rows], np.zeros(1), float(needed[row, 0]), stroke, (mounting[rows],))
            assert back[0, 0] == pytest.approx(70.0, rel=1e-9)


@settings(deadline=None)
@given(st.floats(-200, 200), st.floats(0, 50), st.floats(0, 2), st.sampled_from([1.0, -1.0]))
def test_the_input_force_of_a_loop_gives_the_output_force_back(output, preload, exponent, stroke):
    remainder = jnp.asarray(preload), jnp.asarray(exponent), jnp.asarray(stroke)
    back = loop_output_force(loop_input_force(jnp.asarray(output), *remainder), *remainder)
    assert float(back) == pytest.approx(output, rel=1e-9, abs=1e-9)


@pytest.mark.extended
def test_predict_says_what_a_wanted_force_takes(fit):
    (row,) = bf.predict(fit, output_force=(70.0, "N"))
    (efficiency,) = bf.predict(fit)
    assert row["input_force_N"] == pytest.approx(70.0 / efficiency["efficiency"], rel=1e-6)
    assert row["q05"] < row["input_force_N"] < row["q95"]
    assert row["mounting_q05"] <= row["q05"]
    assert row["note"] == ""
    (bent,) = bf.predict(fit, output_force=(70.0, "N"), wrap_angles=[(90.0, "deg")])
    (there,) = bf.predict(fit, input_force=(bent["input_force_N"], "N"), wrap_angles=[(90.0, "deg")])
    assert there["output_force_N"] == pytest.approx(70.0, rel=1e-4)


@pytest.mark.extended
def test_a_force_that_takes_more_than_was_measured_says_so(fit):
    (row,) = bf.predict(fit, output_force=(700.0, "N"))
    assert "outside the loads measured" in row["note"]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"output_force": (70.0, "N"), "input_force": (70.0, "N")}, "leave one of them out"),
        ({"output_force": (70.0, "mm")}, "--output-force"),
        ({"output_force": (-70.0, "N")}, "not positive"),
        ({"output_force": (70.0, "N"), "quantity": "efficiency"}, "leave --quantity efficiency out"),
        ({"quantity": "input-force"}, "as --output-force 100N"),
    ],
)
def test_what_does_not_go_together_is_refused(fit, options, says):
    with pytest.raises(UsageError, match=says):
        bf.predict(fit, **options)
