"""What recordings of a pull-pull loop say of the parameters, against the same densities integrated numerically."""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from loop_benches import HALF_TURN, MU, PRELOAD, folder_of, motor, output_of, recorded
from scipy import integrate, stats

from bowdenfit.cable.drive import LoopDrive
from bowdenfit.dataset import load_dataset
from bowdenfit.kinds.recordings.whole_recordings import LoopRecordingsTerm
from bowdenfit.models import build_model
from bowdenfit.recordings.loop_strokes import loop_limits

pytestmark = pytest.mark.extended

VALUES = {"mu": MU, "preload": PRELOAD, "tau": 0.02, "sigma_block": 0.1}


def term_of(folder) -> LoopRecordingsTerm:
    return next(t for t in build_model(load_dataset(folder)).terms if isinstance(t, LoopRecordingsTerm))


def of_term(term, case, values, *extra):
    named = {name: jnp.asarray(float(value)) for name, value in values.items()}
    return np.asarray(jax.jit(getattr(term, case))(named, term.data, *extra))


def test_the_slope_of_the_operator_is_its_derivative():
    generator = np.random.default_rng(0)
    force = jnp.asarray(np.cumsum(generator.standard_normal((400, 3)), axis=0) * 4)
    preload, exponent = jnp.array([5.0, 20.0, 0.0]), jnp.array([0.4, 0.2, 0.3])
    start, step = force[0], 1e-7
    drive, never = LoopDrive(preload, exponent), jnp.full(force.shape, jnp.nan)
    y, slope = drive.follow(force, jnp.zeros(3), start)
    more, less = (drive.follow(force, jnp.full(3, s), start)[0] for s in (step, -step))
    same = np.isclose((more + less) / 2, y, atol=1e-9)
    assert same.mean() > 0.99
    np.testing.assert_allclose(np.asarray(slope)[same], np.asarray((more - less) / (2 * step))[same], atol=1e-5)
    anew = never.at[200].set(force[200] + 0.1)
    restarted, _ = drive.follow(force, jnp.zeros(3), start, anew)
    np.testing.assert_allclose(restarted[200], force[200] + 0.1)
    np.testing.assert_allclose(restarted[:200], y[:200])


def passed_on(force, noise, output, preload, exponent):
    """What of the input's noise is in the output, by the end of the band that this is nearer to."""
    ends = [loop_limits(x, 2 * preload * exponent, exponent) for x in (force, force + noise)]
    below = output - ends[0][0] < ends[0][1] - output
    return np.where(below, ends[1][0] - ends[0][0], ends[1][1] - ends[0][1])


def integrated(term, values) -> float:
    """Log likelihood of a term's only run with its mounting effect integrated by quadrature, the operator written out."""
    data = jax.tree.map(np.asarray, term.data)
    weight, noise, preload = data.weight[:, 0], values["sigma_block"], values["preload"]
    force, output, noise_in = (getattr(data, k)[:, 0] for k in ("likely_force", "output_force", "input_noise"))
    gain = math.exp(values.get("gain_error", 0.0))
    constant = (data.log_weights[0] - data.n[0] * np.log(2 * np.pi)) / 2 - data.n[0] * np.log(noise)

    def log_joint(m):
        exponent = values["mu"] * math.pi + m
        stands = output_of(force, preload, exponent, float(output[0]) * gain)
        apart = output - (stands + passed_on(force, noise_in, stands, preload, exponent)) / gain
        return constant - np.sum(weight * apart**2) / (2 * noise**2) + stats.norm.logpdf(m, 0, values["tau"])

    grid = np.linspace(-0.15, 0.15, 601)
    peak = float(grid[np.argmax([log_joint(m) for m in grid])])
    near = np.linspace(peak - 0.005, peak + 0.005, 201)
    heights = np.array([log_joint(m) for m in near])
    inside = near[heights > heights.max() - 40]
    low, high = (inside[0] - 1e-4, inside[-1] + 1e-4) if heights[0] < heights.max() - 40 else (peak - 0.06, peak + 0.06)
    area, _ = integrate.quad(
        lambda m: np.exp(log_joint(m) - heights.max()), low, high, epsabs=0, epsrel=1e-10, limit=200
    )
    return float(heights.max() + np.log(area))


def test_the_likelihood_is_that_with_the_mounting_integrated_out_where_the_loop_stays_taut(tmp_path):
    """Without input noise the contacts do not change with the mounting, and the output is linear in it."""
    time, force = motor("triangle", 25.0, 8.0)
    output = output_of(force, PRELOAD, HALF_TURN + 0.012)
    columns = {"time_s": time, "input_force_N": force, "output_force_N": output}
    columns["output_force_N"] = output + 0.3 * np.random.default_rng(1).standard_normal(len(time))
    term = term_of(folder_of(tmp_path, [columns]))
    for more in ({}, {"mu": 0.125}, {"preload": 20.7, "sigma_block": 0.07}, {"gain_error": 0.1}, {"tau": 0.005}):
        values = VALUES | more
        assert of_term(term, "log_likelihood", values)[0] == pytest.approx(integrated(term, values), abs=1e-6)


def test_the_likelihood_is_close_to_the_integrated_one_where_the_loop_goes_slack(tmp_path):
    """To first order about the effect that suits best, which leaves a few hundredths even where the values are far off."""
    term = term_of(folder_of(tmp_path, [recorded(amplitude=90.0, exponent=HALF_TURN + 0.02, seconds=8.0)]))
    for more in ({}, {"mu": 0.14}, {"preload": 21.0}, {"mu": 0.11, "sigma_block": 0.3}):
        values = VALUES | more
        assert of_term(term, "log_likelihood", values)[0] == pytest.approx(integrated(term, values), abs=0.02)


def test_residuals_vanish_at_the_truth_of_a_recording_without_noise(tmp_path):
    """With offsets and a gain error, which the term must undo as the load cells do them."""
    columns = recorded("triangle", 60.0, noise=0.0, seconds=3.0)
    truth = VALUES | {"input_offset": 0.8, "output_offset": -0.5, "gain_error": 0.02}
    columns["input_force_N"] = columns["input_force_N"] + 0.8
    columns["output_force_N"] = columns["output_force_N"] * math.exp(-0.02) - 0.5
    sensors = '[sensors]\ninput_gain_error_sd = 0\noutput_gain_error_sd = 0.02\noffset_sd = { value = 1, unit = "N" }'
    more = f'{sensors}\n[tables]\nrecordings = {{ prepare = {{ block = "none" }} }}'
    term = term_of(folder_of(tmp_path, [columns], more=more))
    assert np.abs(of_term(term, "residuals", truth)).max() < 1e-3
    for name in ("input_offset", "output_offset", "gain_error", "mu", "preload"):
        assert np.abs(of_term(term, "residuals", truth | {name: truth[name] * 1.2})).max() > 0.1, name


def test_an_error_of_the_delay_shifts_the_output(tmp_path):
    columns = recorded("triangle", 60.0, noise=0.0, seconds=3.0)
    time, output = columns["time_s"], columns["output_force_N"]
    more = '[tables]\nrecordings = { prepare = { block = "none" } }'
    term = term_of(folder_of(tmp_path, [columns | {"output_force_N": np.interp(time - 0.01, time, output)}], more=more))
    computed = {
        late: np.mean(of_term(term, "residuals", VALUES | {"delay_error": late}) ** 2) for late in (-0.01, 0.0, 0.01)
    }
    assert computed[0.01] < 0.05 * computed[0.0] < 0.05 * computed[-0.01]


def test_expected_loss_is_the_observed_one_and_mountings_scatter_it(tmp_path):
    term = term_of(
        folder_of(tmp_path, [recorded(noise=0.01, seconds=8.0), recorded(noise=0.01, seconds=4.0, amplitude=80.0)])
    )
    expected = of_term(term, "expected", VALUES)
    np.testing.assert_allclose(expected, term.observed(), rtol=3e-3)
    assert np.all(expected >= 2 * PRELOAD * HALF_TURN)
    more = of_term(term, "expected", VALUES | {"mu": MU + 1e-4 / math.pi})
    keys = jax.random.split(jax.random.key(0), 4000)
    named = {name: jnp.asarray(value) for name, value in VALUES.items()}
    draws = np.asarray(jax.jit(jax.vmap(term.simulate, in_axes=(None, None, 0)))(named, term.data, keys))
    np.testing.assert_allclose(draws.mean(axis=0), expected, atol=0.1)
    np.testing.assert_allclose(draws.std(axis=0), VALUES["tau"] * (more - expected) / 1e-4, rtol=0.05)


def test_a_likelihood_is_finite_where_the_loop_could_not_have_moved(tmp_path):
    nothing = {"tells_loss": np.array([False]), "tells_exponent": np.array([False])}
    term = term_of(folder_of(tmp_path, [recorded(amplitude=25.0, seconds=6.0)]))
    term = replace(term, data=replace(term.data, **nothing))
    named = {name: jnp.asarray(value) for name, value in (VALUES | {"mu": 3.0, "preload": 300.0}).items()}
    value, slope = jax.jit(jax.value_and_grad(lambda v, data: term.log_likelihood(v, data).sum()))(named, term.data)
    assert np.isfinite(value)
    assert all(np.isfinite(s) for s in slope.values())


def test_long_recordings_are_joined_to_a_few_hundred_blocks(tmp_path):
    more = '[tables]\nrecordings = { prepare = { block = "none" } }'
    term = term_of(folder_of(tmp_path, [recorded(seconds=16.0, noise=0.02)], more=more))
    assert len(term.data.weight) < 1000
    assert np.argmax([of_term(term, "log_likelihood", VALUES | {"mu": mu})[0] for mu in (0.11, 0.12, 0.13)]) == 1


def test_blocks_at_the_end_of_a_load_cell_s_range_are_no_readings(tmp_path):
    columns = {n: np.clip(v, -60, 60) if n != "time_s" else v for n, v in recorded(amplitude=60.0, seconds=8.0).items()}
    more = '[tables]\nrecordings = { prepare = { limits = { low = -60, high = 60, unit = "N" } } }'
    term = term_of(folder_of(tmp_path, [columns], more=more))
    cut = np.abs(term.data.input_force) > 59.9
    assert cut.any()
    assert not term.data.weight[cut].any()
    assert term.data.restart.any()
    scores = [of_term(term, "log_likelihood", VALUES | {"mu": mu})[0] for mu in (0.11, 0.12, 0.13)]
    assert np.argmax(scores) == 1
