"""Identifiability of a fit, of a data set before sampling, and of a plan before anything is measured."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from bowdenfit.dataset import DESCRIPTION_FILE, Dataset
from bowdenfit.errors import DescriptionError
from bowdenfit.frames import Frame
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.least_squares import find_maximum_posterior, predict_posterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.inference.profiles import compute_profile
from bowdenfit.inference.scalar_priors import value_at
from bowdenfit.inputs import read_toml_file
from bowdenfit.models import build_model
from bowdenfit.questions.identify.answer import Identifiability
from bowdenfit.questions.identify.judgment import assess_identifiability, identifiability_at_maximum
from bowdenfit.questions.simulate.tables import draw_true_values, empty_tables, read_bench, simulate_design
from bowdenfit.reading import Reading, read, refuse_named
from bowdenfit.results.record import Record
from bowdenfit.results.store import load

_PROFILE_SDS, _PROFILE_POINTS = 4.0, 21  # profiles span four standard deviations to each side, enough for a 99.9 % interval


def identify_source(source: str | Path | Dataset | Frame | Record, reading: Reading) -> Identifiability:
    """Return identifiability of a fit, of a data set by least squares, or of a plan.

    Args:
        source: A fit or its results folder, a data set, or a cable.toml with [design].
        reading: Keywords of `bowdenfit.read`, for a data set.
    """
    with jax.enable_x64(True):
        return _identify(source, reading)


def _identify(source: str | Path | Dataset | Frame | Record, reading: Reading) -> Identifiability:
    """Return identifiability of a fit, of a data set by least squares, or of a plan, with 64-bit floats."""
    if isinstance(source, str | Path) and (Path(source) / "fit.json").exists():
        source = load(Path(source))
    if isinstance(source, Record):
        refuse_named(reading, f"{source.name} is a fit", "fit its data set again with that, or leave it out")
        return _identify_fit(source)
    if isinstance(source, str | Path) and _is_plan(Path(source)):
        refuse_named(reading, "a plan is judged as it stands", "change the file instead")
        return _identify_plan(Path(source))
    return _identify_tables(read(source, **reading))


def _is_plan(path: Path) -> bool:
    """Return whether a file is a plan: a description with [design]."""
    if path.suffix.lower() != ".toml" or not path.is_file():
        return False
    try:
        return "design" in read_toml_file(path)[1]
    except DescriptionError:
        return False  # the reader says what is wrong


def _identify_fit(fit: Record) -> Identifiability:
    """Return identifiability from the draws of a fit, with profiles of its friction coefficients."""
    from_draws = assess_identifiability(fit)
    posterior = LogDensity(fit.model)
    objective = make_objective(posterior)
    return replace(from_draws, profiles=_friction_profiles(posterior, objective, find_maximum_posterior(posterior, objective)))


def _friction_profiles(posterior: Any, objective: Any, best: Any) -> tuple[Any, ...]:
    """Return profiles of the friction coefficients, over four standard deviations on both sides."""
    space, sd = posterior.model.space, np.sqrt(np.diag(best.covariance))
    which = [i for i, p in enumerate(space.free) if p.role == "friction"]
    steps = np.linspace(-_PROFILE_SDS, _PROFILE_SDS, _PROFILE_POINTS)
    return tuple(compute_profile(posterior, objective, space.free[i].name, best.z, z=best.z[i] + sd[i] * steps) for i in which)


def _identify_tables(data: Dataset) -> Identifiability:
    """Return identifiability from the Fisher information at the maximum of the posterior of a data set."""
    posterior = LogDensity(build_model(data))
    objective = make_objective(posterior)
    best = find_maximum_posterior(posterior, objective)
    basis = f"the best fit to the tables, with readings that scatter as {DESCRIPTION_FILE} expects"
    return identifiability_at_maximum(posterior.model, best, basis, True, _friction_profiles(posterior, objective, best))


def _identify_plan(path: Path) -> Identifiability:
    """Return identifiability from the Fisher information of noise-free readings at the design of a plan."""
    plan = read_bench(path)
    tables = empty_tables(plan.description, plan.design)
    space = build_model(Dataset(plan.description, tables, {})).space
    medians = {p.name: value_at(p.prior, 0.0) * p.shown_scale for p in space.free}
    values = draw_true_values(plan.description, tables, medians | dict(plan.truth), jax.random.key(0), run_once=True)
    data = simulate_design(plan.description, plan.design, values, jax.random.key(0), noise=False, run_once=True)
    posterior = LogDensity(build_model(data))
    assumed = "[truth]" if plan.truth else "the medians of the priors"
    basis = f"the plan, for a cable with the values of {assumed}; nothing has been measured"
    z = compile_program(posterior.model.space.unconstrain, values, run_once=True)(values)
    at = predict_posterior(posterior, np.asarray(z))
    return identifiability_at_maximum(posterior.model, at, basis, False)
