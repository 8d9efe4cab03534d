"""One recording of the bench: the true forces under a motion of the motor, and what the load cells make of them."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.signal import lfilter

from bowdenfit.description import Finite, NonNegative, Positive
from bowdenfit.errors import UsageError
from bowdenfit.questions.simulate.bench.mechanics import (
    BenchFriction,
    BenchSettings,
    Mechanics,
    MotorProfile,
    plan_motion,
)
from bowdenfit.types import Labels, Vector


@dataclass(frozen=True)
class LoadCellFaults:
    """Faults of readings on their way from the rope to the file; nothing, unless said.

    Args:
        input_noise, output_noise: Standard deviation of a reading [N].
        noise_cutoff: Corner frequency of a first-order low-pass that the noise went through [Hz]; None for white noise.
            The standard deviation of a reading stays the same.
        gain_error: Added to log(F_in/F_out): the output cell shows too little by this fraction [1].
        input_offset, output_offset: Added to the forces [N].
        delay: How much later the output channel shows what happened [s].
        input_range, output_range: Lowest and highest force that the cells can show [N]; beyond, readings stay there.
        bits: Readings are rounded to one of 2^bits forces evenly over the range.
        dropouts: Gaps a minute in each channel [1/min].
        dropout_length: Length of a gap [s].
        dropout_kind: Whether samples are "missing" in a gap or "frozen" at the last reading.
        spikes: Single wild readings a minute in each channel [1/min].
        spike_size: How far off these are, up or down [N].
    """

    input_noise: NonNegative = 0.0
    output_noise: NonNegative = 0.0
    noise_cutoff: Positive | None = None
    gain_error: Finite = 0.0
    input_offset: Finite = 0.0
    output_offset: Finite = 0.0
    delay: Finite = 0.0
    input_range: tuple[Finite, Finite] | None = None
    output_range: tuple[Finite, Finite] | None = None
    bits: Annotated[int, Field(ge=1, le=32)] | None = None
    dropouts: NonNegative = 0.0
    dropout_length: Positive = 0.1
    dropout_kind: Literal["missing", "frozen"] = "missing"
    spikes: NonNegative = 0.0
    spike_size: NonNegative = 50.0


@dataclass(frozen=True)
class SimulatedRecording:
    """One recording and what truly happened.

    Args:
        time: Time of each sample [s].
        input_force, output_force: Readings [N]; NaN where missing.
        velocity: Velocity of the rope at the drum, positive toward the motor [mm/s].
        position: Rope pulled in by the motor [mm].
        stroke: +1 sliding toward the motor, -1 sliding back, 0 stuck.
        true_output_force: Force at the time of the sample, before any fault [N].
        reversals: Times at which the motor sets out in the other direction [s].
        drum_radius: Radius of the drum [mm].
    """

    time: Vector
    input_force: Vector
    output_force: Vector
    velocity: Vector
    position: Vector
    stroke: Labels
    true_output_force: Vector
    reversals: tuple[float, ...]
    drum_radius: float

    @property
    def motor_speed(self) -> Vector:
        """Speed of the motor, positive pulling [rad/s]."""
        return self.velocity / self.drum_radius

    @property
    def contact_changes(self) -> tuple[tuple[float, int], ...]:
        """Time of the first sample of each contact state, and the state."""
        first = np.flatnonzero(np.diff(self.stroke, prepend=2))
        return tuple((float(self.time[i]), int(self.stroke[i])) for i in first)


def simulate_recording(
    exponent: float,
    friction: BenchFriction,
    profile: MotorProfile,
    bench: BenchSettings,
    faults: LoadCellFaults,
    generator: np.random.Generator,
    run_effect: float = 0.0,
) -> SimulatedRecording:
    r"""Simulate one recording as a bench would give it, quasi-static.

    The motor pulls the rope by q, the load's spring gives way by x >= 0: `F_in = K (q - x) + P`, `F_out = P + k x`.
    While the rope slides toward the motor `g(F_in) - g(F_out) = Lambda(v) + m`, while it slides back minus that, and in
    between x stays, so that x follows q by the play operator `x_t = clip(x_{t-1}, x_low(q_t), x_high(q_t))`.

    Args:
        exponent: Friction exponent of the cable [1].
        friction: How friction depends on load and speed.
        profile: Motion of the motor.
        bench: Mechanics and sampling.
        faults: Faults of the readings.
        generator: Random numbers; each kind of fault draws from its own stream, so that one does not change another.
        run_effect: m, added to the exponent by how the cable was mounted [1].

    Raises:
        UsageError: The friction exponent is not positive, or a profile or fault contradicts itself.
    """
    check_settings(profile, faults)
    motion = plan_motion(profile)
    n = int(np.floor((motion.start[-1] + profile.pause) * bench.rate + 1e-9)) + 1
    time = np.arange(n) / bench.rate
    input_generator, output_generator = generator.spawn(2)
    mechanics = Mechanics(exponent, run_effect, friction, profile, bench, motion)
    stroke, true_input, true_output = mechanics.forces_at(time)
    delayed_output = mechanics.forces_at(time - faults.delay)[2] if faults.delay else true_output
    position, velocity = motion.state_at(time)
    shown_output = delayed_output * np.exp(-faults.gain_error) + faults.output_offset
    return SimulatedRecording(
        time,
        apply_faults(
            true_input + faults.input_offset, faults.input_noise, faults.input_range, faults, bench.rate, input_generator
        ),
        apply_faults(shown_output, faults.output_noise, faults.output_range, faults, bench.rate, output_generator),
        velocity,
        position,
        stroke,
        true_output,
        motion.reversals,
        profile.drum_radius,
    )


def check_settings(profile: MotorProfile, faults: LoadCellFaults) -> None:
    """Refuse settings that contradict one another.

    Raises:
        UsageError: Which ones, and what to change.
    """
    if profile.unloaded > profile.lead_in:
        raise UsageError(
            f"unloaded = {profile.unloaded:g} s is longer than lead_in = {profile.lead_in:g} s; the time without load "
            "is the beginning of the lead-in."
        )
    for where, back in profile.partial_reversals:
        if not where < profile.stroke or back > where:
            raise UsageError(
                f"the partial reversal [{where:g}, {back:g}] mm does not fit into a stroke of {profile.stroke:g} mm; "
                "it must start inside the stroke and go back no further than to its start."
            )
    if faults.bits is not None and (faults.input_range is None or faults.output_range is None):
        raise UsageError(
            f"bits = {faults.bits} needs input_range and output_range, the forces that they are spread over."
        )
    for limits in (faults.input_range, faults.output_range):
        if limits is not None and not limits[0] < limits[1]:
            raise UsageError(f"the range [{limits[0]:g}, {limits[1]:g}] N is empty; write [lowest, highest].")


def apply_faults(
    force: Vector,
    noise: float,
    limits: tuple[float, float] | None,
    faults: LoadCellFaults,
    rate: float,
    generator: np.random.Generator,
) -> Vector:
    """Return the readings of one cell: noise, spikes, the ends of its range, rounding, gaps."""
    noise_generator, spike_generator, gap_generator = generator.spawn(3)
    reading = force + noise * _unit_noise(len(force), faults.noise_cutoff, rate, noise_generator)
    minutes = len(force) / rate / 60
    spiked = spike_generator.integers(0, len(force), spike_generator.poisson(faults.spikes * minutes))
    reading[spiked] += faults.spike_size * spike_generator.choice([-1.0, 1.0], len(spiked))
    if limits is not None:
        reading = np.clip(reading, *limits)
        if faults.bits is not None:
            step = (limits[1] - limits[0]) / (2**faults.bits - 1)
            reading = limits[0] + step * np.round((reading - limits[0]) / step)
    length = max(1, round(faults.dropout_length * rate))
    for first in gap_generator.integers(0, len(force), gap_generator.poisson(faults.dropouts * minutes)):
        reading[first : first + length] = np.nan if faults.dropout_kind == "missing" else reading[max(first - 1, 0)]
    return reading


def _unit_noise(n: int, cutoff: float | None, rate: float, generator: np.random.Generator) -> Vector:
    """Return noise of standard deviation 1, white or after a first-order low-pass."""
    white = generator.standard_normal(n)
    if cutoff is None:
        return white
    memory = float(np.exp(-2 * np.pi * cutoff / rate))
    drive = white * np.sqrt(1 - memory**2)
    drive[0] = white[0]
    return np.asarray(lfilter([1.0], [1.0, -memory], drive))
