r"""A cable by its own inspections alone, without the population: draws as those of the population's cables.

Its log coefficients when new have the prior of its single fits, and its wear that of the middle of a population. Only where its
inspections tell less of its wear than that prior does is its wear one of the population, and so are coefficients that it does
not have. Effects of lubrication and temperature are those of the other cables.

Errors of an inspection follow a multivariate t distribution, a normal one of which the precision is stretched by a number that
has a gamma distribution: given these numbers the cable is normal, and given the cable they are independent. Each draw of the
population has a chain of its own, so that nothing need be thinned.

References:
    Geweke 1993, "Bayesian treatment of the independent Student-t linear model" (Journal of Applied Econometrics 8).
"""

import numpy as np

from bowdenfit.inference.population.model import WEAR, Inspections, whitening_roots
from bowdenfit.inference.population.sampling import PopulationDraws

_SWEEPS = 60


def draw_unpooled(inspected: Inspections, population: PopulationDraws, cable: int, seed: int) -> tuple[np.ndarray, bool]:
    """Log coefficients of a cable when new and its wear, (draw, number), and whether its own inspections tell its wear.

    Args:
        inspected: What is known.
        population: That the cable is unlike, for what its inspections do not tell; as many draws come back.
        cable: Its number.
        seed: Of everything random.
    """
    generator, rows = np.random.default_rng([seed, 19, cable]), np.flatnonzero(inspected.cable == cable)
    freedom, counts = inspected.summaries.freedom[rows], inspected.known[rows].sum(axis=1)
    root = whitening_roots(inspected.summaries.scale[rows], inspected.known[rows])
    design = root @ inspected.design[rows]  # of errors of unit precision, as all that follows
    columns = np.stack([*inspected.effects.values(), np.zeros(len(inspected.cable))], axis=1)[rows, : len(inspected.effects)]
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
    """Whether inspections tell more of wear than its prior does, whatever the coefficients are.

    Args:
        information: Precision of log coefficients and wear, (number, number).
        has: Which coefficients they have.
    """
    inside = information[:-1, :-1][np.ix_(has, has)]
    beside = information[:-1, -1][has]
    return bool(information[-1, -1] - beside @ np.linalg.solve(inside, beside) > 1 / WEAR.sd**2)
