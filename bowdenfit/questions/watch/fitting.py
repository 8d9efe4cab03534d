"""Fits of a table that grows: programs are compiled once for many numbers of mountings, and draws take tenths of a second.

The draws are those of the whole posterior, weighted or walked by the engines of a batch, each with its own checks; nothing is
taken over from the fit before. What the verdict needs besides, least squares and replicated readings, takes longer and is
worked out afterwards.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.dataset import Dataset
from bowdenfit.description import SamplerSettings
from bowdenfit.errors import ConvergenceError
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.batch.programs import BatchPrograms, BatchSettings
from bowdenfit.inference.batch.shaped_data import ScaledDensity, ShapedDataset, shape_dataset
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.draws import BATCH, compile_replicator, curves_at, imply_groups, run_in_batches, shown_values
from bowdenfit.inference.engines import installed_versions
from bowdenfit.inference.least_squares import LeastSquares, find_maximum_posterior, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.models import Model, build_model
from bowdenfit.results.along_route import make_optimizer_of_values, route_grid
from bowdenfit.results.record import DrawPrograms, Draws, Provenance, Record

SETTINGS = BatchSettings(  # standard deviations to a twentieth, as 400 effective draws give them
    SamplerSettings(n_ensembles=2, n_walkers=64, max_steps=20_000, target_ess=400, target_r_hat=1.03),
    target_sd_error=float("inf"),
    chunk=1,
)
_CHAINS = 4  # into which draws that are independent are divided, since answers look at several
_SHUFFLE = 3  # stream of random numbers that shuffles draws
_NO_LEAST_SQUARES = LeastSquares({}, {}, {}, np.nan, np.nan, np.zeros(0), False, "not worked out yet")


@dataclass(frozen=True)
class ShapePrograms:
    """What draws imply, for all data sets of one shape; each takes a block of z (rows) and data.

    Args:
        values: Named values in shown units.
        optimum: Best length and efficiency there; None without a route.
        along_route: Curves along the route, and efficiencies at the choices; None without a route.
    """

    values: Callable[..., Any]
    optimum: Callable[..., Any] | None
    along_route: Callable[..., Any] | None


@dataclass(frozen=True)
class GrowingFit:
    """Fits of one data set as it grows, with programs that are kept from one fit to the next of the same shape.

    Args:
        seed: Random seed.
        samplers: What draws, by the last shape.
        programs: What draws imply, by the last shape and what of the measurements enters it.
        completed: Shapes of the data that were completed last; empty before.
    """

    seed: int
    samplers: dict[str, BatchPrograms] = field(default_factory=dict)
    programs: dict[str, ShapePrograms] = field(default_factory=dict)
    completed: list[str] = field(default_factory=list)

    def draw(self, dataset: Dataset) -> Record:
        """Return the draws of a data set as a fit without least squares, which answers what follows from parameters.

        Raises:
            BowdenfitError: The description does not fit the measurements, or nothing can be computed.
        """
        with jax.enable_x64(True):
            shaped, model = shape_dataset(dataset, spare=True), build_model(dataset)
            if shaped.key not in self.samplers:
                self.samplers.clear()
                self.samplers[shaped.key] = BatchPrograms(shaped.posterior, SETTINGS)
            sampler = self.samplers[shaped.key]
            programs, data = self._programs(shaped, model), shaped.data
            (fit,) = fit_batch(sampler.posterior, [data], [self.seed], programs=sampler)
            if not len(fit.z):
                raise ConvergenceError(fit.reasons[0])
            order = np.random.default_rng([self.seed, _SHUFFLE]).permutation(len(fit.z) // _CHAINS * _CHAINS)
            z, draw_programs = fit.z[order], _bind(programs, data)
            optimum = {name: _chains(part) for name, part in draw_programs.find_optimum(z).items()}
            values = {name: _chains(part) for name, part in draw_programs.values(z).items()}
        draws = Draws(_chains(z), values, optimum, {}, {}, {}, {}, {}, _CHAINS, fit.steps, np.nan)
        provenance = Provenance(self.seed, dict(installed_versions()), {}, datetime.now(UTC).isoformat(timespec="seconds"))
        return Record(dataset, _NO_LEAST_SQUARES, draws, not fit.reasons, fit.reasons, provenance, draw_programs)

    def _programs(self, shaped: ShapedDataset, model: Model) -> ShapePrograms:
        """Return what draws imply of data sets of this shape, compiled where it is new."""
        friction = model.cable.friction
        conditions = friction.conditions if friction.options else ""  # capstan friction is the same at any load and speed
        key = f"{shaped.key} {dict(model.cable.nominal)} {conditions}"
        if key not in self.programs:
            self.programs.clear()
            self.programs[key] = _compile_shape(shaped.posterior, model)
        return self.programs[key]

    def complete(self, fit: Record) -> Record:
        """Return a fit of `draw` with least squares and replicated readings, which the verdict looks at."""
        with jax.enable_x64(True):
            density = LogDensity(fit.model)
            objective = make_objective(density)
            squares = fit_least_squares(density, objective, find_maximum_posterior(density, objective).z)
            implied = compile_replicator(density, self.seed)
            draws = replace(fit.draws(), **imply_groups(fit.model, fit.draws().z, implied, self.seed), units={})
            programs = fit.programs and replace(fit.programs, quantities=implied)
        return replace(fit, least_squares=squares, sampled=draws, programs=programs)

    def release_programs(self, fit: Record) -> None:
        """Release what JAX keeps of the programs of `complete` once data of another shape were completed.

        A new mounting needs each of them for another shape, and JAX would keep 6 to 8 MiB of the earlier ones for ever
        (`scripts/watch_bench.py --memory 200`). Whatever else the process runs by `jax.jit` is compiled again at its next call.

        Args:
            fit: The fit that was completed last.
        """
        shapes = str([jax.tree.map(np.shape, term.data) for term in fit.model.terms])
        if [shapes] != self.completed:
            self.completed[:] = [shapes]
            jax.clear_caches()


def _chains(rows: np.ndarray) -> np.ndarray:
    return rows.reshape(_CHAINS, -1, *rows.shape[1:])


def _bind(programs: ShapePrograms, data: Any) -> DrawPrograms:
    """Return the programs of a shape for the data of one data set."""

    def values(z: np.ndarray) -> Any:
        return run_in_batches(lambda rows: programs.values(rows, data), BATCH, z)

    def along_route(z_and_mounting: np.ndarray) -> Any:
        assert programs.along_route is not None  # there is a route
        program = programs.along_route
        return run_in_batches(lambda rows: program(rows, data), BATCH, z_and_mounting[:, :-1])

    def optimum(z: np.ndarray) -> Any:
        assert programs.optimum is not None  # there is a route
        program = programs.optimum
        return run_in_batches(lambda rows: program(rows, data), BATCH, z)

    has_route = programs.along_route is not None
    of_values = lambda z: {"values": values(z)}  # noqa: E731
    return DrawPrograms(values, of_values, along_route if has_route else None, optimum if has_route else None)


def _compile_shape(posterior: ScaledDensity, model: Model) -> ShapePrograms:
    """Compile the programs that serve all data sets of one shape.

    Args:
        posterior: The posterior, whose data hold the scales of its priors.
        model: The model with its own priors and conditions.
    """
    z = jax.ShapeDtypeStruct((BATCH, model.space.size), jnp.float64)

    def compile_of_values(function: Callable[[Mapping[str, Array]], Any]) -> Callable[..., Any]:
        over_rows = jax.vmap(lambda z, data: function(posterior.values(z, data)), (0, None))
        return compile_program(over_rows, z, posterior.data, run_once=True)

    values = compile_of_values(lambda values: shown_values(model, values))
    if (route := model.description.route) is None:
        return ShapePrograms(values, None, None)
    grid, choices = route_grid(model), jnp.asarray(route.choices, dtype=float)

    def along_route(values: Mapping[str, Array]) -> dict[str, Any]:
        at_choices = {"choices": model.cable.efficiency_at(values, choices)} if len(choices) else {}
        return {"curves": curves_at(model, values, grid), **at_choices}

    return ShapePrograms(values, compile_of_values(make_optimizer_of_values(model)), compile_of_values(along_route))
