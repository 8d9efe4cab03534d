r"""Agreement of the tables of a cable with each other.

For each table: how far it moves the parameters from the estimate by all other tables, compared with what is expected. If the
model is correct, the move :math:`\delta` that a table makes has covariance :math:`V = H_{-t}^{-1} - H^{-1}`, with H the
Gauss-Newton information of everything and :math:`H_{-t}` that without the table; so :math:`\delta^\top V^+ \delta` is
chi-squared with as many degrees of freedom as V has directions, or F where few readings tell how much they scatter. A table of
many readings is weighted by its scatter about the best fit to that table alone: the scatter about a fit that it contradicts
would hide the contradiction. With few readings that scatter is too uncertain, and the scatter about the common fit is used.

Priors do not count as measurements here: only directions count in which the other tables carry much more information than the
priors, which merely keep the problem regular. A parameter that conflicts with its prior is reported separately
(`bowdenfit.inference.prior_sensitivity.find_prior_conflicts`).

References:
    Hausman, Specification tests in econometrics, Econometrica 46 (1978), 1251.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtrc, fdtrc, ndtri

from bowdenfit.inference.linearized import estimate_scatter
from bowdenfit.inference.scalar_priors import value_at
from bowdenfit.kinds.term import Term
from bowdenfit.parameters.space import Parameter

NOTICEABLE_SDS = 3.0  # standard deviations; a table that agrees exceeds this in three of a thousand fits (two-sided normal)
_MANY = 8  # spare degrees of freedom from which a table's own scatter is known well enough, to 25 %; a judgement
_LEAST_SCATTER = 1e-4  # in units of the noise prior; readings that scatter less were not measured
_LITTLE = 0.1  # most share of the priors in the information of the other tables along a direction that counts; a judgement
_LEAST_MOVE = 1e-6  # share of a parameter's variance below which a table carries no information about it


@dataclass(frozen=True)
class Disagreement:
    """Disagreement of one table with everything else.

    Args:
        table: Name of the table.
        sds: Improbability of the disagreement, as standard deviations of a normal.
        conflict: By how much the sum of squares would fall if this table had parameters of its own. The remainder is the
            conflict among the others, so the table with the largest value is the odd one out.
        parameter: The parameter that it moves farthest, in standard deviations.
        others, others_sd: Estimate of that parameter by all other tables, in its shown unit, and its standard deviation.
        together: Estimate with this table.
    """

    table: str
    sds: float
    conflict: float
    parameter: str
    others: float
    others_sd: float
    together: float


def find_disagreements(
    terms: Sequence[Term], parameters: Sequence[Parameter], solution: Mapping[str, Any]
) -> tuple[Disagreement, ...]:
    """Return how well each table agrees with the others near the best fit; empty for a single table."""
    residuals, z = [solution["residuals"][term.name] for term in terms], solution["z"]
    if len(terms) < 2 or not all(np.isfinite(part).all() for part in (*residuals, solution["jacobian"])):
        return ()
    jacobians = np.split(solution["jacobian"], np.cumsum([len(r) for r in residuals])[:-1])
    together = np.linalg.inv(sum((j.T @ j for j in jacobians), np.eye(len(z))))
    weighed = [_weigh_by_scatter(*table, together) for table in zip(terms, residuals, jacobians, strict=True)]
    information = [w.jacobian.T @ w.jacobian for w in weighed]
    scores = [w.jacobian.T @ w.residuals for w in weighed]
    whole = sum(information, np.eye(len(z)))
    best, covariance = z - np.linalg.solve(whole, sum(scores, z)), np.linalg.inv(whole)
    disagreements = []
    for term, table, own in zip(terms, weighed, information, strict=True):
        # Summed up, not subtracted: digits would cancel where one table says almost everything.
        information_of_others = sum((i for i in information if i is not own), np.eye(len(z)))
        move = -np.linalg.solve(information_of_others, table.jacobian.T @ (table.residuals + table.jacobian @ (best - z)))
        disagreements.append(_assess_move(term.name, move, information_of_others, covariance, table.freedom, parameters, best))
    return tuple(d for d in disagreements if d is not None)


@dataclass(frozen=True)
class _WeighedTable:
    """Residuals and Jacobian of a table in units of its scatter, and the degrees of freedom of that scatter."""

    residuals: np.ndarray
    jacobian: np.ndarray
    freedom: float


def _weigh_by_scatter(term: Term, residuals: np.ndarray, jacobian: np.ndarray, together: np.ndarray) -> _WeighedTable:
    u, s, _ = np.linalg.svd(jacobian, full_matrices=False)
    u = u[:, s > 1e-8 * max(s.max(initial=0.0), 1e-30)]
    own_leverage, common_leverage = np.sum(u**2, axis=1), np.sum((jacobian @ together) * jacobian, axis=1)
    has_own_scatter = len(residuals) - own_leverage.sum() >= _MANY
    about, leverage = (residuals - u @ (u.T @ residuals), own_leverage) if has_own_scatter else (residuals, common_leverage)
    scale, spread = estimate_scatter([term], {term.name: about}, leverage)
    scale, finite = np.maximum(scale, _LEAST_SCATTER), np.isfinite(spread[term.name])
    freedom = float(term.residual_blocks[0][1] - leverage.sum()) if finite else np.inf
    return _WeighedTable(residuals / scale, jacobian / scale[:, None], freedom)


def _assess_move(
    table: str,
    move: np.ndarray,
    information_of_others: np.ndarray,
    covariance: np.ndarray,
    freedom: float,
    parameters: Sequence[Parameter],
    best: np.ndarray,
) -> Disagreement | None:
    """Return what a move means; None where the table shares no information with any other table."""
    covariance_of_others = np.linalg.inv(information_of_others)
    allowed = np.diag(covariance_of_others) - np.diag(covariance)
    # In units of what the rest leaves open, directions that the table says nothing of have no variance.
    root = np.linalg.cholesky(information_of_others)
    shares, directions = np.linalg.eigh(np.eye(len(move)) - root.T @ covariance @ root)
    prior_share = np.sum(np.linalg.solve(root.T, directions) ** 2, axis=0)
    informed = (shares > _LEAST_MOVE) & (prior_share < _LITTLE)
    along = directions[:, informed].T @ (root.T @ move)
    moved = np.flatnonzero((allowed > _LEAST_MOVE * np.diag(covariance_of_others)) & (np.diag(covariance_of_others) < _LITTLE))
    if not informed.any() or not len(moved):
        return None
    total, n = float(np.sum(along**2 / shares[informed])), int(informed.sum())
    p_value = fdtrc(n, max(freedom, 1.0), total / n) if np.isfinite(freedom) else chdtrc(n, total)
    sds = -float(ndtri(p_value / 2))
    farthest = moved[np.argmax(np.abs(move[moved]) / np.sqrt(allowed[moved]))]
    p = parameters[farthest]

    def to_shown_unit(at: float) -> float:
        return value_at(p.prior, at) * p.shown_scale

    z_of_others, sd = best[farthest] - move[farthest], np.sqrt(covariance_of_others[farthest, farthest])
    spread = abs(to_shown_unit(z_of_others + sd) - to_shown_unit(z_of_others - sd)) / 2
    return Disagreement(table, min(sds, 37.0), total, p.name, to_shown_unit(z_of_others), spread, to_shown_unit(best[farthest]))
