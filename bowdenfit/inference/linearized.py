"""What the Jacobian at a minimum says: which parameters the readings determine, and how errors of readings move them."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.inference.solver import orthogonal

_SINGULAR = 1e-8  # singular values below this fraction of the largest carry no information


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


def linearized(jacobian: np.ndarray) -> Linearized:
    """The problem about its minimum: by QR, or by singular values where these find directions undetermined."""
    rows, n = jacobian.shape
    if n == 0:
        return Linearized(np.zeros((rows, 0)), np.zeros((0, 0)), np.zeros(0, dtype=bool), 1.0)
    padded = np.concatenate([jacobian, np.zeros((max(n - rows, 0), n))])
    u, s, vt = np.linalg.svd(padded, full_matrices=False)
    informed = s > _SINGULAR * max(s[0], 1e-30)
    if informed.all():
        return Linearized(*orthogonal(jacobian), np.ones(n, dtype=bool), float(s[0] / s[-1]))
    determined = np.sum(vt[~informed] ** 2, axis=0) <= 1e-6
    return Linearized(u[:rows, informed], vt[informed].T / s[informed], determined, float("inf"))
