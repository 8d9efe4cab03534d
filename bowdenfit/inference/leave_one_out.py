"""Leave-one-out cross-validation: importance sampling, where that fails moment matching, and then a fit without the reading."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.description import SamplerSettings
from bowdenfit.description.defaults import WALKERS_PER_PARAMETER
from bowdenfit.inference import importance
from bowdenfit.inference.chain import Chain, SamplingRequest
from bowdenfit.inference.comparison import LooMethod, LooPrediction, psis_loo
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.coordinates import maps_without_ridge
from bowdenfit.inference.diagnostics import Diagnostics, diagnose_all
from bowdenfit.inference.draws import run_in_batches
from bowdenfit.inference.importance import Densities, compile_densities
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.psis import match_moments, reliable_k, smooth_weights
from bowdenfit.inference.walkers import WalkerPrograms, compile_density_walkers
from bowdenfit.kinds.run_parts import RunParts

# A refit computes one number to a few hundredths, so it needs fewer walkers than a fit.
REFIT = SamplerSettings(n_ensembles=4, n_walkers=64, max_steps=4000, target_r_hat=1.02, target_ess=400)
_RATIO = "likelihood"
_ROWS = 128  # draws that a compiled program takes at a time
_LARGEST_ERROR = 0.3  # Monte Carlo error of an elpd beyond which it is called rough; a judgement


@dataclass(frozen=True)
class LooDensity:
    """Posterior density from which any one reading can be left out; compiled once for all readings.

    Args:
        posterior: The posterior.
        settings: Sampler settings of the fits without a reading.
        parts: Parts of runs that take the place of a term's readings, by name of the term.
    """

    posterior: LogDensity
    settings: SamplerSettings = REFIT
    parts: Mapping[str, RunParts] = field(default_factory=dict)

    @cached_property
    def names(self) -> tuple[tuple[str, str], ...]:
        """Table and label of every reading."""
        terms = self.posterior.model.terms
        return tuple((t.name, label) for t in terms for label in self.parts.get(t.name, t).labels)

    def _reading_likelihoods(
        self, z: Float[Array, " free"], data: Any, without: Any
    ) -> tuple[Float[Array, ""], Float[Array, " readings"]]:
        """Return the log likelihood of all data, and of each reading given all others of its mounting."""
        values, by_term = self.posterior.model.space.constrain(z), self.posterior.log_likelihoods(z, data)
        readings = []
        for term in self.posterior.model.terms:
            whole = by_term[term.name]
            if term.name in self.parts:
                log_likelihood = partial(term.log_likelihood, values)
                without_part = jax.vmap(log_likelihood)(
                    without[term.name]
                )  # in all runs, of which only that of the part differs
                run = self.parts[term.name].run
                whole = whole[run] - without_part[jnp.arange(len(run)), run]
            readings.append(whole)
        return sum((jnp.sum(part) for part in by_term.values()), jnp.zeros(())), jnp.concatenate(readings)

    @property
    def refits(self) -> SamplerSettings:
        """Sampler settings with more than twice as many walkers as parameters."""
        size = self.posterior.model.space.size
        walkers = max(self.settings.walkers(size), WALKERS_PER_PARAMETER * size)
        return self.settings.model_copy(update={"n_walkers": walkers})

    def _density(
        self, z: Float[Array, " free"], arguments: tuple[Any, Any, Float[Array, " readings"]]
    ) -> tuple[Float[Array, ""], Float[Array, " readings"]]:
        """Return the log density without the readings that are left out, and the log likelihood of every reading."""
        data, without, counts = arguments
        everything, readings = self._reading_likelihoods(z, data, without)
        total = everything - jnp.sum(jnp.where(counts > 0, 0.0, readings)) - 0.5 * jnp.sum(z**2)
        return jnp.where(jnp.isnan(total), -jnp.inf, total), readings

    @cached_property
    def _program(self) -> Callable[..., Any]:
        model = self.posterior.model
        shape, slow = jax.ShapeDtypeStruct((_ROWS, model.space.size), jnp.float64), model.is_slow
        return compile_program(jax.vmap(self._density, (0, None)), shape, self.data_without(None), run_often=slow)

    @cached_property
    def programs(self) -> WalkerPrograms | Densities:
        """Compiled walkers of fits without a reading, or densities for importance sampling."""
        space, data = self.posterior.model.space, self.data_without(None)

        def log_density(z: Array, data: Any) -> Array:
            return self._density(z, data)[0]

        if self.posterior.model.is_slow:
            return compile_densities(log_density, data, space.size)
        return compile_density_walkers(log_density, data, space.size, self.refits, maps_without_ridge(space))

    def data_without(self, reading: int | None) -> tuple[Any, Any, np.ndarray]:
        """Return data of the density without one reading, or with all."""
        counts = np.array([float(i != reading) for i in range(len(self.names))])
        return self.posterior.data, {name: parts.data for name, parts in self.parts.items()}, counts

    def evaluate(self, z: np.ndarray, without: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return the log posterior density, up to a constant, and log likelihoods of all readings, at any number of z (rows).

        Args:
            z: Points, one a row.
            without: Position of a reading that the density leaves out; none if omitted.
        """
        arguments = self.data_without(without)
        density, readings = run_in_batches(lambda part: self._program(part, arguments), _ROWS, z)
        return density, readings


@dataclass(frozen=True)
class LooRefits:
    """Draws of the posterior with all readings, and how to predict one reading without it.

    Args:
        density: Density from which readings can be left out.
        z: The draws, one a row.
        log_likelihood: Log likelihood of every reading at every draw, (draw, reading).
        share: Effective draws per draw.
        seed: Seed of the refits.
    """

    density: LooDensity
    z: np.ndarray
    log_likelihood: np.ndarray
    share: float
    seed: int

    def predict_without(self, reading: int, limit: float) -> tuple[float, float, LooMethod]:
        """Return the elpd of a reading whose importance weights fail, its Monte Carlo error, and the method used.

        Args:
            reading: Its position.
            limit: Pareto k that is good enough.
        """

        def evaluate(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            density, log_likelihood = self.density.evaluate(at)
            return density, log_likelihood[:, reading]

        elpd, k, error = match_moments(self.z, evaluate, self.share)
        if k <= limit:
            return elpd, error, "moment matching"
        elpd, error, converged = self.refit_without(reading)
        return elpd, error, "refit" if converged else "rough"

    def refit_without(self, reading: int) -> tuple[float, float, bool]:
        """Return the elpd of a reading by a fit without it, its Monte Carlo error, and whether that fit converged."""
        top = float(np.max(self.log_likelihood[:, reading]))

        def likelihood(z: np.ndarray) -> dict[str, np.ndarray]:
            return {_RATIO: np.exp(self.density.evaluate(z)[1][:, reading] - top)}

        chain = self.chain_without(reading, likelihood)
        mean = float(chain.quantities[_RATIO].mean())
        error = chain.diagnostics[_RATIO].mcse_mean / mean if mean > 0 else float("nan")
        return top + float(np.log(mean)) if mean > 0 else -np.inf, error, not chain.reasons and error < _LARGEST_ERROR

    def chain_without(
        self, reading: int, quantities: Callable[[np.ndarray], Mapping[str, np.ndarray]] = lambda _: {}
    ) -> Chain:
        """Return draws of a fit without one reading.

        Args:
            reading: Its position.
            quantities: Derived quantities at many z, which must converge too.
        """
        density = self.density
        weights = np.exp(smooth_weights(-self.log_likelihood[:, reading], self.share)[0])
        start = MaximumPosterior(weights @ self.z, np.atleast_2d(np.cov(self.z.T)))
        own_seed = int(np.random.SeedSequence([self.seed, reading]).generate_state(1)[0])
        request = SamplingRequest(
            density.posterior, start, density.refits, own_seed, quantities, diagnose=_diagnose_without_drift
        )
        data, programs = density.data_without(reading), density.programs
        if isinstance(programs, Densities):
            return importance.sample(request, replace(programs, data=data))
        from bowdenfit.inference import ensemble  # here, because emcee takes half a second to load

        return ensemble.sample(request, programs, data)


def leave_one_out(
    density: LooDensity,
    z: np.ndarray,
    log_likelihood: Mapping[str, np.ndarray],
    n_effective: float,
    seed: int,
    wanted: Sequence[int] | None = None,
    report: Callable[[str], None] = lambda _: None,
) -> LooPrediction:
    """Compute leave-one-out; readings whose importance weights cannot be trusted are treated one by one.

    Where Pareto k exceeds its limit, moments are matched; where that does not bring it down, the model is fitted again without
    the reading. If that fit does not converge, the result is called rough.

    Args:
        density: Density from which readings can be left out.
        z: Draws of the posterior, (chain, draw, parameter).
        log_likelihood: Log likelihood of every reading by table, (chain, draw, reading).
        n_effective: Effective number of the draws.
        seed: Seed of the refits.
        wanted: Positions of the readings in question among `density.names`; all if omitted.
        report: Called with a sentence before each reading that takes longer.
    """
    if density.parts:
        by_reading = density.evaluate(z.reshape(-1, z.shape[-1]))[1].reshape(*z.shape[:2], -1)
    else:
        by_reading = np.concatenate([log_likelihood[term.name] for term in density.posterior.model.terms], axis=-1)
    chosen = list(range(by_reading.shape[-1])) if wanted is None else list(wanted)
    flat, limit = z.reshape(-1, z.shape[-1]), reliable_k(z.shape[0] * z.shape[1])
    refits = LooRefits(density, flat, by_reading.reshape(len(flat), -1), min(n_effective / len(flat), 1.0), seed)
    quick = psis_loo({"": by_reading[..., chosen]}, n_effective)
    elpd, error = quick.elpd.copy(), quick.error.copy()
    how: list[LooMethod] = ["importance sampling"] * len(chosen)
    for position in np.flatnonzero(~(quick.pareto_k <= limit)):
        report(f"leaving out {' '.join(density.names[chosen[position]])}")
        elpd[position], error[position], how[position] = refits.predict_without(chosen[position], limit)
    return LooPrediction(elpd, quick.pareto_k, error, tuple(density.names[i] for i in chosen), tuple(how))


def _diagnose_without_drift(draws: Mapping[str, np.ndarray], n_ensembles: int) -> dict[str, Diagnostics]:
    """Return diagnostics without drift, which cannot be measured with the few effective draws of a refit."""
    return {name: replace(diagnostics, drift=0.0) for name, diagnostics in diagnose_all(draws, n_ensembles).items()}
