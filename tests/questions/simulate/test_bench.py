"""The simulated bench: its physics, its faults, and the plan that makes a data set of recordings."""

import json
import tomllib
from dataclasses import replace

import jax
import numpy as np
import pytest
from conftest import ROOT
from raw_recordings import to_raw

from bowdenfit.errors import DescriptionError, UsageError
from bowdenfit.questions.simulate.bench import (
    BenchFriction,
    BenchSettings,
    LoadCellFaults,
    MotorProfile,
    simulate_recording,
)
from bowdenfit.questions.simulate.recordings import make_recordings, write_recordings
from bowdenfit.questions.simulate.recordings_plan import parse_recordings_plan, read_recordings_plan

pytestmark = pytest.mark.extended

PLAN = ROOT / "datasets" / "synthetic-recordings" / "bench.toml"
EXPONENT = 0.25
PROFILE = MotorProfile(speed=2.0, lead_in=0.5, cycles=2)
BENCH = BenchSettings(rate=500.0)
CAPSTAN, NO_FAULTS = BenchFriction(), LoadCellFaults()
FRICTIONS = {
    "capstan": CAPSTAN,
    "drag": BenchFriction(drag=5.0),
    "load exponent": BenchFriction(load_exponent=0.4),
    "constant friction force": BenchFriction(load_exponent=1.0, reference_force=30.0),
    "load exponent and drag": BenchFriction(load_exponent=0.6, drag=2.0),
    "rate of the rope": BenchFriction(stribeck=0.3, stribeck_speed=15.0, viscous=0.002),
    "rate of the motor": BenchFriction(stribeck=0.3, stribeck_speed=0.7, viscous=-0.05, speed="motor"),
}


def recorded(profile=PROFILE, friction=CAPSTAN, faults=NO_FAULTS, seed=1, bench=BENCH, run_effect=0.0):
    return simulate_recording(EXPONENT, friction, profile, bench, faults, np.random.default_rng(seed), run_effect)


def shift_on_the_scale(recording, friction):
    """g(F_in) - g(F_out), written out independently of the simulator."""
    p, relative = friction.load_exponent, 1 / friction.reference_force
    u_in, u_out = ((f + friction.drag) * relative for f in (recording.input_force, recording.output_force))
    return np.log(u_in / u_out) if p == 0 else (u_in**p - u_out**p) / p


@pytest.mark.parametrize("friction", FRICTIONS.values(), ids=FRICTIONS)
def test_sliding_samples_obey_the_friction_law_both_ways(friction):
    recording = recorded(friction=friction, run_effect=0.01)
    speed = np.abs(recording.velocity if friction.speed == "rope" else recording.motor_speed)
    factor = 1 + friction.stribeck * np.exp(-((speed / friction.stribeck_speed) ** 2)) + friction.viscous * speed
    shift, exponent = shift_on_the_scale(recording, friction), EXPONENT * factor + 0.01
    for stroke in (1, -1):
        sliding = recording.stroke == stroke
        assert sliding.sum() > 300
        np.testing.assert_allclose(shift[sliding], stroke * exponent[sliding], rtol=0, atol=1e-9)
    assert np.all(np.abs(shift) <= exponent + 1e-9)


def test_forces_are_those_of_rope_and_spring():
    recording = recorded()
    x = (recording.output_force - BENCH.preload) / BENCH.load_stiffness
    expected = BENCH.preload + BENCH.rope_stiffness * (recording.position - x)
    np.testing.assert_allclose(recording.input_force, expected, atol=1e-9)
    assert recording.input_force[0] == recording.output_force[0] == BENCH.preload
    assert x.min() >= 0


def test_output_stands_still_while_nothing_slides():
    recording = recorded()
    stroke, moved = recording.stroke, np.diff(recording.output_force)
    stuck = (stroke[1:] == 0) & (stroke[:-1] == 0)  # both: the rope may still slide a little after a sample
    np.testing.assert_array_equal(moved[stuck], 0.0)
    sliding = stroke[1:] != 0
    assert np.all(moved[sliding] * stroke[1:][sliding] > 0)
    switching = stuck & (np.diff(recording.input_force) != 0)
    assert switching.sum() > 50  # the input force does move there


def test_pulling_never_gives_more_than_it_takes():
    for friction in FRICTIONS.values():
        recording = recorded(friction=friction)
        pulling, returning = recording.stroke == 1, recording.stroke == -1
        assert np.all(recording.output_force[pulling] < recording.input_force[pulling])
        assert np.all(recording.output_force[returning] > recording.input_force[returning])
        work = np.sum(np.diff(recording.position) * (recording.input_force[1:] + recording.input_force[:-1]) / 2)
        assert work > 0  # a closed loop costs energy


def test_nested_partial_reversals_follow_the_play_operator():
    profile = replace(PROFILE, partial_reversals=((40.0, 15.0), (35.0, 5.0)))
    recording = recorded(profile, bench=BenchSettings(rate=20000.0))
    x, y = np.log(recording.input_force), [np.log(recording.output_force[0])]
    for now in x[1:].tolist():
        y.append(min(max(y[-1], now - EXPONENT), now + EXPONENT))
    np.testing.assert_allclose(np.exp(y), recording.output_force, rtol=2e-4)
    turns = [25.0, 35.0, 30.0]  # inside the first stroke: pulled to 40, back to 25, on to 35, back to 30, on to 50
    positions = recording.position[np.searchsorted(recording.time, recording.reversals[:5])]
    np.testing.assert_allclose(positions, [40.0, *turns, 50.0], atol=1e-2)
    assert len(recording.reversals) == 5 * 4 - 1


def test_forces_do_not_depend_on_the_sampling_rate():
    profile = replace(PROFILE, pause=0.0, partial_reversals=((30.0, 15.0),))  # turns between two samples
    fine, coarse = (recorded(profile, bench=BenchSettings(rate=rate)) for rate in (1000.0, 10.0))
    np.testing.assert_allclose(fine.output_force[::100][: len(coarse.time)], coarse.output_force, rtol=1e-9)


def test_motor_runs_at_the_stated_speed_and_over_the_stated_stroke():
    recording = recorded()
    assert recording.velocity.max() == pytest.approx(2.0 * 20.0)
    assert recording.motor_speed.min() == pytest.approx(-2.0)
    assert recording.position.max() == pytest.approx(50.0) and recording.position[-1] == pytest.approx(0.0)
    slope = np.gradient(recording.position, recording.time)
    assert np.abs(slope - recording.velocity).max() < 0.5


def test_short_moves_and_jumping_speeds_end_where_they_should():
    slow_start = recorded(replace(PROFILE, stroke=3.0, acceleration_time=1.0))
    assert slow_start.position.max() == pytest.approx(3.0, abs=1e-3)
    assert slow_start.velocity.max() < 40.0
    jump = recorded(replace(PROFILE, acceleration_time=0.0))
    assert set(np.round(jump.velocity, 9)) == {-40.0, 0.0, 40.0}


def test_contact_changes_tell_the_state_of_every_sample():
    recording = recorded()
    times, states = zip(*recording.contact_changes, strict=True)
    again = np.array(states)[np.searchsorted(times, recording.time, side="right") - 1]
    np.testing.assert_array_equal(again, recording.stroke)
    assert len(recording.contact_changes) < 20


def test_noise_has_its_standard_deviation_white_or_filtered():
    white = recorded(faults=LoadCellFaults(input_noise=0.5, output_noise=2.0))
    slow = recorded(faults=LoadCellFaults(input_noise=0.5, noise_cutoff=20.0))
    clean = recorded()
    n = len(clean.time)
    for reading, force, sd in (
        (white.input_force, clean.input_force, 0.5),
        (white.output_force, clean.output_force, 2.0),
    ):
        assert np.std(reading - force) == pytest.approx(sd, abs=4 * sd / np.sqrt(2 * n))
        assert abs(correlation(reading - force)) < 4 / np.sqrt(n)
    memory = np.exp(-2 * np.pi * 20 / 500)
    error = slow.input_force - clean.input_force
    assert np.std(error) == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(2 * n * (1 - memory) / (1 + memory)))
    assert correlation(error) == pytest.approx(memory, abs=4 * np.sqrt((1 - memory**2) / n))


def correlation(error):
    return np.corrcoef(error[1:], error[:-1])[0, 1]


def test_gain_and_offsets_have_the_signs_of_the_model():
    clean, faulty = recorded(), recorded(faults=LoadCellFaults(gain_error=0.03))
    ratio = np.log(faulty.input_force / faulty.output_force) - np.log(clean.input_force / clean.output_force)
    np.testing.assert_allclose(ratio, 0.03, atol=1e-12)
    shifted = recorded(faults=LoadCellFaults(input_offset=1.5, output_offset=-2.0))
    np.testing.assert_allclose(shifted.input_force - clean.input_force, 1.5, atol=1e-12)
    np.testing.assert_allclose(shifted.output_force - clean.output_force, -2.0, atol=1e-12)


@pytest.mark.parametrize("samples", [1, 7, -3])
def test_delay_of_whole_samples_shifts_the_output_alone(samples):
    clean, late = recorded(), recorded(faults=LoadCellFaults(delay=samples / 500))
    np.testing.assert_array_equal(late.input_force, clean.input_force)
    rows, by = (
        (slice(samples, None), slice(None, -samples)) if samples > 0 else (slice(None, samples), slice(-samples, None))
    )
    np.testing.assert_allclose(late.output_force[rows], clean.output_force[by], atol=1e-9)
    np.testing.assert_array_equal(late.stroke, clean.stroke)


@pytest.mark.parametrize("delay", [0.02, 0.3])
def test_a_late_channel_shows_the_rest_before_the_start_first(delay):
    late = recorded(faults=LoadCellFaults(delay=delay))
    np.testing.assert_allclose(late.output_force[late.time < delay], recorded().output_force[0])


def test_delay_between_samples_is_exact():
    late = recorded(faults=LoadCellFaults(delay=0.0005))
    fine = recorded(bench=BenchSettings(rate=2000.0))
    np.testing.assert_allclose(late.output_force[1:], fine.output_force[3::4][: len(late.time) - 1], atol=1e-9)


def test_saturation_clips_and_nothing_else_changes():
    clean, clipped = recorded(), recorded(faults=LoadCellFaults(input_range=(0.0, 80.0), output_range=(30.0, 70.0)))
    assert clean.input_force.max() > 80 and clean.output_force.max() > 70 and clean.output_force.min() < 30
    np.testing.assert_array_equal(clipped.input_force, np.minimum(clean.input_force, 80))
    np.testing.assert_array_equal(clipped.output_force, np.clip(clean.output_force, 30, 70))


def test_quantization_has_the_step_of_its_bits():
    clean = recorded()
    coarse = recorded(faults=LoadCellFaults(input_range=(-100.0, 500.0), output_range=(0.0, 255.0), bits=8))
    np.testing.assert_allclose(coarse.output_force, np.round(coarse.output_force), atol=1e-9)
    step = 600 / 255
    levels = (coarse.input_force + 100) / step
    np.testing.assert_allclose(levels, np.round(levels), atol=1e-9)
    assert np.abs(coarse.input_force - clean.input_force).max() <= step / 2 + 1e-9


def test_gaps_are_missing_or_frozen_for_their_length():
    clean = recorded()
    missing = recorded(faults=LoadCellFaults(dropouts=60.0, dropout_length=0.05))
    frozen = recorded(faults=LoadCellFaults(dropouts=60.0, dropout_length=0.05, dropout_kind="frozen"))
    gap = np.isnan(missing.input_force)
    assert gap.sum() >= 25 and not np.array_equal(gap, np.isnan(missing.output_force))
    np.testing.assert_array_equal(missing.input_force[~gap], clean.input_force[~gap])
    first = np.flatnonzero(np.diff(gap.astype(int)) == 1) + 1
    assert np.all(frozen.input_force[first] == clean.input_force[first - 1])
    assert np.all(np.diff(frozen.input_force)[gap[1:] & gap[:-1]] == 0)


def test_spikes_are_single_readings_of_their_size():
    clean, spiked = recorded(), recorded(faults=LoadCellFaults(spikes=120.0, spike_size=30.0))
    off = spiked.input_force - clean.input_force
    hit = np.flatnonzero(np.abs(off) > 1e-9)
    duration = clean.time[-1] / 60
    assert abs(len(hit) - 120 * duration) < 4 * np.sqrt(120 * duration)
    np.testing.assert_allclose(np.abs(off[hit]), 30.0)
    assert set(np.sign(off[hit])) == {-1.0, 1.0}


def test_one_fault_does_not_change_the_random_numbers_of_another():
    noisy, both = (
        LoadCellFaults(input_noise=0.5),
        LoadCellFaults(input_noise=0.5, spikes=100.0, dropouts=20.0, output_noise=1.0),
    )
    few, many = recorded(faults=noisy).input_force, recorded(faults=both).input_force
    assert np.mean(few == many) > 0.9


def test_cells_show_only_their_offsets_before_the_preload_is_put_on():
    quiet = recorded(
        replace(PROFILE, unloaded=0.3), faults=LoadCellFaults(input_offset=1.0, output_offset=-1.0, gain_error=0.1)
    )
    initial = quiet.time < 0.3 - 1e-9
    assert np.all(quiet.input_force[initial] == 1.0) and np.all(quiet.output_force[initial] == -1.0)
    assert np.all(quiet.stroke[initial] == 0)
    assert np.all(quiet.input_force[~initial] > 10)


def test_raw_recording_carries_all_channels_in_internal_units():
    recording = recorded()
    raw = to_raw(recording, "first", "first.csv")
    assert (raw.name, raw.file) == ("first", "first.csv")
    np.testing.assert_array_equal(raw.input_force, recording.input_force)
    np.testing.assert_array_equal(raw.output_force, recording.output_force)
    np.testing.assert_array_equal(raw.velocity, recording.velocity)
    np.testing.assert_allclose(to_raw(recording, "first", "first.csv", velocity="motor").velocity * 20, raw.velocity)


def test_friction_that_pushes_is_refused():
    with pytest.raises(UsageError, match="friction cannot push"):
        recorded(run_effect=-0.3)


@pytest.mark.parametrize(
    ("profile", "faults", "words"),
    [
        (replace(PROFILE, unloaded=1.0), LoadCellFaults(), "longer than lead_in"),
        (replace(PROFILE, partial_reversals=((60.0, 5.0),)), LoadCellFaults(), "does not fit"),
        (replace(PROFILE, partial_reversals=((10.0, 12.0),)), LoadCellFaults(), "does not fit"),
        (PROFILE, LoadCellFaults(bits=12), "needs input_range"),
        (PROFILE, LoadCellFaults(input_range=(5.0, 5.0)), "is empty"),
    ],
)
def test_settings_that_contradict_one_another_are_refused(profile, faults, words):
    with pytest.raises(UsageError, match=words):
        recorded(profile, faults=faults)


def written(plan, folder, seed):
    with jax.enable_x64(True):
        made = make_recordings(plan, seed)
    write_recordings(made, folder)
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.fixture(scope="module")
def plan():
    return read_recordings_plan(PLAN)


def test_the_data_set_is_what_its_plan_and_seed_give(plan, tmp_path):
    folder = PLAN.parent
    seed = json.loads((folder / "truth.json").read_text())["seed"]
    made = written(plan, tmp_path, seed)
    names = {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}
    assert names == {*made, "bench.toml", "README.md"}
    for name, text in made.items():
        if name.endswith(".csv"):  # numbers to the last printed digit; other machines may round differently
            assert_same_numbers(text.decode(), (folder / name).read_text())
    assert made["cable.toml"] == (folder / "cable.toml").read_bytes()


def assert_same_numbers(text, other):
    rows, expected_rows = ([line.split(",") for line in t.splitlines()] for t in (text, other))
    assert rows[0] == expected_rows[0] and len(rows) == len(expected_rows)
    values, kept_values = (
        np.array([[float(c.replace("<", "-")) for c in row] for row in t[1:]]) for t in (rows, expected_rows)
    )
    np.testing.assert_allclose(values, kept_values, atol=0.0101)


def test_same_seed_same_bytes_and_another_seed_others(plan, tmp_path):
    first, again, other = (written(plan, tmp_path / str(i), seed) for i, seed in enumerate((5, 5, 6)))
    assert first == again
    csv = [name for name in first if name.endswith(".csv")]
    assert len(csv) == 8 and all(first[name] != other[name] for name in csv)
    assert sum(map(len, first.values())) < 700_000


def test_the_paper_s_efficiencies_come_out(plan):
    with jax.enable_x64(True):
        made = make_recordings(plan, 1, noise=False)
    expected = {440: 0.77, 470: 0.785, 510: 0.753, 550: 0.678}
    for recording in made.recordings:
        simulated = recording.simulated
        pulling = simulated.stroke == 1
        efficiency = np.mean(simulated.output_force[pulling] / simulated.input_force[pulling])
        assert efficiency == pytest.approx(np.exp(-recording.exponent), rel=1e-9)
        assert efficiency == pytest.approx(expected[recording.planned.length], abs=0.006)


def test_run_effects_have_the_scatter_of_the_truth_and_belong_to_mountings():
    raw = tomllib.loads(PLAN.read_text())
    raw["recordings"]["also"] = [{"length": 470, "run": f"mounting {i // 2}"} for i in range(60)]
    raw["recordings"]["profile"] |= {"stroke": 1, "cycles": 1}
    with jax.enable_x64(True):
        made = make_recordings(parse_recordings_plan(raw, ""), 3).recordings[4:]
    effects = np.array([m.run_effect for m in made])
    np.testing.assert_array_equal(effects[::2], effects[1::2])
    assert np.std(effects[::2]) == pytest.approx(0.01, abs=4 * 0.01 / np.sqrt(60))


def test_truth_tells_everything_that_was_put_in(tmp_path):
    raw = tomllib.loads(PLAN.read_text())
    faults = {"gain_error": 0.02, "input_offset": 0.5, "output_noise": 0.7, "delay": 0.01}
    raw["recordings"] |= {"faults": faults, "friction": {"drag": 3.0, "viscous": 0.1, "speed": "motor"}}
    text = PLAN.read_text()
    written(parse_recordings_plan(raw, text), tmp_path, 4)
    page = json.loads((tmp_path / "truth.json").read_text())
    assert page["seed"] == 4
    assert page["truth"]["mu2"] == 0.108 and page["truth"]["drag"] == 3.0 and page["truth"]["gain_error"] == 0.02
    assert page["truth"]["viscous"] == pytest.approx(0.1 * 2 * np.pi / 60)  # per r/min, as a fit shows it
    first = page["recordings"][0]
    assert {k: first["faults"][k] for k in faults} == faults and first["faults"]["input_noise"] == 0.5
    assert first["wrap_angles_deg"]["bracket edge"] == pytest.approx(45)
    assert len(first["reversals"]) == 5 and first["contact_changes"][0] == [0.0, 0]
    assert page["recordings"][3]["wrap_angles_deg"]["free sheath"] == pytest.approx(100)


def test_coefficients_that_the_plan_leaves_open_are_drawn():
    raw = tomllib.loads(PLAN.read_text())
    del raw["truth"]["mu1"], raw["truth"]["sigma_F"]
    with jax.enable_x64(True):
        first, two = (make_recordings(parse_recordings_plan(raw, ""), seed).truth for seed in (1, 2))
    assert first["mu1"] != two["mu1"] and first["sigma_F"] != two["sigma_F"] and first["mu2"] == 0.108


def test_a_cable_at_one_angle_needs_no_lengths(tmp_path):
    text = (
        'name = "one angle"\n[[contact]]\nname = "cable"\nfriction = "mu"\n'
        'wrap_angle = { value = 180, unit = "deg" }\n[tables]\nrecordings = {}\n'
        '[truth]\nmu = 0.1\n[recordings]\nspeeds = ["20 rpm", "2.5 rad/s"]\n'
    )
    made = written(parse_recordings_plan(tomllib.loads(text), text), tmp_path, 1)
    assert "recordings/20rpm.csv" in made and "recordings/2.5radps.csv" in made and "angles.csv" not in made
    description = tomllib.loads(made["cable.toml"].decode())
    assert set(description) == {"name", "contact", "tables", "recording"} and "at" not in description["recording"][0]


def test_rows_of_the_files_are_the_readings(plan, tmp_path):
    with jax.enable_x64(True):
        made = make_recordings(plan, 9)
    write_recordings(made, tmp_path)
    recording = made.recordings[0]
    table = np.genfromtxt(tmp_path / recording.planned.file, delimiter=",", names=True)
    assert table.dtype.names == ("time_s", "input_force_N", "output_force_N", "motor_speed_rpm")
    np.testing.assert_allclose(table["time_s"], recording.simulated.time, atol=1e-6)
    np.testing.assert_allclose(table["input_force_N"], recording.simulated.input_force, atol=0.00501)
    assert table["motor_speed_rpm"].max() == 20 and table["motor_speed_rpm"].min() == -20


WRONG = [
    (lambda r: r.pop("recordings"), r"has no \[recordings\]"),
    (lambda r: r["recordings"].update(lenghts=[440]), "unknown key 'recordings.lenghts'; did you mean 'lengths'"),
    (lambda r: r["recordings"]["profile"].update(stroek=3), "unknown key 'stroek'; did you mean 'stroke'"),
    (lambda r: r["recordings"].update(faults={"gain": 0.1}), "did you mean 'gain_error'"),
    (lambda r: r["recordings"]["also"][0].update(sped="40 r/min"), "unknown key .*did you mean 'speed'"),
    (lambda r: r["recordings"].pop("speeds"), "'recordings.speeds' is missing"),
    (lambda r: r["recordings"].update(speeds=["20 km/h"]), "'20 km/h' is not a motor speed"),
    (lambda r: r["recordings"].update(speeds=["0 r/min"]), "is not a motor speed"),
    (lambda r: r["recordings"]["bench"].update(rate=-5), "bench, rate: .*greater than 0.*found -5"),
    (lambda r: r["recordings"].update(faults={"bits": 12}), "needs input_range"),
    (lambda r: r["recordings"].pop("measured_angles"), "550 lies outside the range"),
    (lambda r: r["recordings"]["measured_angles"][0].pop("free_sheath_angle"), "'free_sheath_angle' is missing"),
    (lambda r: r["recordings"]["measured_angles"][0].update(at=500), "lies inside the range"),
    (lambda r: r["recordings"].pop("angles"), "curves need angles"),
    (lambda r: r["recordings"].update(lengths=[], also=[]), "nothing to record"),
    (lambda r: r["recordings"]["also"].append({"speed": "20 r/min"}), "needs a length"),
    (lambda r: r["recordings"]["also"][0].update(run="440 mm, 20 r/min"), "a run is one mounting"),
    (lambda r: r["truth"].update(mu1="low"), "truth.mu1: 'low' is not a number"),
    (lambda r: r["tables"].update(forces={"files": "forces.csv"}), "tables.forces: a plan of recordings"),
    (lambda r: r.update(recording=[{"file": "a.csv"}]), r"no \[\[recording\]\]"),
    (lambda r: r.update(nmae="x"), "unknown key 'nmae'; did you mean 'name'"),
    (lambda r: r.update(reference_force=50), "reference_force: write a force"),
]


@pytest.mark.parametrize(("spoil", "words"), WRONG, ids=[words for _, words in WRONG])
def test_a_wrong_plan_is_refused_in_a_sentence(spoil, words):
    raw = tomllib.loads(PLAN.read_text())
    spoil(raw)
    with pytest.raises(DescriptionError, match=words) as refused:
        parse_recordings_plan(raw, "")
    assert str(refused.value).endswith((".", "?"))


def test_a_missing_or_broken_plan_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(DescriptionError, match=r"does not exist; name a bench\.toml"):
        read_recordings_plan(tmp_path / "bench.toml")
    (tmp_path / "bench.toml").write_text("[recordings")
    with pytest.raises(DescriptionError, match="not valid TOML"):
        read_recordings_plan(tmp_path / "bench.toml")


def test_an_unknown_name_in_the_truth_is_refused():
    raw = tomllib.loads(PLAN.read_text())
    raw["truth"]["mu9"] = 0.1
    with jax.enable_x64(True), pytest.raises(UsageError, match="'mu9' is not a parameter"):
        make_recordings(parse_recordings_plan(raw, ""), 1)
