"""What the haptic paper says of friction compensation, row by row, on an assumed plant; the limits against simulation."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from bowdenfit.addons.device.mechanics.limits import (
    LinearDevice,
    discretize,
    largest_safe_share,
    moves_by_itself,
    passive_gain,
    spectral_radius,
    stable_gain,
)
from bowdenfit.addons.device.mechanics.motion import (
    Controller,
    Hand,
    measure_transmitted_torque,
    oscillating_path,
    simulate_device,
)
from bowdenfit.addons.device.mechanics.plant import LoopTransmission, Motion, Plant

pytestmark = pytest.mark.extended

T_F, F_M, B, DEAD_ZONE, COUNT = 0.14, 0.01, 0.001, 0.8, 2 * np.pi / 2000
HAND, EXPONENT = Hand(200.0, 2.0), 0.2


def plant(friction=T_F, motor_friction=F_M, rope_damping=0.02, damping=B, stiffness=20.0, joint_inertia=1e-3):
    loop = LoopTransmission(stiffness, np.asarray(friction) / (2 * EXPONENT), EXPONENT)
    return Plant(loop, 7e-4, damping, motor_friction, joint_inertia, damping, rope_damping)


def controller(coulomb=0.0, dead_zone=DEAD_ZONE, linear=0.0, gain=0.0, active_zone=0.0):
    return Controller(coulomb, dead_zone, linear, gain, 0.0, active_zone, COUNT, 6e-3, 2.5)


SHARES = np.array([0.0, 0.5, 0.8, 1.0])


@lru_cache
def moved(law: str):
    """A bar moved to and fro: without compensation and with shares of it, with the linear variant, or actively."""
    always = np.full(2, np.inf)
    how = {
        "shares": controller(SHARES * (T_F + F_M)),
        "linear": controller(T_F + F_M, linear=1.0),
        "active": controller(gain=np.array([1.0, 2.0]), active_zone=always),
    }[law]
    return measure_transmitted_torque(
        simulate_device(plant(), how, HAND, oscillating_path(3.0, 1e-3, 0.5, 1.25), noise=1e-3), 1.0, start=0.6
    )


def test_the_torques_differ_by_friction_and_what_is_felt_is_all_of_it():
    runs = simulate_device(plant(), controller(), HAND, oscillating_path(3.0, 1e-3, 0.5, 1.25))
    moving = np.abs(runs.speed) > 1.0
    lost = (runs.motor_torque - runs.joint_torque) * np.sign(runs.speed)
    assert np.mean(lost[moving]) == pytest.approx(T_F, rel=2e-3)
    assert moved("shares").mean[0] == pytest.approx(T_F + F_M + 2e-3, rel=0.02)  # b w of the motor, 1 mN m each rad/s


def test_feeding_forward_lowers_the_average_by_what_is_fed():
    expected = (1 - SHARES) * (T_F + F_M) + 2.2e-3
    np.testing.assert_allclose(moved("shares").mean, expected, atol=1.5e-3)


def test_the_two_torques_change_phase_once_the_motor_works():
    uncompensated, half = moved("shares").correlation[:2]
    assert uncompensated > 0.6
    assert half < -0.4
    assert np.all(moved("active").correlation < -0.95)


def test_the_bar_sticks_when_it_turns_round_however_much_is_fed_forward_and_the_linear_variant_too():
    peaks = moved("shares").peak
    assert np.ptp(peaks) < 0.02 * peaks[0], "whatever the share"
    assert peaks[0] > T_F + F_M
    assert 0.85 < moved("linear").peak / (T_F + F_M) < 1.1
    assert np.all(moved("active").peak < 0.7 * peaks[0]), "the active law does not stick"


def test_a_dead_zone_narrower_than_a_count_in_the_filters_time_chatters():
    of_count = COUNT / 6e-3
    zones = of_count * np.array([0.3, 0.9, 2.0])
    slow = np.stack([0.15 * np.arange(4000) * 1e-3, np.full(4000, 0.15)], axis=1)
    jumps = measure_transmitted_torque(
        simulate_device(plant(), controller(0.9 * (T_F + F_M), zones), HAND, slow), 0.05, start=0.5
    ).jumps
    assert jumps[0] > 20
    assert jumps[1] > 20
    assert jumps[2] == 0


@pytest.mark.parametrize("gain", [1.0, 2.0])
def test_the_active_law_leaves_friction_over_one_and_the_gain(gain):
    slow = 0.25 * oscillating_path(6.0, 1e-3, 1.0, 3.0)
    runs = simulate_device(plant(), controller(gain=gain, active_zone=np.inf), HAND, slow)
    left = measure_transmitted_torque(runs, 0.3, start=1.0).mean
    assert left == pytest.approx((T_F + F_M + B * 0.45) / (1 + gain), rel=0.02)


DEVICES = {
    "a soft hand": (LinearDevice(20.0, 0.02, 7e-4, 1e-3, B, B + 0.05, 5.0, 1e-3), Hand(5.0, 0.05)),
    "a heavy bar": (LinearDevice(20.0, 0.03, 7e-4, 3e-3, B, B + 0.1, 2.0, 1e-3), Hand(2.0, 0.1)),
    "a damped rope": (LinearDevice(20.0, 0.05, 7e-4, 3e-3, B, B + 0.1, 2.0, 1e-3), Hand(2.0, 0.1)),
}


@pytest.mark.parametrize("device", DEVICES)
def test_the_largest_gain_is_that_of_the_simulated_device(device):
    linear, hand = DEVICES[device]
    largest = stable_gain(linear)[0]
    gains = largest * np.linspace(0.9, 1.1, 21)
    moving = plant(
        motor_friction=0.0, rope_damping=linear.rope_damping, joint_inertia=linear.joint_inertia, friction=T_F
    )
    path = np.stack([2e-3 * np.arange(900), np.full(900, 2.0)], axis=1)
    start = replace(Motion.at_rest(np.zeros(())), motor_speed=np.asarray(2.0), joint_speed=np.asarray(2.0))
    law = replace(controller(gain=gains, active_zone=np.inf), largest_torque=1e9)
    torque = np.diff(simulate_device(moving, law, hand, path, start=start, step=1e-5).joint_torque, axis=0)
    early, late = (np.mean(torque[part] ** 2, axis=0) for part in (slice(200, 400), slice(600, 800)))
    first = np.flatnonzero(late > early)[0]
    assert (gains[first - 1] + gains[first]) / 2 == pytest.approx(largest, rel=0.02)


def test_above_the_largest_gain_an_eigenvalue_leaves_the_unit_circle():
    device = LinearDevice(20.0, np.array([0.01, 0.02, 0.05]), 7e-4, 1e-3, B, B, 0.0, 1e-3)
    largest, parts = stable_gain(device), discretize(device)
    assert np.all(spectral_radius(parts, 0.99 * largest) < 1 + 1e-6)
    assert np.all(spectral_radius(parts, 1.01 * largest) > 1 + 1e-4)


@pytest.mark.parametrize("integral", [5.0, 40.0])
def test_the_largest_gain_beside_an_integral_is_that_of_the_simulated_device(integral):
    linear, hand = DEVICES["a damped rope"]
    largest = stable_gain(replace(linear, integral_gain=integral))[0]
    gains = largest * np.array([0.95, 1.05])
    moving = plant(motor_friction=0.0, rope_damping=0.05, joint_inertia=3e-3)
    path = np.stack([2e-3 * np.arange(900), np.full(900, 2.0)], axis=1)
    start = replace(Motion.at_rest(np.zeros(())), motor_speed=np.asarray(2.0), joint_speed=np.asarray(2.0))
    law = replace(controller(gain=gains, active_zone=np.inf), integral_gain=integral, largest_torque=1e9)
    torque = np.diff(simulate_device(moving, law, hand, path, start=start, step=1e-5).joint_torque, axis=0)
    early, late = (np.mean(torque[part] ** 2, axis=0) for part in (slice(200, 400), slice(600, 800)))
    assert late[0] < 0.5 * early[0]
    assert late[1] > 0.9 * early[1], "it goes on; slack of the return side bounds it"


def test_an_integral_lets_less_gain_be_and_makes_what_is_left_fade():
    device = LinearDevice(20.0, 0.02, 7e-4, 1e-3, B, B + 0.05, 5.0, 1e-3, np.array([0.0, 100.0, 1000.0]))
    assert np.all(np.diff(stable_gain(device)) < 0)
    one_way = np.stack([0.5 * np.arange(1500) * 1e-3, np.full(1500, 0.5)], axis=1)
    law = replace(controller(gain=1.0, active_zone=np.inf), integral_gain=np.array([0.0, 5.0]))
    left = -simulate_device(plant(), law, HAND, one_way).joint_torque
    levels = [np.mean(left[part], axis=0) for part in (slice(280, 320), slice(680, 720))]
    assert levels[1][0] == pytest.approx(levels[0][0], rel=0.03)
    assert levels[1][1] / levels[0][1] == pytest.approx(np.exp(-0.4 * 5.0 / 2.0), rel=0.1), "with 1 + K_f over K_i"


def test_with_an_integral_a_hand_may_be_found_that_shakes_it():
    device = LinearDevice(20.0, 0.02, 7e-4, 1e-3, B, B, 0.0, 1e-3, np.array([0.0, 200.0]))
    passive = passive_gain(device, stable_gain(device))
    assert passive[0] > 0
    assert passive[1] == 0


def impedance(gain, b_c, s, sample=1e-3):
    rope, motor = 20.0 + b_c * s, 7e-4 * s**2 + B * s
    return 1e-3 * s + B + rope / (s * (1 + rope * (1 + gain * np.exp(-1.5 * sample * s)) / motor))


@pytest.mark.parametrize("b_c", [0.01, 0.02, 0.05])
def test_the_passive_gain_is_where_the_impedance_first_loses_its_real_part(b_c):
    device = LinearDevice(20.0, b_c, 7e-4, 1e-3, B, B, 0.0, 1e-3)
    largest = passive_gain(device, stable_gain(device))[0]
    s = 1j * np.geomspace(1e-3, 1.0, 2000) * np.pi / 1e-3
    shares = [np.min(impedance(share * largest, b_c, s).real) for share in (0.2, 0.6, 0.98, 1.02)]
    assert min(shares[:3]) > 0
    assert shares[3] < 0


def test_what_no_passive_hand_can_shake_is_several_times_less():
    device = LinearDevice(20.0, np.array([0.01, 0.02, 0.05]), 7e-4, 1e-3, B, B, 0.0, 1e-3)
    largest = stable_gain(device)
    ratio = largest / passive_gain(device, largest)
    assert np.all((ratio > 2) & (ratio < 12))


def foretold(runs: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Whether devices that are pushed go on by themselves: by the closed form, and in simulation."""
    draw = np.random.default_rng(seed)
    friction, motor_friction = draw.uniform(0.03, 0.3, runs), draw.uniform(0.0, 0.03, runs)
    damping, dead_zone = draw.uniform(0.5e-3, 3e-3, runs), draw.uniform(1.2, 2.5, runs)
    held = np.where(draw.random(runs) < 0.5, 0.0, draw.uniform(0.0, 5e-3, runs))  # of a damped hand
    limit = friction + motor_friction + (2 * damping + held) * dead_zone
    fed, pushed = limit * draw.uniform(0.3, 1.7, runs), dead_zone * 2.0
    start = replace(Motion.at_rest(np.zeros(runs)), motor_speed=pushed, joint_speed=pushed)
    moving = plant(friction, motor_friction, 0.02, damping)
    seen = simulate_device(moving, controller(fed, dead_zone), Hand(0.0, held), np.zeros((3000, 2)), start=start)
    goes_on = np.abs(seen.speed[-50:]).max(axis=0) > 0.5 * dead_zone
    return moves_by_itself(fed, friction + motor_friction, 2 * damping + held, dead_zone), goes_on


def test_the_limit_cycle_is_foretold():
    predicted, goes_on = foretold(300, 3)
    assert np.mean(predicted == goes_on) >= 0.99
    assert np.all(predicted[predicted != goes_on]), (
        "where they differ, counts of the encoder end what the closed form is wary of"
    )


@pytest.mark.slow
def test_the_limit_cycle_is_foretold_in_a_thousand_runs():
    predicted, goes_on = foretold(1000, 4)
    assert np.mean(predicted == goes_on) >= 0.99


def known_of(readings, noise, draw, n=4000):
    """Draws of the friction exponent of a new mounting, and of the cable's mean, from exponents read in several mountings.

    With the priors that truths come from, so that what is said with 95 % probability holds in 95 % of cables.
    """
    scatters = np.linspace(0.004, 0.02, 60)
    variance = scatters[:, None] ** 2 + noise**2
    k = len(readings)
    precision = k / variance[:, 0] + 1 / 0.05**2
    mean = (readings.sum() / variance[:, 0] + 0.2 / 0.05**2) / precision
    spread = np.sum((readings - 0.2) ** 2) / variance[:, 0]
    log_weight = -0.5 * (k * np.log(variance[:, 0]) + spread + np.log(precision) - precision * (mean - 0.2) ** 2)
    weight = np.exp(log_weight - log_weight.max())
    which = draw.choice(len(scatters), n, p=weight / weight.sum())
    exponent = mean[which] + draw.standard_normal(n) / np.sqrt(precision[which])
    return exponent + scatters[which] * draw.standard_normal(n), exponent


def test_two_hundred_cables_move_by_themselves_as_often_as_was_accepted_and_oftener_if_mountings_are_forgotten():
    draw, cables, noise, torque, risk = np.random.default_rng(11), 200, 1e-3, 0.35, 0.05
    truth, scatter = 0.2 + 0.05 * draw.standard_normal(cables), draw.uniform(0.004, 0.02, cables)
    mounted = truth[:, None] + scatter[:, None] * draw.standard_normal((cables, 7))
    fed = []
    for mounting in mounted:
        draws = known_of(mounting[:6] + noise * draw.standard_normal(6), noise, draw)
        margins = [2 * torque * exponent[:, None] + F_M + 2 * B * DEAD_ZONE for exponent in draws]
        usual = [np.median(2 * torque * exponent) + F_M for exponent in draws]
        fed.append([largest_safe_share(m, np.array([u]), risk) * u for m, u in zip(margins, usual, strict=True)])
    pushed = np.full((cables, 2), 2.0 * DEAD_ZONE)
    start = replace(Motion.at_rest(np.zeros((cables, 2))), motor_speed=pushed, joint_speed=pushed)
    friction = np.repeat(2 * torque * mounted[:, 6:], 2, axis=1)
    seen = simulate_device(plant(friction), controller(np.array(fed)), Hand(0.0, 0.0), np.zeros((3000, 2)), start=start)
    went_on = np.sum(np.abs(seen.speed[-50:]).max(axis=0) > 0.5 * DEAD_ZONE, axis=0)
    assert 4 <= went_on[0] <= 17, "95 % of a binomial of 200 at 5 %"
    assert went_on[1] > 2 * went_on[0], "what coefficients alone promise"


def test_the_share_keeps_the_risk_it_is_asked_for():
    margin = np.random.default_rng(1).lognormal(0.0, 0.1, (4001, 3))
    share = largest_safe_share(margin, np.ones(3), 0.05)
    assert 0.045 < np.mean(np.any(share > margin, axis=1)) <= 0.05
    assert np.mean(np.any(1.01 * share > margin, axis=1)) > 0.05
