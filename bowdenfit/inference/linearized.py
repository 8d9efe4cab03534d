"""What the Jacobian and the residuals at a minimum say: which parameters the readings determine, and how readings scatter."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bowdenfit.inference.solver import orthogonalize
from bowdenfit.kinds.term import Term

_SINGULAR = 1e-8  # singular values below this fraction of the largest carry no information
_LEAST_FREEDOM = 0.5  # degrees of freedom below which the scatter of a table cannot be estimated
_LEAST_LEVERAGE = 1e-6  # leverage from which a residual is that of a reading


@dataclass(frozen=True)
class Linearized:
    """The least-squares problem about its minimum.

    Args:
        readings: Orthonormal columns: the directions of the readings that move parameters.
        parameters: How far a unit error along each of those moves the parameters.
        determined: Whether the readings determine a parameter.
        condition_number: Of the Jacobian; infinite where a direction is undetermined.
    """

    readings: np.ndarray
    parameters: np.ndarray
    determined: np.ndarray
    condition_number: float

    @property
    def leverage(self) -> np.ndarray:
        """How much each reading decides about its own fit, 0 to 1."""
        return np.sum(self.readings**2, axis=1)

    @property
    def unit_error(self) -> np.ndarray:
        """Standard errors of the parameters by readings of unit scatter."""
        return np.linalg.norm(self.parameters, axis=1)

    def moves(self, scale: np.ndarray) -> np.ndarray:
        """How far each reading moves each parameter by one standard deviation of its scatter."""
        return self.parameters @ (self.readings.T * scale)


def linearize(jacobian: np.ndarray) -> Linearized:
    """The problem about its minimum: by QR, or by singular values where these find directions undetermined."""
    rows, n = jacobian.shape
    if n == 0:
        return Linearized(np.zeros((rows, 0)), np.zeros((0, 0)), np.zeros(0, dtype=bool), 1.0)
    padded = np.concatenate([jacobian, np.zeros((max(n - rows, 0), n))])
    u, s, vt = np.linalg.svd(padded, full_matrices=False)
    informed = s > _SINGULAR * max(s[0], 1e-30)
    if informed.all():
        return Linearized(*orthogonalize(jacobian), np.ones(n, dtype=bool), float(s[0] / s[-1]))
    determined = np.sum(vt[~informed] ** 2, axis=0) <= 1e-6
    return Linearized(u[:rows, informed], vt[informed].T / s[informed], determined, float("inf"))


def estimate_scatter(
    terms: Sequence[Term], residuals: Mapping[str, np.ndarray], leverage: np.ndarray
) -> tuple[np.ndarray, dict[str, float]]:
    """Scatter of the standardized residuals about the fit: for each residual, and by table (of its first block)."""
    scale = np.ones(len(leverage))
    by_table: dict[str, float] = {}
    for name, rows, values, freedom in iterate_blocks(terms, residuals, leverage):
        spread = float(np.sqrt(np.sum(values**2) / freedom)) if np.isfinite(freedom) else float("nan")
        scale[rows] = spread if np.isfinite(spread) else 1.0
        by_table.setdefault(name, spread)
    return scale, by_table


def iterate_blocks(
    terms: Sequence[Term], residuals: Mapping[str, np.ndarray], leverage: np.ndarray
) -> Iterator[tuple[str, slice, np.ndarray, float]]:
    """Table, rows, residuals and degrees of freedom of every block of residuals that scatter alike.

    A block whose residuals are all used up by parameters has no scatter of its own; its weight stands, to infinitely many
    degrees of freedom.
    """
    start = 0
    for term in terms:
        first = start
        for count, independent in term.residual_blocks:
            rows, values = slice(start, start + count), residuals[term.name][start - first : start - first + count]
            # A reading that parameters of its own fit exactly is one whatever rounding leaves; a bound that is met is none.
            read = int(np.count_nonzero((values != 0) | (leverage[rows] > _LEAST_LEVERAGE)))
            freedom = min(read, independent) - float(leverage[rows].sum())
            yield term.name, rows, values, freedom if freedom > _LEAST_FREEDOM else float("inf")
            start = rows.stop
