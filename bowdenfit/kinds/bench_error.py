"""Systematic errors of a whole bench, as its tables would show them, and how large they may be."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import sqrt
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from bowdenfit.description import Description
from bowdenfit.kinds.rows import OwnAngles
from bowdenfit.types import Labels, Matrix, Vector

_READ_CELLS = frozenset({"forces", "recordings", "loop"})  # tables that hold the readings of both load cells
PARABOLA = 3  # coefficients
STEP = 1e-4  # relative, and of an angle in rad: small beside any interval, large beside rounding


@dataclass(frozen=True)
class BenchLoads:
    """Loads of all readings of a table, to which errors of its bench refer.

    Args:
        input_force, output_force: Largest force that each load cell read [N].
        middle, largest: Median and largest tension of the readings, each the geometric mean of both forces [N].
    """

    input_force: float
    output_force: float
    middle: float
    largest: float

    @classmethod
    def of(cls, input_force: Vector, output_force: Vector) -> "BenchLoads":
        """Return those of the forces that were read [N]; for efficiencies the input force is 1."""
        tensions = np.sqrt((input_force * output_force)[(input_force > 0) & (output_force > 0)])
        middle, largest = (float(np.median(tensions)), float(tensions.max())) if len(tensions) else (1.0, 1.0)
        return cls(float(np.abs(input_force).max()), float(np.abs(output_force).max()), middle, largest)


@dataclass(frozen=True)
class BenchError:
    """An error that all readings of a bench share.

    Args:
        gain: Relative error of the output's load cell against that of the input [1].
        hysteresis: By how much the output's cell reads higher while its force falls than while it rises, relative to the
            force [1]: half of it is taken off while pulling, and half is added while returning.
        angle_scale: Relative error of all wrap angles [1].
        angle_offset: Error that all wrap angles share [rad].
        wear: Change of friction from the first mounting, or row, to the last, relative to its middle [1].
        load_exponent: Exponent by which friction grows with the load, beyond the model's; none at the middle load [1].
        compression: Growth of all wrap angles, and with them of friction, from no load to the largest [1].
        input_zero, output_zero: What a load cell reads without a load, relative to the largest force that it read [1].
        crosstalk: Share of the input force that the output's reading holds [1].
    """

    gain: float = 0.0
    hysteresis: float = 0.0
    angle_scale: float = 0.0
    angle_offset: float = 0.0
    wear: float = 0.0
    load_exponent: float = 0.0
    compression: float = 0.0
    input_zero: float = 0.0
    output_zero: float = 0.0
    crosstalk: float = 0.0

    @property
    def kind(self) -> str:
        """Name of the field of an error that is of one kind only."""
        (name,) = (name for name, value in vars(self).items() if value)
        return name

    def apply_to_force(self, output_force: Vector, stroke: Vector | Labels | float = 1.0) -> Vector:
        """Return output forces [N], or efficiencies, as the bench would read them.

        Args:
            output_force: As they were read.
            stroke: +1 pulling, -1 returning, 0 neither.
        """
        return output_force * (1 + self.gain) * (1 - self.hysteresis * np.asarray(stroke) / 2)

    def apply_to_cells(
        self, input_force: Vector, output_force: Vector, stroke: Vector | Labels, loads: BenchLoads
    ) -> tuple[Vector, Vector]:
        """Return input and output forces [N] as the bench would read them.

        Args:
            input_force, output_force: As they were read, without their noise.
            stroke: +1 pulling, -1 returning, 0 neither.
            loads: Loads of the whole table.
        """
        output = self.apply_to_force(output_force + self.crosstalk * input_force, stroke)
        return input_force + self.input_zero * loads.input_force, output + self.output_zero * loads.output_force

    def apply_to_loop(
        self, forces: tuple[Vector, Vector], stroke: Labels, group: Labels, loads: BenchLoads
    ) -> tuple[Vector, Vector]:
        """Return input and output forces [N] of a loop as the bench would read them; their noise is not of the bench.

        Args:
            forces: Input and output force as they were read [N].
            stroke: +1 moving forward, -1 back, 0 neither.
            group: Number of the setting and stroke of each.
            loads: Loads of the whole table.
        """
        input_force, output_force = forces
        smooth = smooth_readings(output_force, powers(input_force, PARABOLA), group)
        read_input, changed = self.apply_to_cells(input_force, smooth, stroke, loads)
        return read_input, output_force + changed - smooth

    def apply_to_friction(
        self, input_force: Vector, output_force: Vector, loads: BenchLoads, order: Vector | float = 0.0
    ) -> Vector:
        """Return output forces of sliding readings as friction would make them that is worn, or depends on the load.

        Args:
            input_force: Input force [N], or 1 for efficiencies.
            output_force: Output force [N], or efficiency.
            loads: Loads of the whole table.
            order: When each was read, from -0.5 for the first to 0.5 for the last.
        """
        taut = (output_force > 0) & (input_force > 0)
        tension = np.sqrt(np.where(taut, input_force * output_force, loads.middle**2))
        of_load = (tension / loads.middle) ** self.load_exponent * (1 + self.compression * tension / loads.largest)
        ratio = np.where(taut, output_force / np.where(taut, input_force, 1.0), 1.0)
        return np.where(taut, input_force * ratio ** (of_load * (1 + self.wear * np.asarray(order))), output_force)

    def apply_to_rope(
        self,
        forces: tuple[Vector, Vector],
        log_ratio: Vector,
        stroke: Labels,
        order: Vector | float,
        loads: BenchLoads,
    ) -> tuple[Vector, Vector]:
        """Return input and output forces [N] of a single rope as the bench would read them; their noise is not of the bench.

        An error that is calculated from a noisy reading scales its noise too. Where the error itself does not show, as wear
        inside a run, that would be all that the readings say of it, and more with each of them.

        Args:
            forces: Input and output force as they were read [N].
            log_ratio: log(F_in/F_out) to which friction had taken each reading when the rope last slid, without noise [1].
            stroke: +1 pulling, -1 returning, 0 where it sticks.
            order: When each was read, from -0.5 for the first to 0.5 for the last.
            loads: Loads of the whole table.
        """
        input_force, output_force = forces
        taut = (input_force > 0) & (output_force > 0)
        slid = np.where(taut, input_force * np.exp(-log_ratio), output_force)
        likely = np.where(stroke != 0, slid, output_force)
        worn = self.apply_to_friction(input_force, slid, loads, order)
        likely_worn = likely * np.where(taut, worn / np.where(taut, slid, 1.0), 1.0)
        read_input, read_output = self.apply_to_cells(input_force, likely_worn, stroke, loads)
        return read_input, np.where(taut, output_force * read_output / np.where(taut, likely, 1.0), read_output)

    def apply_to_angles(self, angle: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Return wrap angles [rad] as the bench would read them; an angle of 0, and one that is not known, stays."""
        return np.where(angle > 0, angle * (1 + self.angle_scale) + self.angle_offset, angle)

    def where_angles_grow(self, sds: Float[np.ndarray, "..."]) -> "BenchError":
        """Return the error without growth of wrap angles where all measured ones have a stated error, which is in the fit.

        Args:
            sds: Standard deviations of the wrap angles measured with rows [rad]; NaN where none is stated.
        """
        return replace(self, compression=0.0) if sds.size and np.all(np.isfinite(sds)) else self

    def apply_to_rows(self, own: OwnAngles) -> OwnAngles:
        """Return wrap angles measured with rows; one with a standard deviation stays, because its error is in the fit."""
        return replace(own, angle=np.where(np.isnan(own.sd), self.apply_to_angles(own.angle), own.angle))


def smooth_readings(reading: Vector, columns: Matrix, group: Labels, weight: Vector | float = 1.0) -> Vector:
    """Return readings without most of their noise, which an error of the bench does not scale: by least squares in each group.

    Args:
        reading: Readings.
        columns: What they depend on linearly, (readings, columns).
        group: Number of the group of each, such as its stroke.
        weight: Weight of each residual.
    """
    smooth, weights = np.empty(len(reading)), np.broadcast_to(weight, len(reading))
    for number in np.unique(group):
        rows = group == number
        weighed = columns[rows] * weights[rows, None]
        smooth[rows] = columns[rows] @ np.linalg.lstsq(weighed, reading[rows] * weights[rows], rcond=None)[0]
    return smooth


def powers(values: Vector, count: int) -> Matrix:
    """Return the columns of a polynomial with so many coefficients; a value that is not known counts as 0."""
    finite = np.nan_to_num(values)
    return np.vander(finite / max(float(np.max(np.abs(finite), initial=0.0)), 1e-300), count)


def order_of(number: Labels, count: int) -> Vector:
    """Return the order of mountings or rows from -0.5 to 0.5; 0 where there is only one.

    Args:
        number: Number of each, from 0.
        count: How many there are.
    """
    return number / (count - 1) - 0.5 if count > 1 else np.zeros(len(number))


@dataclass(frozen=True)
class ErrorSource:
    """One cause of error.

    Args:
        name: Name of the error: "wrap angles", "gain", "hysteresis", "wear", "load exponent", "compression", "zeros"
            or "crosstalk".
        words: The same with how well it is known.
        steps: Small errors of the readings that stand for it, each with its standard uncertainty in such steps.
        cells: How many independent errors within the same limits add up to it: 2 for two load cells.
    """

    name: str
    words: str
    steps: Mapping[BenchError, float]
    cells: int = 1

    JSON: ClassVar = ("name", "words")

    @property
    def heading(self) -> str:
        """Heading of a column of its shifts."""
        return {"wrap angles": "angles", "load exponent": "load"}.get(self.name, self.name)


def iterate_error_sources(description: Description) -> Iterator[ErrorSource]:
    """Yield each source of error with its standard uncertainty.

    Between limits of +-a every value is as likely (GUM 4.3.7), which makes a standard uncertainty of a/sqrt(3); two load cells
    have errors of their own.
    """
    limits = description.errors
    angles = {
        f"{limits.angle.value:g} {limits.angle.unit}": (BenchError(angle_offset=STEP), limits.angle.to("angle")),
        f"{100 * limits.angle_scale:g} %": (BenchError(angle_scale=STEP), limits.angle_scale),
    }
    known_to = {words: (step, limit / sqrt(3) / STEP) for words, (step, limit) in angles.items() if limit}
    if known_to:
        yield ErrorSource("wrap angles", f"wrap angles known to {' and '.join(known_to)}", dict(known_to.values()))
    of_both_cells = sqrt(2 / 3) / STEP
    if limits.gain and description.gain_sd is None:
        words = f"a gain of each load cell known to {100 * limits.gain:g} %"
        yield ErrorSource("gain", words, {BenchError(gain=STEP): limits.gain * of_both_cells}, 2)
    if limits.hysteresis:
        words = f"a hysteresis of each load cell of up to {100 * limits.hysteresis:g} %"
        yield ErrorSource("hysteresis", words, {BenchError(hysteresis=STEP): limits.hysteresis * of_both_cells}, 2)
    if limits.wear:
        words = f"wear of up to {100 * limits.wear:g} %"
        yield ErrorSource("wear", words, {BenchError(wear=STEP): limits.wear / sqrt(3) / STEP})
    if limits.load_exponent:
        words = f"a load exponent within {limits.load_exponent:g}"
        yield ErrorSource("load exponent", words, {BenchError(load_exponent=STEP): limits.load_exponent / sqrt(3) / STEP})
    if limits.compression:
        words = f"wrap angles that grow by up to {100 * limits.compression:g} % with the load"
        yield ErrorSource("compression", words, {BenchError(compression=STEP): limits.compression / sqrt(3) / STEP})
    if not _READ_CELLS.intersection(description.tables.stated):
        return
    if limits.zero and not description.fits_offsets:
        words = f"a zero of each load cell known to {100 * limits.zero:g} % of its largest force"
        has_input = description.sensors.noise_ratio > 0 and description.motor is None  # no hung weight, and no motor
        cells = (BenchError(output_zero=STEP), *([BenchError(input_zero=STEP)] if has_input else []))
        yield ErrorSource("zeros", words, dict.fromkeys(cells, limits.zero / sqrt(3) / STEP))
    if limits.crosstalk:
        words = f"crosstalk of up to {100 * limits.crosstalk:g} %"
        yield ErrorSource("crosstalk", words, {BenchError(crosstalk=STEP): limits.crosstalk / sqrt(3) / STEP})
