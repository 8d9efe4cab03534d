"""Models and callbacks for MuJoCo, driven by MuJoCo, against the device's own friction node."""

import importlib.util
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from exported_cables import HOSTILE, cable, with_rope

from bowdenfit.addons.device.mechanics.plant import LoopTransmission
from bowdenfit.addons.device.mujoco import mujoco_model
from bowdenfit.errors import UsageError

pytestmark = pytest.mark.extended

mujoco = pytest.importorskip("mujoco")
STEP, SECONDS = 1e-3, 4.0
MAIN = """<mujoco><option timestep="{step}" gravity="0 0 0" integrator="{integrator}"/>{include}
<worldbody>
<body><joint name="bowden_motor" type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 7e-4"/></body>
<body><joint name="bowden_joint" type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/></body>
</worldbody></mujoco>"""


@pytest.fixture
def no_callback():
    yield
    mujoco.set_mjcb_passive(None)


def swings(amplitude):
    """Angles of the motor to and fro from rest, by less and more [rad], with the joint held."""
    time = np.arange(0, SECONDS, STEP)
    angle = amplitude * (1 - np.cos(np.pi * time)) * np.sin(0.35 * np.pi * time + 0.4)
    return angle, np.gradient(angle, STEP)


def loop_of(computed, place):
    """The device's loop in newtons and meters."""
    median, route_points = computed.median, computed.points.values
    exponent, lost, k = (
        np.interp(place, route_points, table) for table in (median.exponent[0], median.taut_loss, median.stiffness)
    )
    return LoopTransmission(jnp.asarray(1000 * k), jnp.asarray(lost / (2 * exponent)), jnp.asarray(exponent))


def by_node(loop, motor):
    """Forces at both ends [N] along a path of the motor's end of the rope [m], the other held at 0."""
    with jax.enable_x64(True):

        def step(node, value):
            node = loop.settled_node(node, value, jnp.zeros(()))
            return node, jnp.stack(loop.torques(node, value, jnp.zeros(())))

        return np.asarray(jax.lax.scan(step, jnp.zeros(()), jnp.asarray(motor))[1])


def driven(simulated, motion, forces):
    """Forces at both ends [N] that a model gives while its motor is led along a path and its joint held."""
    data, seen = mujoco.MjData(simulated), []
    motor, joint = (simulated.joint(f"bowden_{name}") for name in ("motor", "joint"))
    for angle, speed in zip(*motion, strict=True):
        data.qpos[motor.qposadr[0]], data.qvel[motor.dofadr[0]] = angle, speed
        data.qpos[joint.qposadr[0]], data.qvel[joint.dofadr[0]] = 0.0, 0.0
        mujoco.mj_forward(simulated, data)
        seen.append(forces(data))
        mujoco.mj_step(simulated, data)
    return np.array(seen)


@pytest.mark.parametrize("integrator", ["implicitfast", "Euler"])
@pytest.mark.parametrize("stiffness", [20.0, 300.0])
def test_a_taut_loop_in_mjcf_follows_the_node_to_a_small_part_of_its_hysteresis(tmp_path, integrator, stiffness):
    tables, place = with_rope(cable("loop"), stiffness), 1.3
    path = tmp_path / "cable.xml"
    path.write_text(mujoco_model(tables, place, path)[0])
    text = MAIN.format(step=STEP, integrator=integrator, include='<include file="cable.xml"/>')
    (tmp_path / "main.xml").write_text(text)
    simulated = mujoco.MjModel.from_xml_path(str(tmp_path / "main.xml"))
    loop, radius = loop_of(tables, place), tables.radii[0] / 1000
    motion = swings(0.45 * float(2 * loop.preload / loop.stiffness) / radius)
    tendons = [simulated.tendon(f"bowden_{name}_side").id for name in ("motor", "joint")]
    stiffness = [np.ravel(simulated.tendon_stiffness[tendon])[0] for tendon in tendons]
    ends = driven(simulated, motion, lambda data: stiffness * data.ten_length[tendons])
    expected = by_node(loop, radius * motion[0])
    hysteresis = 2 * float(loop.friction)
    assert np.ptp(expected[:, 1]) > hysteresis  # it slides both ways
    assert np.max(np.abs(ends - expected)) < 0.01 * hysteresis
    assert np.sqrt(np.mean((ends - expected) ** 2)) < 0.003 * hysteresis


@pytest.mark.parametrize("stiffness", [20.0, 300.0])
def test_a_slack_loop_as_a_callback_is_the_node_itself(tmp_path, stiffness, no_callback):
    tables, place = with_rope(cable("loop"), stiffness), 1.3
    made, simulated = called_back(tables, place, tmp_path)
    loop, radius = loop_of(tables, place), tables.radii[0] / 1000
    motion = swings(4.0 * float(loop.preload / loop.stiffness) / radius)
    mujoco.set_mjcb_passive(made)
    ends = driven(simulated, motion, lambda data: [made.motor_force, made.joint_force])
    expected = by_node(loop, radius * motion[0])
    assert np.max(np.abs(expected[:, 0])) > 2 * 2 * float(loop.preload)  # the return side was slack
    start = 200  # the callback begins in the middle of the band, the node where nothing is loaded
    np.testing.assert_allclose(ends[start:], expected[start:], atol=1e-9 * float(loop.preload))


def called_back(computed, place, folder, **options):
    path = folder / "cable.py"
    path.write_text(mujoco_model(computed, place, path)[0])
    spec = importlib.util.spec_from_file_location("exported_cable", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    simulated = mujoco.MjModel.from_xml_string(MAIN.format(step=STEP, integrator="implicitfast", include=""))
    return module.Cable(simulated, "bowden_motor", "bowden_joint", **options), simulated


@pytest.mark.parametrize("case", ["rope", "stroke", "rate"])
def test_a_single_rope_as_a_callback_keeps_to_the_capstan_equation(case, tmp_path, no_callback):
    tables = with_rope(cable(case))
    made, simulated = called_back(tables, 1.3, tmp_path, level="q95")
    mujoco.set_mjcb_passive(made)
    angle, speed = swings(0.3)
    ends = driven(simulated, (angle, speed), lambda data: [made.motor_force, made.joint_force])
    level, route_points = tables.levels[2], tables.points.values
    factor = 1.0
    if case == "rate":
        a, v, c = level.rate
        of = lambda speed: 1 + a * np.exp(-((speed / v) ** 2)) + c * np.abs(speed)  # noqa: E731
        factor = of(15 * speed) / of(tables.reference_speed)
    up, down = (factor * np.interp(1.3, route_points, level.exponent[row]) for row in (0, 1))
    pulled = angle > 0
    assert pulled.any() and not pulled.all()
    assert np.all(ends[~pulled] == 0)  # a rope does not push
    share = np.log(ends[pulled, 0] / ends[pulled, 1])
    up, down = (np.broadcast_to(x, angle.shape)[pulled] for x in (up, down))
    assert np.all(share <= up * (1 + 1e-9)) and np.all(share >= -down * (1 + 1e-9))
    assert np.mean(np.abs(share - up) < 1e-9) > 0.2 and np.mean(np.abs(share + down) < 1e-9) > 0.1  # it slid both ways
    k = 1000 * np.interp(1.3, route_points, level.stiffness)
    np.testing.assert_allclose(ends[pulled].sum(axis=1) / (2 * k), 0.015 * angle[pulled], rtol=1e-9)


def test_a_callback_clamps_its_place_and_says_so(tmp_path):
    tables = with_rope(cable("loop"))
    made, _ = called_back(tables, 1.3, tmp_path)
    made.place = tables.points.values[-1] + 1
    beyond = made.forces(0.01, 0.0)
    assert made.clamped
    made.reset()
    made.place = tables.points.values[-1]
    assert made.forces(0.01, 0.0) == beyond and not made.clamped


def test_what_mujoco_cannot_express_is_refused_with_what_can():
    for tables, file, words in (
        (with_rope(cable("rope")), "cable.xml", "cannot express the friction of a single rope.*--output cable.py"),
        (with_rope(cable("load")), "cable.py", "depends on the load; --to c, fmu and matlab can"),
        (cable("loop"), "cable.xml", "how the rope stretches.*--to c or fmu"),
        (with_rope(cable("loop"), radii=(0.0, 20.0)), "cable.xml", "input_pulley_radius = "),
        (with_rope(cable("loop")), "cable.txt", "from cable.xml, or a callback from cable.py"),
    ):
        with pytest.raises(UsageError, match=words):
            mujoco_model(tables, None, Path(file))
    with pytest.raises(UsageError, match="outside the range of this fit, which is wrap_angle"):
        mujoco_model(with_rope(cable("loop")), 9.0, Path("cable.xml"))


def test_both_files_say_where_they_are_from_and_where_they_hold():
    tables = with_rope(cable("loop"))
    for file in ("cable.xml", "cable.py"):
        text, remarks = mujoco_model(tables, None, Path(file))
        assert all(words in text for words in ("seed 7", "bowdenfit 0.1.0", "Range: wrap_angle"))
        assert "the middle of the range; --at names another place" in remarks[0]
    assert "above which the return side goes slack" in mujoco_model(tables, 1.0, Path("x.xml"))[1][1]


def test_hostile_names_are_harmless_in_mujoco(tmp_path):
    tables = with_rope(cable("loop"))
    about = replace(tables.about, cable=HOSTILE, group=HOSTILE, distrust=HOSTILE, version=HOSTILE, created=HOSTILE)
    hostile = replace(tables, about=about, points=replace(tables.points, variable=HOSTILE + '"""', unit=HOSTILE))
    text, _ = mujoco_model(hostile, None, Path("cable.xml"))
    assert text.isascii()
    assert ElementTree.fromstring(text).tag == "mujocoinclude"
    made, _ = called_back(hostile, 1.3, tmp_path)
    assert made.place == 1.3
