"""From a data set to a finished fit: the stages in their order, and what runs beside them."""

import platform
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

import jax

from bowdenfit.dataset import Dataset
from bowdenfit.front_desk import Fit
from bowdenfit.inference.least_squares import (
    LeastSquares,
    MaximumPosterior,
    Objective,
    least_squares,
    make_objective,
    maximum_posterior,
)
from bowdenfit.inference.log_density import LogDensity as Density
from bowdenfit.model import build_model
from bowdenfit.results.record import Provenance
from bowdenfit.run.helpers import Assistants, load_ahead
from bowdenfit.run.sampling import implied_program, libraries, sampled, sampling_programs
from bowdenfit.run.stopwatch import Stopwatch

VERSIONED = ("bowdenfit", "jax", "optimistix", "emcee", "blackjax", "arviz-stats", "numpy", "scipy")


def run(
    data: Dataset,
    begin: Callable[[], Path | None],
    mcmc: bool,
    seed: int,
    resume: bool,
    progress: Callable[..., None] | None,
    helpers: Assistants,
) -> Fit:
    """Least squares, and the posterior if `mcmc`; see `bowdenfit.run.verb.fit`.

    Args:
        data: What is fitted.
        begin: Called when sampling starts; gives the checkpoint to write, if any.
        mcmc: Whether to sample.
        seed: Seed.
        resume: Whether the checkpoint has states to go on from.
        progress: Called while sampling.
        helpers: Who does the statistics.
    """
    watch = Stopwatch()
    density = Density(build_model(data))
    with ThreadPoolExecutor(1) as thread:
        if mcmc:
            load_ahead("scipy.stats", *libraries(data.description.sampler.method), "arviz_stats.base")
            programs = thread.submit(sampling_programs, density)
        with watch.stage("compile least squares"):
            objective = make_objective(density)
        with watch.stage("maximum of the posterior"):
            start = maximum_posterior(density, objective)
        # Sampling does not need least squares, so they are done beside it.
        classical = thread.submit(_least_squares, density, objective, start, watch)
        if not mcmc:
            squares = classical.result()
            reasons: tuple[str, ...] = () if squares.converged else (squares.message,)
            return Fit(data, squares, None, not reasons, reasons, provenance(seed, watch))
        with watch.stage("compile the posterior"):
            compiled, implied = programs.result(), thread.submit(implied_program, density, seed)
        files = begin(), resume
        posterior, reasons = sampled(density, compiled, implied, start, seed, *files, progress, watch, helpers)
        squares = classical.result()
    return Fit(data, squares, posterior, not reasons, reasons, provenance(seed, watch))


def _least_squares(density: Density, objective: Objective, start: MaximumPosterior, watch: Stopwatch) -> LeastSquares:
    with jax.enable_x64(True), watch.stage("least squares"):  # the setting is each thread's own
        return least_squares(density, objective, start.z)


def provenance(seed: int, watch: Stopwatch) -> Provenance:
    """Seed, versions and times of a fit that ends now."""
    from importlib.metadata import PackageNotFoundError, version

    def of(package: str) -> str:
        try:
            return version(package)
        except PackageNotFoundError:
            return "(not installed)"

    versions = {package: of(package) for package in VERSIONED} | {"python": platform.python_version()}
    return Provenance(seed, versions, watch.seconds, datetime.now(UTC).isoformat(timespec="seconds"))
