"""Sampling a population and its cables together with NUTS, and one cable by itself by Gibbs sampling.

`draw_unpooled` uses only the inspections of one cable. Its log coefficients when new have the prior of its single fits, and its
wear the prior of the mean wear of a population. Where its inspections say less about its wear than that prior, its wear comes
from the population, and so do coefficients that it does not have. Effects of lubrication and temperature are those of the other
cables.

Errors of an inspection follow a multivariate t distribution: a normal whose precision is multiplied by a gamma variable. Given
these variables the cable is normal, and given the cable they are independent. Each draw of the population has a chain of its
own, so no thinning is needed.

References:
    Geweke 1993, "Bayesian treatment of the independent Student-t linear model" (Journal of Applied Econometrics 8).
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from bowdenfit.addons.fleet.population.likelihoods import JointReadings, without_cables
from bowdenfit.addons.fleet.population.model import WEAR, Inspections, PopulationDensity, whitening_roots
from bowdenfit.description import SamplerSettings
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.diagnostics import describe_convergence_shortfalls, diagnose
from bowdenfit.inference.nuts import BLOCK, WARM_UP, compile_block, next_block_state
from bowdenfit.words import percent

_SETTINGS = SamplerSettings(n_chains=4, target_acceptance=0.8, target_ess=400, target_r_hat=1.02)
# With fewer cables hardly anything is known of their spread, and NUTS needs this target acceptance.
_FEW_CABLES, _CAREFUL_ACCEPTANCE = 5, 0.99
_MOST_DENSE = 60  # largest number of parameters whose covariance 200 draws of warm-up can estimate
_FIRST, _MORE, _MOST = 20, 10, 100  # blocks after warm-up at the first convergence check, until the next, and at most
_AT_ONCE = _SETTINGS.n_chains * BLOCK  # draws whose values are computed together
_STEP = 1e-4  # of numerical derivatives
_DISPERSED = 5.0  # spread of the starts of the population, over that of cables
_UNCOMPUTABLE = 1e100  # minus the log density where it cannot be computed
_MOST_DIVERGENT = 0.001  # share of trajectories that may diverge
_SWEEPS = 60  # of the Gibbs sampler


@dataclass(frozen=True)
class PopulationDraws:
    """Draws of a population with its cables, of equal weight.

    Args:
        mean, spread: Mean and spread of log coefficients of new cables and of wear, (draw, parameter).
        effects: Estimated effects of lubrication and of a degree, (draw, effect).
        cables: Log coefficients of each cable when new, and its wear, (draw, cable, number).
        reasons: Why the draws should not be trusted; empty if they can be.
        n_effective: Effective sample size of the population's worst parameter.
    """

    mean: np.ndarray
    spread: np.ndarray
    effects: np.ndarray
    cables: np.ndarray
    reasons: tuple[str, ...]
    n_effective: float


def draw_population(
    inspected: Inspections,
    seed: int,
    without: Collection[int] = (),
    coefficient_names: Sequence[str] = (),
    readings: tuple[JointReadings, ...] = (),
) -> PopulationDraws:
    """Sample a population and its cables by NUTS.

    Args:
        inspected: The inspections.
        seed: Random seed.
        without: Numbers of cables whose inspections are left out.
        coefficient_names: Names of the coefficients, for messages.
        readings: Inspections whose readings themselves enter, in place of their summaries.
    """
    wears = inspected.cycles is not None
    density = PopulationDensity(inspected.coefficients, wears, tuple(inspected.effects), inspected.cables, readings)
    about = _locate_population(replace(density, readings=()), _blank_cables(inspected.data_with(()), without))
    data = _blank_cables(inspected.data_with(readings), without) | {"about": about}
    program, values_of = _compile(density, *_tree_and_shapes(data))
    generator = np.random.default_rng([seed, 5])
    start = 0.3 * generator.standard_normal((_SETTINGS.n_chains, density.size))
    start[:, : len(density.names)] *= _DISPERSED
    blocks: list[dict[str, np.ndarray]] = []
    target = WARM_UP + _FIRST
    while True:
        while len(blocks) < target:
            z, tuning, mass = next_block_state(blocks, start, _first_mass(density))
            adapting = np.bool_(len(blocks) < WARM_UP)
            done = program(np.uint32(seed), np.uint32(len(blocks)), z, tuning, adapting, mass, data)
            blocks.append({name: np.asarray(value) for name, value in done.items()})
        z = np.concatenate([block["z"] for block in blocks[WARM_UP:]]).transpose(1, 0, 2)
        divergent = np.mean([block["diverging"] for block in blocks[WARM_UP:]])
        population = about[0] + z[:, :, : len(density.names)] @ about[1].T
        reasons, n_effective = _describe_shortfalls(
            population, density.describe_parameters(coefficient_names), float(divergent)
        )
        if not reasons or target >= WARM_UP + _MOST:
            break
        target += _MORE
    parts = z.reshape(-1, _AT_ONCE, density.size)
    every = zip(*(values_of(part, data) for part in parts), strict=True)
    mean, spread, effects, cables = (np.concatenate([np.asarray(part) for part in columns]) for columns in every)
    return PopulationDraws(mean, spread, effects[:, :-1], cables, reasons, n_effective)


def _first_mass(density: PopulationDensity) -> np.ndarray:
    """Return the first inverse mass matrix; only its diagonal where cables are many.

    With few cables, wear, lubrication and temperature are distinguished by hardly anything but their priors: their sum is known
    well, and each of them badly.
    """
    dense = density.cables < _FEW_CABLES and density.size <= _MOST_DENSE
    return np.eye(density.size) if dense else np.ones(density.size)


def _blank_cables(data: dict[str, Any], cables: Collection[int]) -> dict[str, Any]:
    """Return the data without those of some cables."""
    blanked = dict(data)
    for name in ("root", "precision", "toward", "by_effect") if cables else ():
        blanked[name] = data[name].copy()
        blanked[name][list(cables)] = 0.0
    blanked["readings"] = tuple(without_cables(stacked, list(cables)) for stacked in data["readings"])
    return blanked


def _describe_shortfalls(z: np.ndarray, names: tuple[str, ...], divergent: float) -> tuple[tuple[str, ...], float]:
    """Describe why the draws should not be trusted; return also the smallest effective sample size."""
    diagnostics = {name: diagnose(np.ascontiguousarray(z[:, :, i]), len(z)) for i, name in enumerate(names)}
    reasons = describe_convergence_shortfalls(diagnostics, _SETTINGS.target_r_hat, _SETTINGS.target_ess)
    if divergent > _MOST_DIVERGENT:
        reasons = (*reasons, f"{percent(divergent)} of the trajectories diverged")
    return reasons, min(min(d.ess_bulk, d.ess_tail) for d in diagnostics.values())


def _locate_population(density: PopulationDensity, data: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return the population's mode in z and a root of its covariance, the units in which it is sampled.

    Effects of lubrication and temperature are strongly correlated with wear and the mean of all cables, and known a hundred
    times better than their priors say. Coordinates of cables at 0 are their most likely values, so that the density there is
    that of the population alone, as far as single fits are normal.
    """
    size, slopes_of = len(density.names), _compile_gradient(density, *_tree_and_shapes(data))

    def negative_density(inner: np.ndarray) -> tuple[float, np.ndarray]:
        value, slopes = slopes_of(np.append(inner, np.zeros(density.size - size)), data)
        negated = -float(value), -np.asarray(slopes)[:size]
        return (
            negated if np.isfinite(np.append(*negated)).all() else (_UNCOMPUTABLE, np.zeros(size))
        )  # a spread that is none

    center = minimize(negative_density, np.zeros(size), jac=True, method="BFGS").x
    steps = _STEP * np.eye(size)
    slopes = [negative_density(center + step)[1] - negative_density(center - step)[1] for step in steps]
    precision = np.array(slopes) / (2 * _STEP)
    sizes, ways = np.linalg.eigh((precision + precision.T) / 2)
    return center, ways / np.sqrt(np.maximum(sizes, 1.0))  # the prior alone has precision 1


def _to_z(units: Any, density: PopulationDensity, data: dict[str, Any]) -> Any:
    """Return z of a point in units of the population."""
    (center, root), size = data["about"], len(density.names)
    return jnp.concatenate([center + root @ units[:size], units[size:]])


def _tree_and_shapes(data: dict[str, Any]) -> tuple[Any, tuple[tuple[tuple[int, ...], Any], ...]]:
    """Return the tree of data, and shapes and types of its leaves."""
    leaves, tree = jax.tree.flatten(data)
    return tree, tuple((np.shape(leaf), np.asarray(leaf).dtype) for leaf in leaves)


def _shape_tree(tree: Any, shapes: tuple[tuple[tuple[int, ...], Any], ...]) -> Any:
    return jax.tree.unflatten(tree, [jax.ShapeDtypeStruct(shape, kind) for shape, kind in shapes])


@lru_cache(maxsize=16)
def _compile_gradient(density: PopulationDensity, tree: Any, shapes: tuple[tuple[tuple[int, ...], Any], ...]) -> Any:
    """Compile the log density and its gradient."""
    z = jax.ShapeDtypeStruct((density.size,), np.float64)
    return compile_program(jax.value_and_grad(density.log_density), z, _shape_tree(tree, shapes), run_once=True)


@lru_cache(maxsize=16)
def _compile(density: PopulationDensity, tree: Any, shapes: tuple[tuple[tuple[int, ...], Any], ...]) -> tuple[Any, Any]:
    """Compile the sampler and the values of draws, for all fleets of one shape."""
    data = _shape_tree(tree, shapes)
    settings = (
        _SETTINGS.model_copy(update={"target_acceptance": _CAREFUL_ACCEPTANCE})
        if density.cables < _FEW_CABLES
        else _SETTINGS
    )

    def log_density(units: jax.Array, data: dict[str, Any]) -> jax.Array:
        return density.log_density(_to_z(units, density, data), data)

    program = compile_block(log_density, _first_mass(density).shape, data, settings, fine=False)

    def values(units: jax.Array, data: dict[str, Any]) -> tuple[jax.Array, ...]:
        z = _to_z(units, density, data)
        population = density.population_at(z, data)
        return (
            population["mean"],
            population["spread"],
            population["effects"],
            density.cables_at(z, data, population)[0],
        )

    rows = jax.ShapeDtypeStruct((_AT_ONCE, density.size), np.float64)
    many = compile_program(jax.vmap(values, (0, None)), rows, data, run_once=True)
    return program, many


def draw_unpooled(
    inspected: Inspections, population: PopulationDraws, cable: int, seed: int
) -> tuple[np.ndarray, bool]:
    """Return a cable's log coefficients when new and its wear, (draw, parameter), and whether its wear is identified.

    Args:
        inspected: The inspections.
        population: Population of the other cables, for what the cable's inspections do not identify; as many draws are
            returned.
        cable: Number of the cable.
        seed: Random seed.
    """
    generator, rows = np.random.default_rng([seed, 19, cable]), np.flatnonzero(inspected.cable == cable)
    freedom, counts = inspected.summaries.freedom[rows], inspected.known[rows].sum(axis=1)
    root = whitening_roots(inspected.summaries.scale[rows], inspected.known[rows])
    design = root @ inspected.design[rows]  # of errors of unit precision, as all that follows
    columns = np.stack([*inspected.effects.values(), np.zeros(len(inspected.cable))], axis=1)[
        rows, : len(inspected.effects)
    ]
    shift = np.einsum("hf,jf->hj", population.effects, columns)
    seen = (root @ inspected.summaries.center[rows, :, None])[..., 0] - shift[:, :, None] * root.sum(axis=2)
    information = np.einsum("jkd,jke->jde", design, design)
    has = np.atleast_1d(inspected.known[rows].any(axis=0))
    is_wear_known = _is_wear_known(information.sum(axis=0), has) if inspected.cycles is not None else False
    own = np.append(has, [is_wear_known] * (inspected.cycles is not None))
    sd = np.append(inspected.prior_sd, [WEAR.sd] * (inspected.cycles is not None))
    mean = np.append(inspected.prior_mean, [0.0] * (inspected.cycles is not None))
    before = np.where(own, 1 / sd**2, 1 / population.spread**2)
    pulled = before * np.where(own, mean, population.mean)
    stretch = np.ones(seen.shape[:2])
    for _ in range(_SWEEPS):
        precision = np.einsum("hj,jde->hde", stretch, information) + before[:, :, None] * np.eye(len(own))
        toward = np.einsum("hj,jkd,hjk->hd", stretch, design, seen, optimize=True) + pulled
        noise = np.linalg.cholesky(precision) @ generator.standard_normal((*toward.shape, 1))
        values: np.ndarray = np.linalg.solve(precision, toward[:, :, None] + noise)[..., 0]
        away = np.sum((seen - np.einsum("jkd,hd->hjk", design, values)) ** 2, axis=2)
        stretch = generator.standard_gamma((freedom + counts) / 2, stretch.shape) / ((freedom + away) / 2)
    return values, is_wear_known


def _is_wear_known(information: np.ndarray, has: np.ndarray) -> bool:
    """Return whether inspections carry more information about wear than its prior, for any coefficients.

    Args:
        information: Precision of log coefficients and wear, (parameter, parameter).
        has: Which coefficients the cable has.
    """
    inside = information[:-1, :-1][np.ix_(has, has)]
    beside = information[:-1, -1][has]
    return bool(information[-1, -1] - beside @ np.linalg.solve(inside, beside) > 1 / WEAR.sd**2)
