"""From a data set to a finished fit: the stages in their order, and what runs beside them."""

import platform
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import jax
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.inference.diagnostics import diagnose_all
from bowdenfit.inference.least_squares import (
    LeastSquares,
    MaximumPosterior,
    Objective,
    least_squares,
    make_objective,
    maximum_posterior,
)
from bowdenfit.inference.posterior import Posterior as Density
from bowdenfit.models.build import Model, build_model
from bowdenfit.predictions.draws import for_each_draw, replicator
from bowdenfit.predictions.optimal_length import optimum_of
from bowdenfit.results.fit import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Fit, Posterior, Provenance
from bowdenfit.workflow.background import Assistants, load_ahead

VERSIONED = ("bowdenfit", "jax", "optimistix", "emcee", "arviz-stats", "numpy", "scipy")
PRIOR_DRAWS = 4096


@dataclass
class Stopwatch:
    """Seconds spent in each stage of a fit."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what runs inside."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


@dataclass(frozen=True)
class Compiled:
    """Programs of a fit: those that sampling needs compiled while least squares is, what follows it while it runs.

    Args:
        log_density: Of half of all walkers.
        optimum: Optimal length and efficiency of many z; None without a route.
        implied: Everything else that a draw implies, once that is compiled.
    """

    log_density: Callable[..., Any]
    optimum: Callable[[np.ndarray], Any] | None
    implied: Future[Callable[[np.ndarray], Any]]


def run(
    data: Dataset,
    begin: Callable[[], Path | None],
    mcmc: bool,
    seed: int,
    resume: bool,
    progress: Callable[..., None] | None,
    watch: Stopwatch,
    helpers: Assistants,
) -> Fit:
    """Least squares, and the posterior if `mcmc`; see `bowdenfit.workflow.fit`.

    Args:
        data: What is fitted.
        begin: Called when sampling starts; gives the checkpoint to write, if any.
        mcmc: Whether to sample.
        seed: Seed.
        resume: Whether the checkpoint has states to go on from.
        progress: Called while sampling.
        watch: Records the stages' times.
        helpers: Who does the statistics.
    """
    density = Density(build_model(data))
    with ThreadPoolExecutor(1) as thread:
        if mcmc:
            load_ahead("scipy.stats", "emcee")
            programs = thread.submit(_sampling_programs, density)
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
            compiled = Compiled(*programs.result(), thread.submit(_implied_program, density, seed))
        posterior, reasons = _sampled(density, compiled, start, seed, begin, resume, progress, watch, helpers)
        squares = classical.result()
    return Fit(data, squares, posterior, not reasons, reasons, provenance(seed, watch))


def _least_squares(density: Density, objective: Objective, start: MaximumPosterior, watch: Stopwatch) -> LeastSquares:
    with jax.enable_x64(True), watch.stage("least squares"):  # the setting is each thread's own
        return least_squares(density, objective, start.z)


def _sampling_programs(density: Density) -> tuple[Callable[..., Any], Callable[[np.ndarray], Any] | None]:
    model, settings = density.model, density.model.description.sampler
    with jax.enable_x64(True):
        log_density = density.batched_log_density(settings.n_ensembles * settings.n_walkers // 2)
        return log_density, for_each_draw(optimum_of(model), model.space.size) if model.description.route else None


def _implied_program(density: Density, seed: int) -> Callable[[np.ndarray], Any]:
    with jax.enable_x64(True):
        return replicator(density, seed)


def _sampled(
    density: Density,
    compiled: Compiled,
    start: MaximumPosterior,
    seed: int,
    begin: Callable[[], Path | None],
    resume: bool,
    progress: Callable[..., None] | None,
    watch: Stopwatch,
    helpers: Assistants,
) -> tuple[Posterior, tuple[str, ...]]:
    with watch.stage("import emcee"):
        from bowdenfit.inference.ensemble import sample

    def quantities(z: np.ndarray) -> Mapping[str, np.ndarray]:
        if compiled.optimum is None:
            return {}
        return dict(zip((OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY), compiled.optimum(z), strict=True))

    with watch.stage("sample"):
        chain = sample(
            density,
            compiled.log_density,
            start,
            density.model.description.sampler,
            seed,
            quantities,
            begin(),
            resume,
            progress,
            diagnose=lambda *args: helpers.statistics.submit(diagnose_all, *args).result(),
        )
    with watch.stage("replicate"):
        values, groups, prior = _implied(density.model, compiled, chain.z, seed)
    posterior = Posterior(
        chain.z,
        values,
        chain.quantities,
        groups["log_likelihood"],
        groups["expected"],
        groups["replicated"],
        prior,
        chain.diagnostics,
        chain.n_ensembles,
        chain.steps,
        chain.acceptance,
    )
    return posterior, chain.reasons


def _implied(
    model: Model, compiled: Compiled, z: np.ndarray, seed: int
) -> tuple[dict[str, np.ndarray], dict[str, dict[str, np.ndarray]], dict[str, np.ndarray]]:
    """Named values and what else the draws imply, and named values of draws from the prior."""
    space, shape, n = model.space, z.shape[:2], z.shape[0] * z.shape[1]
    prior_z = np.random.default_rng([seed, 2]).standard_normal((PRIOR_DRAWS, space.size))
    implied = compiled.implied.result()(np.concatenate([z.reshape(n, space.size), prior_z]))
    groups = {
        group: {name: v[:n].reshape(*shape, *v.shape[1:]) for name, v in values.items()}
        for group, values in implied.items()
    }
    prior = {p.name: implied["values"][p.name][n:][None] for p in space.free}
    return groups.pop("values"), groups, prior


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
