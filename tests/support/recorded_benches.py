"""Recordings of benches unlike each other, with known truth, by a simulator that shares no code with the package.

A motor moves one end of the rope, a spring with a preload holds the other, and dry friction lets the rope slide only while the
force of one side is exp(friction exponent) of the other's, a drag added to both. All in units of the largest input force.
"""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

WAVES = ("triangle", "sine", "trapezoid", "chirp", "random")
WRAP = np.pi  # rad
FINE = 500.0  # Hz, at least, of the motion


@dataclass(frozen=True)
class RecordedBench:
    """One bench and what its recordings suffer; the rates in Hz, times in s, shares of the largest force.

    Args:
        rate, length, period: Sampling, length of a recording, time of a cycle.
        wave: One of `WAVES`.
        load: Largest input force [N].
        exponent: Friction exponent [1].
        drag: Tension that the cells do not show.
        noise: Standard deviation of a single sample of each cell.
        correlated: Correlation time of the input cell's noise; 0 for white noise.
        cutoff: Of the filter of both cells; 0 for none.
        delay: Of the output channel.
        drift: Of the output's zero from the start to the end.
        mountings: How many, with a recording each.
        scatter: Standard deviation of their exponents.
        velocity: Whether the speed is recorded.
        preload: Force of the spring at rest.
        stiffness: Of the rope, over that of the spring.
        least: Lowest position of the motor after the first half period, over the highest.
        crosstalk: Share of either force that the other cell reads.
        input_jump, output_jump: Of the zero of a cell at half time.
        other_friction: Friction exponent from half time on, over that before.
    """

    rate: float = 500.0
    length: float = 120.0
    period: float = 6.0
    wave: str = "triangle"
    load: float = 100.0
    exponent: float = 0.3
    drag: float = 0.0
    noise: float = 0.003
    correlated: float = 0.0
    cutoff: float = 0.0
    delay: float = 0.0
    drift: float = 0.0
    mountings: int = 1
    scatter: float = 0.006
    velocity: bool = False
    preload: float = 0.2
    stiffness: float = 20.0
    least: float = 0.0
    crosstalk: float = 0.0
    input_jump: float = 0.0
    output_jump: float = 0.0
    other_friction: float = 1.0

    @property
    def unusual(self) -> str:
        """What is not as usual, in words."""
        plain = RecordedBench()
        changes = ((f.name, getattr(self, f.name), getattr(plain, f.name)) for f in fields(self))
        return ", ".join(
            f"{name} {value:g}" if name != "wave" else str(value) for name, value, usual in changes if value != usual
        )


def channels(bench: RecordedBench, generator: np.random.Generator) -> dict[str, np.ndarray]:
    """One recording of one mounting: columns of its file."""
    finer = max(1, int(np.ceil(FINE / bench.rate)))
    samples = round(bench.length * bench.rate)
    fine = np.arange(samples * finer) / (bench.rate * finer)
    exponent = bench.exponent + bench.scatter * generator.standard_normal()
    output = (1 - bench.preload) / np.exp(exponent)
    motor = _position(bench, fine, generator)
    if bench.least:
        motor = np.where(fine < bench.period / 2, motor, np.maximum(motor, 0) * (1 - bench.least) + bench.least)
    motor = motor * (output + (1 - bench.preload) / bench.stiffness)
    forces = [_filtered(force, bench.cutoff / (bench.rate * finer)) for force in _forces(bench, motor, exponent)]
    time = fine[::finer]
    pulled, output = forces[0][::finer], np.interp(time - bench.delay, fine, forces[1])
    pulled, output = pulled + bench.crosstalk * output, output + bench.crosstalk * pulled
    late = np.arange(samples) >= samples // 2
    pulled, output = pulled + bench.input_jump * late, output + bench.output_jump * late
    white = generator.standard_normal((2, samples))
    if bench.correlated:
        decay = np.exp(-1 / (bench.correlated * bench.rate))
        white[0] = lfilter([np.sqrt(1 - decay**2)], [1, -decay], white[0])
    drift = bench.drift * (np.arange(samples) / samples - 0.5)
    columns = {
        "time_s": time,
        "input_force_N": bench.load * (pulled + bench.noise * white[0]),
        "output_force_N": bench.load * (output + bench.noise * white[1] + drift),
    }
    return columns | ({"velocity_mm/s": 50 * np.gradient(motor, fine)[::finer]} if bench.velocity else {})


def _position(bench: RecordedBench, time: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Of the motor, from 0 to 1."""
    cycles = time / bench.period
    triangle = 1 - np.abs(2 * (cycles % 1) - 1)
    if bench.wave == "random":
        frequency = np.arange(1, int(4 * cycles[-1])) / time[-1]
        knots = np.linspace(0, time[-1], 40 * len(frequency))
        amplitude = generator.rayleigh(size=len(frequency)) / (1 + (frequency * bench.period) ** 4) ** 0.5
        phase = generator.uniform(0, 2 * np.pi, len(frequency))
        waves = (a * np.cos(2 * np.pi * f * knots + p) for a, f, p in zip(amplitude, frequency, phase, strict=True))
        place = np.interp(time, knots, sum(waves))
        return (place - place.min()) / np.ptp(place)
    turns = cycles * (0.5 + 0.75 * time / time[-1]) if bench.wave == "chirp" else cycles
    shapes = {"triangle": triangle, "trapezoid": np.clip(1.5 * triangle - 0.25, 0, 1)}
    return shapes.get(bench.wave, (1 - np.cos(2 * np.pi * turns)) / 2)


def _forces(bench: RecordedBench, motor: np.ndarray, exponent: float) -> tuple[np.ndarray, np.ndarray]:
    """Input and output force for a motion of the motor; the spring is of unit stiffness, and at rest at the start."""
    stiff, preload = bench.stiffness, bench.preload
    late = np.arange(len(motor)) >= len(motor) // 2
    exponents = exponent * np.where(late, bench.other_friction, 1.0)
    ends = []
    for ratio in (np.exp(exponents), np.exp(-exponents)):
        ends.append(np.maximum((stiff * motor + (preload + bench.drag) * (1 - ratio)) / (stiff + ratio), 0.0).tolist())
    value, places = 0.0, []
    for least, most in zip(*ends, strict=True):
        value = least if value < least else most if value > most else value
        places.append(value)
    place = np.array(places)
    return stiff * (motor - place) + preload, preload + place


def _filtered(force: np.ndarray, cutoff: float) -> np.ndarray:
    """By a filter of first order; the cutoff as a share of the sampling rate, 0 for none."""
    decay = np.exp(-2 * np.pi * cutoff)
    return lfilter([1 - decay], [1, -decay], force, zi=[decay * force[0]])[0] if cutoff else force


def write(bench: RecordedBench, folder: Path, seed: int) -> Path:
    """A data set of a bench."""
    folder.mkdir(parents=True)
    generator, entries = np.random.default_rng(seed), []
    for i in range(bench.mountings):
        columns = channels(bench, generator)
        table = np.column_stack(list(columns.values()))
        np.savetxt(folder / f"r{i}.csv", table, "%.7g", ",", header=",".join(columns), comments="")
        entries.append(f'[[recording]]\nfile = "r{i}.csv"\nrun = "m{i}"\n')
    (folder / "cable.toml").write_text(
        'schema = 1\nname = "bench"\n[[contact]]\nname = "cable"\nfriction = "mu"\n'
        'wrap_angle = { value = 180, unit = "deg" }\n[tables]\nrecordings = {}\n' + "".join(entries)
    )
    return folder


def draw_bench(seed: int) -> RecordedBench:
    """A bench drawn at random from all that recordings differ in."""
    g = np.random.default_rng(seed)
    rate = float(np.exp(g.uniform(np.log(20), np.log(5000))))
    length = float(np.exp(g.uniform(np.log(20), np.log(700))))
    length = min(length, 1.2e6 / rate) if length * rate > 1.2e6 else length
    cycles = float(np.exp(g.uniform(np.log(3), np.log(min(300, length * min(rate, 60) / 40)))))
    return RecordedBench(
        rate=round(rate),
        length=round(length),
        period=float(f"{length / cycles:.3g}"),
        wave=str(g.choice(WAVES)),
        load=float(g.choice([1.0, 100.0, 1e4])),
        exponent=float(g.choice([0.1, 0.3, 0.6])),
        drag=float(g.choice([0.0, 0.0, 0.0, 0.05])),
        noise=float(g.choice([0.001, 0.003, 0.01, 0.03])),
        correlated=float(g.choice([0.0, 0.0, 0.01, 0.1])),
        cutoff=float(g.choice([0.0, 0.0, 5.0])) * (20 / min(length / cycles, 20)),
        delay=float(g.choice([0.0, 0.02, -0.01])),
        drift=float(g.choice([0.0, 0.0, 0.0, 0.01])),
        mountings=int(g.choice([1, 3])),
        scatter=0.02 * float(g.choice([0.1, 0.3])),
        velocity=bool(g.random() < 0.5),
    )
