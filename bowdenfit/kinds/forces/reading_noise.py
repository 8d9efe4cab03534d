"""How likely noise explains the readings of a force table: each by itself, those of a run and stroke, and all together.

A gain of force is as likely as Student's t says it is for a rope without any friction, with the noise as stated or as the
other readings of a run scatter, and Bonferroni's rule divides `FALSE_ALARM` among all these tests: fewer than one healthy table
of a thousand is refused, however many rows it has. Where every reading stands alone, no scatter tells the noise: it is then
taken to be 2 % of the force, known as well as from six readings, together with how readings differ from run to run; a bench
that is noisier states its noise.
"""

from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.types import Flags, Labels, Vector

FALSE_ALARM = 1e-3
_RARER = 1e-3  # than that, for readings that stand out, whose noise need not be normal
_FEWEST = 4  # degrees of freedom from which scatter tells the noise
_USUAL_NOISE, _USUAL_FREEDOM = 0.02 * np.sqrt(2), 6.0  # of a log ratio where nothing tells it, and how well it is known
_TRUNCATED = 1.8  # standard deviation of a normal over that of either half, 1.66, and some more for estimating it
_LEAST_FOR_LINE = 3  # readings of a run and stroke, above which a line is put through them


@dataclass(frozen=True)
class LogGains:
    """Sliding readings of a force table.

    Args:
        log_gain: Logarithm of what each gains: output over input while pulling, input over output while returning [1].
        load: A load whose error has nothing to do with that, such as the sum of both forces where friction is small [N].
        weight: One over the variance of the log gain, for a noise of 1 N [N^2].
        cell: Number of the run, stroke and place of each.
    """

    log_gain: Vector
    load: Vector
    weight: Vector
    cell: Labels


def beyond_noise(excess: Vector, readings: LogGains, stated: float | None) -> tuple[Flags, Flags]:
    """Which rows noise does not explain, and which rows of cells, or of the whole table, whose mean it does not explain.

    Args:
        excess: What each reading gains beyond what load cells explain [1].
        readings: All sliding readings of a table.
        stated: Noise of a force reading as stated [N]; None where scatter tells it.
    """
    log_gain, weight, cell = readings.log_gain, readings.weight, readings.cell
    n, total = len(excess), np.bincount(cell, weight)
    limit = FALSE_ALARM / (n + len(total) + 1)
    of_cell = np.bincount(cell, weight * excess) / np.sqrt(total)
    if stated is not None:
        alone = _chance(excess * np.sqrt(weight) / stated, np.full(n, np.inf)) < limit
        return alone, (_chance(of_cell / stated, np.full(len(total), np.inf)) < limit)[cell]
    if n - len(total) < _FEWEST:
        return _without_repeats(excess, log_gain, limit)
    # Where pulling and returning are not told apart, gains and losses of a run are: each half scatters less.
    halves = np.unique(2 * cell + (log_gain > 0), return_inverse=True)[1].ravel()
    alone, together = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    for group, factor in ((cell, 1.0), (halves, _TRUNCATED)):
        _, noise, freedom = _scatter(replace(readings, cell=group))
        if np.min(freedom) >= _FEWEST - 1:
            alone |= _chance(excess * np.sqrt(weight) / noise / factor, freedom) < limit
            together |= _chance(of_cell[cell] / noise / factor, freedom) < limit
    return alone, together


def _without_repeats(excess: Vector, log_gain: Vector, limit: float) -> tuple[Flags, Flags]:
    """The same of readings that stand alone, with the usual noise beside what their differences show."""
    n, freedom = len(excess), _USUAL_FREEDOM + len(excess) - 1.0
    known = _USUAL_FREEDOM * _USUAL_NOISE**2
    squares = (log_gain - log_gain.mean()) ** 2
    others = np.sum(squares) - squares * (n / (n - 1.0) if n > 1 else 1.0)
    left = np.full(n, max(freedom - 1, _USUAL_FREEDOM))
    alone = _chance(excess / np.sqrt((known + np.maximum(others, 0.0)) / left), left) < limit
    of_table = excess.mean() * np.sqrt(n * freedom / (known + np.sum(squares)))
    return alone, np.full(n, _chance(np.array([of_table]), np.array([freedom]))[0] < limit)


def standing_out(readings: LogGains) -> Flags:
    """Which readings lie off the others of their cell by a factor of two and far beyond their noise."""
    if len(readings.cell) - np.max(readings.cell) - 1 < _FEWEST:
        return np.zeros(len(readings.cell), dtype=bool)
    off, noise, freedom = _scatter(readings)
    limit = _RARER * FALSE_ALARM / len(readings.cell)
    return np.asarray((np.abs(off) > np.log(2)) & (_chance(np.abs(off) * np.sqrt(readings.weight) / noise, freedom) < limit))


def _scatter(readings: LogGains) -> tuple[Vector, Vector, Vector]:
    """Of each row, its deviation from a straight line in one over the load; noise that all other rows show, its freedom.

    The line takes what zeros and hidden tension do at low loads out of the noise.
    """
    weight, group = readings.weight, readings.cell
    total = np.bincount(group, weight)

    def from_mean(of: Vector) -> Vector:
        return np.asarray(of - (np.bincount(group, weight * of) / total)[group])

    inverse = 1 / readings.load
    x, deviation = from_mean(inverse), from_mean(readings.log_gain)
    spread = np.bincount(group, weight * x**2)
    sloped = (np.bincount(group) > _LEAST_FOR_LINE) & (spread > 1e-12 * total * np.mean(inverse) ** 2)
    spread = np.where(sloped, spread, np.inf)
    residual = deviation - x * (np.bincount(group, weight * x * deviation) / spread)[group]
    leverage = weight * (1 / total[group] + x**2 / spread[group])
    squares, shared = weight * residual**2, leverage < 1 - 1e-9
    own = np.divide(squares, 1 - leverage, out=np.zeros(len(weight)), where=shared)
    left = np.maximum(len(weight) - len(total) - np.sum(sloped) - shared, 1.0)
    others = np.maximum(np.sum(squares) - own, 1e-24 * np.max(weight))
    return residual, np.sqrt(others / left), left


def _chance(t: Vector, freedom: Vector) -> Vector:
    """Probability of a larger Student's t; of a larger normal deviate where the freedom is infinite."""
    from scipy.special import ndtr, stdtr

    return np.asarray(np.where(np.isinf(freedom), ndtr(-t), stdtr(np.where(np.isinf(freedom), 1.0, freedom), -t)))
