"""What bowdenfit says of a simulated laboratory: how a fit ends, whether that is right, and what intervals hold."""

from pathlib import Path

import jax
import numpy as np
from bench_simulator import Laboratory

import bowdenfit as bf
from bowdenfit.inference.draws import for_each_draw
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.models import Model, build_model
from bowdenfit.questions.calibrate.replicator import BatchFitter, replace_data
from bowdenfit.results.along_route import make_optimizer

HELD = 0.9


def ending(laboratory: Laboratory, folder: Path, model: str) -> tuple[int, str]:
    """Exit code of a fit by least squares, and everything that is said."""
    try:
        verdict = bf.fit(folder, mcmc=False, seed=1, **laboratory.models[model]).verdict()
    except bf.BowdenfitError as error:
        return 2, str(error)
    return (0 if verdict.trusted else 3), " ".join(verdict.reasons)


def fault(laboratory: Laboratory, model: str, code: int, message: str) -> str:
    """What is wrong with how a fit ended, in words; empty if nothing is."""
    if model == laboratory.right:
        return f"{model}: exit {code}" if code else ""
    if not laboratory.cause or model in laboratory.alike:
        return ""  # a larger model of a healthy bench or the like; that it is not preferred is asked elsewhere
    if code == 0:
        return f"{model}: exit 0"
    return "" if any(cause in message for cause in laboratory.cause) else f"{model}: exit {code} without its cause"


def held(laboratory: Laboratory, sessions: int, scratch: Path) -> dict[str, int]:
    """In how many sessions the 90 % interval of each true value holds it."""
    options = laboratory.models[laboratory.right]
    folders = [laboratory.write(scratch / f"interval {seed}", 1000 + seed) for seed in range(sessions)]
    with jax.enable_x64(True):
        data = [bf.read(folder, **options) for folder in folders]
        model = build_model(data[0])
        posteriors = [LogDensity(replace_data(model, item)) for item in data]
        fits = BatchFitter().fit_all(posteriors, list(range(sessions)))
        draws = [draw_values(model, fit.z) for fit in fits if len(fit.z) and not fit.reasons]
    results = {}
    for name, true in laboratory.truth.items():
        ends = np.array([np.quantile(draw[name], ((1 - HELD) / 2, (1 + HELD) / 2)) for draw in draws])
        results[name] = int(np.sum((ends[:, 0] <= true) & (true <= ends[:, 1])))
    return results | {"": len(draws)}


def draw_values(model: Model, z: np.ndarray) -> dict[str, np.ndarray]:
    """Draws of every parameter, and of the best length where there is a route."""
    values = np.asarray(jax.vmap(model.space.vector)(z))
    estimates = {p.name: values[:, i] for i, p in enumerate(model.space.free)}
    if model.description.route is not None:
        estimates["best length"] = np.asarray(for_each_draw(make_optimizer(model), model.space.size)(z)[0])
    return estimates
