"""A bench on the computer, sample by sample: a motor pulls a rope against a spring, and two load cells are read."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from bowdenfit.description import Finite, NonNegative, Positive
from bowdenfit.errors import UsageError
from bowdenfit.measurements.recordings import SWITCH, RawRecording
from bowdenfit.types import Labels, Vector

_NEWTON_STEPS = 60


@dataclass(frozen=True)
class Profile:
    """What the motor does: `cycles` times pull, pause, return, pause, at one speed with even acceleration.

    Args:
        speed: Motor speed [rad/s].
        stroke: Rope pulled in by a stroke [mm].
        drum_radius: Radius of the drum on the motor [mm].
        acceleration_time: Time to reach the speed, and to stop [s]; 0 for a speed that jumps.
        pause: Rest after each stroke [s].
        cycles: Number of strokes each way.
        partial_reversals: Short ways back inside each stroke, as pairs (where, how far back) along the stroke [mm]; a
            return stroke has them at the same distances from its own start. They may lie inside one another.
        lead_in: Rest under preload before the first stroke [s].
        unloaded: Time at the very start, inside the lead-in, in which the cells carry nothing [s], for taring.
    """

    speed: Positive
    stroke: Positive = 50.0
    drum_radius: Positive = 20.0
    acceleration_time: NonNegative = 0.1
    pause: NonNegative = 0.3
    cycles: Annotated[int, Field(ge=1)] = 3
    partial_reversals: tuple[tuple[Positive, Positive], ...] = ()
    lead_in: NonNegative = 0.0
    unloaded: NonNegative = 0.0

    @property
    def rope_speed(self) -> float:
        """Speed of the rope at the drum [mm/s]."""
        return self.speed * self.drum_radius


@dataclass(frozen=True)
class BenchSettings:
    """The mechanics around the cable, and the sampling.

    Args:
        rate: Samples a second [1/s].
        preload: Force of the load's spring at rest, on both sides [N].
        load_stiffness: Stiffness of the load's spring [N/mm].
        rope_stiffness: Stiffness of the rope between motor and load [N/mm].
    """

    rate: Positive = 100.0
    preload: Positive = 20.0
    load_stiffness: Positive = 1.5
    rope_stiffness: Positive = 20.0


@dataclass(frozen=True)
class BenchFriction:
    r"""How friction depends on load and on speed.

    Sliding shifts the force by the exponent on a scale g: `g(F_in) - g(F_out) = s Lambda(v)`, with

    .. math::
        g(F) = \frac{((F + D)/F_\text{ref})^p - 1}{p}, \quad g_0(F) = \log\frac{F + D}{F_\text{ref}}, \quad
        \Lambda(v) = \Lambda\,(1 + a\,e^{-(v/v_s)^2} + c\,|v|)

    Args:
        load_exponent: p [1]; 0 is the capstan equation, 1 a constant friction force.
        reference_force: F_ref [N].
        drag: D [N].
        stribeck: a [1].
        stribeck_speed: v_s [mm/s or rad/s].
        viscous: c [s/mm or s/rad].
        speed: Whether v is the speed of the rope [mm/s] or of the motor [rad/s].
    """

    load_exponent: Annotated[float, Field(ge=0, le=1)] = 0.0
    reference_force: Positive = 50.0
    drag: NonNegative = 0.0
    stribeck: NonNegative = 0.0
    stribeck_speed: Positive = 10.0
    viscous: Finite = 0.0
    speed: Literal["rope", "motor"] = "rope"

    def scale(self, force: Vector) -> Vector:
        """g(F)"""
        p, relative = self.load_exponent, (force + self.drag) / self.reference_force
        return (relative**p - 1) / p if p > 0 else np.log(relative)

    def force(self, scale: Vector) -> Vector:
        """The force at a place on the scale; where friction takes all of it, a slack rope."""
        p = self.load_exponent
        relative = np.maximum(1 + p * scale, 0.0) ** (1 / p) if p > 0 else np.exp(scale)
        return self.reference_force * relative - self.drag

    def rate_factor(self, velocity: Vector) -> Vector:
        """Lambda(v)/Lambda"""
        a, v_s, c = self.stribeck, self.stribeck_speed, self.viscous
        return 1 + a * np.exp(-((velocity / v_s) ** 2)) + c * np.abs(velocity)


@dataclass(frozen=True)
class Faults:
    """What readings suffer on their way from the rope to the file; nothing, unless said.

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
        true_input_force, true_output_force: Forces at the time of the sample, before any fault [N].
        reversals: Times at which the motor sets out in the other direction [s].
        drum_radius: Radius of the drum [mm].
    """

    time: Vector
    input_force: Vector
    output_force: Vector
    velocity: Vector
    position: Vector
    stroke: Labels
    true_input_force: Vector
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


@dataclass(frozen=True)
class _Motion:
    """Motor position as stretches of constant acceleration [s, mm, mm/s, mm/s^2]; the last one is a rest."""

    start: Vector
    position: Vector
    velocity: Vector
    acceleration: Vector
    turns: Vector
    reversals: tuple[float, ...]

    def at(self, time: Vector) -> tuple[Vector, Vector]:
        """Position [mm] and velocity [mm/s]."""
        i = np.searchsorted(self.start, time, side="right") - 1
        since = time - self.start[i]
        velocity = self.velocity[i] + self.acceleration[i] * since
        return self.position[i] + (self.velocity[i] + self.acceleration[i] * since / 2) * since, velocity


def simulate_recording(
    exponent: float,
    friction: BenchFriction,
    profile: Profile,
    bench: BenchSettings,
    faults: Faults,
    generator: np.random.Generator,
    run_effect: float = 0.0,
) -> SimulatedRecording:
    r"""One recording as a bench would give it, quasi-static.

    The motor pulls the rope by q, the load's spring gives way by x >= 0: `F_in = K (q - x) + P`, `F_out = P + k x`.
    While the rope slides toward the motor `g(F_in) - g(F_out) = Lambda(v) + m`, while it slides back minus that, and in
    between x stays, so that x follows q by the play operator `x_t = clip(x_{t-1}, x_low(q_t), x_high(q_t))`.

    Args:
        exponent: Friction exponent of the cable [1].
        friction: How friction depends on load and speed.
        profile: What the motor does.
        bench: Mechanics and sampling.
        faults: What readings suffer.
        generator: Random numbers; each kind of fault draws from its own stream, so that one does not change another.
        run_effect: m, added to the exponent by how the cable was mounted [1].

    Raises:
        UsageError: The friction exponent is not positive, or a profile or fault contradicts itself.
    """
    check_settings(profile, faults)
    motion = _motion(profile)
    n = int(np.floor((motion.start[-1] + profile.pause) * bench.rate + 1e-9)) + 1
    time = np.arange(n) / bench.rate
    of_input, of_output = generator.spawn(2)
    states = _Mechanics(exponent, run_effect, friction, profile, bench, motion)
    stroke, true_input, true_output = states.at(time)
    late_output = states.at(time - faults.delay)[2] if faults.delay else true_output
    position, velocity = motion.at(time)
    shown_output = late_output * np.exp(-faults.gain_error) + faults.output_offset
    return SimulatedRecording(
        time,
        _read(true_input + faults.input_offset, faults.input_noise, faults.input_range, faults, bench.rate, of_input),
        _read(shown_output, faults.output_noise, faults.output_range, faults, bench.rate, of_output),
        velocity,
        position,
        stroke,
        true_input,
        true_output,
        motion.reversals,
        profile.drum_radius,
    )


def to_raw(
    simulated: SimulatedRecording, name: str, file: str, velocity: Literal["rope", "motor"] = "rope"
) -> RawRecording:
    """The recording as a reader of files would hand it on.

    Args:
        simulated: The recording.
        name: Its name.
        file: File name for errors.
        velocity: Whether the velocity is the rope's [mm/s] or the motor's [rad/s].
    """
    time = simulated.time
    shown = simulated.velocity if velocity == "rope" else simulated.motor_speed
    return RawRecording(name, file, time, simulated.input_force, time, simulated.output_force, time, shown)


def check_settings(profile: Profile, faults: Faults) -> None:
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


def _motion(profile: Profile) -> _Motion:
    """All moves of the profile, one after the other."""
    clock, where = profile.lead_in, 0.0
    rows, turns, reversals, heading = [(0.0, 0.0, 0.0, 0.0)], [], [], 0.0
    for ends_of_stroke in (_waypoints(profile, cycle) for cycle in range(2 * profile.cycles)):
        for target in ends_of_stroke:
            direction = float(np.sign(target - where))
            if direction == 0:
                continue
            if direction == -heading:
                reversals.append(clock)
            heading = direction
            rows += _move(profile, clock, where, target)
            clock, where = rows[-1][0], target
            turns.append(clock)
        clock += profile.pause
    start, position, velocity, acceleration = (np.array(column) for column in zip(*rows, strict=True))
    return _Motion(start, position, velocity, acceleration, np.array(turns), tuple(reversals))


def _waypoints(profile: Profile, number: int) -> list[float]:
    """Where the motor turns within one stroke [mm]; even strokes pull, odd ones return."""
    along = [point for where, back in profile.partial_reversals for point in (where, where - back)]
    along.append(profile.stroke)
    return along if number % 2 == 0 else [profile.stroke - point for point in along]


def _move(profile: Profile, clock: float, start: float, end: float) -> list[tuple[float, float, float, float]]:
    """One trapezoidal move, or a triangular one where the way is too short for the full speed, and the rest after it."""
    distance, speed, ramp = abs(end - start), profile.rope_speed, profile.acceleration_time
    if speed * ramp > distance:
        speed, ramp = float(np.sqrt(distance * speed / ramp)), float(np.sqrt(distance * ramp / speed))
    cruise = max(distance / speed - ramp, 0.0)
    sign = float(np.sign(end - start))
    steps = [(0.0, start, sign * speed, 0.0)]
    if ramp > 0:
        acceleration, on_the_ramp = sign * speed / ramp, sign * speed * ramp / 2
        steps = [
            (0.0, start, 0.0, acceleration),
            (ramp, start + on_the_ramp, sign * speed, 0.0),
            (ramp + cruise, end - on_the_ramp, sign * speed, -acceleration),
        ]
    steps.append((2 * ramp + cruise, end, 0.0, 0.0))
    return [(clock + after, q, v, a) for after, q, v, a in steps]


@dataclass(frozen=True)
class _Mechanics:
    """Rope, friction and spring under a given motion of the motor."""

    exponent: float
    run_effect: float
    friction: BenchFriction
    profile: Profile
    bench: BenchSettings
    motion: _Motion

    def at(self, time: Vector) -> tuple[Labels, Vector, Vector]:
        """Contact state, input force and output force [N]; before the start everything is at rest."""
        clock = np.union1d(np.maximum(time, 0.0), self.motion.turns)
        asked = np.searchsorted(clock, np.maximum(time, 0.0))
        position, velocity = self.motion.at(clock)
        exponent = self._exponent(velocity)
        x = _play(self._boundary(position, exponent), self._boundary(position, -exponent))
        stroke = np.sign(np.diff(x, prepend=0.0)).astype(int)
        bench, loaded = self.bench, np.maximum(time, 0.0) >= self.profile.unloaded
        input_force = bench.rope_stiffness * (position - x) + bench.preload
        output_force = bench.preload + bench.load_stiffness * x
        return (
            np.where(loaded, stroke[asked], SWITCH),
            np.where(loaded, input_force[asked], 0.0),
            np.where(loaded, output_force[asked], 0.0),
        )

    def _exponent(self, velocity: Vector) -> Vector:
        """Lambda(v) + m"""
        shown = velocity if self.friction.speed == "rope" else velocity / self.profile.drum_radius
        exponent = self.exponent * self.friction.rate_factor(shown) + self.run_effect
        if not np.all(exponent > 0):
            raise UsageError(
                f"the friction exponent comes out at {exponent.min():.4g}, but friction cannot push: raise the friction "
                "coefficients or wrap angles, or lower the scatter between runs (tau) or the viscous term."
            )
        return exponent

    def _boundary(self, position: Vector, shift: Vector) -> Vector:
        """Displacement x >= 0 of the load at which `g(F_in) = g(F_out) + shift`, for each motor position [mm].

        Newton's method from the side on which the curve bends away from zero, so that it cannot overshoot.
        """
        K, k, P, law = self.bench.rope_stiffness, self.bench.load_stiffness, self.bench.preload, self.friction
        x = np.zeros_like(position) if shift[0] > 0 else position + P / K
        for _ in range(_NEWTON_STEPS):
            load = P + k * x
            needed = law.force(law.scale(load) + shift)
            slope = ((needed + law.drag) / (load + law.drag)) ** (1 - law.load_exponent)
            step = (K * (position - x) + P - needed) / (K + k * slope)
            x = np.maximum(x + step, 0.0)
            if np.all(np.abs(step) <= 1e-14 * (1 + position) + (x == 0) * np.abs(step)):
                break
        return x


def _play(low: Vector, high: Vector) -> Vector:
    """The play operator `x_t = clip(x_{t-1}, low_t, high_t)`, from rest at 0."""
    x, path = 0.0, []
    for lowest, highest in zip(low.tolist(), high.tolist(), strict=True):
        x = lowest if x < lowest else highest if x > highest else x
        path.append(x)
    return np.array(path)


def _read(
    force: Vector,
    noise: float,
    limits: tuple[float, float] | None,
    faults: Faults,
    rate: float,
    generator: np.random.Generator,
) -> Vector:
    """Readings of one cell: noise, spikes, the ends of its range, rounding, gaps."""
    of_noise, of_spikes, of_gaps = generator.spawn(3)
    reading = force + noise * _unit_noise(len(force), faults.noise_cutoff, rate, of_noise)
    minutes = len(force) / rate / 60
    at = of_spikes.integers(0, len(force), of_spikes.poisson(faults.spikes * minutes))
    reading[at] += faults.spike_size * of_spikes.choice([-1.0, 1.0], len(at))
    if limits is not None:
        reading = np.clip(reading, *limits)
        if faults.bits is not None:
            step = (limits[1] - limits[0]) / (2**faults.bits - 1)
            reading = limits[0] + step * np.round((reading - limits[0]) / step)
    length = max(1, round(faults.dropout_length * rate))
    for first in of_gaps.integers(0, len(force), of_gaps.poisson(faults.dropouts * minutes)):
        reading[first : first + length] = np.nan if faults.dropout_kind == "missing" else reading[max(first - 1, 0)]
    return reading


def _unit_noise(n: int, cutoff: float | None, rate: float, generator: np.random.Generator) -> Vector:
    """Noise of standard deviation 1, white or after a first-order low-pass."""
    white = generator.standard_normal(n)
    if cutoff is None:
        return white
    from scipy.signal import lfilter

    memory = float(np.exp(-2 * np.pi * cutoff / rate))
    drive = white * np.sqrt(1 - memory**2)
    drive[0] = white[0]
    return np.asarray(lfilter([1.0], [1.0, -memory], drive))
