"""The phases found in a recording, against what the simulated bench truly did."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from raw_recordings import to_raw

from bowdenfit.description import Phase, Preparation, QuantityValue
from bowdenfit.errors import DatasetError
from bowdenfit.questions.simulate.bench import (
    BenchFriction,
    BenchSettings,
    LoadCellFaults,
    MotorProfile,
    SimulatedRecording,
    simulate_recording,
)
from bowdenfit.recordings.preparation import prepare
from bowdenfit.recordings.preparation.hysteresis import play
from bowdenfit.recordings.recording import PULL, RETURN, SWITCH, Blocks, RawRecording, Strokes
from bowdenfit.recordings.rope_strokes import RopeStrokes
from bowdenfit.recordings.strokes import correlation_time, find_strokes
from bowdenfit.types import Flags, Labels, Vector


def seconds(value: float) -> QuantityValue:
    """A time of the preparation."""
    return QuantityValue(value=value, unit="s")


SETTINGS = Preparation(delay="none")
PARTIAL = ((20.0, 8.0), (35.0, 10.0))
CASES: dict[str, dict[str, Any]] = {
    "plain": {},
    "hardly any friction": {"exponent": 0.02},
    "much friction": {"exponent": 1.0},
    "two cycles": {"cycles": 2},
    "five cycles": {"cycles": 5},
    "partial reversals": {"partial_reversals": PARTIAL, "block": 0.03},
    "drag": {"friction": BenchFriction(drag=5.0)},
    "low preload": {"bench": BenchSettings(preload=3.0)},
    "slow": {"speed": 0.5},
    "fast": {"speed": 8.0},
}


@dataclass(frozen=True)
class Found:
    """A simulated recording, prepared, with the phases found in it and those that truly were."""

    simulated: SimulatedRecording
    blocks: Blocks
    strokes: Strokes

    @property
    def width(self) -> float:
        """Length of a block [s]."""
        return float(np.median(np.diff(self.blocks.time)))

    @property
    def truth(self) -> Labels:
        """True contact in the middle of each block."""
        nearest = np.searchsorted(self.simulated.time, self.blocks.time).clip(max=len(self.simulated.time) - 1)
        return self.simulated.stroke[nearest]

    @property
    def moving(self) -> Flags:
        """Blocks in whose middle the motor turns; at rest the simulated load counts as held, whatever the forces say."""
        return np.interp(self.blocks.time, self.simulated.time, np.abs(self.simulated.velocity)) > 0

    @property
    def judged(self) -> Flags:
        """Blocks while the motor turns, further than one block from any change of the contact."""
        changes = np.array([time for time, _ in self.simulated.contact_changes])
        near = np.abs(self.blocks.time[:, None] - changes[None, :]).min(axis=1)
        return self.moving & (near > 1.5 * self.width)


def simulated(
    exponent: float = 0.2,
    noise: float = 0.0,
    seed: int = 1,
    friction: BenchFriction | None = None,
    bench: BenchSettings | None = None,
    **profile: Any,
) -> SimulatedRecording:
    return simulate_recording(
        exponent,
        friction or BenchFriction(),
        MotorProfile(**{"speed": 2.0, "cycles": 3, **profile}),
        bench or BenchSettings(),
        LoadCellFaults(input_noise=noise, output_noise=noise),
        np.random.default_rng(seed),
    )


def without_velocity(raw: RawRecording) -> RawRecording:
    return replace(raw, velocity=np.zeros(0), velocity_time=np.zeros(0))


def swapped(raw: RawRecording) -> RawRecording:
    return replace(raw, input_force=raw.output_force, output_force=raw.input_force)


def find(
    velocity: str = "recorded", by_hand: tuple[Phase, ...] = (), block: float | None = None, **settings: Any
) -> Found:
    recording = simulated(**settings)
    raw = to_raw(recording, "run", "run.csv")
    if velocity == "absent":
        raw = without_velocity(raw)
    elif velocity == "turned around":
        raw = replace(raw, velocity=-raw.velocity)
    blocks, _ = prepare(raw, SETTINGS.model_copy(update={"block": seconds(block) if block else "auto"}))
    return Found(recording, blocks, find_strokes(blocks, "run.csv", "run", by_hand))


@pytest.mark.parametrize("velocity", ["recorded", "absent", "turned around"])
@pytest.mark.parametrize("noise", [0.0, 0.5])
@pytest.mark.parametrize("case", CASES)
def test_the_phases_found_are_the_true_ones(case, noise, velocity):
    result = find(velocity, noise=noise, **CASES[case])
    judged, strokes = result.judged, result.strokes
    assert judged.sum() > 40
    assert np.mean(strokes.stroke[judged] == result.truth[judged]) >= 0.97
    assert not np.any(strokes.used_sliding & (strokes.stroke == -result.truth))
    sure = judged & (result.truth != SWITCH)
    assert np.mean(strokes.used_sliding[sure]) > 0.7  # blocks in which the motor speeds up or slows down are left out


@pytest.mark.parametrize("noise", [0.0, 0.5])
@pytest.mark.parametrize("case", CASES)
def test_the_exponent_of_a_recording_is_the_true_one(case, noise):
    setting = CASES[case]
    strokes = find(noise=noise, **setting).strokes
    if case == "drag":  # the loop is wider at low forces; its drag is found beside it
        assert strokes.drag == pytest.approx(5.0, rel=0.02 if noise == 0 else 0.3)
        assert strokes.exponent > 0.2
    else:
        assert strokes.exponent == pytest.approx(setting.get("exponent", 0.2), rel=0.02)
        assert abs(strokes.center) < 0.005


@pytest.mark.parametrize("velocity", ["recorded", "turned around"])
@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_nothing_counts_as_sliding_while_the_motor_rests(velocity, noise):
    result = find(velocity, noise=noise, pause=1.0, lead_in=1.0)
    resting = result.blocks.velocity == 0  # for the whole block
    assert resting.sum() > 50
    assert not result.strokes.used_sliding[resting].any()


def test_with_a_velocity_of_zero_throughout_nothing_slides():
    result = find()
    blocks = replace(result.blocks, velocity=np.zeros(len(result.blocks.time)))
    strokes = find_strokes(blocks, "run.csv", "run")
    assert not strokes.used_sliding.any()
    assert "says nothing about friction" in " ".join(strokes.remarks)


def test_blocks_beside_a_change_of_the_contact_are_not_used():
    for velocity in ("recorded", "absent"):
        strokes = find(velocity, noise=0.5, partial_reversals=PARTIAL).strokes
        state, used = strokes.stroke, strokes.used_sliding
        edges = np.flatnonzero(np.diff(state))
        assert len(edges) > 10
        assert not used[edges].any()
        assert not used[edges + 1].any()
        assert not used[state == SWITCH].any()


def test_phases_set_by_hand_come_before_those_found():
    alone = find(noise=0.5)
    time = alone.blocks.time
    spans = (
        Phase(start=0.2, end=0.5, stroke="return"),
        Phase(start=1.0, end=1.2, stroke="hold"),
        Phase(start=1.2001, end=1.4, stroke="ignore"),
        Phase(start=2.0, end=2.3, stroke="pull"),
    )
    strokes = find(noise=0.5, by_hand=spans).strokes
    assert strokes.by_hand
    assert not alone.strokes.by_hand
    covered = np.zeros(len(time), dtype=bool)
    for span, stroke in zip(spans, (RETURN, SWITCH, SWITCH, PULL), strict=True):
        inside = (time >= span.start) & (time <= span.end)
        covered |= inside
        assert inside.any()
        assert (strokes.stroke[inside] == stroke).all()
        assert (strokes.used_sliding[inside] == (stroke != SWITCH)).all()
    assert (strokes.stroke[~covered] == alone.strokes.stroke[~covered]).all()
    assert (strokes.used_sliding[~covered] == alone.strokes.used_sliding[~covered]).all()


def test_a_phase_by_hand_does_not_use_saturated_blocks():
    result = find(noise=0.5)
    saturated = (result.blocks.time > 0.5) & (result.blocks.time < 0.7)
    blocks = replace(result.blocks, saturated=saturated)
    strokes = find_strokes(blocks, "run.csv", "run", (Phase(start=0.4, end=0.8, stroke="pull"),))
    assert not strokes.used_sliding[saturated].any()
    assert strokes.used_sliding[(result.blocks.time > 0.42) & (result.blocks.time < 0.48)].all()


def test_a_phase_outside_the_recording_is_refused():
    with pytest.raises(DatasetError, match=r"from 100 to 200 s holds nothing of the recording, which goes from"):
        find(by_hand=(Phase(start=100.0, end=200.0, stroke="pull"),))


def test_a_recording_of_a_few_blocks_is_refused():
    with pytest.raises(DatasetError, match=r"too few blocks .*\(5, at least 10 needed\).*shorter block"):
        find(block=2.0, cycles=3)


def test_time_without_load_is_neither_used_nor_in_the_way():
    settings = {"lead_in": 3.0, "unloaded": 2.0, "cycles": 1, "noise": 0.5}
    for velocity in ("recorded", "absent"):
        result = find(velocity, **settings)
        assert not result.strokes.used_sliding[result.blocks.time < 2.0].any()
        assert result.strokes.exponent == pytest.approx(0.2, rel=0.03)


def test_drag_is_not_found_where_there_is_none_to_tell_it_by():
    strokes = find(noise=0.5, exponent=0.02).strokes
    assert strokes.drag < 20.0  # noise in logarithms shrinks with drag, and must not be mistaken for a better fit


def turning_every_few_blocks(seed: int, lowest: float, exponent: float, top: float) -> Blocks:
    """Blocks of forces with frequencies up to `top` times a tenth of their rate."""
    generator, time = np.random.default_rng(seed), np.arange(3000) / 10
    waves = [np.sin(2 * np.pi * f * time + generator.uniform(0, 2 * np.pi)) for f in generator.uniform(0.1, top, 40)]
    motion = np.sum(waves, axis=0)
    force_in = lowest + (100 - lowest) * (motion - motion.min()) / np.ptp(motion)
    forces = force_in, np.exp(play(np.log(force_in), exponent)[0])
    noisy = [force + generator.normal(0, 0.3, len(time)) for force in forces]
    return Blocks(time, *noisy, np.full(len(time), np.nan), np.ones(len(time), int), np.zeros(len(time), bool))


def test_low_forces_of_a_fast_motion_are_not_taken_for_noise():
    assert np.mean(RopeStrokes().usable(turning_every_few_blocks(3, 5.0, 0.1, 3.0))) > 0.98


def test_a_loop_of_which_few_blocks_are_fitted_is_not_taken_for_one_phase():
    strokes = find_strokes(turning_every_few_blocks(1, 10.0, 0.6, 2.5), "run.csv", "run")
    assert strokes.exponent == pytest.approx(0.6, rel=0.03)


def test_a_loop_off_center_and_a_lone_pull_are_remarked_on():
    recording = simulated(noise=0.2)
    raw = to_raw(recording, "run", "run.csv")
    blocks, _ = prepare(replace(raw, output_force=raw.output_force * np.exp(-0.1)), SETTINGS)
    strokes = find_strokes(blocks, "run.csv", "run")
    assert strokes.center == pytest.approx(0.1, abs=0.01)
    assert "off center by +10" in " ".join(strokes.remarks)
    pull = slice(*np.flatnonzero(recording.stroke == PULL)[[0, 100]])
    alone = RawRecording(
        "run",
        "run.csv",
        *(v[pull] for v in (raw.input_time, raw.input_force) * 1),
        *(v[pull] for v in (raw.output_time, raw.output_force)),
    )
    blocks, _ = prepare(alone, SETTINGS)
    strokes = find_strokes(blocks, "run.csv", "run")
    assert "run is pulling throughout" in " ".join(strokes.remarks)
    assert strokes.exponent == pytest.approx(0.2, rel=0.02)
    assert strokes.center == 0.0


def random_recording(seed: int) -> RawRecording:
    """A bench as it may be: any speed, stiffness, preload, noise and friction, now and then with drag or a delay."""
    g = np.random.default_rng(seed)
    noise = float(g.choice([0.0, 0.1, 0.5, 1.0]))
    profile = MotorProfile(
        speed=float(np.exp(g.uniform(np.log(0.5), np.log(6.0)))),
        cycles=int(g.integers(1, 5)),
        stroke=float(g.uniform(25, 60)),
        lead_in=1.0,
        unloaded=float(g.choice([0.0, 0.8])),
        partial_reversals=((15.0, 8.0),) if g.random() < 0.3 else (),
    )
    friction = BenchFriction(drag=float(g.choice([0.0, 0.0, 3.0])), load_exponent=float(g.choice([0.0, 0.0, 0.2])))
    bench = BenchSettings(
        float(g.choice([50.0, 100.0])), float(g.uniform(3, 25)), float(g.uniform(1, 3)), float(g.uniform(10, 40))
    )
    faults = LoadCellFaults(
        input_noise=noise,
        output_noise=noise,
        delay=float(g.choice([0.0, 0.0, 0.01])),
        gain_error=float(g.normal(0, 0.01)),
    )
    exponent = float(np.exp(g.uniform(np.log(0.05), 0.0)))
    return to_raw(simulate_recording(exponent, friction, profile, bench, faults, g), "run", "run.csv")


@pytest.mark.extended
@pytest.mark.parametrize(("velocity", "n"), [("recorded", 10), ("absent", 40), ("turned around", 10)])
def test_swapped_channels_are_told_from_good_ones(velocity, n):
    for seed in range(n):
        raw = random_recording(seed)
        if velocity == "absent":
            raw = without_velocity(raw)
        elif velocity == "turned around":
            raw = replace(raw, velocity=-raw.velocity)
        find_strokes(prepare(raw, SETTINGS)[0], "run.csv", "run")  # no false alarm
        with pytest.raises(DatasetError, match="exchange the channels of input and output"):
            find_strokes(prepare(swapped(raw), SETTINGS)[0], "run.csv", "run")


def ar1(n: int, memory: float, seed: int) -> Vector:
    drive = np.random.default_rng(seed).standard_normal(n)
    series = np.zeros(n)
    for i in range(1, n):
        series[i] = memory * series[i - 1] + drive[i]
    return series


def test_the_correlation_time_of_noise_without_memory_is_one():
    times = [correlation_time(np.random.default_rng(seed).standard_normal(2000)) for seed in range(20)]
    assert np.mean(times) == pytest.approx(1.0, abs=0.1)
    assert min(times) >= 1.0


def test_the_correlation_time_of_noise_with_memory_is_known():
    times = [correlation_time(ar1(4000, 0.8, seed)) for seed in range(20)]
    assert np.mean(times) == pytest.approx(1.8 / 0.2, rel=0.12)


def test_the_correlation_time_of_next_to_nothing_is_one():
    assert correlation_time(np.array([1.0, 2.0, 1.0])) == 1.0
    assert correlation_time(np.full(100, 3.0)) == 1.0
