"""The plant against MuJoCo: another solver of friction, another integrator, the same device."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bowdenfit.addons.device.mechanics.plant import LoopTransmission, Motion, Plant, advance, rope_torques, settle_node

pytestmark = pytest.mark.extended

mujoco = pytest.importorskip("mujoco", reason="the independent check needs MuJoCo, of bowdenfit[test]")
STIFFNESS, T_F, F_M, HAND = 20.0, 0.14, 0.01, (5.0, 0.05)
J_M, J_J, B_M, B_J, B_C = 7e-4, 1.5e-3, 1e-3, 2e-3, 0.02
STEP, SECONDS = 2e-4, 2.0
TIME = np.arange(round(SECONDS / STEP)) * STEP
TORQUE = 0.45 * np.sin(2 * np.pi * TIME / 0.8) + 0.1 * np.sin(2 * np.pi * TIME / 0.13)
BODY = """<body>
<joint name="{name}" type="hinge" axis="0 0 1" damping="{damping}" frictionloss="{friction}" stiffness="{spring}"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 {inertia}"/></body>"""
TENDON = """<fixed stiffness="{stiffness}" damping="{damping}">
<joint joint="{one}" coef="1"/><joint joint="{other}" coef="-1"/></fixed>"""


def in_mujoco(friction):
    """Angles of motor and joint [rad], and the torque that the rope gives the joint [N m], at every step."""
    node = 4 * 2 * STIFFNESS * STEP**2  # the inertia that its springs still bear
    bodies = {
        "motor": (B_M, F_M, 0.0, J_M),
        "joint": (B_J + HAND[1], 0.0, HAND[0], J_J),
        "node": (0.0, friction, 0.0, node),
    }
    half = {"stiffness": 2 * STIFFNESS, "damping": 0.0}
    tendons = [
        TENDON.format(one="motor", other="node", **half),
        TENDON.format(one="node", other="joint", **half),
        TENDON.format(one="motor", other="joint", stiffness=0.0, damping=B_C),
    ]
    shown = "".join(
        BODY.format(name=name, damping=b, friction=f, spring=k, inertia=f"{j:.9g}")
        for name, (b, f, k, j) in bodies.items()
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{STEP}" gravity="0 0 0" integrator="implicitfast" iterations="200" tolerance="1e-12"/>'
        f'<default><joint solimpfriction="0.999 0.9999 0.001" solreffriction="{2 * STEP} 1"/></default>'
        f"<worldbody>{shown}</worldbody><tendon>{''.join(tendons)}</tendon></mujoco>"
    )
    data, seen = mujoco.MjData(model), []
    for torque in TORQUE:
        (motor, joint, node), (w_m, w_j, _) = data.qpos, data.qvel
        seen.append((motor, joint, 2 * STIFFNESS * (node - joint) + B_C * (w_m - w_j)))
        data.qfrc_applied[0] = torque
        mujoco.mj_step(model, data)
    return np.array(seen)


def integrate():
    loop = LoopTransmission(jnp.asarray(STIFFNESS), jnp.asarray(0.7), jnp.asarray(T_F / 1.4))
    plant = Plant(loop, *(jnp.asarray(v) for v in (J_M, B_M, F_M, J_J, B_J, B_C)))

    def make_step(motion, torque):
        seen = jnp.stack([motion.motor, motion.joint, rope_torques(plant, motion)[1]])
        hand = -HAND[0] * motion.joint - HAND[1] * motion.joint_speed
        return advance(plant, motion, torque, hand, STEP), seen

    return np.asarray(jax.lax.scan(make_step, settle_node(plant, Motion.at_rest(jnp.zeros(()))), jnp.asarray(TORQUE))[1])


def test_the_plant_moves_as_mujoco_says_and_otherwise_with_other_friction():
    expected, computed = in_mujoco(T_F), integrate()
    assert np.max(np.abs(computed[:, 2])) < 0.7 * (2 - T_F / 0.7), "taut, so that friction is a constant torque"
    size = np.ptp(expected, axis=0)
    assert np.all(size > [0.05, 0.02, 2 * T_F])
    away = np.max(np.abs(computed - expected), axis=0) / size
    assert np.all(away < 0.02)
    other = np.max(np.abs(in_mujoco(0.8 * T_F) - computed), axis=0) / size
    assert np.all(other > 2 * np.max(away)), "a fifth less friction shows"
