"""The two load cells at the ends of a cable: what they show of the true forces, and names of what several tables share."""

from collections.abc import Mapping
from dataclasses import dataclass

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from bowdenfit.description.shares import GAIN_ERROR as GAIN_ERROR
from bowdenfit.description.shares import RUN_SCATTER as RUN_SCATTER

FORCE_NOISE = "sigma_F"
BLOCK_NOISE = "sigma_block"
DELAY_ERROR = "delay_error"
INPUT_OFFSET, OUTPUT_OFFSET = "input_offset", "output_offset"


@dataclass(frozen=True)
class LoadCells:
    r"""Systematic errors of the load cells, 0 where nothing is said of them.

    .. math:: F_\text{in} = F_\text{in,shown} - b_\text{in}, \quad
              F_\text{out} = (F_\text{out,shown} - b_\text{out}) e^\gamma

    Args:
        input_offset: b_in [N].
        output_offset: b_out [N].
        gain_error: gamma, relative gain error between the two [1].
        delay_error: By how much the output still comes later than it was shifted back by: its delay, less the estimate [s].
    """

    input_offset: Array | float
    output_offset: Array | float
    gain_error: Array | float
    delay_error: Array | float

    @classmethod
    def of(cls, values: Mapping[str, Array]) -> "LoadCells":
        """The load cells at given parameters."""
        names = (INPUT_OFFSET, OUTPUT_OFFSET, GAIN_ERROR, DELAY_ERROR)
        return cls(*(values.get(name, 0.0) for name in names))

    def true_input(self, shown: Float[Array, "*batch"], least: float = -jnp.inf) -> Float[Array, "*batch"]:
        """Force at the input [N] where its cell shows a force, at least `least`."""
        return _at_least(shown - self.input_offset, least)

    def true_output(self, shown: Float[Array, "*batch"], least: float = -jnp.inf) -> Float[Array, "*batch"]:
        """Force at the output [N] where its cell shows a force; what the offset leaves of that is at least `least`."""
        return _at_least(shown - self.output_offset, least) * jnp.exp(self.gain_error)

    def shown_input(self, force: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """What the input's cell shows of a force [N]."""
        return force + self.input_offset

    def shown_output(self, force: Float[Array, "*batch"], least: float = -jnp.inf) -> Float[Array, "*batch"]:
        """What the output's cell shows of a force [N], at least `least`."""
        return _at_least(self.shown_change(force) + self.output_offset, least)

    def shown_change(self, change: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """What the output's cell shows of a change of the force [N]."""
        return change * jnp.exp(-self.gain_error)

    def late(self, drift: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """What the error of the delay adds to the output, in the unit whose change in a second `drift` is."""
        return self.delay_error * drift


def _at_least(force: Float[Array, "*batch"], least: float) -> Float[Array, "*batch"]:
    return jnp.maximum(force, least) if least > -jnp.inf else force
