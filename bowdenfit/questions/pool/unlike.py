r"""Which cable is unlike the rest, and whether all are of one kind.

Each number of a cable, its log coefficients when new and its wear, is compared with what the population of the other cables
foretells of it, as far as its own inspections tell it:

.. math:: t_{ik} = (\hat u_{ik} - m_k) / \sqrt{s_k^2 + v_{ik}}

and its inspections with each other, so that wear that is not straight and an inspection that disagrees are seen too. The least
of these probabilities, times their number, is the cable's. Cables that are far off by median and median deviation, which
several of them cannot hide behind, and any other that may be named are left out of the population and compared with it drawn
without them; for the others its draws are weighted by one over the likelihood of the cable in question, which is enough to see
that they are not at its end. Whether cables are of one kind is the test of Anderson and
Darling for a normal distribution.

References:
    Gelman, Meng and Stern 1996, "Posterior predictive assessment" (Statistica Sinica 6); Rosner 1983, "Percentage points for
    a generalized ESD many-outlier procedure" (Technometrics 25); Stephens 1986, in D'Agostino and Stephens, "Goodness-of-fit
    techniques", table 4.9, for the distribution of the statistic with estimated mean and variance.
"""

from collections.abc import Callable, Collection

import numpy as np
from scipy.special import chdtrc, gammaln, log_ndtr, ndtr

from bowdenfit.inference.population.model import Inspections
from bowdenfit.inference.population.sampling import PopulationDraws
from bowdenfit.inference.psis import smooth_weights
from bowdenfit.multiple_testing import adjust_p_values

FALSE_ALARM, OF_KINDS = 0.05, 0.01  # of fleets in which all cables are alike: of naming any, and of seeing two kinds
_POPULATIONS = 1000  # draws of the population
_REPEATS = 20  # stretches of the errors for each
_OFTENER = 4.0  # times fewer degrees of freedom, by which large stretches are drawn oftener
_LEAST_SQUARE = 1e-200  # that divides without overflow
_RANK = 1e-9
_TOGETHER = -1  # in place of the number of a cable: its inspections, with each other and with a line
_FEWEST_TO_LEAVE_OUT, _FAR = 5, 3.5  # cables, and typical deviations from the median
_NORMAL_DEVIATION = 0.6745  # median deviation of a normal distribution in standard deviations
_FEWEST = 8  # cables of which can be said whether they are of one kind


def far_off(inspected: Inspections, drawn: PopulationDraws) -> tuple[int, ...]:
    """Cables that may be unlike the rest, by number: at most a third of them.

    Args:
        inspected: What is known.
        drawn: Of the population.
    """
    if inspected.cables < _FEWEST_TO_LEAVE_OUT:
        return ()
    values = drawn.cables.mean(axis=0)
    away = np.abs(values - np.median(values, axis=0))
    typical = np.median(away, axis=0) / _NORMAL_DEVIATION
    worst = (away / np.maximum(typical, np.finfo(float).tiny)).max(axis=1)
    most = np.argsort(-worst)[: inspected.cables // 3]
    return tuple(int(i) for i in sorted(most) if worst[i] > _FAR)


def judged(
    inspected: Inspections, drawn: PopulationDraws, draw: Callable[[tuple[int, ...]], PopulationDraws], seed: int
) -> tuple[PopulationDraws, np.ndarray]:
    """The population without cables that are unlike it, and the chance of each cable among so many, (cable,).

    Whoever may be named is left out first: draws of a population that has a cable in it say hardly anything of one without it
    where that cable is at its end, however they are weighted. All of them are left out together, so that they cannot hide
    behind each other; who is then not unlike the others is taken in again, because a population without its own ends makes the
    next of them look rare (the least of several suspects decides on how many there are: Rosner 1983).

    Args:
        inspected: What is known.
        drawn: The population of all.
        draw: Draws the population without some cables.
        seed: Of everything random.
    """
    core, adjusted = drawn, adjust_p_values(chances(inspected, drawn, seed))
    without = _suspects(adjusted, far_off(inspected, drawn))
    taken_in: dict[int, float] = {}
    while without:
        core = draw(without)
        found = adjust_p_values(chances(inspected, core, seed, without))
        taken_in |= {i: float(found[i]) for i in without if found[i] >= FALSE_ALARM}
        others = np.where(np.isin(np.arange(len(found)), list(taken_in)), 1.0, found)
        left = _suspects(others, tuple(i for i in without if i not in taken_in))
        if left == without:
            adjusted = found
            break
        without = left
    else:
        core = drawn
    for i, chance in taken_in.items():
        adjusted[i] = max(adjusted[i], chance)
    return core, adjusted


def _suspects(adjusted: np.ndarray, far: tuple[int, ...]) -> tuple[int, ...]:
    """Who may be unlike the rest, by number: at most a third of the cables, or one."""
    likely = {*far, *np.flatnonzero(adjusted < FALSE_ALARM)}
    worst = sorted(likely, key=lambda i: (i not in far, adjusted[i]))[: max(len(adjusted) // 3, 1)]
    return tuple(sorted(int(i) for i in worst))


def chances(inspected: Inspections, drawn: PopulationDraws, seed: int, without: tuple[int, ...] = ()) -> np.ndarray:
    """Probability that a cable of this population is as far from the others as each is, (cable,).

    Among ten thousand cables only a probability of a few millionths names one, which no counting of simulated cables would
    find. Given a draw of the population, and by how much the errors of each inspection are stretched, all that is compared is
    normal: so its tails are exact, and only these two are drawn.

    Args:
        inspected: What is known.
        drawn: Of the population.
        seed: Of everything random.
        without: Cables that the population was drawn without.
    """
    generator, core = np.random.default_rng([seed, 7]), _some(drawn)
    every = range(inspected.cables)
    return np.array([_chance(inspected, i, *core, generator=generator, is_in=i not in without) for i in every])


def _some(drawn: PopulationDraws) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    which = np.linspace(0, len(drawn.mean) - 1, _POPULATIONS).round().astype(int)
    return drawn.mean[which], drawn.spread[which], drawn.effects[which]


def departure(inspected: Inspections, core: PopulationDraws, cable: int, seed: int) -> tuple[int, float] | None:
    """The number in which a cable is unlike the rest by its own inspections, and by how many spreads.

    None where it is rather its inspections that are unlike each other.

    Args:
        inspected: What is known.
        core: The population without it.
        cable: Its number.
        seed: Of everything random.
    """
    generator = np.random.default_rng([seed, 17, cable])
    chance, off = _compared(inspected, cable, *_some(core), generator=generator, is_in=False)
    least = min(chance, key=lambda each: chance[each])
    return None if least == _TOGETHER else (least, off[least])


def _chance(inspected: Inspections, cable: int, *population: np.ndarray, generator: np.random.Generator, is_in: bool) -> float:
    """Of one cable, which may be in the population or not."""
    found, _ = _compared(inspected, cable, *population, generator=generator, is_in=is_in)
    return min(1.0, len(found) * min(found.values()))


def _compared(
    inspected: Inspections,
    cable: int,
    mean: np.ndarray,
    spread: np.ndarray,
    effects: np.ndarray,
    *,
    generator: np.random.Generator,
    is_in: bool,
) -> tuple[dict[int, float], dict[int, float]]:
    """Chance of each number of a cable, and of its inspections together as number -1; how many spreads each number is off."""
    rows = np.flatnonzero(inspected.cable == cable)
    known = inspected.known[rows].ravel()
    design = inspected.design[rows].reshape(known.size, -1)[known]
    scale, count = np.zeros((known.size, known.size)), inspected.coefficients
    for place, row in enumerate(rows):
        inside = slice(place * count, (place + 1) * count)
        scale[inside, inside] = inspected.summaries.scale[row]
    scale, of_row = scale[np.ix_(known, known)], np.repeat(np.arange(len(rows)), count)[known]
    shift = np.zeros((len(mean), len(known)))
    if inspected.effects:
        columns = np.stack(list(inspected.effects.values()), axis=1)[rows]
        shift = np.repeat(effects @ columns.T, count, axis=1)
    away = inspected.summaries.center[rows].ravel()[known] - mean @ design.T - shift[:, known]
    root = np.linalg.cholesky(np.einsum("ad,hd,bd->hab", design, spread**2, design) + scale)
    distance = np.sum(np.linalg.solve(root, away[:, :, None])[..., 0] ** 2, axis=1)
    size = np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    log = distance / 2 + size if is_in else np.zeros(len(mean))
    stretch, weights = _stretches(inspected.summaries.freedom[rows], len(mean), generator)
    weights = weights * np.exp(smooth_weights(log)[0])[:, None]  # of the population without this cable
    beyond, off = {_TOGETHER: _within(away, stretch[..., of_row], scale, design, generator)}, {}
    precision = np.linalg.inv(scale)
    for k in np.flatnonzero((design != 0).any(axis=0)):
        others = np.arange(design.shape[1]) != k
        loose = np.median(spread, axis=0) ** -2 * others  # as far as its own inspections do not tell the others
        gain = np.linalg.solve(design.T @ precision @ design + np.diag(loose), design.T @ precision)[k]
        own = np.bincount(of_row, gain * (scale @ gain), len(rows))
        variance = (spread**2 @ (gain @ design) ** 2)[:, None] + stretch @ own
        beyond[int(k)] = 2 * ndtr(-np.abs(away @ gain)[:, None] / np.sqrt(variance))
        off[int(k)] = float(np.median(away @ gain / spread[:, k]))
    return {k: float(np.sum(weights * each) / weights.sum()) for k, each in beyond.items()}, off


def _stretches(freedom: np.ndarray, populations: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """By how much the variance of each inspection's errors is stretched, (population, repeat, inspection), and their weights.

    Large stretches are drawn oftener than they come, of one inspection at a time, as one large error makes a rare sum.
    """
    which = generator.integers(len(freedom) + 1, size=(populations, _REPEATS, 1))
    fewer = freedom / _OFTENER
    squares = generator.chisquare(np.where(which == np.arange(len(freedom)), fewer, freedom))
    squares = np.maximum(squares, _LEAST_SQUARE)
    log = (fewer - freedom) / 2 * np.log(squares / 2) + gammaln(freedom / 2) - gammaln(fewer / 2)
    return freedom / squares, (len(freedom) + 1) / (1 + np.exp(log).sum(axis=2))


def _within(
    away: np.ndarray, stretch: np.ndarray, scale: np.ndarray, design: np.ndarray, generator: np.random.Generator
) -> np.ndarray:
    """Probabilities that inspections of a cable disagree as much among each other, or with a line; 1 where they cannot."""
    root = np.linalg.inv(np.linalg.cholesky(scale))
    left, sizes, _ = np.linalg.svd(root @ design)
    free = left[:, np.sum(sizes > _RANK * sizes.max()) :]
    if not free.shape[1]:
        return np.ones(stretch.shape[:2])
    seen = np.sum((away @ root.T @ free) ** 2, axis=1)
    way = generator.standard_normal((*stretch.shape[:2], free.shape[1]))
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    found: np.ndarray = chdtrc(free.shape[1], seen[:, None] / np.sum(stretch * (way @ free.T) ** 2, axis=2))
    return found


def mixed(
    inspected: Inspections, drawn: PopulationDraws, names: tuple[str, ...], without: Collection[int] = ()
) -> dict[str, float]:
    """Numbers in which cables do not look like one population, with the probability of that by chance in such a fleet.

    Args:
        inspected: What is known.
        drawn: Of the population.
        names: Of the numbers of a cable.
        without: Cables that are said to be unlike the rest, of which the population has none.
    """
    rest = ~np.isin(np.arange(inspected.cables), list(without))
    data, effects = inspected.data, drawn.effects.mean(axis=0)
    shift = data["by_effect"][:, :, : len(effects)] @ effects
    found: dict[str, float] = {}
    precision = data["precision"]
    for k, name in enumerate(names):
        known = rest & (np.diagonal(precision, axis1=1, axis2=2)[:, k] > 0)
        others = [i for i in range(len(names)) if i != k]
        weight = np.zeros((len(names), len(names)))
        weight[others, others] = 1 / np.mean(drawn.spread[:, others], axis=0) ** 2  # as far as its own data do not tell
        toward = data["toward"] - shift + weight @ drawn.mean.mean(axis=0)
        covariance = np.linalg.inv(precision[known] + weight)
        estimate = np.einsum("ij,ij->i", covariance[:, k], toward[known])
        variance = covariance[:, k, k] + np.mean(drawn.spread[:, k]) ** 2
        standardized = (estimate - drawn.mean[:, k].mean()) / np.sqrt(variance)
        if known.sum() >= _FEWEST:
            found[name] = anderson_darling(standardized)
    adjusted = adjust_p_values(np.array(list(found.values())))
    return {name: float(p) for name, p in zip(found, adjusted, strict=True) if p < OF_KINDS}


def anderson_darling(values: np.ndarray) -> float:
    """Probability of values as far from a normal distribution of unknown mean and variance, by Stephens' approximation.

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
