"""Every block of whole recordings through the play operator, the effect of each run's mounting integrated out.

A single rope and a pull-pull loop differ only in what a recording by itself says of its friction, which is where the operator
is linearized, and in the reading of a run in results: an efficiency of a rope, a mean lost force of a loop.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.drive import LoopDrive, PerRecording, PerTime, RopeDrive, make_drive
from bowdenfit.cable.sensors import BLOCK_NOISE, RUN_SCATTER, LoadCells, noise_law, scatter
from bowdenfit.kinds.recordings.blocks import (
    RECORDED,
    WITHOUT_WEIGHT,
    block_steps,
    group_blocks,
    is_under_tension,
    pad_columns,
    smooth_forces,
    stack_recordings,
)
from bowdenfit.kinds.row_angles import RowAngles, resolve_angles
from bowdenfit.kinds.term import round_up_count
from bowdenfit.physics.distributions import log_normal_cdf
from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.physics.loop import loop_output_force
from bowdenfit.recordings.loop_strokes import loop_limits
from bowdenfit.recordings.recording import Recording, Recordings
from bowdenfit.types import DataArray

_LEAST_TOTAL = 1e-20  # information of a run on its mounting effect, to keep 0 / 0 finite

Values = Mapping[str, Array]
Data: TypeAlias = Any  # a `BlocksData`


# Largest correction of the first guess of a mounting effect, over the friction exponent; a judgement.
_ROPE_REACH = _LOOP_REACH = 0.5
RECORDED_LOSS = "recorded_loss"  # name of the readings of a loop's recordings in results
_LEAST_PRELOAD = 1e-6  # preload over the loads, to keep the exponent by a loop's loss finite
_LARGEST_EXPONENT = 3.0  # by a recording's own loss, however small the preload: exp(-3) is an efficiency of 5 %


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MountingEffects:
    """Blocks with the mounting effects of their runs integrated out.

    Args:
        within: Deviations of the blocks from their run's own mounting effect.
        effect: That effect, of each run [1].
        sd: Its standard deviation, of each run [1].
        total: Information of each run's blocks on it, at unit noise.
    """

    within: Array
    effect: Array
    sd: Array
    total: Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class BlocksData:
    """Blocks of recordings side by side; the shorter ones stand still at their end, without weight.

    Args:
        angles: Wrap angles of the recordings.
        run: Number of the run, (recordings).
        n: How many independent readings it counts for [1], (runs).
        log_weights: Sum of the logarithms of weights, (runs).
        input_force, output_force: Forces [N], (blocks, recordings).
        likely_force: Input force without noise [N], (blocks, recordings).
        input_noise: Noise of the input that is in the output as well [N], (blocks, recordings).
        velocity: Velocity, (blocks, recordings).
        weight: Information on the reading at unit noise, (blocks, recordings).
        drift: Change of the reading with a delay [1/s], (blocks, recordings).
        restart: Whether the operator starts anew there, (blocks, recordings).
        censored: +1 or -1 where the output is only known to lie beyond an end of the range, else 0, (blocks, recordings).
        share: Weight of that bound, (blocks, recordings).
        reading: Output on the scale of the likelihood, (blocks, recordings).
        newtons: Change of the output force with that [N], (blocks, recordings).
        exponent: Friction exponent by the recording itself [1], (recordings).
    """

    angles: RowAngles
    run: DataArray
    n: DataArray
    log_weights: DataArray
    input_force: DataArray
    output_force: DataArray
    likely_force: DataArray
    input_noise: DataArray
    velocity: DataArray
    weight: DataArray
    drift: DataArray
    restart: DataArray
    censored: DataArray
    share: DataArray
    reading: DataArray
    newtons: DataArray
    exponent: DataArray


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RopeBlocksData(BlocksData):
    """Blocks of recordings of a single rope.

    Args:
        speed: Mean speed while it slides, (recordings).
        step: Time since the block before [s], (blocks, recordings).
    """

    speed: DataArray
    step: DataArray


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LoopBlocksData(BlocksData):
    """Blocks of recordings of a loop.

    Args:
        moving: Share of a block in its run's mean lost force, with the sign of the motion, (blocks, recordings).
        loss: Force lost by the recording itself [N], (recordings).
        tells_loss: Whether that is known, (recordings).
        tells_exponent: Whether the friction exponent is, (recordings).
    """

    moving: DataArray
    loss: DataArray
    tells_loss: DataArray
    tells_exponent: DataArray


@dataclass(frozen=True)
class BlocksTerm(ABC):
    r"""Likelihood of every block of whole recordings, one value a run.

    The output is linear in the mounting effect m ~ Normal(0, tau) of a run but for changes of contact (and, of a loop, while
    its return side is taut), so that m integrates out in closed form at the value that suits the recording best: two passes
    of the operator, one to find it, one to linearize there. With Student noise each run's mounting effect, with what noise
    adds to it, is a Student-t; the blocks scatter normally about their run.

    Args:
        cable: The cable.
        data: Its arrays.
        labels: Each run in words.
    """

    cable: CableContacts = field(repr=False)
    data: Data = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    noise: str = RUN_SCATTER
    reading_noise: str = BLOCK_NOISE

    @abstractmethod
    def _first_guess(self, drive: Any, data: Data) -> tuple[PerRecording, PerRecording]:
        """Return each recording's mounting effect by its own hysteresis, and how far from it a better one is looked for [1]."""

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Runs, which scatter by their mounting, and blocks, which scatter about their run by the load cells."""
        runs, blocks = len(self.labels), int(np.sum(self.data.n))
        return ((runs, runs), (self.data.weight.size, max(blocks - runs, 1)))

    @property
    def padded(self) -> BlocksData:
        """See `LogDensity.padded`: recordings that stand still for longer at their end, with no weight."""
        data: BlocksData = self.data
        missing = round_up_count(len(data.weight)) - len(data.weight)
        modes: dict[bool, Literal["constant", "edge"]] = {True: "constant", False: "edge"}
        long: dict[str, Any] = {
            name: np.pad(values, ((0, missing), *((0, 0),) * (values.ndim - 1)), modes[name in WITHOUT_WEIGHT])
            for name, values in vars(data).items()
            if isinstance(values, np.ndarray) and values.ndim > 1
        }
        return replace(data, **long)

    def _per_run(self, data: Data, blocks: PerTime) -> Float[Array, " runs"]:
        """Return the sum over the blocks of each run."""
        return jnp.zeros_like(data.n).at[data.run].add(jnp.sum(blocks, axis=0))

    def _drive(self, values: Values, data: Data) -> tuple[Any, Array, Array]:
        """Return the cable at each recording's conditions, its wrap angles and their variances."""
        angles, variance = resolve_angles(self.cable, values, data.angles)
        drive = make_drive(self.cable, values, angles, data.velocity, step=getattr(data, "step", 0.0))
        return drive, angles, variance

    def _follow(
        self, drive: RopeDrive | LoopDrive, cells: LoadCells, data: Data, mounting: PerRecording
    ) -> tuple[PerTime, PerTime]:
        """Return deviations of the readings from the operator's output, and the output's derivative by the exponent."""
        stands = drive.scaled(cells.true_output(data.output_force, drive.least_force))
        force = cells.true_input(data.likely_force, drive.least_force)
        anew = jnp.where(data.restart, stands, jnp.nan)
        followed = drive.follow(force, mounting, stands[0], anew, data.input_noise)
        expected, loading = drive.shown(cells, *followed)
        return data.reading + cells.late(data.drift) - expected, loading

    def _deviations(self, values: Values, data: Data, weights: Values) -> MountingEffects:
        """Return the mounting effects, and the deviations of the blocks from them."""
        (drive, angles, variance), cells = self._drive(values, data), LoadCells.of(values)
        guess, reach = self._first_guess(drive, data)
        deviation, loading = self._follow(drive, cells, data, guess)
        by_recording = jnp.sum(data.weight * loading**2, axis=0)
        step = jnp.sum(data.weight * loading * deviation, axis=0) / jnp.maximum(by_recording, 1e-30)
        guess = guess + jnp.clip(step, -reach, reach)
        deviation, loading = self._follow(drive, cells, data, guess)
        of_angles = self.cable.exponent_variance(weights, angles, variance)
        return self._integrate_mountings(data, weights, deviation + loading * guess, loading, of_angles)

    def _integrate_mountings(
        self, data: Data, weights: Values, deviation: PerTime, loading: PerTime, of_angles: PerRecording
    ) -> MountingEffects:
        """Return the mounting effect of each run in closed form.

        Args:
            data: Arrays of the term.
            weights: Values of the parameters that make the weights.
            deviation: Deviations of the blocks, without mounting effects.
            loading: Change of the operator's output with the friction exponent.
            of_angles: Variance of each recording's friction exponent by its wrap angles.
        """
        # Blocks that no friction of this size can explain have no information on the effect: the limit, instead of 0 / 0.
        total = jnp.maximum(self._per_run(data, data.weight * loading**2), _LEAST_TOTAL)
        effect = self._per_run(data, data.weight * loading * deviation) / total
        from_angles = self._per_run(data, data.weight * loading**2 * of_angles) / total
        sd = jnp.sqrt(weights[RUN_SCATTER] ** 2 + from_angles + weights[self.reading_noise] ** 2 / total)
        return MountingEffects(deviation - loading * effect[data.run], effect, sd, total)

    def _excess_over_limit(self, data: Data, effects: MountingEffects, noise: Array) -> PerTime:
        """Return how far beyond the end of the range a saturated output is expected, in standard deviations of a block."""
        return data.censored * -effects.within * data.newtons / noise

    def log_likelihood(self, values: Values, data: Data) -> Float[Array, " runs"]:
        """Log likelihood of each run, all blocks together; these scatter normally about the run."""
        effects, noise, n = self._deviations(values, data, values), values[self.reading_noise], data.n
        squares = self._per_run(data, data.weight * effects.within**2)
        constant = (data.log_weights - jnp.log(effects.total) - (n - 1) * jnp.log(2 * jnp.pi)) / 2
        inside = constant - (n - 1) * jnp.log(noise) - squares / (2 * noise**2)
        log_probability = log_normal_cdf(self._excess_over_limit(data, effects, noise)) * data.share
        censored = self._per_run(data, jnp.where(data.censored != 0, log_probability, 0.0))
        return inside + noise_law(self.cable.description).log_density(effects.effect, 0.0, effects.sd) + censored

    def residuals(self, values: Values, data: Data) -> Float[Array, " runs_and_blocks"]:
        """Standardized residuals of the same likelihood: between runs, and of the blocks of a run."""
        effects = self._deviations(values, data, jax.lax.stop_gradient(dict(values)))
        noise = jax.lax.stop_gradient(values[self.reading_noise])
        beyond = self._excess_over_limit(data, effects, noise)
        inside = jnp.sqrt(data.weight) * effects.within / noise
        # Beyond 30 sd the root is 0 to the last digit, and its derivative would be 0 times infinity.
        root = jnp.sqrt(-2 * data.share * log_normal_cdf(jnp.minimum(beyond, 29.0)) + 1e-300)
        censored = jnp.where((data.censored != 0) & (beyond < 30.0), root, 0.0)
        between = noise_law(self.cable.description).residual(effects.effect / jax.lax.stop_gradient(effects.sd))
        return jnp.concatenate([between, (inside + censored).ravel()])


@dataclass(frozen=True)
class WholeRecordingsTerm(BlocksTerm):
    r"""Likelihood of every block of whole recordings of a single rope, one value a run.

    .. math:: y_t = \text{clip}(y_{t-1},\ x_t - \Lambda_t - m,\ x_t + \Lambda_t + m), \quad
              x = g(F_\text{in} - b_\text{in}), \quad
              \log F_\text{out} = \log\left(g^{-1}(y) e^{-\gamma} + b_\text{out}\right) + e

    with the offsets b and gain error gamma of the load cells.
    """

    name: str = RECORDED
    unit: str = "1"

    def _first_guess(self, drive: RopeDrive, data: Data) -> tuple[PerRecording, PerRecording]:
        guess = jnp.zeros_like(drive.exponent)
        if not self.cable.friction.depends_on_load:  # else the loop's width means another exponent at every scale
            guess = data.exponent - self._typical_exponent(drive, data)
        return guess, _ROPE_REACH * jnp.asarray(data.exponent)

    def _typical_exponent(self, drive: RopeDrive, data: Data) -> PerRecording:
        """Return the friction exponent of each recording at its mean speed [1]."""
        return drive.exponent * drive.friction.rate(drive.values, data.speed)

    def expected(self, values: Values, data: Data) -> Float[Array, " runs"]:
        """Expected efficiency of each run, the effect of its mounting left out [1]."""
        return transmission_efficiency(self._average_by_run(self._typical_exponent(self._drive(values, data)[0], data)))

    def simulate(self, values: Values, data: Data, key: Array) -> Float[Array, " runs"]:
        """Efficiency of each run as the bench would give it [1]."""
        sd = self._deviations(values, data, values).sd
        of_run = self._average_by_run(self._typical_exponent(self._drive(values, data)[0], data))
        return transmission_efficiency(of_run + sd * scatter(key, sd.shape, self.cable.description))

    def _average_by_run(self, of_recording: Array) -> Array:
        """Return the mean over the recordings of each run."""
        run, runs = jnp.asarray(self.data.run), len(self.labels)
        counts = jnp.zeros(runs).at[run].add(1.0)
        return jnp.zeros(runs).at[run].add(of_recording) / counts

    def observed(self) -> np.ndarray:
        """Efficiency of each run by the width of its own hysteresis loop [1]."""
        run, exponent = self.data.run, self.data.exponent
        return np.exp(-np.bincount(run, exponent) / np.bincount(run))


def stack_rope_recordings(
    recordings: Recordings,
    angles: RowAngles,
    censored: bool,
    noise_ratio: float,
    *,
    counts_turns: bool = False,
) -> RopeBlocksData:
    """Stack recordings of a rope into arrays over time and recordings; shorter ones stand still at their end, without weight.

    The noise ratio is that of the input over that of the output; for `counts_turns` see `BlockGroups.arrays`.
    """
    parts = [_rope_blocks(r, censored, noise_ratio, counts_turns) for r in recordings.items]
    data = stack_recordings(recordings, parts, angles)
    speeds = [np.abs(r.blocks.velocity[r.strokes.used_sliding]) for r in recordings.items]
    return RopeBlocksData(
        **data,
        reading=np.log(data["output_force"]),
        newtons=data["output_force"],
        exponent=np.array([r.strokes.exponent for r in recordings.items]),
        speed=np.array([float(speed.mean()) if len(speed) else float("nan") for speed in speeds]),
        step=pad_columns([part["step"] for part in parts], "constant"),
    )


def _rope_blocks(recording: Recording, censored: bool, noise_ratio: float, counts_turns: bool) -> dict[str, Any]:
    """Return the blocks of one recording; while the rope stands still the input's noise is not in the output."""
    groups = group_blocks(recording)
    arrays = groups.arrays(RopeDrive, is_under_tension(recording), censored, counts_turns=counts_turns)
    likely_in, likely_out = (groups.mean(force) for force in smooth_forces(recording.blocks))
    of_input = noise_ratio * (recording.strokes.contact[groups.starts] != 0)
    weight = arrays["n_effective"] / ((of_input / likely_in) ** 2 + 1 / likely_out**2)
    return arrays | {"weight": weight, "step": block_steps(groups.mean(recording.blocks.time))}


@dataclass(frozen=True)
class LoopRecordingsTerm(BlocksTerm):
    r"""Likelihood of every block of a loop's recordings, one value a run.

    .. math:: y_t = \text{clip}(y_{t-1},\ f_-(x_t),\ f_+(x_t)), \quad x = F_\text{in} - b_\text{in}, \quad
              F_\text{out} = y e^{-\gamma} + b_\text{out} + e, \quad e \sim \text{Normal}(0, \sigma_B / \sqrt{w})

    where f are the output forces of `bowdenfit.physics.loop.loop_band` moving forward and back, at the cable's preload and
    at the friction exponent Lambda + m of the run.

    The reading of a run in results is the mean force lost while it moves, over the blocks inside its phases of motion.
    """

    name: str = RECORDED_LOSS
    unit: str = "N"

    def _first_guess(self, drive: LoopDrive, data: Data) -> tuple[PerRecording, PerRecording]:
        """That with which the loop is as wide as the recording's own; none where that is not known."""
        least = _LEAST_PRELOAD * self.cable.friction.conditions.load.value
        by_loss = data.loss / (2 * jnp.maximum(drive.preload, least))
        exponent = jnp.where(data.tells_loss, jnp.minimum(by_loss, _LARGEST_EXPONENT), data.exponent)
        guess = jnp.where(data.tells_loss | data.tells_exponent, exponent - drive.exponent, 0.0)
        return guess, _LOOP_REACH * (drive.exponent + guess)

    def _mean_lost_force(
        self, values: Values, data: Data, drive: LoopDrive, more: PerRecording | float = 0.0
    ) -> Float[Array, " runs"]:
        """Return the mean force lost in moving blocks [N], with `more` friction exponent than the cable's."""
        cells, force = LoadCells.of(values), data.input_force
        stroke = jnp.sign(data.moving)  # which also holds the weight of each block
        exponent = (drive.exponent + more)[None, :]
        output = loop_output_force(cells.true_input(force), drive.preload[None, :], exponent, stroke, drive.rope)
        return self._per_run(data, data.moving * (force - cells.shown_output(output)))

    def expected(self, values: Values, data: Data) -> Float[Array, " runs"]:
        """Expected mean force lost while each run moves, the effect of its mounting left out [N]."""
        return self._mean_lost_force(values, data, self._drive(values, data)[0])

    def simulate(self, values: Values, data: Data, key: Array) -> Float[Array, " runs"]:
        """Mean force lost while each run moves as the bench would give it [N]."""
        drive = self._drive(values, data)[0]

        def lost(more: Array) -> Array:
            return self._mean_lost_force(values, data, drive, more)

        mean, by_exponent = jax.jvp(lost, (jnp.zeros_like(drive.exponent),), (jnp.ones_like(drive.exponent),))
        sd = self._deviations(values, data, values).sd
        return mean + by_exponent * sd * scatter(key, mean.shape, self.cable.description)

    def observed(self) -> np.ndarray:
        """Mean force lost while each run moved [N]."""
        lost = self.data.moving * (self.data.input_force - self.data.output_force)
        return np.bincount(self.data.run, lost.sum(axis=0))


def make_loop_recordings_term(
    cable: CableContacts, recordings: Recordings, angles: RowAngles, labels: tuple[str, ...], censored: bool
) -> LoopRecordingsTerm:
    """Return the term of a loop's recordings.

    Args:
        cable: The cable.
        recordings: Its recordings.
        angles: Wrap angles of each recording.
        labels: Each run in words.
        censored: Whether a saturated output counts as one beyond the end of the range.
    """
    noise_ratio = cable.description.sensors.noise_ratio
    parts = [_loop_blocks(r, censored, noise_ratio) for r in recordings.items]
    data = stack_recordings(recordings, parts, angles)
    moving = pad_columns([p["moving"] for p in parts], "constant")
    of_run = np.bincount(data["run"], np.abs(moving).sum(axis=0))
    loss, exponent = (np.array([getattr(r.strokes, name) for r in recordings.items]) for name in ("drag", "exponent"))
    blocks = LoopBlocksData(
        **data,
        reading=data["output_force"],
        newtons=np.ones_like(data["output_force"]),
        exponent=np.nan_to_num(exponent),
        moving=moving / np.maximum(of_run, 1)[data["run"]],
        loss=np.nan_to_num(loss),
        tells_loss=np.isfinite(loss),
        tells_exponent=np.isfinite(exponent),
    )
    return LoopRecordingsTerm(cable, blocks, labels)


def _loop_blocks(recording: Recording, censored: bool, noise_ratio: float) -> dict[str, Any]:
    """Return the blocks of one recording, joined inside their phases where there are many.

    `moving` is the number of samples that show the loss, with the sign of the motion.
    """
    blocks, strokes, groups = recording.blocks, recording.strokes, group_blocks(recording)
    arrays = groups.arrays(LoopDrive, ~blocks.saturated, censored)
    stroke = strokes.stroke[groups.starts]
    used = strokes.used_sliding & ~blocks.saturated
    return arrays | {
        "weight": arrays["n_effective"] / (1 + (noise_ratio * _input_share(recording, arrays["input_force"], stroke)) ** 2),
        "moving": stroke * np.add.reduceat(blocks.samples * used, groups.starts).astype(float),
    }


def _input_share(recording: Recording, force: np.ndarray, stroke: np.ndarray) -> np.ndarray:
    """Return the share of the input's noise in each block's output: what the recording's own loop transmits while it moves."""
    loss, exponent = (float(np.nan_to_num(value)) for value in (recording.strokes.drag, recording.strokes.exponent))
    taut = np.where(stroke > 0, loop_limits(force, loss, 0.0)[0], loop_limits(force, loss, 0.0)[1])
    moving = np.where(stroke > 0, loop_limits(force, loss, exponent)[0], loop_limits(force, loss, exponent)[1])
    growth = np.where(moving == taut, 1.0, np.exp(-stroke * np.sign(force) * exponent))
    return np.where(stroke == 0, 0.0, growth)
