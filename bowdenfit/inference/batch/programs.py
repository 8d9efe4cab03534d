"""What a batch of data sets is fitted with: settings, and programs compiled once for all data of one shape."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from threading import Lock
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.description import SamplerSettings
from bowdenfit.description.defaults import WALKERS_PER_PARAMETER
from bowdenfit.inference.batch.ensembles import compile_round
from bowdenfit.inference.batch.laplace import count_climb_points
from bowdenfit.inference.batch.proposals import ProposedPoints
from bowdenfit.inference.batch.weights import BLOCK
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.conditional import Conditional
from bowdenfit.inference.coordinates import identity
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import noise_scales

CHUNK = 16  # data sets that climb at once, always as many, so that rounding is the same
# Of threads that share one interpreter: 96 fits of the on-body cable took 27 s with 4 on 16 cores, and 41 s with 17.
MOST_AT_ONCE = 4


@dataclass(frozen=True)
class BatchSettings:
    """How carefully a batch is fitted.

    Args:
        sampler: Ensembles, their walkers at the least (a power of two), most steps, and targets; those of NUTS where it is
            needed.
        target_sd_error: Largest Monte Carlo error of a standard deviation, as a share of it; a tenth is hardly ever exceeded.
            Long tails need many more draws for it than for a mean or a rank.
        n_kept: Draws of equal weight that are made of weighted ones.
        nuts: Whether NUTS takes what the ensembles leave.
        threads: How many data sets at once; if omitted one more than there are cores, for while one is not computing, but
            `MOST_AT_ONCE` at most.
    """

    sampler: SamplerSettings = field(
        default_factory=lambda: SamplerSettings(
            n_ensembles=2, n_walkers=64, max_steps=20_000, target_ess=400, target_r_hat=1.03
        )
    )
    target_sd_error: float = 0.033
    n_kept: int = 2048
    nuts: bool = True
    threads: int = 0

    def __post_init__(self) -> None:
        walkers = self.sampler.walkers(0)
        if walkers & (walkers - 1):
            raise ValueError(f"an ensemble of a batch needs a power of two of walkers, such as 128, and not {walkers}.")


@dataclass(frozen=True)
class BatchPrograms:
    """What is compiled for data of one shape; may serve several batches.

    Args:
        posterior: Its model is that of all data sets.
        settings: How carefully they are fitted.
        compiling: Held by the thread that compiles what all need.
    """

    posterior: LogDensity
    settings: BatchSettings
    compiling: Lock = field(default_factory=Lock, repr=False, compare=False)

    @cached_property
    def gradients(self) -> Callable[..., Any]:
        """Log density and gradient, for climbing."""
        size, gradient = self.posterior.model.space.size, jax.value_and_grad(self.posterior.log_density)
        shape = jax.ShapeDtypeStruct((CHUNK, count_climb_points(size), size), np.dtype(float))
        return compile_program(jax.vmap(jax.vmap(gradient, (0, None))), shape, stack_data([self.posterior.data], CHUNK))

    @cached_property
    def evaluate_points(self) -> Callable[..., Any]:
        """`ProposedPoints` of a block of points of one data set, of each of which it is said whether it is a z."""
        conditional, posterior = Conditional(self.posterior), self.posterior
        coordinate_map = conditional.map_point if conditional.has_coefficients else identity

        def evaluate(point: Array, is_z: Array, data: Any) -> ProposedPoints:
            w, z, log_volume = coordinate_map(point, is_z, data)
            log_density, has_z = posterior.log_density(z, data), jnp.isfinite(z).all()
            has_w, known = jnp.isfinite(w).all() & jnp.isfinite(log_volume), has_z & jnp.isfinite(log_density)
            z, w = jnp.where(has_z, z, 0.0), jnp.where(has_w, w, 0.0)
            return ProposedPoints(w, z, jnp.where(has_w, log_volume, jnp.inf), jnp.where(known, log_density, -jnp.inf))

        rows = jax.ShapeDtypeStruct((BLOCK, posterior.model.space.size), np.dtype(float))
        is_z = jax.ShapeDtypeStruct((BLOCK,), np.dtype(bool))
        return compile_program(jax.vmap(evaluate, (0, 0, None)), rows, is_z, posterior.data)

    @cached_property
    def ensembles(self) -> Callable[..., Any]:
        """A round of all walkers."""
        return compile_round(self.posterior, self.settings.sampler.n_ensembles, self.n_walkers)

    @property
    def threads(self) -> int:
        """How many data sets at once."""
        return self.settings.threads or min(len(os.sched_getaffinity(0)) + 1, MOST_AT_ONCE)

    @property
    def n_walkers(self) -> int:
        """Of each ensemble: enough for a covariance to be fitted to half of them, doubled until they are."""
        walkers = self.settings.sampler.walkers(0)
        while walkers < WALKERS_PER_PARAMETER * self.posterior.model.space.size:
            walkers *= 2
        return walkers

    @cached_property
    def nuts(self) -> Callable[..., Any]:
        """NUTS of one data set."""
        from bowdenfit.inference.nuts import compile_nuts

        return compile_nuts(self.posterior, self.settings.sampler)

    @cached_property
    def noise(self) -> np.ndarray:
        """Which parameters are noise scales."""
        return noise_scales(self.posterior)

    @cached_property
    def friction(self) -> np.ndarray:
        """Which are friction coefficients."""
        return np.array([p.role == "friction" for p in self.posterior.model.space.free], dtype=bool)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the parameters, in the order of z."""
        return tuple(p.name for p in self.posterior.model.space.free)


def stack_data(trees: Sequence[Any], count: int) -> Any:
    """Data of several data sets, along a new first axis, and the last again up to a count."""
    padded = [*trees, *[trees[-1]] * (count - len(trees))]
    return jax.tree.map(lambda *leaves: np.stack(leaves), *padded)
