"""What the load cells get wrong: noise, offsets, delay, the ends of their range, rounding, gaps and spikes."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from bowdenfit.description import Finite, NonNegative, Positive
from bowdenfit.types import Vector


@dataclass(frozen=True)
class LoadCellFaults:
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


def apply_faults(
    force: Vector,
    noise: float,
    limits: tuple[float, float] | None,
    faults: LoadCellFaults,
    rate: float,
    generator: np.random.Generator,
) -> Vector:
    """Readings of one cell: noise, spikes, the ends of its range, rounding, gaps."""
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
    """Noise of standard deviation 1, white or after a first-order low-pass."""
    white = generator.standard_normal(n)
    if cutoff is None:
        return white
    from scipy.signal import lfilter

    memory = float(np.exp(-2 * np.pi * cutoff / rate))
    drive = white * np.sqrt(1 - memory**2)
    drive[0] = white[0]
    return np.asarray(lfilter([1.0], [1.0, -memory], drive))
