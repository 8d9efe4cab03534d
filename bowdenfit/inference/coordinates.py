"""Coordinates w in which walkers move: z, values of the parameters, and friction coefficients given everything else.

Any one-to-one map leaves what is sampled as it is, because the volume in w of a unit of z is counted.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

import jax
import numpy as np

from bowdenfit.inference.conditional import Conditional
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.value_chart import chart_values

Places = tuple[np.ndarray, np.ndarray]  # of walkers (rows), and log of the volume in w of a unit of z there


@runtime_checkable
class Coordinates(Protocol):
    """What walkers move in."""

    def from_z(self, z: np.ndarray) -> Places:
        """W of z."""
        ...

    def to_z(self, w: np.ndarray) -> Places:
        """Z of w; NaN where there is none."""
        ...


def shares_of_coordinates(z: Any, values: Any, ridge: Any) -> Sequence[tuple[Any, float]]:
    """In what walkers move, single or in a batch, and how often.

    By measurement on simulated on-body data, whose scatter between mountings mixes five times as fast for the ridge. Half of
    all is done in values where there is no friction coefficient that readings tell of.

    Args:
        z, values, ridge: The coordinates, in NumPy or in JAX; None in place of those that there are not.
    """
    found = ((z, 0.25), (values, 0.25), (ridge, 0.5)) if ridge is not None else ((z, 0.5), (values, 0.5))
    return tuple((each if each is not None else z, share) for each, share in found)


class Z:
    """Z itself."""

    def from_z(self, z: np.ndarray) -> Places:
        """See `Coordinates`."""
        return z.copy(), np.zeros(len(z))

    to_z = from_z


class WalkerPrograms(NamedTuple):
    """What is compiled for walkers, for batches of half of them all.

    Args:
        log_density: Of z and data.
        ridge: `Conditional.both_ways`; None where there is none.
    """

    log_density: Callable[..., Any]
    ridge: Callable[..., Any] | None = None


def walker_programs(posterior: LogDensity, batch: int) -> WalkerPrograms:
    """The programs of one posterior, compiled for batches of half of all walkers."""
    conditional = Conditional(posterior)
    chart_values(posterior.model.space)  # kept for the sampler
    ridge = conditional.program(batch) if conditional.is_told else None
    return WalkerPrograms(posterior.batched_log_density(batch), ridge)


@dataclass(frozen=True)
class Ridge:
    """Coefficients given everything else, in units of their ridge.

    Args:
        program: `Conditional.both_ways` for batches.
        batch: How many at a time.
        data: Data of the posterior.
    """

    program: Callable[..., Any]
    batch: int
    data: Any

    def from_z(self, z: np.ndarray) -> Places:
        """See `Coordinates`."""
        return self._way(z, 0)

    def to_z(self, w: np.ndarray) -> Places:
        """See `Coordinates`."""
        return self._way(w, 1)

    def _way(self, points: np.ndarray, way: int) -> Places:
        parts = [self.program(part, self.data)[way] for part in points.reshape(-1, self.batch, points.shape[1])]
        places, volumes = (np.concatenate([np.asarray(part[i]) for part in parts]) for i in (0, 1))
        return places, volumes


def coordinates_of(posterior: LogDensity, programs: WalkerPrograms, batch: int) -> Sequence[tuple[Coordinates, float]]:
    """The coordinates that walkers of a single fit move in, with their shares."""
    chart, data = chart_values(posterior.model.space), jax.device_put(posterior.data)
    ridge = None if programs.ridge is None else Ridge(programs.ridge, batch, data)
    return shares_of_coordinates(Z(), chart if len(chart.which) else None, ridge)
