"""Simulated forces at both ends of a cable whose friction wanders, and what load cells and wires make of them.

The rope is integrated on a clock several times finer than the samples: its output force stays while it sticks, and follows the
input force at the edge of the friction band while it slides. Nothing is imported from bowdenfit.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

FINER = 4  # steps of the rope per sample


@dataclass(frozen=True)
class Bench:
    """A cable and how it is driven.

    Args:
        exponent: Friction exponent at the start [1].
        load: Largest input force [N].
        least: Lowest input force over the largest; below 0 for a loop driven both ways.
        period: Time of a cycle [s].
        wave: "sine", "triangle" or "random", a motion that never repeats.
        noise: Standard deviation of a sample of each cell over the largest force.
        rate: Samples per second.
        seconds: Length of a recording.
        preload: Of a pull-pull loop [N]; 0 for a single rope.
        mounting_sd: Standard deviation of the exponent between mountings, over the exponent.
    """

    exponent: float = 0.3
    load: float = 90.0
    least: float = 2 / 9
    period: float = 3.0
    wave: str = "sine"
    noise: float = 0.1 / 90
    rate: float = 1000.0
    seconds: float = 12.0
    preload: float = 0.0
    mounting_sd: float = 0.1

    @property
    def force_sd(self) -> float:
        """Standard deviation of a sample of each cell [N]."""
        return self.noise * self.load


@dataclass(frozen=True)
class Fault:
    """What is wrong with the sensors of a bench.

    Args:
        noise_time: Time constant of the filter through which the noise of both cells went [s]; 0 for white noise.
        latency: How much later the output is than the input [s].
        input_gain, output_gain: Relative error of each cell.
        input_zero, output_zero: Of each cell, over the largest force.
        louder: Factor on the noise.
    """

    noise_time: float = 0.0
    latency: float = 0.0
    input_gain: float = 0.0
    output_gain: float = 0.0
    input_zero: float = 0.0
    output_zero: float = 0.0
    louder: float = 1.0


@dataclass(frozen=True)
class Samples:
    """What both cells read, and the friction exponent that nobody sees.

    Args:
        time: Of each sample [s].
        input_force, output_force: Readings [N].
        exponent: Friction exponent at each sample [1].
    """

    time: np.ndarray
    input_force: np.ndarray
    output_force: np.ndarray
    exponent: np.ndarray


def simulate(bench: Bench, fault: Fault, drift: float, seed: int) -> Samples:
    """Simulate the samples of one recording.

    Args:
        bench: Cable and motion.
        fault: What is wrong.
        drift: Standard deviation by which the exponent wanders in a second [1].
        seed: Of everything random.
    """
    generator = np.random.default_rng([seed, 68])
    samples = round(bench.seconds * bench.rate)
    fine = np.arange(samples * FINER) / (bench.rate * FINER)
    initial = bench.exponent * (1 + bench.mounting_sd * generator.standard_normal())
    steps = drift * generator.standard_normal(len(fine)) / np.sqrt(bench.rate * FINER)
    exponent = np.abs(initial + np.cumsum(steps))
    force = _drive(bench, fine, generator)
    output = _slide_or_stick(*_friction_band(bench, force, exponent))
    time = fine[::FINER]
    late_output = np.interp(time - fault.latency, fine, output)
    noise = _noise(bench, fault, samples, generator)
    return Samples(
        time,
        (1 + fault.input_gain) * force[::FINER] + bench.load * fault.input_zero + noise[0],
        (1 + fault.output_gain) * late_output + bench.load * fault.output_zero + noise[1],
        exponent[::FINER],
    )


def _drive(bench: Bench, time: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return the input force [N]."""
    cycles = time / bench.period
    if bench.wave == "triangle":
        share = 1 - np.abs(2 * (cycles % 1) - 1)
    elif bench.wave == "random":
        frequencies = np.array([0.31, 0.57, 1.0, 1.37])
        phases, weights = generator.uniform(0, 2 * np.pi, 4), generator.uniform(0.4, 1.0, 4)
        waves = weights @ np.sin(2 * np.pi * np.outer(frequencies, cycles) + phases[:, None])
        share = 0.5 + 0.5 * waves / weights.sum()
    else:
        share = 0.5 - 0.5 * np.cos(2 * np.pi * cycles)
    return bench.load * (bench.least + (1 - bench.least) * share)


def _friction_band(bench: Bench, force: np.ndarray, exponent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest output force at which the rope sticks [N]."""
    if not bench.preload:
        return force * np.exp(-exponent), force * np.exp(exponent)
    loss = 2 * bench.preload * exponent
    less, more = force * np.exp(-exponent), force * np.exp(exponent)
    return np.minimum(force - loss, np.minimum(less, more)), np.maximum(force + loss, np.maximum(less, more))


def _slide_or_stick(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the output force [N] between its limits."""
    force, forces = 0.5 * (low[0] + high[0]), []
    for least, most in zip(low.tolist(), high.tolist(), strict=True):
        force = least if force < least else most if force > most else force
        forces.append(force)
    return np.array(forces)


def _noise(bench: Bench, fault: Fault, samples: int, generator: np.random.Generator) -> np.ndarray:
    """Return the noise of both cells [N], filtered or not with the same standard deviation."""
    white = generator.standard_normal((2, samples))
    if fault.noise_time:
        decay = np.exp(-1 / (fault.noise_time * bench.rate))
        start = decay * generator.standard_normal((2, 1))
        white = lfilter([np.sqrt(1 - decay**2)], [1, -decay], white, axis=1, zi=start)[0]
    return bench.force_sd * fault.louder * white
