"""Force recordings: two load cells sampled while a motor pulls, stops, reverses and returns.

Three stages, each a frozen class: what a file holds (`RawRecording`), how it is to be prepared (`description.Preparation`),
and what a fit uses (`Recording`: means of short blocks, with the number of samples that went into each, and an account of all
the others).
"""

import shlex
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from bowdenfit.types import Flags, Labels, OtherFlags, OtherVector, Vector

PULL, RETURN, SWITCH = 1, -1, 0


def describe_exchange(channels: tuple[str, str]) -> str:
    """Return what to do about a recording whose ends are exchanged, as a clause.

    Args:
        channels: Names of the channels that were taken for the input and the output force; empty if unknown.
    """
    if not all(channels):
        return "exchange the channels of input and output"
    of_input, of_output = channels
    options = (shlex.quote(option) for option in (f"input_force={of_output}", f"output_force={of_input}"))
    return f"exchange them by --channel {' --channel '.join(options)}"


@dataclass(frozen=True)
class ExcludedStretches:
    """Stretches of a recording that its user leaves out, whose forces are missing in the recording itself.

    Args:
        spans: Start and end of each, both included [s].
        input_force, output_force: Forces as they were read, on the clocks of the recording [N].
    """

    spans: tuple[tuple[float, float], ...]
    input_force: Float[np.ndarray, " of_input"]
    output_force: Float[np.ndarray, " of_output"]

    def covers(self, time: OtherVector) -> OtherFlags:
        """Return whether each time is in one of the stretches."""
        return np.any([(time >= start) & (time <= end) for start, end in self.spans], axis=0)


@dataclass(frozen=True)
class RawRecording:
    """One recording as read: samples of both load cells, each with its own clock, in internal units.

    Args:
        name: Name of the recording, unique in a data set.
        file: File name, for errors.
        input_time: Time of each sample of the input force [s].
        input_force: Force at the motor side [N]; NaN where a sample is missing.
        output_time: Time of each sample of the output force [s].
        output_force: Force at the load side [N]; NaN where a sample is missing.
        velocity_time: Time of each sample of the velocity [s]; empty without one.
        velocity: Velocity of the rope, positive toward the motor [mm/s], or of the motor [rad/s]; empty without one.
        loop: Whether the forces are those of a pull-pull loop, differences of two tensions: of either sign.
        input_start, output_start: Unix times at which the clocks are 0 [s]; None where they have no dates (`Channel.start`).
        channels: Names that the channels of input and output force have in the file; empty if not read from one, or torques.
        excluded: Stretches that the user leaves out; None without any.
    """

    name: str
    file: str
    input_time: Float[np.ndarray, " of_input_clock"]
    input_force: Float[np.ndarray, " of_input"]
    output_time: Float[np.ndarray, " of_output_clock"]
    output_force: Float[np.ndarray, " of_output"]
    velocity_time: Float[np.ndarray, " of_velocity_clock"] = field(default_factory=lambda: np.zeros(0))
    velocity: Float[np.ndarray, " of_velocity"] = field(default_factory=lambda: np.zeros(0))
    loop: bool = False
    input_start: float | None = None
    output_start: float | None = None
    channels: tuple[str, str] = ("", "")
    excluded: ExcludedStretches | None = None


@dataclass(frozen=True)
class FlaggedSamples:
    """Samples that were left out, for figures and for the account; at most a few hundred of each kind are kept.

    Args:
        kind: "dropout", "spike", "saturated", "quiet" or "by the user", one a sample.
        time: When [s].
        input_force, output_force: Readings [N].
    """

    kind: tuple[str, ...]
    time: Vector
    input_force: Vector
    output_force: Vector


@dataclass(frozen=True)
class Account:
    """What the preparation did, and where every sample went.

    Args:
        counts: Samples of the common clock by where they went: "used", "dropout", "spike", "saturated", "quiet",
            "by the user", "no overlap"; their sum is `samples`.
        samples: Samples in the recording: those of the channel with more of them.
        rate: Samples a second of the common clock [1/s].
        bandwidth: Frequency up to which the forces move together, above which there is only noise [Hz].
        block: Length of a block [s]; 0 without averaging.
        tare: Forces subtracted from the input and the output force [N].
        tare_sd: Standard errors of these [N].
        delay: How much later the output channel was [s]; the output was shifted back by it.
        delay_sd: Standard error of the delay [s]; NaN where the recording says nothing of it or it was given.
        noise: Standard deviation of a single sample about the smooth motion, input and output [N].
        limits: Lowest and highest force taken for the ends of the range [N]; infinite where no clipping was seen.
        flagged: Samples left out.
        remarks: Remarks for the user, in sentences.
        sample_sd: Standard deviation of the noise of a sample without the motion, input and output [N]; 0 in older fits.
        noise_time: Correlation times of that noise [s]; 0 for white noise.
        clock_shift: Of two loggers, what brings the times of the output's to those of the input's, the delay included [s].
    """

    counts: dict[str, int]
    samples: int
    rate: float
    bandwidth: float
    block: float
    tare: tuple[float, float]
    tare_sd: tuple[float, float]
    delay: float
    delay_sd: float
    noise: tuple[float, float]
    limits: tuple[float, float]
    flagged: FlaggedSamples
    remarks: tuple[str, ...]
    sample_sd: tuple[float, float] = (0.0, 0.0)
    noise_time: tuple[float, float] = (0.0, 0.0)
    clock_shift: float | None = None


@dataclass(frozen=True)
class Blocks:
    """A prepared recording: means over short blocks on one clock.

    Args:
        time: Middle of each block [s].
        input_force, output_force: Mean forces of the good samples [N].
        velocity: Mean velocity [mm/s or rad/s]; all NaN without one.
        samples: Number of good samples of each block, at least 1; blocks without any are left out.
        saturated: Blocks most of whose samples were at the end of a load cell's range; their forces are the means of
            the saturated samples, and they must not be used as readings.
        input_turn: Input force [N] at which a block below both neighbors was lowest, or one above both highest, less what
            noise adds to extremes; of other blocks the mean. None in fits that were saved before it was kept.
        finer: The same in shorter blocks, for what happens within a block or two after a turn; None where a block has too few
            samples for that, and of forces that are not those that were read.
    """

    time: Vector
    input_force: Vector
    output_force: Vector
    velocity: Vector
    samples: Labels
    saturated: Flags
    input_turn: Vector | None = None
    finer: "Blocks | None" = None


@dataclass(frozen=True)
class Strokes:
    """What the cable did in each block, and what that says about it before any model of the whole cable.

    Args:
        stroke: +1 sliding toward the motor, -1 sliding back, 0 switching or held; of a pull-pull loop +1 moving forward,
            -1 moving back, 0 between.
        contact: The same as the play operator has it, which stands where noise lifts a sliding rope off its limit.
        used_sliding: Whether the block is safely inside a sliding phase.
        exponent: Friction exponent of this recording by itself [1]; of a pull-pull loop NaN where it does not tell it.
        center: Mean log ratio of input to output force over both strokes [1]; what sensors add. Of a pull-pull loop the
            difference [N].
        drag: Drag that straightens the hysteresis loop [N]; of a pull-pull loop the force lost while both sides are taut,
            NaN where the recording does not tell it.
        noise: Standard deviation of a block's log ratio about the play operator [1]; of a pull-pull loop of its output
            force [N].
        correlation: Integrated autocorrelation time of these deviations, in blocks, at least 1.
        by_hand: Whether the user set the phases.
        remarks: Remarks for the user, in sentences.
    """

    stroke: Labels
    contact: Labels
    used_sliding: Flags
    exponent: float
    center: float
    drag: float
    noise: float
    correlation: float
    by_hand: bool
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Recording:
    """One recording, ready for a fit.

    Args:
        name: Its name, unique in the data set.
        file: File it was read from.
        run: Mounting of the cable that it belongs to.
        route: Value of the route variable; NaN without a route.
        own_angle: Wrap angle measured with this recording [rad], by contact column; NaN where the curve must serve.
        own_sd: Standard deviations of these [rad]; NaN where not stated.
        blocks: The forces.
        strokes: The phases.
        account: Where all samples went.
    """

    name: str
    file: str
    run: str
    route: float
    own_angle: Float[np.ndarray, " contacts"]
    own_sd: Float[np.ndarray, " contacts"]
    blocks: Blocks
    strokes: Strokes
    account: Account


@dataclass(frozen=True)
class Recordings:
    """All recordings of a data set.

    Args:
        columns: Contact columns that `own_angle` refers to.
        items: The recordings.
        velocity_unit: "mm/s" or "rad/s", what the blocks' velocities are in; empty where none was recorded or stated.
        delay_sd: Standard error of the delay that all of them were shifted by [s]; 0 where it is known.
        loop: Whether they are of a pull-pull loop; forces are then differences of two tensions, of either sign.
    """

    columns: tuple[str, ...]
    items: tuple[Recording, ...]
    velocity_unit: str = ""
    delay_sd: float = 0.0
    loop: bool = False

    @property
    def runs(self) -> tuple[str, ...]:
        """Names of the runs, each once."""
        return tuple(dict.fromkeys(r.run for r in self.items))

    def time_of_loss(self, least_share: float) -> float:
        """Return the time in which the input force of a single rope changes by as much as is lost [s].

        A delay by a share of it looks like a change of the friction by that share.

        Args:
            least_share: Least share of the largest force, below which no logarithm is taken.
        """
        losses, rates = [], []
        for blocks in (item.blocks for item in self.items):
            forces = np.maximum([blocks.input_force, blocks.output_force], least_share * np.max(np.abs(blocks.input_force)))
            log_input, log_output = np.log(forces)
            losses.append(np.abs(log_input - log_output))
            rates.append(np.gradient(log_input, blocks.time))
        return float(np.median(np.concatenate(losses)) / np.sqrt(np.mean(np.square(np.concatenate(rates)))))
