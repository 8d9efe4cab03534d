"""Maxima of many posteriors at once, and mixtures of Student t distributions about them from which draws are proposed.

The maxima are those of the log density itself, noise scales included, found by climbing from several starts. Posteriors with
few readings are funnels: with a larger noise scale, everything else is wider. So each noise scale is also held at values away
from its maximum, the density is maximized over all other parameters, and the curvature is taken there. Each friction
coefficient is held below its maximum likewise: a coefficient that the readings hardly identify may be nearly zero, with more
scatter, far from the region that the curvature at the maximum describes.

References:
    Peel and McLachlan 2000, "Robust mixture modelling using the t distribution" (Statistics and Computing 10), for the steps
    of expectation and maximization.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import lgamma
from typing import NamedTuple

import numpy as np

_DEGREES_OF_FREEDOM = 5  # of the Student-t's
_EM_STEPS = 4  # in which a mixture is moved
_LEAST_PART_SHARE = 1e-3  # of a part that draws have left
_SHRINKAGE = 0.5  # of the covariance of all draws, which is what a part has that few draws are near
Gradients = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
N_STARTS = 4  # places that each density is climbed from: the prior medians, and draws of the prior
# Standard deviations from its maximum at which each noise scale is held, as many as starts; the highest are where everything
# else is widest, which decides how well standard deviations are known.
_NOISE_OFFSETS = (-2.0, 2.0, 4.0, 6.0)
_FRICTION_OFFSETS = (
    -0.5,
    -1.0,
    -1.7,
    -2.5,
)  # from its maximum, where a coefficient is held; in standard deviations of its prior
_FRICTION_WIDTH = 0.4  # of the draws about these places, in the same
_MOST_STEPS, _DIFFERENCE = 30, 1e-5
_LEAST_CURVATURE = 0.2  # least curvature that is believed; the prior's is 1
_LONGEST_STEP = 3.0  # step, in standard deviations of the prior
_LEAST_GAIN = 1e-4  # gain that a step promises at which the top is near enough to draw about it
_MOST_DAMPING = 1e8  # damping at which no step gains anything
_LEAST_SHARE, _LEAST_FRICTION_SHARE = 0.1, 0.05  # of each part in the draws, before they are made to sum to 1


@dataclass(frozen=True)
class StudentMixture:
    """Student-t's.

    Args:
        center: Of every part, (part, parameter).
        root: A root R of its scale matrix R R^T.
        share: Of the draws.
    """

    center: np.ndarray
    root: np.ndarray
    share: np.ndarray

    @cached_property
    def _inverse(self) -> np.ndarray:
        return np.linalg.inv(self.root)

    def draw(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """So many, one a row; each part gets its share, and parts follow each other."""
        part = np.searchsorted(np.cumsum(self.share), (np.arange(count) + generator.uniform()) / count)
        part = np.minimum(part, len(self.share) - 1)
        rows = generator.standard_normal((count, self.center.shape[1]))
        wide = np.sqrt(_DEGREES_OF_FREEDOM / generator.chisquare(_DEGREES_OF_FREEDOM, count))
        for i in range(len(self.share)):
            here = part == i
            rows[here] = self.center[i] + wide[here, None] * (rows[here] @ self.root[i].T)
        return rows

    def log_density(self, rows: np.ndarray) -> np.ndarray:
        """Of every row."""
        return _log_sum(self._log_components(self._squared_distances(rows)))

    def _squared_distances(self, rows: np.ndarray) -> np.ndarray:
        """Distance from every part in its own units, squared, (row, part)."""
        count, size = self.center.shape
        flat = self._inverse.reshape(-1, size)
        apart = (rows @ flat.T - np.einsum("kij,kj->ki", self._inverse, self.center).ravel()).reshape(-1, count, size)
        return np.einsum("nki,nki->nk", apart, apart)

    def _log_components(self, squares: np.ndarray) -> np.ndarray:
        """Log of share times density of every part, (row, part)."""
        size = self.center.shape[1]
        constant = (
            lgamma((_DEGREES_OF_FREEDOM + size) / 2)
            - lgamma(_DEGREES_OF_FREEDOM / 2)
            - size / 2 * np.log(_DEGREES_OF_FREEDOM * np.pi)
        )
        of_part = np.log(self.share) + constant - np.linalg.slogdet(self.root)[1]
        return of_part - (_DEGREES_OF_FREEDOM + size) / 2 * np.log1p(squares / _DEGREES_OF_FREEDOM)

    def refined(self, rows: np.ndarray) -> "StudentMixture":
        """The mixture that is likelier to have given draws, some steps of expectation and maximization away.

        Args:
            rows: Draws, one a row.
        """
        mixture, of_all, (count, size) = self, regularized_covariance(rows), rows.shape
        for _ in range(_EM_STEPS):
            squares = mixture._squared_distances(rows)
            logs = mixture._log_components(squares)
            of_part = np.exp(logs - _log_sum(logs)[:, None]) / count
            pulled = of_part * (_DEGREES_OF_FREEDOM + size) / (_DEGREES_OF_FREEDOM + squares)
            share = np.maximum(of_part.sum(axis=0), np.finfo(float).tiny)
            near = share > _LEAST_PART_SHARE
            middle = pulled.T @ rows / np.maximum(pulled.sum(axis=0), np.finfo(float).tiny)[:, None]
            center = np.where(near[:, None], middle, mixture.center)
            few = size / (share**2 / np.maximum(np.sum(of_part**2, axis=0), np.finfo(float).tiny) + size)
            few = np.where(near, few, 1.0)[:, None, None]
            apart = [rows - at for at in center]
            scale = np.stack(
                [(deviation * pull[:, None]).T @ deviation for deviation, pull in zip(apart, pulled.T, strict=True)]
            )
            scale = (1 - few) * scale / share[:, None, None] + few * _SHRINKAGE * of_all
            share = np.maximum(share, _LEAST_PART_SHARE)
            mixture = StudentMixture(center, np.linalg.cholesky(scale), share / share.sum())
        return mixture

    def with_wide_component(self, rows: np.ndarray, times: float, share: float) -> "StudentMixture":
        """The same with one more part, about all of many draws.

        Args:
            rows: Draws, one a row.
            times: How much wider than they.
            share: Of the draws.
        """
        root = times * np.linalg.cholesky(regularized_covariance(rows))
        return StudentMixture(
            np.concatenate([self.center, rows.mean(axis=0, keepdims=True)]),
            np.concatenate([self.root, root[None]]),
            np.append((1 - share) * self.share, share),
        )


def start_mixture(rows: np.ndarray, parts: int) -> StudentMixture:
    """Student-t's about some of many draws, to be moved.

    Args:
        rows: Draws, one a row.
        parts: How many.
    """
    some = ((np.arange(parts) + 0.5) / parts * len(rows)).astype(int)
    root = np.linalg.cholesky(_SHRINKAGE * regularized_covariance(rows))
    return StudentMixture(rows[some], np.stack([root] * parts), np.full(parts, 1 / parts))


def regularized_covariance(rows: np.ndarray) -> np.ndarray:
    """Of draws, with a little more in each direction, so that it always has a root."""
    sample_covariance = np.cov(rows.T).reshape(rows.shape[1], -1)
    return sample_covariance + (
        1e-9 * np.trace(sample_covariance) / len(sample_covariance) + np.finfo(float).tiny
    ) * np.eye(len(sample_covariance))


def _log_sum(logs: np.ndarray) -> np.ndarray:
    """Logarithm of the sum of each row's exponentials; minus infinity where all are 0."""
    top = np.maximum(logs.max(axis=1), np.finfo(float).min)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.sum(np.exp(logs - top[:, None]), axis=1)) + top)


@dataclass(frozen=True)
class Maxima:
    """Where climbs ended: z (cable, climb, parameter), log densities (cable, climb), and minus their second derivatives."""

    z: np.ndarray
    value: np.ndarray
    curvature: np.ndarray


class HeldMaxima(NamedTuple):
    """Places at which one parameter is held.

    Args:
        unit: 1 for that parameter, 0 for the others.
        tops: Of all the rest.
        width: With which it spreads about each place, by cable.
        least: Least share of each place in the draws.
    """

    unit: np.ndarray
    maxima: Maxima
    width: np.ndarray
    least: float


def count_climb_points(size: int) -> int:
    """Gradients of one density that a step of all its climbs asks for."""
    return N_STARTS * (2 * size + 1)


def climb_to_maxima(gradients: Gradients, z: np.ndarray, free: np.ndarray) -> Maxima:
    """Newton's method, damped, with differences of gradients; each climb by itself.

    Args:
        gradients: Log densities and their gradients, at `points_of_climb` points (cable, point, parameter).
        z: Starts, (cable, climb, parameter).
        free: 1 for what moves, 0 for what is held, (climb, parameter).
    """
    held = np.eye(z.shape[2]) * (1 - free)[:, None, :]
    z, (value, slope, curvature) = z, _differentiate(gradients, z)
    damping, active = np.zeros(z.shape[:2]), np.isfinite(value)
    for _ in range(_MOST_STEPS):
        sizes, axes = np.linalg.eigh(curvature * free[:, :, None] * free[:, None, :] + held)
        along = (
            (slope * free)[..., None, :]
            @ axes
            / (np.maximum(np.abs(sizes), _LEAST_CURVATURE) + damping[..., None])[..., None, :]
        )
        step = (axes @ along.swapaxes(-1, -2))[..., 0]
        active &= (np.sum(slope * free * step, axis=-1) > _LEAST_GAIN) & (damping < _MOST_DAMPING)
        if not active.any():
            break
        step *= _LONGEST_STEP / np.maximum(np.abs(step).max(axis=-1, keepdims=True), _LONGEST_STEP)
        trial = _differentiate(gradients, z + step)
        better = active & (trial[0] > value)
        z, value = np.where(better[..., None], z + step, z), np.where(better, trial[0], value)
        slope = np.where(better[..., None], trial[1], slope)
        curvature = np.where(better[..., None, None], trial[2], curvature)
        damping = np.where(better, damping / 10, np.maximum(damping, 0.1) * 10)
    return Maxima(z, value, curvature)


def _differentiate(gradients: Gradients, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Log densities, gradients and minus second derivatives; where they cannot be computed, minus infinity and 0."""
    cables, climbs, size = z.shape
    moves = _DIFFERENCE * np.concatenate([np.zeros((1, size)), np.eye(size), -np.eye(size)])
    value, slope = (np.asarray(part) for part in gradients((z[:, :, None] + moves).reshape(cables, -1, size)))
    value, slope = value.reshape(cables, climbs, -1), slope.reshape(cables, climbs, -1, size)
    curvature = (slope[:, :, size + 1 :] - slope[:, :, 1 : size + 1]) / (2 * _DIFFERENCE)
    curvature = (curvature + curvature.swapaxes(-1, -2)) / 2
    known = (
        np.isfinite(value[..., 0]) & np.isfinite(slope).all(axis=(-1, -2)) & np.isfinite(curvature).all(axis=(-1, -2))
    )
    known_slope = np.where(known[..., None], slope[:, :, 0], 0.0)
    return np.where(known, value[..., 0], -np.inf), known_slope, np.where(known[..., None, None], curvature, 0.0)


def draw_starting_points(size: int, seeds: np.ndarray) -> np.ndarray:
    """Where to climb from, (cable, climb, parameter)."""
    others = [np.random.default_rng([int(seed), 0]).standard_normal((N_STARTS - 1, size)) for seed in seeds]
    return np.concatenate([np.zeros((len(seeds), 1, size)), np.stack(others)], axis=1)


def fit_mixtures(
    gradients: Gradients, noise: np.ndarray, friction: np.ndarray, seeds: np.ndarray
) -> list[StudentMixture | None]:
    """For every cable what its draws are proposed from first; None where its density cannot be computed from any start.

    Args:
        gradients: See `climb`.
        noise: Which parameters are noise scales.
        friction: Which are friction coefficients.
        seeds: Of every cable.
    """
    size = len(noise)
    maxima = climb_to_maxima(gradients, draw_starting_points(size, seeds), np.ones((N_STARTS, size)))
    best = maxima.z[np.arange(len(seeds)), np.argmax(maxima.value, axis=1)]
    spread = np.stack([_standard_deviations(maxima, cable) for cable in range(len(seeds))])
    held_maxima = []
    for which in np.flatnonzero(noise | friction):
        if noise[which]:
            offsets, width, least = np.array(_NOISE_OFFSETS) * spread[:, which, None], spread[:, which], _LEAST_SHARE
        else:
            offsets, width, least = (
                np.array([_FRICTION_OFFSETS]),
                np.full(len(seeds), _FRICTION_WIDTH),
                _LEAST_FRICTION_SHARE,
            )
        unit = (np.arange(size) == which).astype(float)
        held = climb_to_maxima(gradients, best[:, None] + offsets[..., None] * unit, np.tile(1.0 - unit, (N_STARTS, 1)))
        held_maxima.append(HeldMaxima(unit, held, width, least))
    computed = np.isfinite(maxima.value).any(axis=1)
    return [_make_mixture(maxima, held_maxima, cable) if computed[cable] else None for cable in range(len(seeds))]


def _standard_deviations(maxima: Maxima, cable: int) -> np.ndarray:
    best = int(np.argmax(maxima.value[cable]))
    return np.linalg.norm(_covariance_root(maxima.curvature[cable, best]), axis=1)


def _make_mixture(maxima: Maxima, held_maxima: list[HeldMaxima], cable: int) -> StudentMixture:
    """The tops of a cable and the places aside of the best, by how much mass is about each."""
    parts = [
        (maxima.z[cable, i], _covariance_root(maxima.curvature[cable, i]), maxima.value[cable, i], _LEAST_SHARE)
        for i in range(N_STARTS)
    ]
    for unit, held, width, least in held_maxima:
        parts += [
            (held.z[cable, i], _held_root(held.curvature[cable, i], unit, width[cable]), held.value[cable, i], least)
            for i in range(N_STARTS)
        ]
    center, root, value, least_share = (np.array(part) for part in zip(*parts, strict=True))
    mass = value + np.linalg.slogdet(root)[1]
    usable = np.isfinite(mass)
    share = np.exp(mass - mass[usable].max())
    share = np.where(usable, np.maximum(share / share.sum(), least_share), 0.0)
    return StudentMixture(center, root, share / share.sum())


def _covariance_root(curvature: np.ndarray) -> np.ndarray:
    """Root of the covariance of a curvature, no wider in any direction than the least that is believed."""
    sizes, axes = np.linalg.eigh(curvature)
    return axes / np.sqrt(np.maximum(sizes, _LEAST_CURVATURE))


def _held_root(curvature: np.ndarray, unit: np.ndarray, width: float) -> np.ndarray:
    """The same where one coordinate is held at a place and spreads by a width: the others follow it."""
    which, free = int(np.argmax(unit)), np.flatnonzero(unit == 0)
    root = np.zeros_like(curvature)
    free_root = _covariance_root(curvature[np.ix_(free, free)])
    root[np.ix_(free, free)] = free_root
    root[free, which] = -width * free_root @ (free_root.T @ curvature[free, which])
    root[which, which] = width
    return root
