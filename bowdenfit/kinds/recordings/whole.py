"""Whole recordings of a single rope: every block through the play operator, and the efficiency of each run."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.drive import Each, Rope
from bowdenfit.cable.noise import scatter
from bowdenfit.kinds.recordings.blocks import RECORDED, likely_forces, positive
from bowdenfit.kinds.recordings.blocks_term import BlocksTerm, Data, Values
from bowdenfit.kinds.recordings.side_by_side import group_blocks, side_by_side
from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.recordings.recording import Recording, Recordings

_REACH = 0.5  # of a recording's own friction exponent, that the first guess of its mounting effect is corrected by


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

    def _first_guess(self, drive: Rope, data: Data) -> tuple[Each, Each]:
        guess = jnp.zeros_like(drive.exponent)
        if not self.cable.friction.depends_on_load:  # else the loop's width means another exponent at every scale
            guess = data["exponent"] - self._typical(drive, data)
        return guess, _REACH * jnp.asarray(data["exponent"])

    def _typical(self, drive: Rope, data: Data) -> Each:
        """Friction exponent of each recording at its mean speed [1]."""
        return drive.exponent * drive.friction.rate(drive.values, data["speed"])

    def expected(self, values: Values, data: Data) -> Float[Array, " runs"]:
        """Expected efficiency of each run, the effect of its mounting left out [1]."""
        return transmission_efficiency(self._of_run(self._typical(self._drive(values, data)[0], data)))

    def simulate(self, values: Values, data: Data, key: Array) -> Float[Array, " runs"]:
        """Efficiency of each run as the bench would give it [1]."""
        sd = self._deviations(values, data, values).sd
        of_run = self._of_run(self._typical(self._drive(values, data)[0], data))
        return transmission_efficiency(of_run + sd * scatter(key, sd.shape, self.cable.description))

    def _of_run(self, of_recording: Array) -> Array:
        """Mean over the recordings of each run."""
        run, runs = jnp.asarray(self.data["run"]), len(self.labels)
        counts = jnp.zeros(runs).at[run].add(1.0)
        return jnp.zeros(runs).at[run].add(of_recording) / counts

    def observed(self) -> np.ndarray:
        """Efficiency of each run by the width of its own hysteresis loop [1]."""
        run, exponent = self.data["run"], self.data["exponent"]
        return np.exp(-np.bincount(run, exponent) / np.bincount(run))


def pad_recordings(
    recordings: Recordings, angles: Mapping[str, np.ndarray], censored: bool, noise_ratio: float
) -> dict[str, Any]:
    """Arrays over time and recordings; the shorter ones stand still at their end, with no weight.

    The noise ratio is that of the input over that of the output.
    """
    data = side_by_side(recordings, [_blocks(r, censored, noise_ratio) for r in recordings.each], angles)
    speeds = [np.abs(r.blocks.velocity[r.strokes.used_sliding]) for r in recordings.each]
    return data | {
        "reading": np.log(data["output_force"]),
        "newtons": data["output_force"],
        "exponent": np.array([r.strokes.exponent for r in recordings.each]),
        "speed": np.array([float(speed.mean()) if len(speed) else float("nan") for speed in speeds]),
    }


def _blocks(recording: Recording, censored: bool, noise_ratio: float) -> dict[str, Any]:
    """Blocks of one recording; while the rope stands still the input's noise is not in the output."""
    groups = group_blocks(recording)
    arrays = groups.arrays(Rope, positive(recording), censored)
    likely_in, likely_out = (groups.mean(force) for force in likely_forces(recording.blocks))
    of_input = noise_ratio * (recording.strokes.contact[groups.starts] != 0)
    return arrays | {"weight": arrays["worth"] / ((of_input / likely_in) ** 2 + 1 / likely_out**2)}
