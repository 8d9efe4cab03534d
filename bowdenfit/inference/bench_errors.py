r"""What readings reveal of the errors of a bench, and how far the rest may move each parameter.

Errors e of the bench, in units of their standard uncertainties, are further parameters with independent priors of unit
variance. About a point of the posterior, standardized residuals are linear in both, r(z, e) = r + J δ + K e, so that e is
integrated out in closed form:

.. math:: \operatorname{Cov}(e) = (1 + K^\top (1 - H) K)^{-1}, \quad
          \operatorname{E}(e) = -\operatorname{Cov}(e) K^\top (1 - H) r, \quad H = J (1 + J^\top J)^{-1} J^\top

and a draw of the posterior without them moves by :math:`-(1 + J^\top J)^{-1} J^\top K e`. An error that looks like friction, as
wrap angles that are all too large, is not determined by any reading: its variance stays 1. One that shows, as a gain where both
strokes were read, is estimated, and moves the answer.

References:
    JCGM 101:2008, Supplement 1 to the GUM: propagation of distributions using a Monte Carlo method.
    Kennedy and O'Hagan, Bayesian calibration of computer models, Journal of the Royal Statistical Society B 63 (2001), 425.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import Problem, noise_scales
from bowdenfit.inference.solver import ROUGH
from bowdenfit.kinds.bench_error import ErrorSource, iterate_error_sources

_FREE = 1e-6  # weight of a prior that does not count
_ROUNDING = 1e-6  # of a standard deviation, below which an error does not move a reading
# Standard deviations of the estimate of an error within its limit, beyond which it contradicts that limit: so it is of one of
# six errors in one healthy fit in a hundred.
CONTRADICTION = 3.1


@dataclass(frozen=True)
class LearnedErrors:
    """Posterior of the errors of a bench, in units of their standard uncertainties, in linear approximation.

    Args:
        sources: Causes of error that move a reading; each has one column or more below.
        source: Number of the source of each column.
        mean: Posterior mean of each, (errors).
        covariance: Posterior covariance, (errors, errors).
        information: What the readings add to the unit prior information, (errors, errors).
        moves: Change of each z with each error, (free, errors).
        columns: Change of each residual with each error, (residuals, errors).
        inside: Change of each reading inside runs from its cell, in units of its noise, (readings, errors), by table.
        without_effect: Causes of error that move no reading, as wear where the cable was mounted once.
    """

    sources: tuple[ErrorSource, ...]
    source: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    information: np.ndarray
    moves: np.ndarray
    columns: np.ndarray
    inside: Mapping[str, np.ndarray]
    without_effect: tuple[ErrorSource, ...] = ()

    def mean_of(self, kinds: Collection[str]) -> Float[np.ndarray, " errors"]:
        """Return the posterior mean if there are only errors of some kinds, and of these those that keep their limits.

        Args:
            kinds: The kinds, as of `BenchError.kind`.
        """
        steps = [step for source in self.sources for step in source.steps]
        precision = np.eye(len(steps)) + self.information
        gradient, included = precision @ self.mean, np.array([step.kind in kinds for step in steps])
        while included.any():
            covariance = np.linalg.inv(precision[np.ix_(included, included)])
            mean = np.zeros(len(steps))
            mean[included] = covariance @ gradient[included]
            gained = np.sqrt(np.maximum(1 - np.diag(covariance), 0.0))  # standard deviation of the mean before the readings
            beyond = np.abs(mean[included]) > CONTRADICTION * gained
            if not beyond.any():
                return mean
            included[np.flatnonzero(included)[beyond]] = False
        return np.zeros(len(steps))

    def draw(self, count: int, seed: int) -> Float[np.ndarray, "draws errors"]:
        """Draw errors from their posterior: from rectangular priors (GUM 4.3.7), corrected by what the readings say.

        Args:
            count: Number of draws.
            seed: Random seed.
        """
        generator = np.random.default_rng([seed, 5])
        prior = np.empty((count, len(self.mean)))
        for k, number in enumerate(self.source):
            cells = self.sources[number].cells
            prior[:, k] = generator.uniform(-1, 1, (cells, count)).sum(axis=0) * np.sqrt(3 / cells)
        values, vectors = np.linalg.eigh(self.information)
        noise = generator.normal(size=prior.shape) * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
        return self.mean + (prior + noise) @ self.covariance


def learn_errors(posterior: LogDensity, z: np.ndarray) -> LearnedErrors | None:
    """Return what readings reveal of the errors of their bench; None where none is left to learn.

    Args:
        posterior: The posterior.
        z: A point in its middle, at whose noise scales residuals are weighed.
    """

    def residuals(z: Array, data: Any) -> tuple[Array, Array]:
        stacked = jnp.concatenate(list(posterior.residuals(z, data).values()))
        return stacked, stacked

    sources = _list_sources(posterior)
    if not sources:
        return None
    slow, shape = posterior.model.is_slow, jax.ShapeDtypeStruct(z.shape, float)
    program = compile_program(
        jax.jacfwd(residuals, has_aux=True), shape, posterior.data, run_once=not slow, run_often=slow
    )
    free = ~noise_scales(posterior)
    values = posterior.values(jnp.asarray(z), posterior.data)
    return _learn(posterior, sources, lambda data: program(z, data), values, free * 1.0, z)


def learn_at_minimum(problem: Problem, z: np.ndarray, pinned: np.ndarray) -> LearnedErrors | None:
    """Return what readings reveal of the errors of their bench about a minimum of least squares; None where none is left.

    Args:
        problem: The problem, whose data are those of its model.
        z: The minimum, noise scales included.
        pinned: Which parameters are pinned besides noise scales.
    """
    sources = _list_sources(problem.posterior)
    if not sources or problem.posterior.data_override is not None:
        return None

    def evaluate(data: Any) -> tuple[np.ndarray, np.ndarray]:
        solution = problem.objective(z, np.ones(len(z), dtype=bool), z, problem.weight, data, ROUGH)
        return solution["sensitivity"], np.concatenate(list(solution["residuals"].values()))

    counts = np.where(problem.noise | pinned, 0.0, np.maximum(problem.penalty, _FREE))
    values = problem.posterior.model.space.constrain(jnp.asarray(z))
    return _learn(problem.posterior, sources, evaluate, values, counts, np.where(problem.penalty > 0, z, 0.0))


def _list_sources(posterior: LogDensity) -> tuple[ErrorSource, ...]:
    """Return the errors of a bench whose measurements are there; none where they are not."""
    return tuple(iterate_error_sources(posterior.model.description)) if posterior.model.measurements.tables else ()


def _learn(
    posterior: LogDensity,
    sources: tuple[ErrorSource, ...],
    evaluate: Callable[[Any], tuple[Any, Any]],
    values: Mapping[str, Any],
    prior: np.ndarray,
    z: np.ndarray,
) -> LearnedErrors | None:
    """Return the posterior of the errors; None where none moves a reading.

    Args:
        posterior: The posterior.
        sources: Causes of error.
        evaluate: Returns the Jacobian and the residuals of data of all terms.
        values: Parameters by name [internal units].
        prior: Weight of the prior of each z; 0 for noise scales, which residuals do not determine.
        z: Residuals of these priors.
    """
    jacobian, residuals = (np.nan_to_num(np.asarray(part)) for part in evaluate(posterior.data))
    jacobian = jacobian * (prior > 0)
    inside = {term.name: _inside_runs(term, values) for term in posterior.model.terms}
    columns, of_readings, effective = list[np.ndarray](), list[dict[str, np.ndarray]](), list[ErrorSource]()
    for source in sources:
        for step, size in source.steps.items():
            terms = posterior.model.terms_with_error(step)
            changed = np.asarray(evaluate(tuple(term.data for term in terms))[1])
            columns.append(np.nan_to_num((changed - residuals) * size, posinf=0.0, neginf=0.0))
            of_readings.append({term.name: (_inside_runs(term, values) - inside[term.name]) * size for term in terms})
        steps = len(source.steps)
        moved = [part for k in range(-steps, 0) for part in (columns[k], *of_readings[k].values())]
        if max(np.abs(part).max(initial=0.0) for part in moved) > _ROUNDING:
            effective.append(source)
        else:
            del columns[-steps:], of_readings[-steps:]
    if not effective:
        return None
    numbers = [number for number, source in enumerate(effective) for _ in source.steps]
    errors = np.stack(columns, axis=1)
    readings = {name: np.stack([of_error[name] for of_error in of_readings], axis=1) for name in inside}
    with_priors = np.concatenate([jacobian, np.diag(np.where(prior > 0, prior, 1.0))])
    moves = -np.linalg.lstsq(with_priors, np.concatenate([errors, np.zeros((len(prior), len(numbers)))]), rcond=None)[0]
    remaining = errors + jacobian @ moves
    information, gradient = errors.T @ remaining, remaining.T @ residuals + moves.T @ (prior * z)
    for name, single in readings.items():  # parameters do not follow readings inside cells
        information, gradient = information + single.T @ single, gradient + single.T @ inside[name]
    information = (information + information.T) / 2
    of_direction, directions = np.linalg.eigh(information)  # below 0 by rounding alone, where readings say nothing
    covariance = (directions / (1 + np.maximum(of_direction, 0.0))) @ directions.T
    mean, ineffective = -covariance @ gradient, tuple(source for source in sources if source not in effective)
    return LearnedErrors(
        tuple(effective), np.array(numbers), mean, covariance, information, moves, errors, readings, ineffective
    )


def _inside_runs(term: Any, values: Mapping[str, Any]) -> np.ndarray:
    """Return the standardized deviation of each reading inside runs from its cell; empty where there are none."""
    inside = getattr(term, "inside", None)
    if inside is None:
        return np.zeros(0)
    return np.asarray(np.sqrt(inside.weight) * inside.apart / float(values[term.reading_noise]))
