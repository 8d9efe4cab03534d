"""What a batch of data sets is fitted with: settings, and programs compiled once for all data of one shape."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import jax
import numpy as np

from bowdenfit.description import SamplerSettings
from bowdenfit.description.defaults import WALKERS_PER_PARAMETER
from bowdenfit.inference.batch.ensembles import make_round
from bowdenfit.inference.batch.laplace import points_of_climb
from bowdenfit.inference.batch.weights import BLOCK
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import noise_scales

# Data sets that a program takes at once, always as many, so that rounding is the same: to weigh, and to walk, where the last
# of all goes on alone, and fewer than two at once take longer each.
CHUNK, WALKING = 16, 2


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
        threads: How many chunks at once; as many as there are cores if omitted.
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
    """

    posterior: LogDensity
    settings: BatchSettings

    def _of_points(self, function: Callable[..., Any], count: int) -> Callable[..., Any]:
        """Compiled: what a function of z and data gives at so many points of each data set."""
        shape = jax.ShapeDtypeStruct((CHUNK, count, self.posterior.model.space.size), np.dtype(float))
        return compile_program(jax.vmap(jax.vmap(function, (0, None))), shape, stack([self.posterior.data], CHUNK))

    @cached_property
    def gradients(self) -> Callable[..., Any]:
        """Log density and gradient, for climbing."""
        points = points_of_climb(self.posterior.model.space.size)
        return self._of_points(jax.value_and_grad(self.posterior.log_density), points)

    @cached_property
    def densities(self) -> Callable[..., Any]:
        """Log density of a block of draws."""
        return self._of_points(self.posterior.log_density, BLOCK)

    @cached_property
    def ensembles(self) -> Callable[..., Any]:
        """A round of all walkers."""
        data = stack([self.posterior.data], WALKING)
        return make_round(self.posterior, self.settings.sampler.n_ensembles, self.n_walkers, data)

    @property
    def threads(self) -> int:
        """How many chunks at once."""
        return self.settings.threads or len(os.sched_getaffinity(0))

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
        from bowdenfit.inference.nuts import make_program

        return make_program(self.posterior, self.settings.sampler)

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


def stack(trees: Sequence[Any], count: int) -> Any:
    """Data of several data sets, along a new first axis, and the last again up to a count."""
    padded = [*trees, *[trees[-1]] * (count - len(trees))]
    return jax.tree.map(lambda *leaves: np.stack(leaves), *padded)
