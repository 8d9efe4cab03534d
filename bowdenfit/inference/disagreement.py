r"""Do the tables of a cable agree with each other?

For each table: how far it moves the parameters from where all the others put them, against how far it may. If all is right,
the move :math:`\delta` that a table makes has covariance :math:`V = H_{-t}^{-1} - H^{-1}`, with H the Gauss-Newton
information of everything and :math:`H_{-t}` that without the table; so :math:`\delta^\top V^+ \delta` is
chi-squared with as many degrees of freedom as V has directions, or F where few readings tell how much they scatter. A table
of many readings is weighed by its scatter about the best that it alone allows: the scatter about a fit that it contradicts
would hide the contradiction. Of few readings that scatter is too uncertain; theirs about the fit of all has to do.

A prior is no measurement, and contradicts nobody here: only directions count in which the other tables say much more than the
priors, whose information keeps the problem linear where nobody says anything. A parameter far out by its prior is said to be
so in its own words (`bowdenfit.inference.prior_sensitivity.prior_conflicts`).

References:
    Hausman, Specification tests in econometrics, Econometrica 46 (1978), 1251.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bowdenfit.inference.linearized import estimate_scatter
from bowdenfit.inference.scalar_priors import value_at
from bowdenfit.kinds.term import Term
from bowdenfit.parameters.space import Parameter

NOTICEABLE_SDS = 3.0  # sds; a table that is right says more than this three times in a thousand fits
_MANY = 8  # degrees of freedom from which a table's own scatter is known well enough
_LEAST_SCATTER = 1e-4  # readings that agree better than that, in units of their noise's prior, were not measured
_LITTLE = 0.1  # share of the priors in what all others say of a direction, up to which it is the tables that say it
_LEAST_MOVE = 1e-6  # share of a parameter's variance below which a table says nothing of it


@dataclass(frozen=True)
class Disagreement:
    """How well one table agrees with everything else.

    Args:
        table: Name of its readings.
        sds: How improbable the disagreement is, as so many standard deviations of a normal.
        conflict: By how much the sum of squares would fall if this table had parameters of its own; what is left then is
            the conflict among the others, so the table with the largest is the odd one out.
        parameter: The parameter that it moves farthest, in standard deviations.
        rest, rest_sd: What everything else says of that parameter, in its shown unit.
        together: What it is with the table.
    """

    table: str
    sds: float
    conflict: float
    parameter: str
    others: float = field(metadata={"key": "rest"})
    others_sd: float = field(metadata={"key": "rest_sd"})
    together: float


def find_disagreements(
    terms: Sequence[Term], parameters: Sequence[Parameter], solution: Mapping[str, Any]
) -> tuple[Disagreement, ...]:
    """How well each of several tables agrees with the others by what was found near the best fit; empty of one table."""
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
    """Residuals and Jacobian of a table in units of its scatter, and the degrees of freedom that this is known to."""

    residuals: np.ndarray
    jacobian: np.ndarray
    freedom: float


def _weigh_by_scatter(term: Term, residuals: np.ndarray, jacobian: np.ndarray, together: np.ndarray) -> _WeighedTable:
    u, s, _ = np.linalg.svd(jacobian, full_matrices=False)
    u = u[:, s > 1e-8 * max(s.max(initial=0.0), 1e-30)]
    of_itself, of_all = np.sum(u**2, axis=1), np.sum((jacobian @ together) * jacobian, axis=1)
    many = len(residuals) - of_itself.sum() >= _MANY
    about, leverage = (residuals - u @ (u.T @ residuals), of_itself) if many else (residuals, of_all)
    scale, spread = estimate_scatter([term], {term.name: about}, leverage)
    scale, known = np.maximum(scale, _LEAST_SCATTER), np.isfinite(spread[term.name])
    freedom = float(term.residual_blocks[0][1] - leverage.sum()) if known else np.inf
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
    """What a move says; None where the table says nothing that any other table says something of."""
    from scipy.special import chdtrc, fdtrc, ndtri

    covariance_of_others = np.linalg.inv(information_of_others)
    allowed = np.diag(covariance_of_others) - np.diag(covariance)
    # In units of what the rest leaves open, directions that the table says nothing of have no variance.
    root = np.linalg.cholesky(information_of_others)
    shares, directions = np.linalg.eigh(np.eye(len(move)) - root.T @ covariance @ root)
    of_priors = np.sum(np.linalg.solve(root.T, directions) ** 2, axis=0)
    informed = (shares > _LEAST_MOVE) & (of_priors < _LITTLE)
    along = directions[:, informed].T @ (root.T @ move)
    moved = np.flatnonzero((allowed > _LEAST_MOVE * np.diag(covariance_of_others)) & (np.diag(covariance_of_others) < _LITTLE))
    if not informed.any() or not len(moved):
        return None
    total, n = float(np.sum(along**2 / shares[informed])), int(informed.sum())
    p_value = fdtrc(n, max(freedom, 1.0), total / n) if np.isfinite(freedom) else chdtrc(n, total)
    sds = -float(ndtri(p_value / 2))
    farthest = moved[np.argmax(np.abs(move[moved]) / np.sqrt(allowed[moved]))]
    p = parameters[farthest]

    def shown(at: float) -> float:
        return value_at(p.prior, at) * p.shown_scale

    z_of_others, sd = best[farthest] - move[farthest], np.sqrt(covariance_of_others[farthest, farthest])
    spread = abs(shown(z_of_others + sd) - shown(z_of_others - sd)) / 2
    return Disagreement(table, min(sds, 37.0), total, p.name, shown(z_of_others), spread, shown(best[farthest]))
