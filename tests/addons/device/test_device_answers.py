"""What a device wants to know of its cable: springs in series, dynamic range, sticking and slipping."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.errors import UsageError
from bowdenfit.physics.friction import rate_factor, rate_slope
from bowdenfit.physics.loop import dynamic_range, loop_output_force
from bowdenfit.physics.stretch import stiffness_with_springs
from bowdenfit.questions.recorded.friction_effects import StickSlip, compute_friction_slopes, predict_stick_slip
from bowdenfit.questions.summary.details import details_text

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=100", "sampler.target_r_hat=1.3", "sampler.max_steps=300")


def test_springs_in_series_give_with_the_cable():
    assert float(stiffness_with_springs(jnp.asarray(60.0), jnp.asarray(30.0), 2)) == pytest.approx(30.0)
    assert float(stiffness_with_springs(jnp.asarray(60.0), jnp.asarray(30.0), 1)) == pytest.approx(20.0)
    assert float(stiffness_with_springs(jnp.asarray(60.0), jnp.asarray(1e12), 2)) == pytest.approx(60.0)
    # in torques, as the paper has it: 1/K = 1/K_loop + 1/(2 k r^2)
    r_squared = 15.0**2
    in_torques = 1 / (1 / (60.0 * r_squared) + 1 / (2 * 30.0 * r_squared))
    assert in_torques == pytest.approx(r_squared * 30.0)


def test_the_dynamic_range_is_the_force_over_what_an_unloaded_loop_takes_to_move():
    preload, exponent = jnp.asarray(20.0), jnp.asarray(0.4)
    needed = 16.0  # 2 P Lambda: the input force at which the output begins to be positive
    assert float(loop_output_force(jnp.asarray(needed), preload, exponent, jnp.asarray(1.0))) == pytest.approx(0.0)
    assert float(dynamic_range(jnp.asarray(160.0), preload, exponent)) == pytest.approx(10.0)


def test_the_slope_of_friction_by_speed_is_its_derivative_and_changes_sign_where_the_formula_says():
    of = 0.3, 5.0, 0.01
    speeds = jnp.asarray([0.1, 1.0, 5.0, 12.0, 40.0])
    derivative = jax.vmap(jax.grad(lambda v: rate_factor(v, *map(jnp.asarray, of))))(speeds)
    computed = rate_slope(speeds, *map(jnp.asarray, of))
    np.testing.assert_allclose(computed, derivative, rtol=1e-5)
    assert list(np.sign(computed)) == [1, -1, -1, 1, 1]


def test_the_words_of_sticking_and_slipping():
    words = StickSlip((3.0, 10.0, 60.0), "r/min", (0.84, 0.3, 0.02)).sentence()
    assert words.endswith("sticks and slips: 84 % at 3 r/min, 2 % at 60 r/min.")


@pytest.mark.slow
def test_a_fit_of_a_loop_tells_both(on_body):
    fit = bf.fit(on_body.with_name("synthetic-haptic-loop"), seed=5, settings=QUICK)
    options = {"wrap_angles": [(90, "deg")], "input_force": (10, "N")}
    (stiff,) = bf.predict(fit, quantity="stiffness", **options)
    (soft,) = bf.predict(fit, quantity="stiffness", spring=(5, "N/mm"), **options)
    assert soft["stiffness_N_per_mm"] == pytest.approx(1 / (1 / stiff["stiffness_N_per_mm"] + 1 / 10), rel=1e-3)
    (friction,) = bf.predict(fit, quantity="friction", wrap_angles=[(90, "deg")])
    (prediction,) = bf.predict(fit, quantity="dynamic-range", wrap_angles=[(90, "deg")], input_force=(100, "N"))
    arm = 20.0
    assert prediction["dynamic_range"] == pytest.approx(100 / (friction["friction_N_mm"] / arm), rel=1e-3)
    with pytest.raises(UsageError, match="needs the largest force"):
        bf.predict(fit, quantity="dynamic-range", wrap_angles=[(90, "deg")])


@pytest.mark.slow
def test_a_rope_whose_friction_falls_with_speed_says_so(tmp_path):
    rng = np.random.default_rng(1)
    lines = ["wrap_angle_deg,input_force_N,output_force_N,velocity_mm/s"]
    for bend in (90, 180, 270):
        for speed in (0.5, 2.0, 5.0, 15.0, 60.0):
            for force in (20, 60):
                mu = 0.1 * (1 + 0.5 * np.exp(-((speed / 10) ** 2)))
                out = force * np.exp(-mu * np.deg2rad(bend)) * (1 + 0.002 * rng.standard_normal())
                lines.append(f"{bend},{force},{out:.4f},{speed}")
    path = tmp_path / "bench.csv"
    path.write_text("\n".join(lines) + "\n")
    fit = bf.fit(path, seed=1, settings=QUICK, friction="rate-dependent")
    prediction = predict_stick_slip(fit)
    assert prediction is not None
    assert prediction.unit == "mm/s" and max(prediction.probabilities) > 0.9
    values = {name: fit.posterior.values[name].ravel() for name in ("stribeck", "stribeck_speed", "viscous")}
    by_hand = (
        -2 * values["stribeck"] * 5 / values["stribeck_speed"] ** 2 * np.exp(-((5 / values["stribeck_speed"]) ** 2))
    )
    np.testing.assert_allclose(compute_friction_slopes(fit, np.array([5.0]))[:, 0], by_hand + values["viscous"], rtol=1e-9)
    assert "sticks and slips" in " ".join(details_text(fit).split())
