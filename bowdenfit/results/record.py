"""The record of a fit: data set, model, draws, and what follows from them directly."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

import jax
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.description.defaults import THIN
from bowdenfit.display import Display, Rows
from bowdenfit.errors import UsageError
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.diagnostics import Diagnostics, Trajectories
from bowdenfit.inference.draws import DrawFunction, derived_units, efficiency_at, for_each_draw, value_function
from bowdenfit.inference.interval import Interval
from bowdenfit.inference.least_squares import LeastSquares
from bowdenfit.inference.sampler_agreement import SamplerAgreement
from bowdenfit.models import Model, build_model
from bowdenfit.results.along_route import (
    Efficiencies,
    RouteDraws,
    compile_along_route,
    compute_along_route,
    draw_new_mounting,
    make_optimizer,
    summarize_optimum,
)
from bowdenfit.results.optimal_length import OptimalLength
from bowdenfit.results.prediction_angles import NO_ANGLES, choose_angles, predict_forces, split_lengths
from bowdenfit.words import few, shown

OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY = "optimal_length", "optimal_efficiency"
Answer = TypeVar("Answer")


@dataclass(frozen=True, repr=False)
class Draws(Display):
    """Draws of a fit; every array has the walkers (ordered by ensemble) first, then the draws of each.

    Args:
        z: In the coordinates of the sampler, with parameters last.
        values: Parameters and derived curve coefficients, in shown units.
        optimum: Optimal length and efficiency; empty without a route.
        log_likelihood: Log likelihood of every reading, by table, readings last.
        expected: Expected readings.
        replicated: Readings drawn anew.
        prior: Draws of the parameters from the prior, one row.
        diagnostics: Diagnostics of parameters and optimum.
        n_ensembles: Number of independent ensembles.
        steps: Steps of every walker; of NUTS, without warm-up.
        acceptance: Mean fraction of accepted proposals; of NUTS, mean acceptance along trajectories.
        sampler: "emcee", "importance" or "nuts", whose chains are ensembles of one walker each.
        trajectories: How the trajectories of NUTS went.
        agreement: Whether a second sampler agrees, where one was asked.
        units: Units of values and optimum by name, where a fit gives them.
        has_bench_errors: Whether they are moved by draws of the errors of the bench.
    """

    z: np.ndarray
    values: dict[str, np.ndarray]
    optimum: dict[str, np.ndarray]
    log_likelihood: dict[str, np.ndarray]
    expected: dict[str, np.ndarray]
    replicated: dict[str, np.ndarray]
    prior: dict[str, np.ndarray]
    diagnostics: dict[str, Diagnostics]
    n_ensembles: int
    steps: int
    acceptance: float
    sampler: str = "emcee"
    trajectories: Trajectories | None = None
    pareto_k: float | None = None
    agreement: SamplerAgreement | None = None
    units: dict[str, str] = field(default_factory=dict)
    has_bench_errors: bool = False

    @property
    def n_effective(self) -> float:
        """Smallest effective sample size (bulk) of all quantities."""
        return min((d.ess_bulk for d in self.diagnostics.values()), default=float(self.z[..., 0].size))

    @property
    def stored_steps(self) -> tuple[int, int]:
        """First and last step whose draws are stored, the others evenly between: of walkers the second half of the path."""
        return (self.steps // 2 + THIN if self.sampler == "emcee" else 1), self.steps

    @property
    def flat_z(self) -> np.ndarray:
        """All draws, one in a row."""
        return self.z.reshape(-1, self.z.shape[-1])

    def sentences(self) -> list[str]:
        """Return the number of draws, and their effective sample size."""
        worst = max((d.r_hat for d in self.diagnostics.values()), default=float("nan"))
        return [
            f"{self.z[..., 0].size} draws of {few(self.values, 4)} by {self.sampler}; smallest effective sample size "
            f"{self.n_effective:.0f}, largest R-hat {worst:.3f}."
        ]

    def _table(self) -> Rows:
        """Return a column for each quantity, and a row for each draw."""
        return {name: draws.ravel() for name, draws in (self.values | self.optimum).items()}, self.units


@dataclass(frozen=True, repr=False)
class Provenance(Display):
    """Seed, versions and times of a fit.

    Args:
        seed: Random seed.
        versions: Versions of bowdenfit, Python and the libraries that computed.
        stage_times: Seconds by stage.
        created: Date and time, UTC.
        start: Values that the search was told to begin at too, by parameter, in the units in which they are shown.
    """

    seed: int
    versions: dict[str, str]
    stage_times: dict[str, float] = field(default_factory=dict)
    created: str = ""
    start: dict[str, float] = field(default_factory=dict)

    def sentences(self) -> list[str]:
        """Return the seed, and what computed."""
        return [f"Seed {self.seed}; {', '.join(f'{name} {version}' for name, version in self.versions.items())}."]

    def _table(self) -> Rows:
        return [{"stage": stage, "time": seconds} for stage, seconds in self.stage_times.items()], {"time": "s"}


@dataclass(frozen=True)
class DrawPrograms:
    """Functions of many z (rows) compiled for sampling, kept so that no question compiles them again.

    Args:
        values: Named values in shown units.
        quantities: Program for the readings that z implies; see `compile_replicator`.
        along_route: See `compile_along_route`; None without a route.
        optimum: Optimal length and efficiency of each; None without a route.
    """

    values: DrawFunction
    quantities: DrawFunction
    along_route: DrawFunction | None
    optimum: DrawFunction | None

    def find_optimum(self, z: np.ndarray) -> dict[str, np.ndarray]:
        """Return optimal length and efficiency of many z, by name; empty without a route."""
        if self.optimum is None:
            return {}
        return dict(zip((OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY), self.optimum(z), strict=True))


@dataclass(frozen=True, repr=False, eq=False)
class Record(Display):
    """A finished fit of one data set; every question is a function of it.

    Args:
        dataset: Data set that was fitted.
        least_squares: Classical estimates.
        sampled: Draws, or None where only least squares was asked for.
        converged: Whether the sampler (or, without it, least squares) converged.
        reasons: Why not.
        provenance: Seed, versions, times.
        programs: Programs compiled for sampling; None for a fit that was read back, or made without MCMC.
    """

    dataset: Dataset
    least_squares: LeastSquares
    sampled: Draws | None
    converged: bool
    reasons: tuple[str, ...]
    provenance: Provenance
    programs: DrawPrograms | None = None

    @cached_property
    def model(self) -> Model:
        """The model that was fitted."""
        return build_model(self.dataset)

    @property
    def name(self) -> str:
        """Name of the cable."""
        return self.dataset.description.name

    def parameter_of_draws(self, name: str) -> Interval:
        """Return a parameter's value and interval by these draws, in the unit in which it is shown.

        Raises:
            UsageError: There is no such parameter, or no posterior.
        """
        values = self.draws().values
        if name not in values:
            raise UsageError(f"there is no parameter {name!r}; there are {', '.join(values)}.")
        return Interval.of(values[name])

    @cached_property
    def along_route(self) -> RouteDraws:
        """What every draw implies along the route.

        Raises:
            UsageError: The description has no route, or there is no posterior.
        """
        self._needs_route()
        return compute_along_route(self.model, along_route_program(self), self.draws().flat_z, self.mounting())

    def with_seed(self, seed: int | None) -> "Record":
        """Return the same fit with another seed of what is drawn beside its posterior; itself for None."""
        return self if seed is None else replace(self, provenance=replace(self.provenance, seed=seed))

    def mounting(self) -> np.ndarray:
        """Return the effect of one new mounting on the friction exponent of each draw [1]."""
        draws = self.draws()
        return draw_new_mounting(self.dataset.description, draws.values, len(draws.flat_z), self.provenance.seed)

    def efficiency_of_draws(self, lengths: float | Iterable[float] | None = None) -> Efficiencies:
        """Return the efficiency at values of the route variable by these draws; see `bowdenfit.Fit.efficiency`."""
        at = self._lengths(lengths)
        parts = split_lengths(at)
        outside = choose_angles(self.dataset, at, NO_ANGLES, self.provenance.seed).outside
        intervals = [Interval.of(draws) for part in parts for draws in self.efficiency_draws(part).T]
        return Efficiencies(intervals, self.dataset.description.route, at, outside)

    def efficiency_draws(self, lengths: float | Iterable[float] | None = None) -> np.ndarray:
        """Return the efficiency of every draw (rows) at values of the route variable (columns)."""
        at, z = self._lengths(lengths), self.draws().flat_z
        angles = choose_angles(self.dataset, at, NO_ANGLES, self.provenance.seed)
        with jax.enable_x64(True):
            if not angles.rows.is_own.any():
                return efficiency_at(self.model, z, at)
            force = self.model.cable.friction.conditions.reference_force
            (forces,) = predict_forces(self.model, z, angles, force, 1, (np.zeros(len(z)),))
        return forces / force

    def _lengths(self, lengths: float | Iterable[float] | None) -> np.ndarray:
        route = self.dataset.description.route
        stated = (route.choices if route else 0.0) if lengths is None else lengths
        try:
            at = np.atleast_1d(np.asarray(stated, dtype=float))
        except (TypeError, ValueError):
            at = np.array([np.nan])
        if not np.isfinite(at).all():
            raise UsageError(f"lengths = {shown(stated)} must be numbers in the unit of the route, such as [455, 470].")
        return at

    def optimal_length_of_draws(self) -> OptimalLength:
        """Return the best length, how certain it is by these draws, and what the choices cost.

        Raises:
            UsageError: The description has no route to vary, or there is no posterior.
        """
        self._needs_route()
        return self._optimal_length

    @cached_property
    def _optimal_length(self) -> OptimalLength:
        optimum, route = self.draws().optimum, self.dataset.description.route
        assert route is not None  # checked by the caller
        lengths, efficiencies = (optimum[name].ravel() for name in (OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY))
        friction = self.model.cable.friction
        force = friction.conditions.reference_force if friction.depends_on_load else None
        return summarize_optimum(route, lengths, efficiencies, self.along_route, force)

    @cached_property
    def posterior(self) -> Draws:
        """The draws with their units; `sampled` is None where there are none.

        Raises:
            UsageError: There are none.
        """
        if self.sampled is None:
            raise UsageError(
                "this fit has no posterior, because it was made without MCMC; fit again without --no-mcmc for intervals."
            )
        return replace(self.sampled, units=self._units)

    def draws(self) -> Draws:
        """Return the posterior; see `posterior`."""
        return self.posterior

    @property
    def _units(self) -> dict[str, str]:
        """Unit of every parameter, derived quantity and answer along the route."""
        route, units = self.dataset.description.route, {p.name: p.unit for p in self.model.space.parameters}
        units |= {name: unit for name, (unit, _) in derived_units(self.model).items()}
        return units | ({OPTIMAL_LENGTH: route.unit, OPTIMAL_EFFICIENCY: "1"} if route else {})

    def _needs_route(self) -> None:
        self.draws()
        if self.dataset.description.route is None:
            raise UsageError(
                "the description has no [route], so there is no length to choose; add [route] with variable, unit and "
                "range, and angles measured along it, to cable.toml."
            )


def cached_per_fit(question: Callable[[Record], Answer]) -> Callable[[Record], Answer]:
    """Decorate a function of a record so that it is computed once for each, and kept as long as the record."""
    answers: WeakKeyDictionary[Record, Answer] = WeakKeyDictionary()

    @wraps(question)
    def answer(fit: Record) -> Answer:
        if fit not in answers:
            answers[fit] = question(fit)
        return answers[fit]

    return answer


@cached_per_fit
def parameter_values(fit: Record) -> dict[str, np.ndarray]:
    """Return named values of all parameters [internal units] for every draw, or for least squares alone."""
    space = fit.model.space
    if fit.sampled is None:
        with jax.enable_x64(True):
            vector = compile_program(space.vector, jax.ShapeDtypeStruct((space.size,), float), run_once=True)
            values = np.asarray(vector(fit.least_squares.z))[None]
        free = {p.name: values[:, i] for i, p in enumerate(space.free)}
    else:
        free = {p.name: fit.sampled.values[p.name].ravel() / p.shown_scale for p in space.free}
    n = 1 if fit.sampled is None else len(fit.sampled.flat_z)
    return free | {p.name: np.full(n, p.fixed) for p in space.fixed}


def thinned_parameter_values(fit: Record, n: int) -> dict[str, np.ndarray]:
    """Return `parameter_values` for `n` evenly chosen draws, or `n` times for least squares."""
    return {name: draws[np.linspace(0, len(draws) - 1, n).astype(int)] for name, draws in parameter_values(fit).items()}


@cached_per_fit
def along_route_program(fit: Record) -> DrawFunction:
    """Return the compiled program of `compile_along_route`, from sampling if it is there."""
    return fit.programs.along_route if fit.programs and fit.programs.along_route else compile_along_route(fit.model)


@cached_per_fit
def values_program(fit: Record) -> DrawFunction:
    """Return the program from many z to named values in shown units, the same for a fit that samples and one read back."""
    if fit.programs:
        return fit.programs.values
    return for_each_draw(value_function(fit.model), fit.model.space.size, run_once=True)


@cached_per_fit
def optimum_program(fit: Record) -> DrawFunction:
    """Return the program from many z to optimal length and efficiency, the same for a fit that samples and one read back."""
    if fit.programs and fit.programs.optimum:
        return fit.programs.optimum
    return for_each_draw(make_optimizer(fit.model), fit.model.space.size)
