"""Linearization about a least-squares minimum: which parameters the readings determine, leverage, and scatter."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bowdenfit.inference.solver import orthogonalize
from bowdenfit.kinds.term import Term

_SINGULAR = 1e-8  # relative singular value below which a direction carries no information
_LEAST_FREEDOM = 0.5  # degrees of freedom below which the scatter of a table cannot be estimated
# leverage from which a zero residual belongs to a reading that is fitted exactly, not to a bound that holds
_LEAST_LEVERAGE = 1e-6


@dataclass(frozen=True)
class Linearized:
    """The least-squares problem about its minimum.

    Args:
        readings: Orthonormal columns: directions of the readings, and of priors that count below them, that move parameters.
        parameters: Change of the parameters by a unit error along each of those directions.
        determined: Whether the readings determine each parameter.
        condition_number: Condition number of the Jacobian; infinite where a direction is undetermined.
        n_readings: Number of readings, without priors.
    """

    readings: np.ndarray
    parameters: np.ndarray
    determined: np.ndarray
    condition_number: float
    n_readings: int

    @property
    def leverage(self) -> np.ndarray:
        """Leverage of each reading, 0 to 1."""
        return np.sum(self.readings[: self.n_readings] ** 2, axis=1)

    @property
    def unit_error(self) -> np.ndarray:
        """Standard errors of the parameters if readings have unit scatter."""
        return np.linalg.norm(self.parameters, axis=1)

    def moves(self, scale: np.ndarray) -> np.ndarray:
        """How far one standard deviation of each reading's scatter, and below them of each prior, moves each parameter."""
        priors = np.ones(len(self.readings) - self.n_readings)
        return self.parameters @ (self.readings.T * np.concatenate([scale, priors]))


def linearize(readings_jacobian: np.ndarray, penalty: np.ndarray) -> Linearized:
    """Linearize the problem: by QR, or by singular values where these find directions undetermined.

    Args:
        readings_jacobian: Jacobian of the residuals, (reading, parameter).
        penalty: Weight of each parameter's prior; 0 where it does not count.
    """
    n_readings, n = readings_jacobian.shape
    jacobian = np.concatenate([readings_jacobian, np.diag(penalty)[penalty > 0]])
    rows = len(jacobian)
    if n == 0:
        return Linearized(np.zeros((rows, 0)), np.zeros((0, 0)), np.zeros(0, dtype=bool), 1.0, n_readings)
    padded = np.concatenate([jacobian, np.zeros((max(n - rows, 0), n))])
    u, s, vt = np.linalg.svd(padded, full_matrices=False)
    informed = s > _SINGULAR * max(s[0], 1e-30)
    if informed.all():
        return Linearized(*orthogonalize(jacobian), np.ones(n, dtype=bool), float(s[0] / s[-1]), n_readings)
    determined = np.sum(vt[~informed] ** 2, axis=0) <= 1e-6
    return Linearized(u[:rows, informed], vt[informed].T / s[informed], determined, float("inf"), n_readings)


def estimate_scatter(
    terms: Sequence[Term], residuals: Mapping[str, np.ndarray], leverage: np.ndarray
) -> tuple[np.ndarray, dict[str, float]]:
    """Return the scatter of the standardized residuals: for each residual, and by table (of its first block)."""
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
    """Yield table, rows, residuals and degrees of freedom of every block of residuals with a common scatter.

    A block without spare degrees of freedom has no scatter of its own; its prior weight is used, with infinitely many degrees
    of freedom.
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
