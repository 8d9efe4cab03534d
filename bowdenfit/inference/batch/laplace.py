"""Maxima of many posteriors at once, and mixtures about them to draw from.

The maxima are those of the log density itself, noise scales included, climbed to from several starts. Posteriors of few
readings are funnels: where readings scatter more, everything else is wider. So each noise scale is also held aside of its
maximum, the density maximized over all the rest, and the curvature taken there. So is each friction coefficient, below its
maximum: what readings hardly tell may be nearly nothing, with more scatter, far from where the curvature of the maximum looks.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bowdenfit.inference.batch.mixture import StudentMixture

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
