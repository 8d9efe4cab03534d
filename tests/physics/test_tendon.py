"""A rope in its sheath with a spring or a stop: forces after any turns are those of friction at every place of the rope."""

import jax.numpy as jnp
import numpy as np
import pytest
from catheters import Catheter, cycles

from bowdenfit.kinds.displacement.table import follow_motor
from bowdenfit.physics.tendon import RopeStretch, Tendon, Turn

CATHETERS = {
    "a soft spring": Catheter(0.6, 0.5, 20.0),
    "a spring as stiff as the rope": Catheter(0.9, 8.0, 8.0, 1.5),
    "a stop": Catheter(0.5, np.inf, 5.0),
    "little friction": Catheter(0.05, 2.0, 10.0),
    "much friction": Catheter(2.0, 1.0, 3.0),
}
MOTIONS = {
    "a loop": cycles(0.0, 30.0, 16, 2),
    "loops inside a loop": np.concatenate(
        [cycles(2.0, 30.0, 12)[:-4], cycles(8.0, 14.0, 7), cycles(9.0, 30.0, 9), [5.0, 25.0, 7.0, 20.0, 10.0, 31.0]]
    ),
}


def forces_by_turns(catheter, displacements):
    """Forces at the motor, each from the turn before it."""
    motion = follow_motor(displacements, np.zeros(len(displacements), dtype=int))
    tendon = Tendon(jnp.asarray(catheter.exponent), 1 / catheter.spring, RopeStretch(jnp.asarray(catheter.rope)))
    turns, states = motion.turns, []
    for k in range(len(turns.at)):
        travel = jnp.asarray(turns.at[k] - catheter.zero)
        after = turns.after[k]
        force, mean = (
            tendon.sliding(travel, jnp.asarray(float(turns.stroke[k])))
            if after == k
            else tendon.sliding_after_turn(states[after], travel, jnp.asarray(float(turns.stroke[k])))
        )
        states.append(Turn(travel, force, mean))
    results = []
    for x, stroke, after, slides in zip(displacements, motion.stroke, motion.after, motion.slides, strict=True):
        points = jnp.asarray(x - catheter.zero), jnp.asarray(float(stroke))
        results.append(float((tendon.sliding(*points) if slides else tendon.sliding_after_turn(states[after], *points))[0]))
    return np.array(results)


@pytest.mark.extended
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("name", CATHETERS)
def test_forces_after_any_turns_are_those_of_friction_at_every_place_of_the_rope(name, motion):
    catheter, displacements = CATHETERS[name], MOTIONS[motion] + 3.0
    force = forces_by_turns(catheter, displacements)
    # From a slack rope the first stroke is not the one that the turns assume; what follows the first full turn is.
    reference = catheter.pulled(displacements)
    np.testing.assert_allclose(force[20:], reference[20:], rtol=3e-3, atol=2e-3 * reference.max())


def test_the_pull_is_over_the_return_between_one_and_two_friction_exponents():
    for catheter, power in ((Catheter(0.7, 0.01, 100.0), 2.0), (Catheter(0.7, np.inf, 4.0), 1.0)):
        tendon = Tendon(jnp.asarray(catheter.exponent), 1 / catheter.spring, RopeStretch(jnp.asarray(catheter.rope)))
        pull, back = (float(tendon.sliding(jnp.asarray(5.0), jnp.asarray(s))[0]) for s in (1.0, -1.0))
        assert np.log(pull / back) == pytest.approx(power * 0.7, rel=2e-3)
