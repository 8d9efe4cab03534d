"""From a data set to a finished fit: least squares, compilation, sampling, in their order."""

import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

import jax
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.finished_fit import Fit
from bowdenfit.inference.chain import Chain, SamplingRequest
from bowdenfit.inference.coordinates import Conditional
from bowdenfit.inference.draws import PREDICTED_GROUPS, compile_replicator, for_each_draw, imply_groups, value_function
from bowdenfit.inference.engines import installed_versions
from bowdenfit.inference.importance import compile_densities
from bowdenfit.inference.least_squares import (
    LeastSquares,
    MaximumPosterior,
    find_maximum_posterior,
    fit_least_squares,
    read_start,
)
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import Objective, make_objective
from bowdenfit.inference.resources import refuse_shortage
from bowdenfit.inference.sampler_agreement import SAMPLER_NAMES, SamplerDraws, compare_samplers
from bowdenfit.inference.walkers import compile_walkers
from bowdenfit.models import Model, build_model
from bowdenfit.results.along_route import compile_along_route, make_optimizer
from bowdenfit.results.record import DrawPrograms, Draws, Provenance
from bowdenfit.results.serialization import coarsen_predictions, round_draws
from bowdenfit.run.refusing import refuse_large_sampling, refuse_undetermined
from bowdenfit.stages import announce_stage

_SLOW_IMPORTS = ("emcee", "arviz_stats.base", "arviz_stats.ecdf_utils")  # which get their time while XLA compiles
_MOST_WEIGHTED = 12  # parameters; weights sufficed for 3 to 10 on the data sets in `datasets/`, and for 15 to 21 they did not
LIBRARIES = {"emcee": "emcee", "nuts": "blackjax", "importance": "the sampler"}
_MODULES = {name: f"bowdenfit.inference.{module}" for name, module in
            (("emcee", "ensemble"), ("nuts", "nuts"), ("importance", "importance"))}  # fmt: skip


@dataclass
class Stopwatch:
    """Seconds spent in each stage of a fit.

    Args:
        announces: Whether stages are announced as they begin; not those beside others.
        seconds: By stage.
    """

    announces: bool = True
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what runs inside."""
        start = time.perf_counter()
        if self.announces:
            announce_stage(name)
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


@jax.enable_x64(True)
def fit_classically(data: Dataset, seed: int, values: Mapping[str, float] = MappingProxyType({})) -> Fit:
    """Fit by least squares alone, without a posterior.

    Args:
        data: Data set to fit.
        seed: Random seed, for the record.
        values: Values at which the search begins too; see `read_start`.
    """
    watch, density = Stopwatch(), LogDensity(build_model(data))
    objective, start = find_maximum(density, watch, read_start(density.model.space, values))
    squares = estimate(density, objective, start, watch)
    reasons = () if squares.converged else (squares.message,)
    return Fit(data, squares, None, not reasons, reasons, provenance(seed, watch, values))


@jax.enable_x64(True)
def fit_posterior(
    data: Dataset,
    seed: int,
    start_checkpoint: Callable[[], Path | None],
    resume: bool,
    report: Callable[..., None] | None,
    values: Mapping[str, float] = MappingProxyType({}),
) -> Fit:
    """Fit by least squares and sample the posterior.

    Sampling needs only the start from least squares, which is worked out in a thread while XLA compiles what samples.

    Args:
        data: Data set to fit.
        seed: Random seed.
        start_checkpoint: Called before the first draw; returns the checkpoint.
        resume: Whether the checkpoint holds draws to go on from.
        report: Called after every block of draws with where sampling stands.
        values: Values at which the search for the maximum begins too; see `read_start`.

    Raises:
        BowdenfitError: Coefficients cannot be told apart, a value cannot be, or draws would not fit into memory.
    """
    watch, beside = Stopwatch(), Stopwatch(announces=False)
    density, settings = LogDensity(build_model(data)), data.description.sampler
    first = read_start(density.model.space, values)
    with ThreadPoolExecutor(1) as classical, ThreadPoolExecutor(1) as compiling, ThreadPoolExecutor(1) as importing:
        maximum = classical.submit(find_maximum, density, beside, first)
        refuse_undetermined(density.model, lambda: maximum.result()[1])
        refuse_large_sampling(density.model)
        squares = classical.submit(lambda: estimate(density, *maximum.result(), beside))  # one thread: after the other
        for library in _SLOW_IMPORTS:
            importing.submit(import_module, library)
        with watch.stage("compiling the posterior"):
            programs = compile_programs(density, seed, compiling)
        with watch.stage("waiting for least squares"):
            _, start = maximum.result()
        request = SamplingRequest(
            density, start, settings, seed, programs.quantities, start_checkpoint(), resume, _with_memory(report)
        )
        posterior, reasons = draw_posterior(programs, request, watch)
        least = squares.result()
    watch.seconds |= {f"{stage}, beside": seconds for stage, seconds in beside.seconds.items()}
    return Fit(data, least, posterior, not reasons, reasons, provenance(seed, watch, values), programs.draw_programs)


def find_maximum(
    density: LogDensity, watch: Stopwatch, start: np.ndarray | None = None
) -> tuple[Objective, MaximumPosterior]:
    """Return the compiled objective of least squares, and the maximum of the posterior, searched from one more start too."""
    with jax.enable_x64(True):  # a setting of each thread
        with watch.stage("compiling least squares"):
            objective = make_objective(density)
        with watch.stage("finding the maximum of the posterior"):
            return objective, find_maximum_posterior(density, objective, start)


def estimate(density: LogDensity, objective: Objective, start: MaximumPosterior, watch: Stopwatch) -> LeastSquares:
    """Return the classical estimates, which begin at the maximum of the posterior."""
    with jax.enable_x64(True), watch.stage("fitting by least squares"):
        return fit_least_squares(density, objective, start.z)


def _with_memory(report: Callable[..., None] | None) -> Callable[..., None]:
    """Return a report that stops sampling where memory runs out, as long as that can still be said."""

    def report_with_memory(*progress: Any) -> None:
        refuse_shortage()
        if report is not None:
            report(*progress)

    return report_with_memory


def provenance(seed: int, watch: Stopwatch, values: Mapping[str, float]) -> Provenance:
    """Return seed, versions, times and starting values of a fit that ends now."""
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return Provenance(seed, dict(installed_versions()), watch.seconds, now, dict(values))


def choose_samplers(density: LogDensity) -> tuple[str, ...]:
    """Return the samplers that are run, in their order; the draws of the first are the result.

    Unless one is stated, weighted draws serve models whose densities take milliseconds, and few parameters whose scatter is
    determined by the readings; they were found not to reach the ends of funnels, nor far into 15 parameters.
    """
    method = density.model.description.sampler.method
    if method is None:
        few = density.model.space.size <= _MOST_WEIGHTED and not Conditional(density).is_narrow
        method = "importance" if density.model.is_slow or few else "emcee"
    return ("emcee", "nuts") if method == "both" else (method,)


@dataclass(frozen=True)
class Programs:
    """Compiled programs for sampling and what follows it.

    Args:
        samplers: Compiled program of each sampler, by its name.
        draw_programs: Programs that questions will need.
    """

    samplers: dict[str, Any]
    draw_programs: DrawPrograms

    def quantities(self, z: np.ndarray) -> Mapping[str, np.ndarray]:
        """Return quantities that must converge besides the parameters, by name, for many z."""
        return self.draw_programs.find_optimum(z)


def compile_programs(density: LogDensity, seed: int, beside: Executor) -> Programs:
    """Compile the programs that sampling needs and, in an executor beside it, those that its draws will need."""
    model, settings, programs = density.model, density.model.description.sampler, dict[str, Any]()
    for name in choose_samplers(density):
        if name == "emcee":
            programs[name] = compile_walkers(density, settings, beside=beside)
        elif name == "importance":
            programs[name] = compile_densities(density.log_density, density.data, model.space.size)
        else:
            programs[name] = import_module(_MODULES[name]).compile_nuts(density, settings)
    optimum = for_each_draw(make_optimizer(model), model.space.size, beside=beside) if model.description.route else None
    implied = compile_replicator(density, seed, beside)
    along_route = compile_along_route(model, beside) if model.description.route is not None else None
    values = for_each_draw(value_function(model), model.space.size, run_once=True, beside=beside)
    return Programs(programs, DrawPrograms(values, implied, along_route, optimum))


def draw_posterior(programs: Programs, request: SamplingRequest, watch: Stopwatch) -> tuple[Draws, tuple[str, ...]]:
    """Sample the posterior by each of the samplers; return the draws, and why they should not be trusted."""
    model, chains = request.posterior.model, list[Chain]()
    for name, program in programs.samplers.items():
        with watch.stage(f"loading {LIBRARIES[name]}"):
            sampler = import_module(_MODULES[name])
        with watch.stage(f"sampling with {SAMPLER_NAMES[name]}" if chains else "sampling"):
            chain = sampler.sample(request, program)
        if chain.reasons and name == "importance" and request.settings.method is None:
            chain = _sample_by_walkers(request, watch)
        chains.append(chain)
    with watch.stage("predicting readings"):
        posterior = _posterior(model, chains[0], programs.draw_programs.quantities, request.seed)
    if len(chains) == 1:
        return posterior, chains[0].reasons
    with watch.stage("comparing samplers"):
        agreement = compare_samplers(*(_sampler_draws(model, chain) for chain in chains))
    of_other = [f"{SAMPLER_NAMES[chains[1].sampler]}: {reason}" for reason in chains[1].reasons]
    return replace(posterior, agreement=agreement), (*chains[0].reasons, *of_other, *agreement.reasons())


def _sample_by_walkers(request: SamplingRequest, watch: Stopwatch) -> Chain:
    """Sample with walkers, since weighted draws do not suffice."""
    with watch.stage("compiling walkers, since weighted draws do not suffice"):
        programs = compile_walkers(request.posterior, request.settings)
    with watch.stage("sampling with walkers"):
        chain: Chain = import_module(_MODULES["emcee"]).sample(request, programs)
    return chain


def _sampler_draws(model: Model, chain: Chain) -> SamplerDraws:
    draws = {p.name: chain.z[..., i] for i, p in enumerate(model.space.free)} | chain.quantities
    return SamplerDraws(chain.sampler, draws, chain.n_ensembles)


def _posterior(model: Model, chain: Chain, implied: Callable[[np.ndarray], Any], seed: int) -> Draws:
    """Return the draws of a chain with what they imply, and draws from the prior, as numbers of single precision where that
    loses nothing.

    These have seven digits, mostly far more than the Monte Carlo error leaves, and take half the room in the results folder.
    What draws predict of each reading, which is most of them, keeps fewer.
    """
    z, optimum = round_draws(chain.z), {name: round_draws(values) for name, values in chain.quantities.items()}
    of_chain = vars(chain) | {"z": z, "optimum": optimum}
    kept = {name: value for name, value in of_chain.items() if name not in ("quantities", "reasons")}
    groups = imply_groups(model, z, implied, seed)
    groups |= {name: jax.tree.map(coarsen_predictions, groups[name]) for name in PREDICTED_GROUPS}
    return Draws(**kept, **jax.tree.map(round_draws, groups))
