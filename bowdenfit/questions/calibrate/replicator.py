"""Replications: a known truth, tables simulated with it, a fit, and the rank of the truth among the draws.

Priors are weak, so that some of what they allow is no cable: an efficiency of 1 %, an output force below its own noise, a
rope slack at every angle. No bench would hand in such tables, and where noise is as large as what is read the likelihoods,
which take errors to be small, do not hold. They are drawn again, truth and tables together. The rule looks at the simulated
readings alone, never at the truth; and because the posterior is that of the truth given the readings, leaving readings out by
such a rule leaves ranks exactly uniform if they were so.

The limits are wide and are the same for every replication: efficiencies between 20 and 99 %, of every run and recording too;
at least as many detected angles of a contact as its curve has parameters; the largest stretch, preload and scatter within a
factor of ten of the measured one, however it is fitted; and everything that a reader of tables checks.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, field, replace
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.description import SamplerSettings
from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.inference.batch.fitting import BatchFit, fit_batch
from bowdenfit.inference.batch.programs import BatchPrograms, BatchSettings
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.draws import for_each_draw
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.scalar_priors import z_at
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.tables import Measurements
from bowdenfit.kinds.terms import Readings, any_slipped, draw_readings, iterate_replaced_tables
from bowdenfit.models import Model, build_model
from bowdenfit.questions.calibrate.plan import CalibrationPlan
from bowdenfit.questions.calibrate.replications import RankedTruth, Replication, rank_truth
from bowdenfit.results.along_route import make_optimizer
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH

BATCH_SIZE = 128  # replications that are fitted together; a judgement: what is lost when a calibration is interrupted
MAX_DRAWS = 5000  # tables, before a replication is given up; a judgement
# The rank of a truth among any number of independent draws is exactly uniform (Talts et al. 2018): 200 only say it less finely
# than 400. Tails of noise scales mix slowest, so their posteriors are given many steps before they are given up.
RANK_SETTINGS = BatchSettings(
    SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=24000, target_ess=200, target_r_hat=1.03),
    target_sd_error=float("inf"),
    nuts=False,
)


@dataclass(frozen=True)
class BatchFitter:
    """Fits of many data sets of one model: those of one shape together, with programs that serve the next as well.

    Args:
        settings: How carefully.
        programs: Compiled programs, by cable and shape of the data.
    """

    settings: BatchSettings = field(default=RANK_SETTINGS)
    programs: dict[str, BatchPrograms] = field(default_factory=dict)

    def fit_all(self, posteriors: Sequence[LogDensity], seeds: Sequence[int]) -> list[BatchFit]:
        """Return draws of every posterior, in order."""
        groups: dict[str, list[int]] = {}
        for i, posterior in enumerate(posteriors):
            groups.setdefault(_compilation_key(posterior), []).append(i)
        fits: dict[int, BatchFit] = {}
        for key, members in groups.items():
            first = posteriors[members[0]]
            default = BatchPrograms(replace(first, data_override=first.padded), self.settings)
            programs = self.programs.setdefault(key, default)
            data, own_seeds = [posteriors[i].padded for i in members], [seeds[i] for i in members]
            fits |= zip(members, fit_batch(programs.posterior, data, own_seeds, programs=programs), strict=True)
        return [fits[i] for i in range(len(posteriors))]


def _compilation_key(posterior: LogDensity) -> str:
    """Return cable, parameters and shapes of the data: what programs are compiled for."""
    shapes = jax.tree.map(lambda array: (array.shape, str(array.dtype)), posterior.padded)
    parameters = [
        (type(parameter.prior).__name__, *astuple(parameter)) for parameter in posterior.model.space.parameters
    ]
    return f"{shapes} {parameters} {posterior.model.description.to_json()}"


def replace_data(model: Model, dataset: Dataset) -> Model:
    """Return the model of other readings on the same bench; priors that look at the data stay those of the first data."""
    terms = build_model(dataset).terms
    return Model(model.cable, model.space, tuple(replace(term, cable=model.cable) for term in terms))  # type: ignore[type-var]


def why_implausible(measured: Dataset, simulated: Dataset) -> str:
    """Return why no bench would hand in the simulated tables, in a few words; empty if one might.

    Args:
        measured: Measurements.
        simulated: Data set that was simulated in its place.
    """
    reasons = (
        kind.why_implausible(measured.measurements.table(kind.table), table)
        for kind, table in iterate_tables(simulated.measurements)
    )
    return next((reason for reason in reasons if reason), "")


@dataclass(frozen=True)
class SimulatedTables:
    """Tables that are waiting to be fitted.

    Args:
        number: Number of the replication.
        z: The truth, where priors are standard normals.
        posterior: Posterior of the tables.
        redrawn: Why tables were drawn again, with how many were.
        seed: Seed of the fit.
        tie: Share of the draws equal to the truth that count as below it.
    """

    number: int
    z: np.ndarray
    posterior: LogDensity
    redrawn: dict[str, int]
    seed: int
    tie: float


@dataclass(frozen=True)
class Replicator:
    """Runs replications of one plan in this process.

    Args:
        plan: Plan of the replications.
        laboratory: Fitter; may be shared.
        disturb: Change of simulated tables before they are fitted, for calibrations that must fail.
        why_implausible: Why simulated tables are not to be had from a bench, in a word; empty if they may be.
    """

    plan: CalibrationPlan
    laboratory: BatchFitter = field(default_factory=BatchFitter)
    disturb: Callable[[Dataset], Dataset] = lambda dataset: dataset
    why_implausible: Callable[[Dataset, Dataset], str] = why_implausible

    @cached_property
    def stated(self) -> Model:
        """The model that readings are simulated with."""
        return build_model(self.plan.stated)

    @cached_property
    def assumed(self) -> Model:
        """The model that is fitted."""
        return self.stated if self.plan.assumed is self.plan.stated else build_model(self.plan.assumed)

    @cached_property
    def _simulate_readings(self) -> Callable[..., Any]:
        model, tables = self.stated, self.plan.stated.measurements

        def readings(z: jax.Array, words: jax.Array) -> Any:
            values = model.space.constrain(z)
            return draw_readings(model.cable, tables, values, jax.random.wrap_key_data(words))

        words = jax.ShapeDtypeStruct((2,), jnp.uint32)
        return compile_program(readings, jax.ShapeDtypeStruct((model.space.size,), jnp.float64), words)

    @cached_property
    def _optimum_of_truth(self) -> Callable[..., Any]:
        return for_each_draw(make_optimizer(self.stated), self.stated.space.size)

    @cached_property
    def _optimum(self) -> Callable[..., Any]:
        if self.assumed is self.stated:
            return self._optimum_of_truth
        return for_each_draw(make_optimizer(self.assumed), self.assumed.space.size)

    def replicate(self, numbers: Sequence[int]) -> Iterator[Replication]:
        """Yield replications by their numbers, as they are done.

        Raises:
            UsageError: Hardly any tables drawn from the prior look like ones from a bench.
        """
        for start in range(0, len(numbers), BATCH_SIZE):
            with jax.enable_x64(True):
                replications = self._replicate_batch(numbers[start : start + BATCH_SIZE])
            yield from replications

    def _replicate_batch(self, numbers: Sequence[int]) -> list[Replication]:
        start = time.perf_counter()
        waiting = [self._simulate(number) for number in numbers]
        fits = self.laboratory.fit_all(
            [simulated.posterior for simulated in waiting], [simulated.seed for simulated in waiting]
        )
        ranked = [
            self._rank_truths(simulated, fit) if len(fit.z) else {}
            for simulated, fit in zip(waiting, fits, strict=True)
        ]
        seconds = (time.perf_counter() - start) / len(numbers)
        return [
            Replication(simulated.number, simulated.redrawn, fit.reasons, ranks, seconds, fit.steps, fit.engine)
            for simulated, fit, ranks in zip(waiting, fits, ranked, strict=True)
        ]

    def _simulate(self, number: int) -> SimulatedTables:
        generator = np.random.default_rng([self.plan.seed, number])
        z, dataset, redrawn = self._draw_tables(generator)
        assumed = Dataset(self.plan.assumed.description, dataset.measurements, {})
        posterior = LogDensity(replace_data(self.assumed, self.disturb(assumed)))
        return SimulatedTables(number, z, posterior, redrawn, int(generator.integers(2**31)), generator.uniform())

    def _draw_truth(self, generator: np.random.Generator) -> np.ndarray:
        """Draw true values, where the priors are standard normals: from them, but for what is stated."""
        z = generator.standard_normal(self.stated.space.size)
        for stated in self.plan.truths:
            z[self.stated.space.index[stated.parameter.name]] = stated.draw_z(generator)
        return z

    def _draw_tables(self, generator: np.random.Generator) -> tuple[np.ndarray, Dataset, dict[str, int]]:
        """Draw truth and tables together until the tables, by themselves, could come from a bench."""
        redrawn: dict[str, int] = {}
        for _ in range(MAX_DRAWS):
            z = self._draw_truth(generator)
            words = generator.integers(2**32, size=2, dtype=np.uint32)
            tables, why = self._tables_or_reason(self._simulate_readings(z, words))
            if not why:
                return z, Dataset(self.plan.stated.description, Measurements(tables), {}), redrawn
            redrawn[why] = redrawn.get(why, 0) + 1
        commonest = max(redrawn, key=lambda reason: redrawn[reason])
        cause = "a prior far wider than what a cable can be: narrow it under [friction] or [prior] in cable.toml"
        if self.plan.truths:
            cause = "a true value that no cable on this bench can have: state others in the file of --truth"
        raise UsageError(
            f"none of {MAX_DRAWS} simulated data sets looks like one from a bench, mostly because {commonest}; the "
            "usual cause is "
            f"{cause}."
        )

    def _tables_or_reason(self, readings: Readings) -> tuple[tuple[Any, ...], str]:
        """Return tables with simulated readings, and why no bench would hand them in: empty if one might."""
        if any_slipped(readings):
            return (), "held readings would have slipped"
        stated, tables = self.plan.stated, list[Any]()
        try:
            for table in iterate_replaced_tables(stated.description, stated.measurements, readings):
                reason = self.why_implausible(stated, Dataset(stated.description, Measurements((table,)), {}))
                if reason:
                    return (), reason
                tables.append(table)
        except DatasetError:
            return (), "a recording has no strokes"
        return tuple(tables), ""

    def _rank_truths(self, simulated: SimulatedTables, fit: BatchFit) -> dict[str, RankedTruth]:
        return self._rank_parameters(simulated.z, fit.z) | self._rank_optimum(simulated.z, fit.z, simulated.tie)

    def _rank_parameters(self, z_true: np.ndarray, z: np.ndarray) -> dict[str, RankedTruth]:
        """Rank the parameters that both descriptions have and that are fitted."""
        stated, assumed = self.stated.space, self.assumed.space
        truth = dict(zip((p.name for p in stated.free), z_true, strict=True))
        if assumed != stated:
            values = stated.constrain(jnp.asarray(z_true))
            truth = {p.name: z_at(p.prior, float(values[p.name])) for p in assumed.free if p.name in values}
        return {
            name: rank_truth(float(value), z[:, assumed.index[name]])
            for name, value in truth.items()
            if name in assumed.index
        }

    def _rank_optimum(self, z_true: np.ndarray, z: np.ndarray, tie: float) -> dict[str, RankedTruth]:
        """Rank the optimal length and the efficiency there, for a cable with a route.

        An optimum at an end of the range has probability of its own there; a truth at the same end takes a place at random
        within it, which keeps its rank uniform.
        """
        if self.assumed.description.route is None:
            return {}
        truth, draws = self._optimum_of_truth(z_true[None]), self._optimum(z)
        names = (OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY)
        return {name: rank_truth(float(t[0]), d, tie) for name, t, d in zip(names, truth, draws, strict=True)}
