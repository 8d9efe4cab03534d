"""From a data set to a finished fit: the stages in their order, and what runs beside them."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from bowdenfit.dataset import Dataset
from bowdenfit.errors import BowdenfitError
from bowdenfit.front_desk import Fit
from bowdenfit.inference.chain import Sampling
from bowdenfit.inference.diagnostics import diagnose_all
from bowdenfit.inference.engines.memory import refuse_shortage
from bowdenfit.inference.least_squares import least_squares, maximum_posterior
from bowdenfit.inference.log_density import LogDensity as Density
from bowdenfit.inference.objective import make_objective
from bowdenfit.inference.versions import versions
from bowdenfit.model import build_model
from bowdenfit.questions.check.answer import checks_findings, evidence_of
from bowdenfit.questions.check.evidence import work_out
from bowdenfit.questions.check.suspects import caller_of
from bowdenfit.results.record import Provenance
from bowdenfit.run.helpers import Assistant
from bowdenfit.run.loading import load, load_beside
from bowdenfit.run.sampling import LIBRARIES, draws_of, samplers, sampling_programs
from bowdenfit.run.stopwatch import Stopwatch


def run(
    data: Dataset,
    begin: Callable[[], Path | None],
    mcmc: bool,
    seed: int,
    resume: bool,
    progress: Callable[..., None] | None,
    helper: Assistant,
) -> Fit:
    """Least squares, and the posterior if `mcmc`, for which `begin` gives the checkpoint; see `bowdenfit.run.verb.fit`."""
    watch, density = Stopwatch(), Density(build_model(data))
    if not mcmc:
        helper.prepare_to_draw()
        _, (squares, watch.seconds) = classical(density)
        reasons: tuple[str, ...] = () if squares.converged else (squares.message,)
        return Fit(data, squares, None, not reasons, reasons, provenance(seed, watch))
    # Sampling needs the start alone of them, so they are done beside it.
    start, estimated = helper.begin(classical, density, answers=2)
    helper.prepare_to_draw()
    settings = data.description.sampler
    # Not blackjax, whose modules import each other in circles: two threads would see half of one.
    libraries = [LIBRARIES[name] for name in samplers(settings.method) if name == "emcee"]
    if helper.checks:  # a process that is all ours, in which only a move of emcee that is not used would need scipy.stats
        load(*libraries, later=("scipy.stats",))
    else:
        load_beside(*libraries, "arviz_stats.ecdf_utils")
    compiling = ThreadPoolExecutor(1)
    with watch.stage("compile the posterior"):
        programs = sampling_programs(density, seed, compiling)
    with watch.stage("wait for the start"):
        center = start.result()
    checkpoint, report, diagnose = begin(), _with_memory(progress), partial(_called, helper, diagnose_all)
    asked = Sampling(density, center, settings, seed, programs.quantities, checkpoint, resume, report, diagnose)
    posterior, reasons = draws_of(programs, asked, watch)
    squares, beside = estimated.result()
    watch.seconds |= {f"{stage}, beside": seconds for stage, seconds in beside.items()}
    found = Fit(data, squares, posterior, not reasons, reasons, provenance(seed, watch))
    found._answers.update(programs.asked)
    if helper.checks and checkpoint is not None:  # what is written waits for it
        found._answers[checks_findings] = helper.check(work_out, evidence_of(found))
        found._answers[caller_of] = partial(_called, helper)
    return found


def _called(helper: Assistant, function: Callable[..., Any], *arguments: Any) -> Any:
    """What a function of draws gives, by a process that is there for it; here where that was ended from outside."""
    try:
        return helper.check(function, *arguments).result()
    except BowdenfitError:
        return function(*arguments)


def _with_memory(progress: Callable[..., None] | None) -> Callable[..., None]:
    """A report that stops sampling where memory runs out, as long as that can still be said."""

    def report(*where: Any) -> None:
        refuse_shortage()
        if progress is not None:
            progress(*where)

    return report


def classical(density: Density) -> Iterator[Any]:
    """Gives the maximum of the posterior, then least squares and the seconds of each stage."""
    watch = Stopwatch()
    with watch.stage("compile least squares"):
        objective = make_objective(density)
    with watch.stage("maximum of the posterior"):
        start = maximum_posterior(density, objective)
    yield start
    with watch.stage("least squares"):
        squares = least_squares(density, objective, start.z)
    yield squares, watch.seconds


def provenance(seed: int, watch: Stopwatch) -> Provenance:
    """Seed, versions and times of a fit that ends now."""
    return Provenance(seed, dict(versions()), watch.seconds, datetime.now(UTC).isoformat(timespec="seconds"))
