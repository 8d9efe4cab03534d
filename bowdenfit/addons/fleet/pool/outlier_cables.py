r"""Outlying cables of a fleet, and a test for a mixture of several populations.

Each number of a cable, its log coefficients when new and its wear, is compared with what the population of the other cables
predicts for it, as far as its own inspections identify it:

.. math:: t_{ik} = (\hat u_{ik} - m_k) / \sqrt{s_k^2 + v_{ik}}

and its inspections with each other, so that nonlinear wear and an inspection that disagrees are seen too. The smallest of
these probabilities, times their number, is the cable's. Cables that are far off by median and median absolute deviation,
where outliers cannot mask each other, and any other suspect are left out, and compared with the population drawn without
them; for the others its draws are importance-weighted by one over the likelihood of the cable in question. A mixture of
populations is detected by the test of Anderson and Darling for a normal distribution.

References:
    Gelman, Meng and Stern 1996, "Posterior predictive assessment" (Statistica Sinica 6); Rosner 1983, "Percentage points for
    a generalized ESD many-outlier procedure" (Technometrics 25); Stephens 1986, in D'Agostino and Stephens, "Goodness-of-fit
    techniques", table 4.9, for the distribution of the statistic with estimated mean and variance.
"""

from collections.abc import Callable, Collection

import numpy as np
from scipy.special import chdtrc, gammaln, log_ndtr, ndtr

from bowdenfit.addons.fleet.population.model import Inspections
from bowdenfit.addons.fleet.population.sampling import PopulationDraws
from bowdenfit.inference.psis import smooth_weights
from bowdenfit.multiple_testing import adjust_p_values

# Share of homogeneous fleets in which any cable is named as an outlier; measured in `tests/addons/fleet/test_pool_alarms.py`.
FALSE_ALARM = 0.05
MIXTURE_LEVEL = 0.01  # significance level of the test for a mixture of populations; customary
_POPULATIONS = 1000  # draws of the population; a judgement
_REPEATS = 20  # draws of the error scales for each of them; a judgement
_TAIL_FACTOR = 4.0  # the proposal of the error scales has so many times fewer degrees of freedom, hence heavier tails
_LEAST_SQUARE = 1e-200  # smallest chi-square draw that divides without overflow
_RANK = 1e-9  # relative singular value below which a direction is not determined
_CONSISTENCY = -1  # key of the consistency of inspections with each other and with linear wear
_FEWEST_TO_LEAVE_OUT = 5  # cables that a fleet must have at least
_DISTANT = 3.5  # scaled median absolute deviations beyond which a cable is suspect (Iglewicz and Hoaglin 1993)
_NORMAL_DEVIATION = 0.6745  # median deviation of a normal distribution in standard deviations
_FEWEST_FOR_MIXTURE = 8  # cables below which the test of normality is not used


def find_distant_cables(inspected: Inspections, draws: PopulationDraws) -> tuple[int, ...]:
    """Return the numbers of cables far from the median of all, by median absolute deviations; at most a third of them.

    Args:
        inspected: What is known.
        draws: Draws of the population.
    """
    if inspected.cables < _FEWEST_TO_LEAVE_OUT:
        return ()
    values = draws.cables.mean(axis=0)
    away = np.abs(values - np.median(values, axis=0))
    typical = np.median(away, axis=0) / _NORMAL_DEVIATION
    worst = (away / np.maximum(typical, np.finfo(float).tiny)).max(axis=1)
    largest = np.argsort(-worst)[: inspected.cables // 3]
    return tuple(int(i) for i in sorted(largest) if worst[i] > _DISTANT)


def separate_outliers(
    inspected: Inspections, population: PopulationDraws, draw: Callable[[tuple[int, ...]], PopulationDraws], seed: int
) -> tuple[PopulationDraws, np.ndarray]:
    """Draw the population without outlying cables, and return it with the adjusted p-value of every cable, (cable,).

    Whoever may be named is left out first: draws of a population that has a cable in it say hardly anything of one without it
    where that cable is at its end, however they are weighted. All of them are left out together, so that they cannot hide
    behind each other; who is then not unlike the others is taken in again, because a population without its own ends makes the
    next of them look rare (the least of several suspects decides on how many there are: Rosner 1983).

    Args:
        inspected: What is known.
        population: The population of all.
        draw: Draws the population without some cables.
        seed: Random seed.
    """
    core, adjusted = population, adjust_p_values(outlier_p_values(inspected, population, seed))
    suspects = _select_suspects(adjusted, find_distant_cables(inspected, population))
    readmitted: dict[int, float] = {}
    while suspects:
        core = draw(suspects)
        p_values = adjust_p_values(outlier_p_values(inspected, core, seed, suspects))
        readmitted |= {i: float(p_values[i]) for i in suspects if p_values[i] >= FALSE_ALARM}
        others = np.where(np.isin(np.arange(len(p_values)), list(readmitted)), 1.0, p_values)
        remaining = _select_suspects(others, tuple(i for i in suspects if i not in readmitted))
        if remaining == suspects:
            adjusted = p_values
            break
        suspects = remaining
    else:
        core = population
    for i, p_value in readmitted.items():
        adjusted[i] = max(adjusted[i], p_value)
    return core, adjusted


def _select_suspects(adjusted: np.ndarray, far: tuple[int, ...]) -> tuple[int, ...]:
    """Return the numbers of possible outliers: at most a third of the cables, or one."""
    likely = {*far, *np.flatnonzero(adjusted < FALSE_ALARM)}
    worst = sorted(likely, key=lambda i: (i not in far, adjusted[i]))[: max(len(adjusted) // 3, 1)]
    return tuple(sorted(int(i) for i in worst))


def outlier_p_values(
    inspected: Inspections, draws: PopulationDraws, seed: int, without: tuple[int, ...] = ()
) -> np.ndarray:
    """Return for each cable the probability that one of this population is as far from the others, (cable,).

    Among ten thousand cables only a probability of a few millionths names one, which no counting of simulated cables would
    find. Given a draw of the population, and by how much the errors of each inspection are stretched, all that is compared is
    normal: so its tails are exact, and only these two are drawn.

    Args:
        inspected: What is known.
        draws: Draws of the population.
        seed: Random seed.
        without: Cables that the population was drawn without.
    """
    generator, core = np.random.default_rng([seed, 7]), _thin(draws)
    cables = range(inspected.cables)
    return np.array(
        [_outlier_p_value(inspected, i, *core, generator=generator, is_in=i not in without) for i in cables]
    )


def _thin(draws: PopulationDraws) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    which = np.linspace(0, len(draws.mean) - 1, _POPULATIONS).round().astype(int)
    return draws.mean[which], draws.spread[which], draws.effects[which]


def find_departure(inspected: Inspections, core: PopulationDraws, cable: int, seed: int) -> tuple[int, float] | None:
    """Return the quantity in which a cable departs most from the population, and its distance in spreads.

    None where it is rather its inspections that are unlike each other.

    Args:
        inspected: What is known.
        core: The population without it.
        cable: Its number.
        seed: Random seed.
    """
    generator = np.random.default_rng([seed, 17, cable])
    p_values, distances = _compare_with_population(inspected, cable, *_thin(core), generator=generator, is_in=False)
    least = min(p_values, key=lambda number: p_values[number])
    return None if least == _CONSISTENCY else (least, distances[least])


def _outlier_p_value(
    inspected: Inspections, cable: int, *population: np.ndarray, generator: np.random.Generator, is_in: bool
) -> float:
    """Return the Bonferroni-adjusted p-value of one cable, which may be part of the population or not."""
    p_values, _ = _compare_with_population(inspected, cable, *population, generator=generator, is_in=is_in)
    return min(1.0, len(p_values) * min(p_values.values()))


def _compare_with_population(
    inspected: Inspections,
    cable: int,
    mean: np.ndarray,
    spread: np.ndarray,
    effects: np.ndarray,
    *,
    generator: np.random.Generator,
    is_in: bool,
) -> tuple[dict[int, float], dict[int, float]]:
    """Return the p-value of every quantity of a cable (of its consistency as number -1), and their distances in spreads."""
    rows = np.flatnonzero(inspected.cable == cable)
    known = inspected.known[rows].ravel()
    design = inspected.design[rows].reshape(known.size, -1)[known]
    scale, count = np.zeros((known.size, known.size)), inspected.coefficients
    for position, row in enumerate(rows):
        inside = slice(position * count, (position + 1) * count)
        scale[inside, inside] = inspected.summaries.scale[row]
    scale, row_of = scale[np.ix_(known, known)], np.repeat(np.arange(len(rows)), count)[known]
    shift = np.zeros((len(mean), len(known)))
    if inspected.effects:
        columns = np.stack(list(inspected.effects.values()), axis=1)[rows]
        shift = np.repeat(effects @ columns.T, count, axis=1)
    residual = inspected.summaries.center[rows].ravel()[known] - mean @ design.T - shift[:, known]
    root = np.linalg.cholesky(np.einsum("ad,hd,bd->hab", design, spread**2, design) + scale)
    distance = np.sum(np.linalg.solve(root, residual[:, :, None])[..., 0] ** 2, axis=1)
    size = np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    log = distance / 2 + size if is_in else np.zeros(len(mean))
    stretch, weights = _draw_error_scales(inspected.summaries.freedom[rows], len(mean), generator)
    weights = weights * np.exp(smooth_weights(log)[0])[:, None]  # of the population without this cable
    tail, distances = (
        {_CONSISTENCY: _inconsistency_p_values(residual, stretch[..., row_of], scale, design, generator)},
        {},
    )
    precision = np.linalg.inv(scale)
    for k in np.flatnonzero((design != 0).any(axis=0)):
        others = np.arange(design.shape[1]) != k
        loose = np.median(spread, axis=0) ** -2 * others  # as far as its own inspections do not tell the others
        gain = np.linalg.solve(design.T @ precision @ design + np.diag(loose), design.T @ precision)[k]
        own = np.bincount(row_of, gain * (scale @ gain), len(rows))
        variance = (spread**2 @ (gain @ design) ** 2)[:, None] + stretch @ own
        tail[int(k)] = 2 * ndtr(-np.abs(residual @ gain)[:, None] / np.sqrt(variance))
        distances[int(k)] = float(np.median(residual @ gain / spread[:, k]))
    return {k: float(np.sum(weights * probabilities) / weights.sum()) for k, probabilities in tail.items()}, distances


def _draw_error_scales(
    freedom: np.ndarray, populations: int, generator: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Draw the factors of error variance of a t distribution, (population, repeat, inspection), with importance weights.

    Large stretches are drawn oftener than they come, of one inspection at a time, as one large error makes a rare sum.
    """
    which = generator.integers(len(freedom) + 1, size=(populations, _REPEATS, 1))
    fewer = freedom / _TAIL_FACTOR
    squares = generator.chisquare(np.where(which == np.arange(len(freedom)), fewer, freedom))
    squares = np.maximum(squares, _LEAST_SQUARE)
    log = (fewer - freedom) / 2 * np.log(squares / 2) + gammaln(freedom / 2) - gammaln(fewer / 2)
    return freedom / squares, (len(freedom) + 1) / (1 + np.exp(log).sum(axis=2))


def _inconsistency_p_values(
    residual: np.ndarray, stretch: np.ndarray, scale: np.ndarray, design: np.ndarray, generator: np.random.Generator
) -> np.ndarray:
    """Return p-values of the disagreement of inspections with each other or with linear wear; 1 where none is possible."""
    root = np.linalg.inv(np.linalg.cholesky(scale))
    left, sizes, _ = np.linalg.svd(root @ design)
    free = left[:, np.sum(sizes > _RANK * sizes.max()) :]
    if not free.shape[1]:
        return np.ones(stretch.shape[:2])
    observed = np.sum((residual @ root.T @ free) ** 2, axis=1)
    direction = generator.standard_normal((*stretch.shape[:2], free.shape[1]))
    direction /= np.linalg.norm(direction, axis=2, keepdims=True)
    probabilities: np.ndarray = chdtrc(
        free.shape[1], observed[:, None] / np.sum(stretch * (direction @ free.T) ** 2, axis=2)
    )
    return probabilities


def find_mixtures(
    inspected: Inspections, draws: PopulationDraws, names: tuple[str, ...], without: Collection[int] = ()
) -> dict[str, float]:
    """Return the quantities that are not normally distributed between cables, with their adjusted p-values.

    Args:
        inspected: What is known.
        draws: Draws of the population.
        names: Names of the numbers of a cable.
        without: Cables that are outliers, of which the population has none.
    """
    pooled = ~np.isin(np.arange(inspected.cables), list(without))
    data, effects = inspected.data, draws.effects.mean(axis=0)
    shift = data["by_effect"][:, :, : len(effects)] @ effects
    p_values: dict[str, float] = {}
    precision = data["precision"]
    for k, name in enumerate(names):
        known = pooled & (np.diagonal(precision, axis1=1, axis2=2)[:, k] > 0)
        others = [i for i in range(len(names)) if i != k]
        weight = np.zeros((len(names), len(names)))
        weight[others, others] = 1 / np.mean(draws.spread[:, others], axis=0) ** 2  # as far as its own data do not tell
        toward = data["toward"] - shift + weight @ draws.mean.mean(axis=0)
        covariance = np.linalg.inv(precision[known] + weight)
        estimate = np.einsum("ij,ij->i", covariance[:, k], toward[known])
        variance = covariance[:, k, k] + np.mean(draws.spread[:, k]) ** 2
        standardized = (estimate - draws.mean[:, k].mean()) / np.sqrt(variance)
        if known.sum() >= _FEWEST_FOR_MIXTURE:
            p_values[name] = anderson_darling_p_value(standardized)
    adjusted = adjust_p_values(np.array(list(p_values.values())))
    return {name: float(p) for name, p in zip(p_values, adjusted, strict=True) if p < MIXTURE_LEVEL}


def anderson_darling_p_value(values: np.ndarray) -> float:
    """Return the p-value of Anderson and Darling's test of normality, mean and variance unknown, by Stephens' approximation.

    Args:
        values: At least eight.
    """
    n = len(values)
    z = np.sort((values - values.mean()) / values.std(ddof=1))
    i = np.arange(1, n + 1)
    squared = -n - np.mean((2 * i - 1) * (log_ndtr(z) + log_ndtr(-z[::-1])))
    a = squared * (1 + 0.75 / n + 2.25 / n**2)
    if a < 0.2:
        return float(1 - np.exp(-13.436 + 101.14 * a - 223.73 * a**2))
    if a < 0.34:
        return float(1 - np.exp(-8.318 + 42.796 * a - 59.938 * a**2))
    if a < 0.6:
        return float(np.exp(0.9177 - 4.279 * a - 1.38 * a**2))
    return float(np.exp(1.2937 - 5.709 * a + 0.0186 * a**2)) if a < 10 else 0.0
