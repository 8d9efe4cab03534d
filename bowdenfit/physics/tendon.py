r"""A rope in its sheath that pulls a spring, or against a stop: force at the motor against the displacement of the motor.

Friction holds the tension T at every place s (0 at the motor, 1 at the far end) to :math:`|d \log T / ds| \le \Lambda`. While
all of the rope slides, tension falls along it as :math:`F e^{-\sigma\Lambda s}`, :math:`\sigma` = +1 pulling and -1 on the
return, so that the far end feels :math:`F e^{-\sigma\Lambda}`, moves by that over the spring's stiffness K, and the rope
stretches by its mean tension :math:`\bar T = F (1 - e^{-\sigma\Lambda})/(\sigma\Lambda)`. Displacements add up:

.. math:: x - x_0 = F_\sigma e^{-\sigma\Lambda}/K + e(\bar T), \qquad e(T) = T/k + d(1 - e^{-T/T_c})

The extension is that under the mean tension, so that a turn has the closed form below. A linear rope loses nothing by that. Of
one that beds in (k = 29 N/mm, d = 1.2 mm, T_c = 12 N) forces against a stop are off by 0.1, 0.5 and 1.8 % of the largest at
exponents of 0.4, 0.8 and 1.5 and loads of 50 N, and a fitted exponent by 0.3, 1.5 and 8 % (by 0.02, 0.15 and 2.7 % at 184 N,
and with a spring of 10 N/mm by up to 0.1 % but at 1.5, where it is 1 to 5 %). Where that matters, bend the cable less.

A stop that does not give is :math:`K \to \infty`. When the motor turns round, the rope begins to slide at the motor alone: the
far end stands still until the slip front has crossed, and what the motor moves is stretch,

.. math:: e(\bar T) = e(\bar T_t) + x - x_t, \qquad \sqrt F = \sqrt{F_t} + \sigma \sqrt{\Lambda |\bar T - \bar T_t|}

up to :math:`F = F_t e^{2\sigma\Lambda}`, from where on all of it slides. A turn before that is remembered, and forgotten once
the displacement has passed it again.

For a linear rope the pull is over the return, at the same displacement,

.. math:: \frac{F_+}{F_-} = \frac{e^{\Lambda}/K + (e^{\Lambda} - 1)/(\Lambda k)}
          {e^{-\Lambda}/K + (1 - e^{-\Lambda})/(\Lambda k)}

which is :math:`e^{2\Lambda}` of a rope that hardly gives beside the spring and :math:`e^\Lambda` of a stop, whatever the
stiffness: the width of the loop tells friction up to that factor of two by itself, and wholly with the fall of the force after
a turn, which is :math:`e^{2\Lambda}` for any spring, or with the stiffness of spring or rope. The level tells the stiffness.

References:
    Kaneko, Yamashita and Tanie 1991, Basic considerations on transmission characteristics for tendon drive robots, 5th Int.
    Conf. on Advanced Robotics (apparent stiffness that differs by the direction of motion); Agrawal, Peine and Yao 2010,
    Modeling of transmission characteristics across a cable-conduit system, IEEE Trans. Robotics 26, 914 (friction along the
    sheath, and the part of the rope that slides after a turn); Palli, Borghesan and Melchiorri 2012, Modeling, identification
    and control of tendon-based actuation systems, IEEE Trans. Robotics 28, 277. The equation of the turn is that of
    `mean_tension_unloading`, solved for the force.
"""

from dataclasses import dataclass

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from bowdenfit.physics.stretch import extension, mean_tension, tension_from_extension


@dataclass(frozen=True)
class RopeStretch:
    """Elasticity of a rope under its mean tension; linear without bedding-in.

    Args:
        stiffness: k [N/mm].
        bedding: Bedding-in stretch d [mm] and the load over which it is taken up [N]; None for a linear rope.
    """

    stiffness: Array
    bedding: tuple[Array, Array] | None = None

    def extension(self, tension: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the extension under a mean tension [mm]."""
        return tension / self.stiffness if self.bedding is None else extension(tension, self.stiffness, *self.bedding)

    def tension(self, extended: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the mean tension from the extension [N]; 0 for a slack rope."""
        if self.bedding is None:
            return jnp.maximum(extended, 0.0) * self.stiffness
        return tension_from_extension(extended, self.stiffness, *self.bedding)

    def motor_force(self, travel: Array, share: Array, more_compliance: Array) -> Array:
        """Return the force at the motor [N] of a rope in series with a compliance, given its mean tension per motor force."""
        together = more_compliance + share / self.stiffness
        if self.bedding is None:
            return jnp.maximum(travel, 0.0) / together
        stretch, load = self.bedding
        return tension_from_extension(travel, 1 / together, stretch, load / share)


@dataclass(frozen=True)
class Turn:
    """The last reversal of the motor.

    Args:
        travel: Displacement from that without force [mm].
        force: Force at the motor [N].
        mean: Mean tension of the rope [N].
    """

    travel: Array
    force: Array
    mean: Array


@dataclass(frozen=True)
class Tendon:
    """A rope in its sheath, with the spring or stop that it pulls.

    Args:
        exponent: Lambda [1].
        end_compliance: 1/K of the spring at the far end [mm/N]; 0 for a stop.
        rope: Elasticity of the rope.
    """

    exponent: Array
    end_compliance: Array | float
    rope: RopeStretch

    def sliding(self, travel: Array, stroke: Array) -> tuple[Array, Array]:
        """Return the force at the motor and mean tension [N] while all of the rope slides.

        Args:
            travel: Displacement from that without force [mm].
            stroke: +1 pulling, -1 return.
        """
        along = stroke * self.exponent
        share = mean_tension(jnp.ones_like(along), along)
        force = self.rope.motor_force(travel, share, self.end_compliance * jnp.exp(-along))
        return force, share * force

    def sliding_after_turn(self, turn: Turn, travel: Array, stroke: Array) -> tuple[Array, Array]:
        """Return the force and mean tension [N] after a reversal, before and after the slip front has crossed the rope."""
        moved = jnp.maximum(stroke * (travel - turn.travel), 0.0)
        mean = self.rope.tension(self.rope.extension(turn.mean) + stroke * moved)
        before = _safe_root(turn.force)
        root = before + stroke * _safe_root(self.exponent * jnp.abs(mean - turn.mean))
        crossed = stroke * (root - before * jnp.exp(stroke * self.exponent)) >= 0
        force, of_sliding = self.sliding(travel, stroke)
        return jnp.where(crossed, force, root**2), jnp.where(crossed, of_sliding, mean)


def _safe_root(value: Array) -> Array:
    """Return the square root, with a derivative of 0 at 0."""
    positive = value > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, value, 1.0)), 0.0)
