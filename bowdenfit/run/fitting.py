"""From a data set to a finished fit: the stages in their order."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import Any

import jax

from bowdenfit.dataset import Dataset
from bowdenfit.front_desk import Fit
from bowdenfit.inference.chain import SamplingRequest
from bowdenfit.inference.engines import versions
from bowdenfit.inference.least_squares import LeastSquares, MaximumPosterior, find_maximum_posterior, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import Objective, make_objective
from bowdenfit.inference.resources import refuse_shortage
from bowdenfit.model import build_model
from bowdenfit.results.record import Provenance
from bowdenfit.run.sampling import Stopwatch, compile_programs, draw_posterior

_SLOW_IMPORTS = ("emcee", "arviz_stats.base", "arviz_stats.ecdf_utils")  # which get their time while XLA compiles


def fit_classically(data: Dataset, seed: int) -> Fit:
    """Fit by least squares alone, without a posterior.

    Args:
        data: What is fitted.
        seed: Of everything random, for the record.
    """
    watch, density = Stopwatch(), LogDensity(build_model(data))
    objective, start = find_maximum(density, watch)
    squares = estimate(density, objective, start, watch)
    reasons = () if squares.converged else (squares.message,)
    return Fit(data, squares, None, not reasons, reasons, provenance(seed, watch))


def fit_posterior(
    data: Dataset,
    seed: int,
    start_checkpoint: Callable[[], Path | None],
    resume: bool,
    report: Callable[..., None] | None,
) -> Fit:
    """Fit by least squares and sample the posterior.

    Sampling needs only the start from least squares, which is worked out in a thread while XLA compiles what samples.

    Args:
        data: What is fitted.
        seed: Of everything random.
        start_checkpoint: Called before the first draw; returns the checkpoint.
        resume: Whether the checkpoint holds draws to go on from.
        report: Called after every block of draws with where sampling stands.
    """
    watch, beside = Stopwatch(), Stopwatch()
    density, settings = LogDensity(build_model(data)), data.description.sampler
    with ThreadPoolExecutor(1) as classical, ThreadPoolExecutor(1) as compiling, ThreadPoolExecutor(1) as importing:
        maximum = classical.submit(find_maximum, density, beside)
        squares = classical.submit(lambda: estimate(density, *maximum.result(), beside))  # one thread: after the other
        for library in _SLOW_IMPORTS:
            importing.submit(import_module, library)
        with watch.stage("compile the posterior"):
            programs = compile_programs(density, seed, compiling)
        with watch.stage("wait for the start"):
            _, start = maximum.result()
        request = SamplingRequest(
            density, start, settings, seed, programs.quantities, start_checkpoint(), resume, _with_memory(report)
        )
        posterior, reasons = draw_posterior(programs, request, watch)
        least = squares.result()
    watch.seconds |= {f"{stage}, beside": seconds for stage, seconds in beside.seconds.items()}
    return Fit(data, least, posterior, not reasons, reasons, provenance(seed, watch), programs.draw_programs)


def find_maximum(density: LogDensity, watch: Stopwatch) -> tuple[Objective, MaximumPosterior]:
    """Return the compiled objective of least squares, and the maximum of the posterior."""
    with jax.enable_x64(True):  # a setting of each thread
        with watch.stage("compile least squares"):
            objective = make_objective(density)
        with watch.stage("maximum of the posterior"):
            return objective, find_maximum_posterior(density, objective)


def estimate(density: LogDensity, objective: Objective, start: MaximumPosterior, watch: Stopwatch) -> LeastSquares:
    """Return the classical estimates, which begin at the maximum of the posterior."""
    with jax.enable_x64(True), watch.stage("least squares"):
        return fit_least_squares(density, objective, start.z)


def _with_memory(report: Callable[..., None] | None) -> Callable[..., None]:
    """Return a report that stops sampling where memory runs out, as long as that can still be said."""

    def report_with_memory(*progress: Any) -> None:
        refuse_shortage()
        if report is not None:
            report(*progress)

    return report_with_memory


def provenance(seed: int, watch: Stopwatch) -> Provenance:
    """Return seed, versions and times of a fit that ends now."""
    return Provenance(seed, dict(versions()), watch.seconds, datetime.now(UTC).isoformat(timespec="seconds"))
