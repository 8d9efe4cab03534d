"""Blocks of whole recordings: the effect of each run's mounting integrated out, and blocks of many recordings side by side.

What the operator of a single rope and that of a pull-pull loop share: both say how far each block is from the operator's
output, and how that output changes with the friction exponent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.load_cells import RUN_SCATTER
from bowdenfit.cable.noise import NoiseLaw
from bowdenfit.kinds.recordings.blocks import inside_phase, standing_share, worth_of
from bowdenfit.kinds.runs import ROW_ARRAYS
from bowdenfit.physics.normal_tail import log_normal_cdf
from bowdenfit.recordings.recording import Recording, Recordings

MOST_BLOCKS = 600  # of one recording in the play operator; more say no more once noise is averaged
_LEAST_TOTAL = 1e-20
_FREE = ("weight", "worth", "censored", "share", "drift", "restart")


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


def per_run(data: Mapping[str, Any], blocks: Float[Array, "time recordings"]) -> Float[Array, " runs"]:
    """Sum over the blocks of each run."""
    return jnp.zeros_like(data["n"]).at[data["run"]].add(jnp.sum(blocks, axis=0))


def better_guess(data: Mapping[str, Any], guess: Array, deviation: Array, loading: Array, reach: Array) -> Array:
    """The mounting effect of each recording that suits it best to first order, no further than `reach` from a guess."""
    by_recording = jnp.sum(data["weight"] * loading**2, axis=0)
    step = jnp.sum(data["weight"] * loading * deviation, axis=0) / jnp.maximum(by_recording, 1e-30)
    return guess + jnp.clip(step, -reach, reach)


def mounted(
    data: Mapping[str, Any],
    weights: Mapping[str, Array],
    noise: Array,
    deviation: Float[Array, "time recordings"],
    loading: Float[Array, "time recordings"],
    of_angles: Float[Array, " recordings"],
) -> Mounted:
    """The mounting effect of each run in closed form.

    Args:
        data: Arrays of `side_by_side`.
        weights: Values of the parameters that make the weights.
        noise: Standard deviation of a block of weight 1.
        deviation: Of the blocks, without mounting effects.
        loading: Change of the operator's output with the friction exponent.
        of_angles: Variance of each recording's friction exponent by its wrap angles.
    """
    # Blocks that no friction of this size can explain tell nothing of the effect: the limit, instead of 0 / 0.
    total = jnp.maximum(per_run(data, data["weight"] * loading**2), _LEAST_TOTAL)
    effect = per_run(data, data["weight"] * loading * deviation) / total
    from_angles = per_run(data, data["weight"] * loading**2 * of_angles) / total
    sd = jnp.sqrt(weights[RUN_SCATTER] ** 2 + from_angles + noise**2 / total)
    return Mounted(deviation - loading * effect[data["run"]], effect, sd, total)


def log_likelihood_of(
    data: Mapping[str, Any], found: Mounted, noise: Array, beyond: Float[Array, "time recordings"], law: NoiseLaw
) -> Float[Array, " runs"]:
    """Log likelihood of each run, all blocks together; these scatter normally about the run.

    Args:
        data: Arrays of `side_by_side`.
        found: What the blocks say.
        noise: Standard deviation of a block of weight 1.
        beyond: How far beyond the end of the range a saturated output is expected, in standard deviations of a block.
        law: How the runs scatter.
    """
    n = data["n"]
    scatter = per_run(data, data["weight"] * found.within**2)
    constant = (data["log_weights"] - jnp.log(found.total) - (n - 1) * jnp.log(2 * jnp.pi)) / 2
    inside = constant - (n - 1) * jnp.log(noise) - scatter / (2 * noise**2)
    log_probability = log_normal_cdf(beyond) * data["share"]
    censored = per_run(data, jnp.where(data["censored"] != 0, log_probability, 0.0))
    return inside + law.log_density(found.effect, 0.0, found.sd) + censored


def residuals_of(
    data: Mapping[str, Any], found: Mounted, noise: Array, beyond: Float[Array, "time recordings"], law: NoiseLaw
) -> Float[Array, " runs_and_blocks"]:
    """Standardized residuals of the same likelihood: between runs, and of the blocks of a run."""
    inside = jnp.sqrt(data["weight"]) * found.within / noise
    # Beyond 30 sd the root is 0 to the last digit, and its derivative would be 0 times infinity.
    root = jnp.sqrt(-2 * data["share"] * log_normal_cdf(jnp.minimum(beyond, 29.0)) + 1e-300)
    censored = jnp.where((data["censored"] != 0) & (beyond < 30.0), root, 0.0)
    between = law.residual(found.effect / jax.lax.stop_gradient(found.sd))
    return jnp.concatenate([between, (inside + censored).ravel()])


def residual_blocks_of(data: Mapping[str, Any], n_runs: int) -> tuple[tuple[int, int], ...]:
    """Runs scatter by their mounting; the blocks of a run about it by the load cells."""
    return ((n_runs, n_runs), (data["weight"].size, max(int(np.sum(data["n"])) - n_runs, 1)))


@dataclass(frozen=True)
class Thinned:
    """Blocks of one recording, joined inside their phases where there are many.

    Args:
        recording: The recording.
        starts: First block of each group that is joined.
    """

    recording: Recording
    starts: np.ndarray

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Mean of each group, by samples."""
        samples = self.recording.blocks.samples
        return np.add.reduceat(values * samples, self.starts) / np.add.reduceat(samples, self.starts)

    def any_of(self, flags: np.ndarray) -> np.ndarray:
        """Whether a flag is set in each group."""
        return np.maximum.reduceat(flags, self.starts)

    def worth(self, counted: np.ndarray, lost: np.ndarray) -> np.ndarray:
        """What each group is worth: the blocks that count, inside their phases, unless its input is not known."""
        stroke = self.recording.strokes.stroke
        each = worth_of(self.recording, np.arange(len(stroke))) * (counted & inside_phase(stroke))
        return np.add.reduceat(each * standing_share(stroke), self.starts) * ~lost

    def censored(self, saturated: np.ndarray, force_out: np.ndarray, lost: np.ndarray) -> dict[str, np.ndarray]:
        """Which end of the range the output lies beyond, and what that says.

        Args:
            saturated: Blocks whose output is beyond the end of the range, as far as that counts.
            force_out: Output force of each group [N].
            lost: Groups whose input is not known.
        """
        low, high = self.recording.account.limits
        end = np.where(force_out > (low + high) / 2 if np.isfinite(low + high) else np.isfinite(high), 1.0, -1.0)
        beyond = self.any_of(saturated) & ~lost
        each = worth_of(self.recording, np.arange(len(saturated)))
        share = np.add.reduceat(each * saturated, self.starts)
        return {"censored": np.where(beyond, end, 0.0), "share": np.where(beyond, share, 0.0)}


def thinned(recording: Recording, most: int = MOST_BLOCKS) -> Thinned:
    """The blocks of a recording, in groups where there are more than `most`."""
    return Thinned(recording, joined(recording.strokes.stroke, most))


def side_by_side(
    recordings: Recordings, parts: Sequence[Mapping[str, Any]], angles: Mapping[str, np.ndarray], held: Sequence[str]
) -> dict[str, Any]:
    """Arrays over time and recordings; the shorter ones stand still at their end, with no weight.

    Args:
        recordings: The recordings.
        parts: Arrays of each, all those of `_FREE` and of `held`.
        angles: `ROW_ARRAYS` of each.
        held: Names of the arrays that keep their last value.
    """
    longest = max(len(p["weight"]) for p in parts)

    def beside(name: str, mode: str) -> np.ndarray:
        return np.stack([np.pad(p[name], (0, longest - len(p[name])), mode) for p in parts], axis=1)  # type: ignore[call-overload]

    runs = recordings.runs
    run = np.array([runs.index(r.run) for r in recordings.each])
    free = {name: beside(name, "constant") for name in _FREE}
    worth = free.pop("worth")
    counted = free["weight"] > 0
    ratio = np.where(counted, free["weight"], 1.0) / np.where(counted, worth, 1.0)
    log_weights = np.where(counted, worth * np.log(ratio), 0.0)
    arrays = {name: angles[name] for name in ROW_ARRAYS} | {name: beside(name, "edge") for name in held} | free
    return arrays | {
        "run": run,
        "n": np.bincount(run, worth.sum(axis=0)),
        "log_weights": np.bincount(run, log_weights.sum(axis=0)),
    }


def joined(state: np.ndarray, most: int) -> np.ndarray:
    """First block of each group of blocks that are joined: of one phase only, its first and last block always alone.

    The operator stands where the end of a stroke left it, so the ends must not be averaged away.
    """
    factor = -(-len(state) // most)
    if factor == 1:
        return np.arange(len(state))
    phase = np.append(0, np.cumsum(np.diff(state) != 0))
    first = np.append(True, np.diff(phase) != 0)
    last = np.append(first[1:], True)
    place = np.arange(len(state)) - np.maximum.accumulate(np.where(first, np.arange(len(state)), 0))
    return np.flatnonzero(first | last | (place % factor == 1))
