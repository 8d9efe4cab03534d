"""Loops that were mounted several times, measured on paper, and fitted together: readings from formulas of their own."""

import jax
import numpy as np

from bowdenfit.dataset import load_dataset
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.models import build_model
from bowdenfit.questions.calibrate.replicator import RANK_SETTINGS, replace_data
from bowdenfit.results.record import Draws, Provenance, Record

MOUNTINGS, LOADS = 6, np.array([2.0, 5.0, 10.0, 20.0, 40.0, 80.0, 120.0, 160.0])  # N
ANGLE, RADIUS, NOISE = np.pi / 2, 0.02, 0.05
CABLE = """
name = "mounted loop"
[cable]
kind = "loop"
output_pulley_radius = { value = 20, unit = "mm" }
[[contact]]
name = "housing"
friction = "mu"
wrap_angle = { column = "wrap_angle" }
[friction.mu]
prior = { lognormal = { median = 0.13, log_sd = 0.25 } }
[prior.tau]
prior = { uniform = { low = 0.004, high = 0.02 } }
[preload]
value = { value = 17.5, unit = "N", sd = 0.3 }
[tables]
efficiencies = { file = "efficiencies.csv" }
loop = { file = "loop.csv" }
"""


def measured(folder, cables, seed):
    """Data sets, and the friction exponent and preload of each in one more mounting, which nobody measured.

    Truths are drawn from the priors that cable.toml states, so that what is said with 95 % holds in 95 % of cables.
    """
    draw = np.random.default_rng(seed)
    mu, tau = 0.13 * np.exp(0.25 * draw.standard_normal(cables)), draw.uniform(0.004, 0.02, cables)
    preload = 17.5 + 0.3 * draw.standard_normal(cables)
    exponent = mu[:, None] * ANGLE + tau[:, None] * draw.standard_normal((cables, MOUNTINGS + 2))
    (folder / "cable.toml").write_text(CABLE)
    results = []
    for i in range(cables):
        lines = ["wrap_angle_deg,efficiency", *(f"90,{np.exp(-loss):.6f}" for loss in exponent[i, :MOUNTINGS])]
        (folder / "efficiencies.csv").write_text("\n".join(lines) + "\n")
        own_values, pulled = exponent[i, MOUNTINGS], LOADS + NOISE * draw.standard_normal(len(LOADS))
        arrives = np.minimum(
            LOADS - 2 * preload[i] * own_values, LOADS * np.exp(-own_values)
        )  # slack from 2 P Lambda/(1 - exp(-Lambda)) on
        shown = arrives + NOISE * draw.standard_normal(len(LOADS))
        rows = [f"90,pull,{first:.4f},{other:.4f}" for first, other in zip(pulled, shown, strict=True)]
        (folder / "loop.csv").write_text("\n".join(["wrap_angle_deg,stroke,input_force_N,output_force_N", *rows]) + "\n")
        results.append(load_dataset(folder))
    return results, exponent[:, -1], preload


def fitted(datasets, seed):
    """Fits of them all in one program, by the engines of a fleet; None of those that did not settle."""
    model = build_model(datasets[0])
    loss = [LogDensity(replace_data(model, dataset)) for dataset in datasets]
    seeds = [seed + i for i in range(len(datasets))]
    fits = fit_batch(loss[0], [posterior.data for posterior in loss], seeds, RANK_SETTINGS)
    return [
        None if fit.reasons else _record(dataset, model, fit.z, own_values)
        for dataset, fit, own_values in zip(datasets, fits, seeds, strict=True)
    ]


def _record(dataset, model, z, seed):
    values = jax.vmap(model.space.constrain)(z)
    shown = {p.name: np.asarray(values[p.name])[None] * p.shown_scale for p in model.space.free}
    draws = Draws(z[None], shown, {}, {}, {}, {}, {}, {}, 2, 0, float("nan"))
    record = Record(dataset, None, draws, True, (), Provenance(seed, {}))
    record.__dict__["model"] = model  # whose priors are those that were fitted with
    return record
