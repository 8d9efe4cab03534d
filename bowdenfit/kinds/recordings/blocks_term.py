"""Every block of recordings through the play operator, the effect of each run's mounting integrated out.

The same for a single rope and for a pull-pull loop but for what a recording by itself says of its friction, which is where
the operator is linearized, and for the reading of a run in results.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.drive import Each, Loop, Recorded, Rope, drive_of
from bowdenfit.cable.load_cells import BLOCK_NOISE, RUN_SCATTER, LoadCells
from bowdenfit.cable.noise import noise_law
from bowdenfit.kinds.padding import rounded_up
from bowdenfit.kinds.recordings.side_by_side import WITHOUT_WEIGHT
from bowdenfit.kinds.resolve_angles import resolve_angles
from bowdenfit.kinds.sliding_rows import ROW_ARRAYS
from bowdenfit.physics.distributions import log_normal_cdf

_LEAST_TOTAL = 1e-20

Values = Mapping[str, Array]
Data = Mapping[str, Any]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Mounted:
    """What blocks say with the mounting effects integrated out.

    Args:
        within: Deviations of the blocks from their run's own mounting effect.
        effect: That effect, of each run [1].
        sd: Its standard deviation, of each run [1].
        total: What the blocks of each run tell of it.
    """

    within: Array
    effect: Array
    sd: Array
    total: Array


@dataclass(frozen=True)
class BlocksTerm(ABC):
    r"""Likelihood of every block of whole recordings, one value a run.

    The output is linear in the mounting effect m ~ Normal(0, tau) of a run but for changes of contact (and, of a loop, while
    its return side is taut), so that m integrates out in closed form at the value that suits the recording best: two passes
    of the operator, one to find it, one to linearize there. With Student noise each run's mounting effect, with what noise
    adds to it, is a Student-t; the blocks scatter normally about their run.

    Args:
        cable: The cable.
        data: Arrays over time and recordings (forces, velocity, weight), over recordings and over runs.
        labels: Each run in words.
    """

    cable: Cable = field(repr=False)
    data: dict[str, Any] = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    noise: str = RUN_SCATTER
    reading_noise: str = BLOCK_NOISE

    @abstractmethod
    def _first_guess(self, drive: Any, data: Data) -> tuple[Each, Each]:
        """Mounting effect of each recording by its own hysteresis, and how far from it a better one is looked for [1]."""

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Runs scatter by their mounting; the blocks of a run about it by the load cells."""
        runs, blocks = len(self.labels), int(np.sum(self.data["n"]))
        return ((runs, runs), (self.data["weight"].size, max(blocks - runs, 1)))

    @property
    def padded(self) -> dict[str, Any]:
        """See `LogDensity.padded`: recordings that stand still for longer at their end, with no weight."""
        blocks = len(self.data["weight"])
        missing = ((0, rounded_up(blocks) - blocks), (0, 0))
        long = {
            name: np.pad(values, missing, "constant" if name in WITHOUT_WEIGHT else "edge")
            for name, values in self.data.items()
            if np.ndim(values) == 2 and name not in ROW_ARRAYS
        }
        return self.data | long

    def _per_run(self, data: Data, blocks: Recorded) -> Float[Array, " runs"]:
        """Sum over the blocks of each run."""
        return jnp.zeros_like(data["n"]).at[data["run"]].add(jnp.sum(blocks, axis=0))

    def _drive(self, values: Values, data: Data) -> tuple[Any, Array, Array]:
        """The cable as it lies in each recording, its wrap angles and their variances."""
        angles, variance = resolve_angles(self.cable, values, data)
        return drive_of(self.cable, values, angles, data["velocity"]), angles, variance

    def _followed(self, drive: Rope | Loop, cells: LoadCells, data: Data, mounting: Each) -> tuple[Recorded, Recorded]:
        """Deviation of the readings from the operator's output, and the output's derivative by the exponent."""
        stands = drive.scaled(cells.true_output(data["output_force"], drive.least_force))
        force = cells.true_input(data["likely_force"], drive.least_force)
        anew = jnp.where(data["restart"], stands, jnp.nan)
        followed = drive.follow(force, mounting, stands[0], anew, data["input_noise"])
        expected, loading = drive.shown(cells, *followed)
        return data["reading"] + cells.late(data["drift"]) - expected, loading

    def _deviations(self, values: Values, data: Data, weights: Values) -> Mounted:
        """What the blocks say with the mounting integrated out."""
        (drive, angles, variance), cells = self._drive(values, data), LoadCells.of(values)
        guess, reach = self._first_guess(drive, data)
        deviation, loading = self._followed(drive, cells, data, guess)
        by_recording = jnp.sum(data["weight"] * loading**2, axis=0)
        step = jnp.sum(data["weight"] * loading * deviation, axis=0) / jnp.maximum(by_recording, 1e-30)
        guess = guess + jnp.clip(step, -reach, reach)
        deviation, loading = self._followed(drive, cells, data, guess)
        of_angles = self.cable.exponent_variance(weights, angles, variance)
        return self._mounted(data, weights, deviation + loading * guess, loading, of_angles)

    def _mounted(self, data: Data, weights: Values, deviation: Recorded, loading: Recorded, of_angles: Each) -> Mounted:
        """The mounting effect of each run in closed form.

        Args:
            data: Arrays of the term.
            weights: Values of the parameters that make the weights.
            deviation: Of the blocks, without mounting effects.
            loading: Change of the operator's output with the friction exponent.
            of_angles: Variance of each recording's friction exponent by its wrap angles.
        """
        # Blocks that no friction of this size can explain tell nothing of the effect: the limit, instead of 0 / 0.
        total = jnp.maximum(self._per_run(data, data["weight"] * loading**2), _LEAST_TOTAL)
        effect = self._per_run(data, data["weight"] * loading * deviation) / total
        from_angles = self._per_run(data, data["weight"] * loading**2 * of_angles) / total
        sd = jnp.sqrt(weights[RUN_SCATTER] ** 2 + from_angles + weights[self.reading_noise] ** 2 / total)
        return Mounted(deviation - loading * effect[data["run"]], effect, sd, total)

    def _beyond(self, data: Data, found: Mounted, noise: Array) -> Recorded:
        """How far beyond the end of the range a saturated output is expected, in standard deviations of a block."""
        return data["censored"] * -found.within * data["newtons"] / noise

    def log_likelihood(self, values: Values, data: Data) -> Float[Array, " runs"]:
        """Log likelihood of each run, all blocks together; these scatter normally about the run."""
        found, noise, n = self._deviations(values, data, values), values[self.reading_noise], data["n"]
        squares = self._per_run(data, data["weight"] * found.within**2)
        constant = (data["log_weights"] - jnp.log(found.total) - (n - 1) * jnp.log(2 * jnp.pi)) / 2
        inside = constant - (n - 1) * jnp.log(noise) - squares / (2 * noise**2)
        log_probability = log_normal_cdf(self._beyond(data, found, noise)) * data["share"]
        censored = self._per_run(data, jnp.where(data["censored"] != 0, log_probability, 0.0))
        return inside + noise_law(self.cable.description).log_density(found.effect, 0.0, found.sd) + censored

    def residuals(self, values: Values, data: Data) -> Float[Array, " runs_and_blocks"]:
        """Standardized residuals of the same likelihood: between runs, and of the blocks of a run."""
        found = self._deviations(values, data, jax.lax.stop_gradient(dict(values)))
        noise = jax.lax.stop_gradient(values[self.reading_noise])
        beyond = self._beyond(data, found, noise)
        inside = jnp.sqrt(data["weight"]) * found.within / noise
        # Beyond 30 sd the root is 0 to the last digit, and its derivative would be 0 times infinity.
        root = jnp.sqrt(-2 * data["share"] * log_normal_cdf(jnp.minimum(beyond, 29.0)) + 1e-300)
        censored = jnp.where((data["censored"] != 0) & (beyond < 30.0), root, 0.0)
        between = noise_law(self.cable.description).residual(found.effect / jax.lax.stop_gradient(found.sd))
        return jnp.concatenate([between, (inside + censored).ravel()])
