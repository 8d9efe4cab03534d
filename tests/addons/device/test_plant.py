"""The plant: the loop's own friction, energy that never grows, and steps whose error falls with their length."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bowdenfit.addons.device.mechanics.plant import (
    LoopTransmission,
    Motion,
    Plant,
    advance,
    apply_dry_friction,
    mechanical_energy,
    rope_torques,
    settle_node,
)
from bowdenfit.physics.friction import play_operator
from bowdenfit.physics.loop import loop_band

LOOP = LoopTransmission(jnp.asarray(20.0), jnp.asarray(0.35), jnp.asarray(0.2))
PLANT = Plant(LOOP, *(jnp.asarray(v) for v in (7e-4, 0.0, 0.01, 1e-3, 0.0, 0.0)))


def loop(stiffness=20.0, preload=0.35, exponent=0.2):
    return LoopTransmission(*(jnp.asarray(float(v)) for v in (stiffness, preload, exponent)))


@pytest.mark.parametrize("preload", [0.0, 0.05, 0.35, 40.0])
@pytest.mark.parametrize("exponent", [0.0, 0.2, 1.5])
def test_the_node_is_the_loops_own_play_operator_under_any_motor_torque(preload, exponent):
    cable, turn = loop(20.0, preload, exponent), np.random.default_rng(1)
    torque = jnp.asarray(np.cumsum(turn.standard_normal((5000, 1)) * 0.3, axis=0) % 4.0 - 2.0)
    low, high = loop_band(torque, cable.preload, cable.exponent)
    expected = play_operator(low, high, jnp.zeros(1))[0][:, 0]
    placed = cable.twist(expected)  # of the node, with the joint held at 0
    motor = placed + cable.twist(torque[:, 0])

    def follow(node, angle):
        node = cable.settled_node(node, angle, jnp.zeros(()))
        return node, cable.torques(node, angle, jnp.zeros(()))

    at_motor, at_joint = jax.lax.scan(follow, jnp.zeros(()), motor)[1]
    np.testing.assert_allclose(at_motor, torque[:, 0], atol=1e-12)
    np.testing.assert_allclose(at_joint, expected, atol=1e-12)


def test_torques_stay_inside_the_loops_band_however_both_ends_move():
    turn = np.random.default_rng(2)
    angles = jnp.asarray(np.cumsum(turn.standard_normal((5000, 2)) * 0.01, axis=0))

    def follow(node, value):
        node = LOOP.settled_node(node, *value)
        return node, jnp.stack(LOOP.torques(node, *value))

    at_motor, at_joint = jax.lax.scan(follow, jnp.zeros(()), angles)[1].T
    low, high = loop_band(at_motor, LOOP.preload, LOOP.exponent)
    assert jnp.max(jnp.maximum(low - at_joint, at_joint - high)) < 1e-13
    assert float(jnp.mean(jnp.abs(at_motor) > 2 * LOOP.preload)) > 0.05, "slack is visited too"


def test_a_twist_is_the_inverse_of_the_torque_it_passes():
    torque = jnp.linspace(-3.0, 3.0, 101)
    np.testing.assert_allclose(LOOP.half_torque(LOOP.twist(torque)), torque, atol=1e-14)


angles = st.floats(-0.3, 0.3)


@jax.jit
def stored_by(cable, node, motor, joint):
    """Energy of a cable with its node where it settles and where it was."""
    nodes = jnp.stack([cable.settled_node(node, motor, joint), node])
    return jax.vmap(lambda value: cable.half_energy(motor - value) + cable.half_energy(value - joint))(nodes)


@settings(max_examples=200, deadline=None)
@given(angles, angles, angles, st.floats(0.0, 1.0), st.floats(0.0, 2.0))
def test_the_node_never_gains_energy(node, motor, joint, preload, exponent):
    settled, initial = stored_by(loop(20.0, preload, exponent), *(jnp.asarray(value) for value in (node, motor, joint)))
    assert settled <= initial + 1e-12


@partial(jax.jit, static_argnames=("seconds", "step"))
def released(plant, start, seconds, step):
    """Motion and energy of a plant that is let go, at every step."""

    def make_step(motion, _):
        motion = advance(plant, motion, jnp.zeros(()), jnp.zeros(()), step)
        return motion, (motion, mechanical_energy(plant, motion))

    return jax.lax.scan(make_step, settle_node(plant, start), None, length=round(seconds / step))[1]


@settings(max_examples=20, deadline=None)
@given(angles, angles, st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_a_device_that_is_let_go_never_gains_energy(motor, joint, motor_speed, joint_speed):
    start = Motion(*(jnp.asarray(v) for v in (motor, motor_speed, joint, joint_speed, 0.0)))
    plant = replace(PLANT, rope_damping=jnp.asarray(0.002), joint_damping=jnp.asarray(0.001))
    initial = mechanical_energy(plant, settle_node(plant, start))
    after = released(plant, start, 0.5, 1e-4)[1]
    swing = 1e-4 * np.sqrt(20.0 * 2 * (1 / 7e-4 + 1 / 1e-3))  # a step's share of the fastest swing
    assert float(jnp.max(after)) <= float(initial) * (1 + swing) + 1e-12
    assert float(after[-1]) <= float(initial)


def test_a_mass_on_a_spring_with_dry_friction_loses_twice_f_over_k_a_half_swing():
    stiffness, mass, friction, step = 20.0, 1e-3, 0.05, 1e-5

    def make_step(state, _):
        position, speed = state
        speed = apply_dry_friction(speed - step * stiffness * position / mass, jnp.asarray(step * friction / mass))
        return (position + step * speed, speed), (position + step * speed, speed)

    points, speed = jax.lax.scan(make_step, (jnp.asarray(0.1), jnp.asarray(0.0)), None, length=60_000)[1]
    turns = np.flatnonzero(np.asarray(speed[:-1]) * np.asarray(speed[1:]) < 0)
    peaks = np.concatenate([[0.1], np.abs(np.asarray(points)[turns])])
    np.testing.assert_allclose(-np.diff(peaks)[:15], 2 * friction / stiffness, rtol=1e-3)
    assert abs(float(points[-1])) <= friction / stiffness, "it comes to rest where friction holds it"


@pytest.mark.extended
def test_halving_the_step_halves_the_error():
    start = replace(Motion.at_rest(jnp.zeros(())), joint=jnp.asarray(0.08))
    plant = replace(PLANT, rope_damping=jnp.asarray(0.005))
    value = {n: float(released(plant, start, 0.02, 2e-4 / n)[0].joint[-1]) for n in (1, 2, 4, 64)}
    error = [abs(value[n] - value[64]) for n in (1, 2, 4)]
    assert 1.6 < error[0] / error[1] < 2.5
    assert 1.6 < error[1] / error[2] < 2.5


def test_torques_that_are_read_are_those_of_a_settled_node():
    motion = replace(Motion.at_rest(jnp.zeros(())), motor=jnp.asarray(0.05))
    stale, fresh = rope_torques(PLANT, motion)[1], rope_torques(PLANT, settle_node(PLANT, motion))[1]
    assert stale == 0
    assert fresh > 0
