"""Maxima of many posteriors at once, and the mixtures about them from which draws are proposed.

The maxima are those of the log density itself, noise scales included, found by climbing from several starts. Posteriors with
few readings are funnels: with a larger noise scale, everything else is wider. So each noise scale is also held at values away
from its maximum, the density is maximized over all other parameters, and the curvature is taken there. Each friction
coefficient is held below its maximum likewise: a coefficient that the readings hardly identify may be nearly zero, with more
scatter, far from the region that the curvature at the maximum describes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bowdenfit.inference.student_mixture import StudentMixture

Gradients = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
N_STARTS = 4  # starts of each climb: the prior medians, and draws of the prior
# Offsets from its maximum, in standard deviations, at which each noise scale is held, as many as there are starts. At the
# highest everything else is widest, which decides how well standard deviations are known.
_NOISE_OFFSETS = (-2.0, 2.0, 4.0, 6.0)
_FRICTION_OFFSETS = (-0.5, -1.0, -1.7, -2.5)  # held below the maximum, in standard deviations of the prior
_FRICTION_WIDTH = 0.4  # spread of the draws about these offsets, in standard deviations of the prior
_MOST_STEPS, _DIFFERENCE = 30, 1e-5
_LEAST_CURVATURE = 0.2  # lower limit of a curvature; the prior's is 1
_LONGEST_STEP = 3.0  # longest step, in standard deviations of the prior
_LEAST_GAIN = 1e-4  # predicted gain of log density below which a climb has arrived
_MOST_DAMPING = 1e8  # damping at which no step gains anything
_LEAST_SHARE, _LEAST_FRICTION_SHARE = 0.1, 0.05  # least share of each component in the draws, before shares are normalized


@dataclass(frozen=True)
class Maxima:
    """Ends of climbs: z (cable, climb, parameter), log densities (cable, climb), and minus their second derivatives."""

    z: np.ndarray
    value: np.ndarray
    curvature: np.ndarray


class HeldMaxima(NamedTuple):
    """Maxima with one parameter held at some values.

    Args:
        unit: 1 for that parameter, 0 for the others.
        maxima: Maxima over all other parameters.
        width: Spread of that parameter about each value, by cable.
        least: Least share of each value in the draws.
    """

    unit: np.ndarray
    maxima: Maxima
    width: np.ndarray
    least: float


def count_climb_points(size: int) -> int:
    """Return how many gradients of one density a step of all its climbs needs."""
    return N_STARTS * (2 * size + 1)


def climb_to_maxima(gradients: Gradients, z: np.ndarray, free: np.ndarray) -> Maxima:
    """Climb to maxima by damped Newton steps with differences of gradients, each climb independently.

    Args:
        gradients: Log densities and their gradients, at `count_climb_points` points (cable, point, parameter).
        z: Starts, (cable, climb, parameter).
        free: 1 for parameters that move, 0 for those held, (climb, parameter).
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
    """Return log densities, gradients and minus second derivatives; minus infinity and 0 where they cannot be computed."""
    cables, climbs, size = z.shape
    moves = _DIFFERENCE * np.concatenate([np.zeros((1, size)), np.eye(size), -np.eye(size)])
    value, slope = (np.asarray(part) for part in gradients((z[:, :, None] + moves).reshape(cables, -1, size)))
    value, slope = value.reshape(cables, climbs, -1), slope.reshape(cables, climbs, -1, size)
    curvature = (slope[:, :, size + 1 :] - slope[:, :, 1 : size + 1]) / (2 * _DIFFERENCE)
    curvature = (curvature + curvature.swapaxes(-1, -2)) / 2
    finite = (
        np.isfinite(value[..., 0]) & np.isfinite(slope).all(axis=(-1, -2)) & np.isfinite(curvature).all(axis=(-1, -2))
    )
    known_slope = np.where(finite[..., None], slope[:, :, 0], 0.0)
    return np.where(finite, value[..., 0], -np.inf), known_slope, np.where(finite[..., None, None], curvature, 0.0)


def draw_starting_points(size: int, seeds: np.ndarray) -> np.ndarray:
    """Return starts of the climbs, (cable, climb, parameter)."""
    remaining = [np.random.default_rng([int(seed), 0]).standard_normal((N_STARTS - 1, size)) for seed in seeds]
    return np.concatenate([np.zeros((len(seeds), 1, size)), np.stack(remaining)], axis=1)


def fit_mixtures(
    gradients: Gradients, noise: np.ndarray, friction: np.ndarray, seeds: np.ndarray
) -> list[StudentMixture | None]:
    """Fit the first proposal of every cable; None where its density cannot be computed from any start.

    Args:
        gradients: See `climb_to_maxima`.
        noise: Which parameters are noise scales.
        friction: Which parameters are friction coefficients.
        seeds: Seed of every cable.
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
    """Combine the maxima of a cable and its held maxima, weighted by the mass about each."""
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
    """Return a root of the covariance that belongs to a curvature, with the curvature limited from below."""
    sizes, axes = np.linalg.eigh(curvature)
    return axes / np.sqrt(np.maximum(sizes, _LEAST_CURVATURE))


def _held_root(curvature: np.ndarray, unit: np.ndarray, width: float) -> np.ndarray:
    """Return such a root where one coordinate spreads by a given width and the others follow it."""
    which, free = int(np.argmax(unit)), np.flatnonzero(unit == 0)
    root = np.zeros_like(curvature)
    free_root = _covariance_root(curvature[np.ix_(free, free)])
    root[np.ix_(free, free)] = free_root
    root[free, which] = -width * free_root @ (free_root.T @ curvature[free, which])
    root[which, which] = width
    return root
