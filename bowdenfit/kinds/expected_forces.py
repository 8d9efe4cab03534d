r"""Forces as a run's readings together say they are, so that the weight of a reading does not hang on its own noise.

A weight made of the very readings that it weighs rises with the output's noise, as the efficiency does, and the mean of a run
comes out too high by about 1.5 (sd/F)^2, however many rows it has. So the readings of each run, stroke and bend are projected
on a line: :math:`F_\text{out} = k F_\text{in}` by total least squares (Deming 1943, with the ratio of the two cells' noises),
bent by what is left over where that is far beyond noise, as hidden tension and load dependence do, and off the origin where
the cells may have offsets. The distance to the line
and the place along it have independent errors. What noise itself adds to a log ratio, to second order,

.. math:: E[\log(F_\text{in}/F_\text{out})] - \log(k^{-1}) = \tfrac{\sigma^2}{2} (F_\text{out}^{-2} - \rho^2 F_\text{in}^{-2}),

is told too, with sigma from the distances.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from bowdenfit.types import Labels, Vector

_FEWEST_TO_SHIFT = 3  # readings of a group, from which a line that need not go through the origin is told
_FEWEST_TO_BEND = 6  # readings of a group, from which a bend is looked for
_FAR_BEYOND = 10.0  # F of the bend, which chance exceeds in a group of a thousand
_FAR_OFF = 0.2  # of a log ratio from the line, from which few readings are taken as they are
_LEAST_FREEDOM = 4  # from which distances tell the noise
_MEDIAN = 0.6745  # of the size of a standard normal deviate


@dataclass(frozen=True)
class ExpectedForces:
    """Forces as the line through a group of readings has them.

    Args:
        input_force, output_force: Forces [N].
        log_ratio_error: What noise adds to log(F_in/F_out) on average [1].
    """

    input_force: Vector
    output_force: Vector
    log_ratio_error: Vector


def expected_forces(
    input_force: Vector,
    output_force: Vector,
    group: Labels,
    noise_ratio: float,
    noise: float | None,
    offsets: bool = False,
) -> ExpectedForces:
    """The forces that readings together say there were.

    Args:
        input_force, output_force: Readings [N].
        group: Number of each reading's run, stroke and bend together.
        noise_ratio: rho, noise of the input over that of the output; 0 where a weight hangs there.
        noise: Standard deviation of an output's reading as stated [N]; None where distances tell it.
        offsets: Whether the cells may show a force where there is none, so that the line need not go through the origin.
    """
    slope = _slopes(input_force, output_force, group, noise_ratio)[group]
    across = 1 + noise_ratio**2 * slope**2
    distance = output_force - slope * input_force
    bend, freedom = np.zeros(len(distance)), float(len(distance) - np.max(group, initial=-1) - 1)
    along = input_force + noise_ratio**2 * slope * distance / across
    few = np.zeros(len(distance), dtype=bool)
    for mine in np.split(np.argsort(group, kind="stable"), np.cumsum(np.bincount(group))[:-1]):
        if offsets and len(mine) >= _FEWEST_TO_SHIFT:
            bend[mine], more = _shift(along[mine], distance[mine])
            freedom -= more
        elif len(mine) >= _FEWEST_TO_BEND:
            bend[mine], more = _bend(along[mine], distance[mine])
            freedom -= more
        elif np.any(np.abs(np.log(output_force[mine] / (slope * input_force)[mine])) > _FAR_OFF):
            few[mine] = True
    left = np.where(few, 0.0, distance - bend)
    expected_in = input_force + noise_ratio**2 * slope * left / across
    expected_out = output_force - left / across
    if noise is None:
        sizes, freedom = np.abs(left)[~few] / np.sqrt(across[~few]), freedom - np.sum(few)
        noise = float(np.median(sizes) / _MEDIAN * np.sqrt(len(sizes) / freedom)) if freedom >= _LEAST_FREEDOM else 0.0
    possible = (expected_in > 0) & (expected_out > 0)
    expected_in, expected_out = (
        np.where(possible, expected, read)
        for expected, read in ((expected_in, input_force), (expected_out, output_force))
    )
    return ExpectedForces(
        expected_in, expected_out, noise**2 / 2 * (1 / expected_out**2 - noise_ratio**2 / expected_in**2)
    )


def _slopes(input_force: Vector, output_force: Vector, group: Labels, noise_ratio: float) -> Float[np.ndarray, " groups"]:
    """Slope of each group: the line through the origin with the least squares of its distances in units of their noise."""
    of_input, of_both, of_output = (
        np.bincount(group, product) for product in (input_force**2, input_force * output_force, output_force**2)
    )
    difference = of_input - noise_ratio**2 * of_output
    root = np.sqrt(difference**2 + 4 * noise_ratio**2 * of_both**2)
    # One of two forms of the same root, whichever does not cancel; forces that no table has may be 0 or negative.
    steep = (root - difference) / np.where(of_both == 0, 1.0, 2 * noise_ratio**2 * of_both) if noise_ratio else root
    flat = 2 * of_both / np.where(difference < 0, 1.0, np.maximum(difference + root, 1e-300))
    return np.asarray(np.where(difference < 0, steep, flat))


def _shift(along: Vector, distance: Vector) -> tuple[Vector, int]:
    """What is left over as a straight line along the line, and its further coefficients."""
    spread = np.ptp(along)
    if spread <= 1e-9 * np.max(along):
        return np.zeros(len(along)), 0
    columns = np.vander((along - along.mean()) / spread, 2)
    return columns @ np.linalg.lstsq(columns, distance, rcond=None)[0], 1


def _bend(along: Vector, distance: Vector) -> tuple[Vector, int]:
    """What is left over as a parabola along the line, and its coefficients; nothing where that may be noise."""
    spread = np.ptp(along)
    if spread <= 1e-9 * np.max(along):
        return np.zeros(len(along)), 0
    columns = np.vander((along - along.mean()) / spread, 3)
    fitted = columns @ np.linalg.lstsq(columns, distance, rcond=None)[0]
    noise = np.sum((distance - fitted) ** 2) / (len(along) - 3)
    return (fitted, 2) if np.sum(fitted**2) > 3 * _FAR_BEYOND * noise else (np.zeros(len(along)), 0)
