"""Ring-downs whose truth is known: swung in small steps, which share no code with the likelihood, and found again as often
as is said."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import chi2, kstest

from bowdenfit.dataset import load_dataset
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.least_squares import find_maximum_posterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.kinds.ringdown.term import RingDownTerm
from bowdenfit.models import Model, build_model
from bowdenfit.questions.calibrate.replicator import RANK_SETTINGS

pytestmark = pytest.mark.extended

NAMES = ("ring_inertia", "ring_stiffness", "rope_damping", "ring_friction")
NOISE, ROWS, RATE, STEP = 1e-3, 250, 1000.0, 1e-5
SWINGS = 60  # that the model follows, for all alike
CABLE = """
name = "bar"
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { column = "wrap_angle" }
[tables]
efficiencies = { file = "efficiencies.csv" }
ringdown = { file = "ringdown.csv", inertia = { value = 1.0e-3, sd = 2e-5, unit = "kg*m^2" } }
[prior.ring_stiffness]
prior = { lognormal = { median = 20, log_sd = 0.2 } }
[prior.rope_damping]
prior = { lognormal = { median = 0.006, log_sd = 0.4 } }
[prior.ring_friction]
prior = { lognormal = { median = 0.05, log_sd = 0.3 } }
[prior.sigma_ringdown]
fixed = 0.001
[prior.tau]
fixed = 0.01
[friction.mu]
fixed = 0.1
"""


def swung(cables, seed):
    """True values, and angles at every row: a bar in small steps, released up to a few milliseconds before the first row."""
    draw = np.random.default_rng(seed)
    inertia = 1e-3 + 2e-5 * draw.standard_normal(cables)
    medians, sds = np.array([20.0, 0.006, 0.05]), np.array([0.2, 0.4, 0.3])
    stiffness, damping, friction = (medians * np.exp(sds * draw.standard_normal((cables, 3)))).T
    amplitude, late = 0.2 + 0.01 * draw.standard_normal(cables), np.abs(1e-3 * draw.standard_normal(cables))
    value, speed, seen = amplitude.copy(), np.zeros(cables), []
    rows, next_row = np.arange(ROWS) / RATE, 0
    for i in range(round((ROWS / RATE) / STEP)):
        if next_row < ROWS and i * STEP >= rows[next_row] - STEP / 2:
            seen.append(value.copy())
            next_row += 1
        moving = i * STEP >= late
        pushed = speed + STEP * (-stiffness * value - damping * speed) / inertia
        held = np.sign(pushed) * np.maximum(np.abs(pushed) - STEP * friction / inertia, 0.0)
        speed = np.where(moving, held, 0.0)
        value = value + STEP * speed
    shown = np.array(seen) + 0.5 + NOISE * draw.standard_normal((ROWS, cables))
    return dict(zip(NAMES, (inertia, stiffness, damping, friction), strict=True)), rows, shown.T


def posteriors(folder, cables, seed):
    """Truths that can be told by the swings seen, and their posteriors, of one shape."""
    truth, rows, shown = swung(cables, seed)
    (folder / "efficiencies.csv").write_text("wrap_angle_deg,efficiency\n90,0.86\n180,0.74\n270,0.63\n")
    (folder / "cable.toml").write_text(CABLE)
    results = []
    for angles in shown:
        lines = ["time_s,angle_rad", *(f"{t:.6f},{x:.8f}" for t, x in zip(rows, angles, strict=True))]
        (folder / "ringdown.csv").write_text("\n".join(lines) + "\n")
        model = build_model(load_dataset(folder))
        terms = [
            replace(t, data=replace(t.data, swings=np.zeros(SWINGS))) if isinstance(t, RingDownTerm) else t for t in model.terms
        ]
        results.append(LogDensity(Model(model.cable, model.space, tuple(terms))))
    return truth, results


def true_z(posterior, truth, i):
    free = {p.name: p.prior for p in posterior.model.space.free}
    return np.array([float(free[name].unconstrain(jnp.asarray(truth[name][i]))) for name in NAMES])


def distances(posteriors, truth):
    """Squares of the distances of truths from what is found, in standard deviations; of four parameters at once."""
    objective, results = make_objective(posteriors[0]), []
    index = [posteriors[0].model.space.index[name] for name in NAMES]
    for i, posterior in enumerate(posteriors):
        best = find_maximum_posterior(posterior, objective)
        away = best.z[index] - true_z(posterior, truth, i)
        results.append(float(away @ np.linalg.solve(best.covariance[np.ix_(index, index)], away)))
    return np.array(results)


def test_truths_lie_as_far_from_what_is_found_as_is_said(tmp_path):
    """Chi-square of 4 times 8; one seed in 500 would fail by chance."""
    truth, estimates = posteriors(tmp_path, 8, 5)
    far = distances(estimates, truth)
    assert chi2(32).ppf(0.001) < far.sum() < chi2(32).ppf(0.999)
    assert np.all(far < chi2(4).ppf(0.9999)), "none in a maximum of another number of half swings"


@pytest.mark.slow
def test_ranks_of_truths_among_draws_are_uniform(tmp_path):
    """Three quantities of 120 cables; one seed in 300 would fail by chance."""
    truth, estimates = posteriors(tmp_path, 120, 6)
    space = estimates[0].model.space
    fits = fit_batch(estimates[0], [posterior.data for posterior in estimates], list(range(120)), RANK_SETTINGS)
    settled = [i for i, fit in enumerate(fits) if not fit.reasons]
    assert len(settled) >= 110
    for name in NAMES[1:]:
        index = space.index[name]
        ranks = [np.mean(fits[i].z[:, index] < true_z(estimates[i], truth, i)[NAMES.index(name)]) for i in settled]
        assert kstest(ranks, "uniform").pvalue > 0.001, name
