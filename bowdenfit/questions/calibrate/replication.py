"""One replication: truth from the prior, tables simulated with it, a fit, and the rank of the truth among the draws."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.errors import ConvergenceError, DatasetError, UsageError
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.drawn_readings import drawn_readings, slipped
from bowdenfit.model import Model, build_model
from bowdenfit.questions.calibrate.acceptable_tables import refusal
from bowdenfit.questions.calibrate.refit import Laboratory, with_parameters_of
from bowdenfit.questions.simulate.simulation import with_readings
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH

MOST_DRAWN = 5000  # tables, before a replication is given up


@dataclass(frozen=True)
class Plan:
    """What is replicated.

    Args:
        stated: The data set whose description and design are replicated; its readings give way to simulated ones.
        assumed: The data set with the description that is fitted; the same for a calibration proper.
        seed: Seed; replication i is the same whatever else is run.
    """

    stated: Dataset
    assumed: Dataset
    seed: int


@dataclass(frozen=True)
class RankedTruth:
    """Truth and posterior of one quantity; of a parameter in z, where its prior is a standard normal.

    Args:
        truth: What the readings were simulated with.
        mean: LogDensity mean.
        sd: LogDensity standard deviation.
        rank: Share of the posterior below the truth; uniform between 0 and 1 if all is right.
    """

    truth: float
    mean: float
    sd: float
    rank: float


@dataclass(frozen=True)
class Replication:
    """What came of one replication.

    Args:
        number: Its number.
        redrawn: Why tables were drawn again, with how many were.
        reasons: Why its draws should not be trusted; empty if they may.
        ranked: By quantity; empty where the fit failed.
        seconds: What it took.
        steps: Steps of each walker.
    """

    number: int
    redrawn: dict[str, int]
    reasons: tuple[str, ...]
    ranked: dict[str, RankedTruth]
    seconds: float
    steps: int = 0


@dataclass(frozen=True)
class Workbench:
    """Runs replications of one plan in this process.

    Args:
        plan: What is replicated.
        laboratory: What fits; may be shared.
        disturb: What is done to simulated tables before they are fitted, for calibrations that must fail.
        refusal: Why simulated tables are not to be had from a bench, in a word; empty if they may be.
    """

    plan: Plan
    laboratory: Laboratory = field(default_factory=Laboratory)
    disturb: Callable[[Dataset], Dataset] = lambda dataset: dataset
    refusal: Callable[[Dataset, Dataset], str] = refusal

    @cached_property
    def stated(self) -> Model:
        """The model that readings are simulated with."""
        return build_model(self.plan.stated)

    @cached_property
    def assumed(self) -> Model:
        """The model that is fitted."""
        return self.stated if self.plan.assumed is self.plan.stated else build_model(self.plan.assumed)

    @cached_property
    def _readings(self) -> Callable[..., Any]:
        model, tables = self.stated, self.plan.stated.measurements

        def readings(z: jax.Array, words: jax.Array) -> Any:
            values = model.space.constrain(z)
            return drawn_readings(model.cable, tables, values, jax.random.wrap_key_data(words))

        words = jax.ShapeDtypeStruct((2,), jnp.uint32)
        return compile_program(readings, jax.ShapeDtypeStruct((model.space.size,), jnp.float64), words)

    @cached_property
    def _optimum_of_truth(self) -> Callable[..., Any]:
        return self.laboratory.programs_for(LogDensity(self.stated)).optimum

    def replication(self, number: int) -> Replication:
        """Replication `number`.

        Raises:
            UsageError: Hardly any tables drawn from the prior look like ones from a bench.
        """
        begin = time.perf_counter()
        generator = np.random.default_rng([self.plan.seed, number])
        z_true, dataset, redrawn = self._tables(generator)
        seed = int(generator.integers(2**31))
        assumed = Dataset(self.plan.assumed.description, dataset.measurements, {})
        posterior = LogDensity(with_parameters_of(self.assumed, self.disturb(assumed)))
        try:
            chain = self.laboratory.chain(posterior, seed)
        except ConvergenceError as error:
            return Replication(number, redrawn, (str(error),), {}, time.perf_counter() - begin)
        z = chain.z.reshape(-1, posterior.model.space.size)
        ranked = self._ranked_parameters(z_true, z) | self._ranked_optimum(posterior, z_true, z, generator.uniform())
        return Replication(number, redrawn, chain.reasons, ranked, time.perf_counter() - begin, chain.steps)

    def _tables(self, generator: np.random.Generator) -> tuple[np.ndarray, Dataset, dict[str, int]]:
        """Truth and tables: drawn together until the tables, by themselves, could come from a bench."""
        redrawn: dict[str, int] = {}
        for _ in range(MOST_DRAWN):
            z = generator.standard_normal(self.stated.space.size)
            words = generator.integers(2**32, size=2, dtype=np.uint32)
            drawn = self._readings(z, words)
            try:
                dataset = with_readings(self.plan.stated, drawn)
            except DatasetError:
                why = "a recording has no strokes"
            else:
                why = "held readings would have slipped" if slipped(drawn) else self.refusal(self.plan.stated, dataset)
                if not why:
                    return z, dataset, redrawn
            redrawn[why] = redrawn.get(why, 0) + 1
        most = max(redrawn, key=lambda why: redrawn[why])
        raise UsageError(
            f"none of {MOST_DRAWN} data sets drawn from the priors looks like one from a bench, mostly because {most}; the "
            "usual cause is a prior far wider than what a cable can be: narrow it under [friction] or [prior] in cable.toml."
        )

    def _ranked_parameters(self, z_true: np.ndarray, z: np.ndarray) -> dict[str, RankedTruth]:
        """Parameters that both descriptions have and that are fitted."""
        stated, assumed = self.stated.space, self.assumed.space
        truth = dict(zip((p.name for p in stated.free), z_true, strict=True))
        if assumed != stated:
            values = stated.constrain(jnp.asarray(z_true))
            truth = {
                p.name: float(p.prior.unconstrain(jnp.asarray(values[p.name])))
                for p in assumed.free
                if p.name in values
            }
        return {
            name: rank_truth(float(value), z[:, assumed.index[name]])
            for name, value in truth.items()
            if name in assumed.index
        }

    def _ranked_optimum(
        self, posterior: LogDensity, z_true: np.ndarray, z: np.ndarray, tie: float
    ) -> dict[str, RankedTruth]:
        """Optimal length and the efficiency there, for a cable with a route.

        An optimum at an end of the range has probability of its own there; a truth at the same end takes a place at random
        within it, which keeps its rank uniform.
        """
        if posterior.model.description.route is None:
            return {}
        truth = self._optimum_of_truth(z_true[None])
        draws = self.laboratory.programs_for(posterior).optimum(z)
        names = (OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY)
        return {name: rank_truth(float(t[0]), d, tie) for name, t, d in zip(names, truth, draws, strict=True)}


def rank_truth(truth: float, draws: np.ndarray, tie: float = 0.0) -> RankedTruth:
    """Where the truth is among the draws; of draws equal to it the share `tie` counts as below."""
    rank = float(np.mean(draws < truth) + tie * np.mean(draws == truth))
    return RankedTruth(truth, float(np.mean(draws)), float(np.std(draws)), rank)
