"""A single rope or a pull-pull loop as a recording shows it: from the input force through any motion to the output force.

Both follow the play operator, each on a scale of its own: a rope on the scale g on which friction is a shift, a loop on
that of the force itself. A rope whose friction builds up after a turn follows `bowdenfit.physics.presliding` instead. What a
load cell shows of the output is compared as a logarithm of a rope, whose force is positive, and as it is of a loop, whose force
passes through zero.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.conditions import LEAST_SHARE
from bowdenfit.cable.friction import FrictionModel
from bowdenfit.cable.sensors import LoadCells
from bowdenfit.physics.friction import play_operator
from bowdenfit.physics.loop import Rope, loop_band
from bowdenfit.physics.presliding import presliding_operator

LEAST_EXPONENT = 1e-9  # no mounting takes friction below none; not 0, of which logarithms are infinite

PerTime = Float[Array, "time recordings"]
PerRecording = Float[Array, " recordings"]
Shown = Float[np.ndarray, "*batch"]


@dataclass(frozen=True)
class RopeDrive:
    """A single rope at given parameters, in several recordings.

    Args:
        friction: How friction depends on load and speed.
        values: Values of the parameters.
        exponent: Friction exponent of each recording at the reference speed [1].
        rate: Factor on it at each time [1].
        step: Time since the one before [s]; 0 where it is not known, and bristles then have no damping.
    """

    friction: FrictionModel
    values: Mapping[str, Array]
    exponent: PerRecording
    rate: PerTime
    step: PerTime | float = 0.0
    least_share = LEAST_SHARE

    @property
    def least_force(self) -> float:
        """What an offset or a drag leaves of a force at least [N]."""
        return self.friction.conditions.least_force

    def band(self, mounting: PerRecording) -> PerTime:
        """Return half the width of the friction band on the scale g [1], with an effect of the mounting on the exponent."""
        return jnp.maximum(self.exponent * self.rate + mounting, LEAST_EXPONENT)

    def scaled(self, force: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the scale on which the operator works [1]."""
        return self.friction.scaled(self.values, force)

    def follow(
        self,
        input_force: PerTime,
        mounting: PerRecording,
        start: PerRecording,
        restart: PerTime | None = None,
        noise: PerTime | None = None,
    ) -> tuple[PerTime, PerTime]:
        """Return the output force [N], and the derivative of its `scaled` by the friction exponent [1].

        Args:
            input_force: Time first [N].
            mounting: Effect of the mounting on the friction exponent [1].
            start: `scaled` of the output force before the first time.
            restart: The same where it must be set anew, because the input before was not known; NaN elsewhere.
            noise: What the output is expected to follow beyond what the rope does: what a reading of the input has in it
                that is no motion, where the rope slides; 0 elsewhere [N].
        """
        x = self.scaled(input_force)
        stiffness = self.friction.presliding_stiffness(self.values)
        if stiffness is None:
            y, slope = self._stand_still(x, mounting, start, restart)
        else:
            follow = partial(self._creep, x, stiffness, start, restart)
            y, slope = jax.jvp(follow, (mounting,), (jnp.ones_like(mounting),))
        if noise is not None:
            y = y + self.scaled(jnp.maximum(input_force + noise, self.least_force)) - x
        return jnp.maximum(self.friction.force(self.values, y), self.least_force), slope

    def _stand_still(
        self, x: PerTime, mounting: PerRecording, start: PerRecording, restart: PerTime | None
    ) -> tuple[PerTime, PerTime]:
        """Return the output of the play operator on the scale g, and its derivative by the friction exponent."""
        band = self.band(mounting)
        (pulling, returning), slopes = jax.jvp(partial(self.friction.shifts, self.values), (band,), (jnp.ones_like(band),))
        return play_operator(x - pulling, x + returning, start, (-slopes[0], slopes[1]), restart)

    def _creep(
        self, x: PerTime, stiffness: Array, start: PerRecording, restart: PerTime | None, mounting: PerRecording
    ) -> PerTime:
        """Return the output on the scale g where friction builds up after a turn."""
        band, step = self.band(mounting), jnp.asarray(self.step)
        damping, known = self.friction.bristle_damping(self.values), step > 0
        if damping is not None:
            damping = jnp.where(known, damping / jnp.where(known, step, 1.0), 0.0)
        by_band = stiffness * jnp.maximum(self.exponent + mounting, LEAST_EXPONENT) / band
        return presliding_operator(x, self.friction.shifts(self.values, band), by_band, start, restart, damping)

    def shown(self, cells: LoadCells, output_force: PerTime, slope: PerTime) -> tuple[PerTime, PerTime]:
        """Return the log of what the output's cell shows, and its derivative by the exponent, of what `follow` gave."""
        shown = cells.shown_output(output_force, self.least_force)
        return jnp.log(shown), cells.shown_change(slope) / (self.friction.slope(self.values, output_force) * shown)

    @staticmethod
    def reading(shown: Shown) -> Shown:
        """Return what is compared of a shown output force: its logarithm."""
        return np.log(np.maximum(shown, LEAST_SHARE * np.max(np.abs(shown))))

    @staticmethod
    def without_delay(shown: Float[Array, "*batch"], late: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return a shown output force [N] less what a delay added to its `reading`."""
        return shown * jnp.exp(-late)


@dataclass(frozen=True)
class LoopDrive:
    """A pull-pull loop at given parameters, in several recordings: a play operator whose width is the loss.

    Exact while the loop moves on. At a reversal the slip fronts of the two sides cross the cable at different times: against
    a stiff load the output begins to change when about nine tenths of the band are crossed, against a soft one at its end.

    Args:
        preload: P of each recording [N].
        exponent: Friction exponent of one side, of each [1].
        rope: How the rope stretches; None where it is taken for linear.
    """

    preload: PerRecording
    exponent: PerRecording
    rope: Rope = None
    least_share = least_force = -jnp.inf

    def band(self, mounting: PerRecording) -> PerRecording:
        """Friction exponent of one side with an effect of the mounting [1]."""
        return jnp.maximum(self.exponent + mounting, LEAST_EXPONENT)

    def scaled(self, force: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the scale on which the operator works: the force itself [N]."""
        return force

    def follow(
        self,
        input_force: PerTime,
        mounting: PerRecording,
        start: PerRecording,
        restart: PerTime | None = None,
        noise: PerTime | None = None,
    ) -> tuple[PerTime, PerTime]:
        """Return the output force and its derivative by the friction exponent [N]; arguments as of `RopeDrive.follow`."""
        exponent = self.band(mounting)

        def limits(exponent: PerRecording) -> tuple[PerTime, PerTime]:
            return loop_band(input_force, self.preload, exponent, self.rope)

        (low, high), slopes = jax.jvp(limits, (exponent,), (jnp.ones_like(exponent),))
        y, slope = play_operator(low, high, start, slopes, restart)
        if noise is None:
            return y, slope
        lower, upper = loop_band(input_force + noise, self.preload, exponent, self.rope)
        return y + jnp.where(y - low < high - y, lower - low, upper - high), slope

    def shown(self, cells: LoadCells, output_force: PerTime, slope: PerTime) -> tuple[PerTime, PerTime]:
        """Return what the output's cell shows, and its derivative by the friction exponent, of what `follow` gave [N]."""
        return cells.shown_output(output_force), cells.shown_change(slope)

    @staticmethod
    def reading(shown: Shown) -> Shown:
        """Return what is compared of a shown output force: itself [N]."""
        return shown

    @staticmethod
    def without_delay(shown: Float[Array, "*batch"], late: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return a shown output force [N] less what a delay added to it."""
        return shown - late


def make_drive(
    cable: CableContacts,
    values: Mapping[str, Array],
    wrap_angles: Float[Array, "recordings contacts"],
    velocity: PerTime,
    exponent: PerRecording | None = None,
    step: PerTime | float = 0.0,
) -> RopeDrive | LoopDrive:
    """Return the cable as it lies in each recording.

    Args:
        cable: The cable.
        values: Values of the parameters.
        wrap_angles: Wrap angle of each contact in each recording [rad].
        velocity: At each time; NaN where it is not known.
        exponent: Friction exponents, if they are not those of the wrap angles [1].
        step: Time since the one before [s]; 0 where it is not known.
    """
    exponent = cable.friction_exponent(values, wrap_angles) if exponent is None else exponent
    if cable.is_loop:
        preload = cable.elasticity.preload(values, jnp.sum(wrap_angles, axis=-1))[0]
        return LoopDrive(preload, exponent, cable.elasticity.loop_rope(values))
    return RopeDrive(cable.friction, values, exponent, cable.friction.rate(values, velocity), step)
