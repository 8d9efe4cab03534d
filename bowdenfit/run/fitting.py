"""From a data set to a finished fit: the stages in their order, and what runs beside them."""

import platform
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import jax

from bowdenfit.dataset import Dataset
from bowdenfit.front_desk import Fit
from bowdenfit.inference.chain import Sampling
from bowdenfit.inference.draws import replicator
from bowdenfit.inference.least_squares import LeastSquares, least_squares, maximum_posterior
from bowdenfit.inference.log_density import LogDensity as Density
from bowdenfit.inference.objective import make_objective
from bowdenfit.model import build_model
from bowdenfit.results.record import Provenance
from bowdenfit.run.helpers import Assistants, Stopwatch, load_ahead
from bowdenfit.run.sampling import LIBRARIES, draws_of, samplers, sampling_programs

VERSIONED = ("bowdenfit", "jax", "optimistix", "emcee", "blackjax", "arviz-stats", "numpy", "scipy")
Answer = TypeVar("Answer")


def run(
    data: Dataset,
    begin: Callable[[], Path | None],
    mcmc: bool,
    seed: int,
    resume: bool,
    progress: Callable[..., None] | None,
    helpers: Assistants,
) -> Fit:
    """Least squares, and the posterior if `mcmc`, for which `begin` gives the checkpoint; see `bowdenfit.run.verb.fit`."""
    watch = Stopwatch()
    density = Density(build_model(data))

    def beside(function: Callable[..., Answer], *arguments: Any) -> "Future[Answer]":
        def in_64_bits() -> Answer:
            with jax.enable_x64(True):  # the setting is each thread's own
                return function(*arguments)

        return thread.submit(in_64_bits)

    def classical() -> LeastSquares:
        with watch.stage("least squares"):
            return least_squares(density, objective, start.z)

    with ThreadPoolExecutor(1) as thread:
        if mcmc:
            libraries = [LIBRARIES[name] for name in samplers(data.description.sampler.method)]
            load_ahead("scipy.stats", *libraries, "arviz_stats.base")
            programs = beside(sampling_programs, density)
        with watch.stage("compile least squares"):
            objective = make_objective(density)
        with watch.stage("maximum of the posterior"):
            start = maximum_posterior(density, objective)
        # Sampling does not need least squares, so they are done beside it.
        estimated = beside(classical)
        if not mcmc:
            squares = estimated.result()
            reasons: tuple[str, ...] = () if squares.converged else (squares.message,)
            return Fit(data, squares, None, not reasons, reasons, provenance(seed, watch))
        with watch.stage("compile the posterior"):
            compiled, implied = programs.result(), beside(replicator, density, seed)
        settings, files = data.description.sampler, (begin(), resume)
        asked = Sampling(density, start, settings, seed, compiled.quantities, *files, progress or (lambda _: None))
        posterior, reasons = draws_of(compiled, implied, asked, watch, helpers)
        squares = estimated.result()
    return Fit(data, squares, posterior, not reasons, reasons, provenance(seed, watch))


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
