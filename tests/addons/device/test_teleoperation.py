"""What the haptic paper says of teleoperation, on an assumed plant: formulas and the linear loop, simulated."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from bowdenfit.addons.device.mechanics.motion import Hand
from bowdenfit.addons.device.mechanics.plant import LoopTransmission, Plant
from bowdenfit.addons.device.mechanics.teleoperation import (
    CouplingGains,
    MasterController,
    MasterSlave,
    Slave,
    free_motion_torque,
    is_stable,
    simulate_teleoperation,
    spectral_radius_in_contact,
    transmitted_stiffness,
)

pytestmark = pytest.mark.extended

STIFFNESS, T_F, F_M, F_S, EXPONENT, WALL = 9.5, 0.14, 0.01, 0.05, 0.05, 100.0
HAND = Hand(5.0, 0.05)
FOUR = CouplingGains(5.0, 0.03, 5.0, 0.03, 1.0, 1.0)
SCHEMES = {"four": FOUR, "two": FOUR.two_channels(), "local": FOUR.with_local_gain(1.0)}
PLANT = Plant(
    LoopTransmission(STIFFNESS, T_F / (2 * EXPONENT), EXPONENT), 7e-4, 1e-3, F_M, 1e-3 + 5e-4, 1e-3, 0.02,
)  # fmt: skip


def pair(wall, sample=1e-3):
    damping = np.where(np.asarray(wall) > 0, 0.02, 0.0)
    return MasterSlave(
        STIFFNESS, 0.02, 7e-4, 1e-3, 1e-3, 1e-3, 5e-4, 0.05, 5.0, 1e-3, 5e-3, wall, damping, sample, 6e-3
    )


def slave(wall):
    return Slave(1e-3, 5e-3, F_S, 2.5, 0.1, wall, 0.02)


def path(sample):
    """Two seconds to and fro in the open, then against the wall."""
    time = np.arange(round(4 / sample)) * sample
    turned = 2 * np.pi
    value = np.where(time < 2, 0.15 * (np.cos(turned * time) - 1), np.clip(0.6 * (time - 2), 0, 0.6))
    speed = np.where(time < 2, -0.15 * turned * np.sin(turned * time), np.where(value < 0.6, 0.6, 0.0))
    return np.stack([value, speed], axis=1)


@lru_cache
def seen(scheme="four", sample=1e-3):
    sampled = MasterController(2 * np.pi / 2000, 6e-3, 2.5)
    return simulate_teleoperation(
        PLANT, HAND, slave(WALL), sampled, SCHEMES[scheme], path(sample), delay=1, sample=sample
    )


def in_the_open(runs):
    speed = np.gradient(runs.joint, runs.time)
    slow = (runs.time > 0.5) & (runs.time < 2) & (np.abs(speed) > 0.5)
    return float(np.mean((runs.hand_torque - 2e-3 * speed)[slow] * np.sign(speed[slow])))


def bounces(runs):
    """Whether the slave leaves the wall again 1.2 s after it came."""
    came = runs.time[np.flatnonzero((runs.wall_torque > 0) & (runs.time > 2))[0]]
    return bool(np.any(runs.wall_torque[runs.time > came + 1.2] == 0))


def test_free_motion_is_felt_as_the_formula_says_about_a_tenth_of_a_newton_metre():
    expected = free_motion_torque(FOUR, T_F, F_M, F_S)
    assert expected == pytest.approx(0.1)
    assert in_the_open(seen()) == pytest.approx(expected, rel=0.1)


def test_four_channels_are_felt_less_than_two():
    assert in_the_open(seen("two")) > 1.4 * in_the_open(seen())


def test_local_feedback_is_felt_less_still_in_the_open_and_follows_worse_in_contact():
    assert in_the_open(seen("local")) == pytest.approx(free_motion_torque(SCHEMES["local"], T_F, F_M, F_S), rel=0.12)
    late = seen().time > 3.5
    behind = {name: np.mean((seen(name).joint - seen(name).slave)[late]) for name in ("four", "local")}
    assert behind["local"] > 1.2 * behind["four"]


@pytest.mark.parametrize("scheme", ["four", "local"])
def test_the_stiffness_that_is_felt_is_that_of_cable_and_wall(scheme):
    runs = seen(scheme)
    pushing = (runs.time > 2.55) & (runs.time < 2.95)
    slope = np.polyfit(runs.joint[pushing], runs.hand_torque[pushing], 1)[0]
    assert slope == pytest.approx(transmitted_stiffness(SCHEMES[scheme], STIFFNESS, WALL), rel=0.05)


@lru_cache
def scaled():
    """The slave moves half as far, with torques and stiffnesses that suit."""
    halved = replace(
        FOUR, position_to_slave=0.5, position_to_master=2.0, torque_to_slave=0.5, torque_to_master=0.5,
        master_stiffness=2.5, master_damping=0.015,
    )  # fmt: skip
    moved = 1.5 * path(1e-3)
    sampled = MasterController(2 * np.pi / 2000, 6e-3, 2.5)
    return halved, simulate_teleoperation(PLANT, HAND, slave(WALL), sampled, halved, moved, delay=1)


def test_a_slave_that_moves_half_as_far_is_felt_by_the_formulas_too():
    halved, runs = scaled()
    late = (runs.time > 1.2) & (runs.time < 2)
    assert np.std((runs.slave - 0.5 * runs.joint)[late]) < 0.05 * np.std(0.5 * runs.joint[late])
    assert in_the_open(runs) == pytest.approx(free_motion_torque(halved, T_F, F_M, F_S), rel=0.1)
    pushing = (runs.time > 2.55) & (runs.time < 2.95)
    slope = np.polyfit(runs.joint[pushing], runs.hand_torque[pushing], 1)[0]
    assert slope == pytest.approx(transmitted_stiffness(halved, STIFFNESS, WALL), rel=0.05)
    assert slope < 0.5 * transmitted_stiffness(FOUR, STIFFNESS, WALL), "which is another than without scales"
    assert is_stable(spectral_radius_in_contact(pair(0.0), halved, 1))[0]
    unsuited = replace(halved, master_stiffness=5.0, torque_to_slave=1.0)
    assert not is_stable(spectral_radius_in_contact(pair(0.0), unsuited, 1))[0], (
        "the loop of positions and torques is doubled"
    )


def test_with_equal_gains_it_is_that_of_springs_in_series():
    assert transmitted_stiffness(FOUR, STIFFNESS, WALL) == pytest.approx(1 / (1 / STIFFNESS + 1 / WALL))
    assert transmitted_stiffness(FOUR, STIFFNESS, WALL) == pytest.approx(8.6, abs=0.1), (
        "as the paper's figure 14, by the choice of K"
    )


def test_the_wall_is_felt_as_it_is_less_half_of_the_friction():
    late = seen().time > 3.5
    wall, hand = (np.mean(part[late]) for part in (seen().wall_torque, seen().hand_torque))
    assert wall == pytest.approx(hand - (T_F + F_M + F_S) / 2, rel=0.05)
    assert np.ptp(seen().wall_torque[late]) < 0.02 * wall


def test_a_hard_wall_is_touched_without_bouncing_unless_samples_come_five_times_later():
    assert not bounces(seen())
    assert bounces(seen(sample=5e-3))
    assert is_stable(spectral_radius_in_contact(pair(WALL), FOUR, 1))[0]
    assert not is_stable(spectral_radius_in_contact(pair(WALL, 5e-3), FOUR, 1))[0]


def hardest(gains):
    walls = np.geomspace(1.0, 1000.0, 400)
    stable = is_stable(spectral_radius_in_contact(pair(walls), gains, 1))
    return walls[np.argmin(stable)]


def test_two_channels_are_unstable_on_walls_that_four_bear():
    assert hardest(FOUR.two_channels()) < 0.2 * hardest(FOUR)


def test_local_feedback_bears_no_harder_walls():
    walls = [hardest(FOUR.with_local_gain(gain)) for gain in (0.0, 0.5, 1.0, 2.0)]
    assert np.all(np.diff(walls) <= 0)
    assert walls[2] < walls[0]


def test_the_linear_loop_is_that_of_the_simulation():
    stiffness = hardest(FOUR) * np.array([0.9, 1.1])
    bare = replace(PLANT, loop=LoopTransmission(STIFFNESS, 1e3, 1e-12), motor_friction=0.0)
    glued = replace(slave(stiffness), wall=-1.0, friction=0.0)  # which pushes all the time
    fine = MasterController(1e-9, 6e-3, 1e9)
    pushed = np.stack([10 * np.minimum(np.arange(2000) / 1000, 1.0), np.zeros(2000)], axis=1)
    runs = simulate_teleoperation(
        bare, HAND, replace(glued, largest_torque=1e9), fine, FOUR, pushed, delay=1, step=2e-5
    )
    changes = np.diff(runs.wall_torque[1100:], axis=0)
    early, late = (np.ptp(part, axis=0) for part in (changes[:300], changes[-300:]))
    assert late[0] < 0.5 * early[0]
    assert late[1] > 0.9 * early[1], "it bounces on"
