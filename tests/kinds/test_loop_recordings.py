"""Recordings of a pull-pull loop, from files to figures, against loops simulated here in plain NumPy."""

import json
import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate, stats

import bowdenfit as bf
from bowdenfit.cable.drive import Loop
from bowdenfit.dataset import load_dataset
from bowdenfit.description import Phase, Preparation
from bowdenfit.errors import DatasetError, DescriptionError
from bowdenfit.kinds.recordings.loops import LoopRecordingsTerm
from bowdenfit.model import build_model
from bowdenfit.questions.check.data_set_words import check_text
from bowdenfit.questions.figures import FIGURES, figures_of
from bowdenfit.questions.recorded.loop_traces import loop_points
from bowdenfit.questions.recorded.traces import traces
from bowdenfit.recordings.forces import parse_channels
from bowdenfit.recordings.loop_strokes import LoopStrokes
from bowdenfit.recordings.preparation import prepare
from bowdenfit.recordings.recording import RawRecording, Recordings
from bowdenfit.recordings.strokes import find_strokes
from bowdenfit.results.store import _measurements, _measurements_page

PRELOAD, MU, RATE = 20.0, 0.12, 200.0
HALF_TURN = MU * math.pi
SETTINGS = Preparation()
SLACK_FROM = 2 * PRELOAD * HALF_TURN / (1 - math.exp(-HALF_TURN))


def output_of(force, preload, exponent, start=0.0):
    """Output force of a loop: it stands still between what it would be moving forward and moving back."""
    y, output, lost = start, [], 2 * preload * exponent
    for x in force.tolist():
        slack = x * math.exp(-exponent), x * math.exp(exponent)
        forward, back = min(x - lost, *slack), max(x + lost, *slack)
        y = min(max(y, forward), back)
        output.append(y)
    return np.array(output)


def motor(shape, amplitude, seconds=16.0):
    """Time and input force of a motor that swings through zero, with partial reversals on the way."""
    time = np.arange(0, seconds, 1 / RATE)
    phase = 0.5 * np.pi * time
    swing = np.sin(phase) if shape == "sine" else 2 / np.pi * np.arcsin(np.sin(phase))
    return time, amplitude * (swing + 0.35 * np.sin(3.3 * phase))


def recorded(shape="sine", amplitude=60.0, exponent=HALF_TURN, preload=PRELOAD, noise=0.3, seed=0, seconds=16.0):
    """Columns of a recording, with noise on both load cells."""
    time, force = motor(shape, amplitude, seconds)
    output = output_of(force, preload, exponent)
    in_noise, out_noise = noise * np.random.default_rng(seed).standard_normal((2, len(time)))
    return {"time_s": time, "input_force_N": force + in_noise, "output_force_N": output + out_noise}


def write(path, columns):
    np.savetxt(path, np.column_stack(list(columns.values())), "%.6f", ",", header=",".join(columns), comments="")


def folder_of(path, each, *, angles=None, cable="", more="", entry=""):
    """A data set of recordings of a loop; each at its wrap angle in degrees, or all at half a turn."""
    bend = '{ value = 180, unit = "deg" }' if angles is None else '{ column = "bend" }'
    lines = ["[[contact]]", 'name = "sheath"', 'friction = "mu"', f"wrap_angle = {bend}"]
    lines.append(more or "[tables]\nrecordings = {}")
    for i, columns in enumerate(each):
        write(path / f"r{i}.csv", columns)
        lines += ["[[recording]]", f'file = "r{i}.csv"', entry]
        if angles is not None:
            lines.append(f'wrap_angles = {{ bend = {{ value = {angles[i]}, unit = "deg" }} }}')
    (path / "cable.toml").write_text("\n".join(['name = "loop"', "[cable]", 'kind = "loop"', cable, *lines]) + "\n")
    return path


def prepared(columns, settings=SETTINGS):
    time = columns["time_s"]
    forces = columns["input_force_N"], columns["output_force_N"]
    return prepare(RawRecording("run", "run.csv", time, forces[0], time, forces[1], loop=True), settings)


def strokes_of(columns, by_hand=(), preload=None):
    return find_strokes(prepared(columns)[0], "run.csv", "run", by_hand, LoopStrokes(preload))


def term_of(folder) -> LoopRecordingsTerm:
    return next(t for t in build_model(load_dataset(folder)).terms if isinstance(t, LoopRecordingsTerm))


def of_term(term, what, values, *extra):
    named = {name: jnp.asarray(float(value)) for name, value in values.items()}
    return np.asarray(jax.jit(getattr(term, what))(named, term.data, *extra))


VALUES = {"mu": MU, "preload": PRELOAD, "tau": 0.02, "sigma_block": 0.1}
ANGLES, AMPLITUDES = (90, 180, 180, 270), (60, 20, 90, 60)


@pytest.fixture(scope="module")
def several(tmp_path_factory):
    """Four recordings, each with a mounting of its own; one of them never goes slack."""
    effects = 0.01 * np.random.default_rng(5).standard_normal(4)
    each = [
        recorded(("sine", "triangle")[i % 2], amplitude, MU * math.radians(angle) + effects[i], seed=i)
        for i, (angle, amplitude) in enumerate(zip(ANGLES, AMPLITUDES, strict=True))
    ]
    return folder_of(tmp_path_factory.mktemp("several"), each, angles=ANGLES)


@pytest.fixture(scope="module")
def sampled(tmp_path_factory):
    """A short posterior from two short recordings; the first of them never goes slack."""
    each = [recorded(amplitude=a, seconds=6.0, seed=i) for i, a in enumerate((30.0, 80.0))]
    settings = ("sampler.n_walkers=32", "sampler.n_ensembles=2", "sampler.max_steps=400", "sampler.target_ess=100")
    return bf.fit(folder_of(tmp_path_factory.mktemp("sampled"), each), seed=2, settings=settings)


# What a recording says by itself ----------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", ["sine", "triangle"])
def test_loss_and_exponent_of_a_recording_without_noise_are_found(shape):
    found = strokes_of(recorded(shape, 60.0, noise=0.0))
    assert found.drag == pytest.approx(2 * PRELOAD * HALF_TURN, rel=2e-3)
    assert found.exponent == pytest.approx(HALF_TURN, rel=2e-3)
    assert found.center == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("amplitude", [20.0, 60.0, 120.0])
def test_phases_are_where_the_loop_moves(amplitude):
    columns = recorded(amplitude=amplitude, noise=0.3)
    blocks, _ = prepared(columns)
    found = find_strokes(blocks, "run.csv", "run", cable=LoopStrokes())
    time, force = motor("sine", amplitude)
    rate = np.interp(blocks.time, time, np.gradient(output_of(force, PRELOAD, HALF_TURN), time))
    assert found.used_sliding.any()
    assert np.all(np.sign(rate[found.used_sliding]) == found.stroke[found.used_sliding])
    assert found.noise < 0.3


def test_without_slack_a_recording_tells_the_loss_and_not_the_exponent():
    columns = recorded(amplitude=25.0)
    assert np.abs(columns["input_force_N"]).max() < SLACK_FROM
    found = strokes_of(columns)
    assert found.drag == pytest.approx(2 * PRELOAD * HALF_TURN, rel=0.01)
    assert np.isnan(found.exponent)
    assert any("does not go slack" in remark for remark in found.remarks)
    stated = strokes_of(columns, preload=PRELOAD)
    assert stated.exponent == pytest.approx(found.drag / (2 * PRELOAD))
    assert not any("does not go slack" in remark for remark in stated.remarks)


def test_without_preload_a_recording_tells_the_exponent_and_not_the_loss():
    found = strokes_of(recorded(preload=0.0))
    assert found.exponent == pytest.approx(HALF_TURN, rel=0.01)
    assert np.isnan(found.drag)


@pytest.mark.parametrize(("amplitude", "told"), [(60.0, True), (20.0, False)])
def test_either_sign_of_the_forces_is_right(amplitude, told):
    columns = recorded(amplitude=amplitude)
    found, turned = strokes_of(columns), strokes_of({n: v if n == "time_s" else -v for n, v in columns.items()})
    assert turned.drag == pytest.approx(found.drag, rel=1e-4)
    assert np.isfinite(found.exponent) == np.isfinite(turned.exponent) == told
    assert np.mean(turned.stroke == -found.stroke) > 0.99


def test_a_recording_of_one_direction_is_enough():
    time = np.arange(0, 8, 1 / RATE)
    force = 5 + 9 * time
    noise = 0.2 * np.random.default_rng(0).standard_normal((2, len(time)))
    columns = {
        "time_s": time,
        "input_force_N": force + noise[0],
        "output_force_N": output_of(force, PRELOAD, HALF_TURN) + noise[1],
    }
    found = strokes_of(columns)
    assert set(found.stroke[found.used_sliding]) == {1}
    assert found.drag == pytest.approx(2 * PRELOAD * HALF_TURN, rel=0.03)
    assert found.exponent == pytest.approx(HALF_TURN, rel=0.03)
    assert any("moves forward throughout" in remark for remark in found.remarks)


def test_load_cells_that_disagree_shift_the_center_and_not_the_loss():
    columns = recorded(amplitude=60.0)
    columns["output_force_N"] = columns["output_force_N"] - 5.0
    found = strokes_of(columns)
    assert found.center == pytest.approx(5.0, abs=0.1)
    assert found.drag == pytest.approx(2 * PRELOAD * HALF_TURN, rel=0.02)
    assert any("off the output force by +" in remark for remark in found.remarks)


def test_phases_set_by_hand_replace_those_found():
    columns = recorded()
    blocks, _ = prepared(columns)
    spans = (
        Phase(start=1.0, end=2.0, stroke="hold"),
        Phase(start=3.0, end=3.5, stroke="return"),
        Phase(start=5.0, end=5.5, stroke="pull"),
    )
    found = find_strokes(blocks, "run.csv", "run", spans, LoopStrokes())
    plain = find_strokes(blocks, "run.csv", "run", cable=LoopStrokes())
    inside = [(blocks.time >= s.start) & (blocks.time <= s.end) for s in spans]
    assert [set(found.stroke[part]) for part in inside] == [{0}, {-1}, {1}]
    assert not found.used_sliding[inside[0]].any()
    outside = ~np.any(inside, axis=0)
    assert np.array_equal(found.stroke[outside], plain.stroke[outside])
    assert found.by_hand


def test_the_motor_s_overtones_are_not_taken_for_noise():
    """The output has corners that a smooth input has not: blocks must stay short enough for them."""
    _, account = prepared(recorded(amplitude=120.0, noise=0.05, seconds=30.0))
    assert account.block < 0.05


# What is refused --------------------------------------------------------------------------------------------------


def test_swapped_channels_are_refused_with_the_command():
    for shape, amplitude in (("sine", 60.0), ("triangle", 25.0)):
        columns = recorded(shape, amplitude)
        swapped = columns | {"input_force_N": columns["output_force_N"], "output_force_N": columns["input_force_N"]}
        with pytest.raises(
            DatasetError, match="--channel input_force=OUTPUT_CHANNEL --channel output_force=INPUT_CHANNEL"
        ):
            strokes_of(swapped)


def test_channels_that_count_opposite_directions_are_refused():
    columns = recorded()
    with pytest.raises(DatasetError, match="output_force=NAME:-N"):
        strokes_of(columns | {"output_force_N": -columns["output_force_N"]})


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_a_loop_that_never_moves_is_refused(noise):
    columns = recorded(amplitude=8.0, noise=noise)
    columns["output_force_N"] = columns["output_force_N"] + np.linspace(0, 1e-3, len(columns["time_s"]))
    assert np.abs(columns["input_force_N"]).max() < 2 * PRELOAD * HALF_TURN
    with pytest.raises(DatasetError, match=r"stands still, .* inside the friction band"):
        strokes_of(columns)


def test_a_phase_to_be_ignored_is_refused(tmp_path):
    phases = 'strokes = [{ start = 1, end = 2, stroke = "ignore" }]'
    with pytest.raises(DescriptionError, match=r"from 1 to 2 s is to be ignored.*cut the file"):
        load_dataset(folder_of(tmp_path, [recorded()], entry=phases))


def test_a_recording_beyond_the_range_of_its_load_cells_is_refused():
    with pytest.raises(DatasetError, match="inside the range of the load cells"):
        blocks, _ = prepared(recorded())
        find_strokes(replace(blocks, saturated=np.arange(len(blocks.time)) > 5), "run.csv", "run", cable=LoopStrokes())


def as_torques(columns, input_radius=15.0, output_radius=12.0, unit="N_m"):
    scale = {"N_m": 1e-3, "N_mm": 1.0}[unit]
    return {
        "time_s": columns["time_s"],
        f"input_torque_{unit}": columns["input_force_N"] * input_radius * scale,
        f"output_torque_{unit}": columns["output_force_N"] * output_radius * scale,
    }


IN_RADIUS = 'input_pulley_radius = { value = 15, unit = "mm" }'
OUT_RADIUS = 'output_pulley_radius = { value = 1.2, unit = "cm" }'


def test_torques_over_the_radii_are_forces(tmp_path):
    columns = recorded(seconds=6.0)
    (tmp_path / "a").mkdir()
    forces = load_dataset(folder_of(tmp_path, [columns])).measurements.table(Recordings)
    torques = folder_of(tmp_path / "a", [as_torques(columns, unit="N_mm")], cable=f"{IN_RADIUS}\n{OUT_RADIUS}")
    found = load_dataset(torques).measurements.table(Recordings)
    assert forces is not None and found is not None
    for end in ("input_force", "output_force"):
        one, other = (getattr(r.each[0].blocks, end) for r in (forces, found))
        np.testing.assert_allclose(one, other, atol=1e-6)


def test_a_torque_at_one_end_only_and_a_named_channel_are_read(tmp_path):
    columns = recorded(seconds=6.0)
    mixed = {
        "time_s": columns["time_s"],
        "motor": -15.0 * columns["input_force_N"],
        "output_force_N": columns["output_force_N"],
    }
    path = folder_of(tmp_path, [mixed], cable=IN_RADIUS)
    found = load_dataset(path, channels=parse_channels(["input_torque=motor:-N*mm"])).measurements.table(Recordings)
    assert found is not None
    assert found.each[0].blocks.input_force.max() == pytest.approx(columns["input_force_N"].max(), abs=2.0)


@pytest.mark.parametrize(
    ("cable", "channels", "says"),
    [
        (OUT_RADIUS, [], r"gives input_torque, but the radius .* \[cable\] input_pulley_radius = "),
        (IN_RADIUS, [], r"gives output_torque, but the radius .* \[cable\] output_pulley_radius = "),
        (f"{IN_RADIUS}\n{OUT_RADIUS}", ["input_torque=time_s:N*m", "input_force=time_s:N"], "both input_force .* input_torque"),
        (f"{IN_RADIUS}\n{OUT_RADIUS}", ["input_torque=input_torque_N_m:N"], "does not measure a torque"),
    ],
)  # fmt: skip
def test_torques_that_cannot_be_read_are_refused(tmp_path, cable, channels, says):
    path = folder_of(tmp_path, [as_torques(recorded(seconds=3.0))], cable=cable)
    with pytest.raises(DatasetError, match=says):
        load_dataset(path, channels=parse_channels(channels))


def test_a_file_with_both_force_and_torque_is_refused(tmp_path):
    columns = recorded(seconds=3.0)
    path = folder_of(tmp_path, [columns | as_torques(columns)], cable=f"{IN_RADIUS}\n{OUT_RADIUS}")
    with pytest.raises(DatasetError, match=r"both input_force .* and input_torque .*say which is meant"):
        load_dataset(path)


def test_a_torque_of_a_single_rope_is_refused(tmp_path):
    path = folder_of(tmp_path, [as_torques(recorded(seconds=3.0))])
    text = (path / "cable.toml").read_text().replace('kind = "loop"', 'kind = "single"')
    (path / "cable.toml").write_text(text)
    with pytest.raises(DatasetError, match=r'named for a single rope.*kind = "loop"'):
        load_dataset(path, channels=parse_channels(["input_torque=input_torque_N_m:N*m"]))


def test_a_delay_is_not_estimated_but_a_stated_one_is_applied(tmp_path):
    columns = recorded(seconds=6.0, noise=0.1)
    late = columns | {
        "output_force_N": np.interp(columns["time_s"] - 0.05, columns["time_s"], columns["output_force_N"])
    }
    plain = load_dataset(folder_of(tmp_path, [late, recorded(seconds=6.0, seed=1)])).measurements
    assert plain.table(Recordings) is not None
    assert [r.account.delay for r in plain.table(Recordings).each] == [0.0, 0.0]
    assert sum("not estimated for a loop" in remark for remark in plain.remarks) == 1
    assert any('delay = { value = 10, unit = "ms" }' in remark for remark in plain.remarks)
    stated = 'recordings = { prepare = { delay = { value = 50, unit = "ms", sd = 2 } } }'
    found = load_dataset(folder_of(tmp_path, [late], more=f"[tables]\n{stated}"))
    assert found.measurements.table(Recordings) is not None
    strokes = found.measurements.table(Recordings).each[0].strokes
    assert strokes.exponent == pytest.approx(HALF_TURN, rel=0.02)
    assert "delay_error" in {p.name for p in build_model(found).space.free}
    assert not any("not estimated" in remark for remark in found.measurements.remarks)


# The likelihood ---------------------------------------------------------------------------------------------------


def test_the_slope_of_the_operator_is_its_derivative():
    generator = np.random.default_rng(0)
    force = jnp.asarray(np.cumsum(generator.standard_normal((400, 3)), axis=0) * 4)
    preload, exponent = jnp.array([5.0, 20.0, 0.0]), jnp.array([0.4, 0.2, 0.3])
    start, step = force[0], 1e-7
    drive, never = Loop(preload, exponent), jnp.full(force.shape, jnp.nan)
    y, slope = drive.follow(force, jnp.zeros(3), start)
    more, less = (drive.follow(force, jnp.full(3, s), start)[0] for s in (step, -step))
    same = np.isclose((more + less) / 2, y, atol=1e-9)
    assert same.mean() > 0.99
    np.testing.assert_allclose(np.asarray(slope)[same], np.asarray((more - less) / (2 * step))[same], atol=1e-5)
    anew = never.at[200].set(force[200] + 0.1)
    restarted, _ = drive.follow(force, jnp.zeros(3), start, anew)
    np.testing.assert_allclose(restarted[200], force[200] + 0.1)
    np.testing.assert_allclose(restarted[:200], y[:200])


def integrated(term, values) -> float:
    """Log likelihood of a term's only run with its mounting effect integrated by quadrature, the operator written out."""
    data = {name: np.asarray(array) for name, array in term.data.items()}
    weight, noise, preload = data["weight"][:, 0], values["sigma_block"], values["preload"]
    force, output = data["input_force"][:, 0], data["output_force"][:, 0]
    gain = math.exp(values.get("gain_error", 0.0))
    constant = (data["log_weights"][0] - data["n"][0] * np.log(2 * np.pi)) / 2 - data["n"][0] * np.log(noise)

    def log_joint(m):
        apart = output - output_of(force, preload, values["mu"] * math.pi + m, float(output[0]) * gain) / gain
        return constant - np.sum(weight * apart**2) / (2 * noise**2) + stats.norm.logpdf(m, 0, values["tau"])

    grid = np.linspace(-0.15, 0.15, 601)
    peak = float(grid[np.argmax([log_joint(m) for m in grid])])
    near = np.linspace(peak - 0.005, peak + 0.005, 201)
    heights = np.array([log_joint(m) for m in near])
    inside = near[heights > heights.max() - 40]
    low, high = (inside[0] - 1e-4, inside[-1] + 1e-4) if heights[0] < heights.max() - 40 else (peak - 0.06, peak + 0.06)
    area, _ = integrate.quad(
        lambda m: np.exp(log_joint(m) - heights.max()), low, high, epsabs=0, epsrel=1e-10, limit=200
    )
    return float(heights.max() + np.log(area))


def test_the_likelihood_is_that_with_the_mounting_integrated_out_where_the_loop_stays_taut(tmp_path):
    """Without input noise the contacts do not change with the mounting, and the output is linear in it."""
    time, force = motor("triangle", 25.0, 8.0)
    output = output_of(force, PRELOAD, HALF_TURN + 0.012)
    columns = {"time_s": time, "input_force_N": force, "output_force_N": output}
    columns["output_force_N"] = output + 0.3 * np.random.default_rng(1).standard_normal(len(time))
    term = term_of(folder_of(tmp_path, [columns]))
    for more in ({}, {"mu": 0.125}, {"preload": 20.7, "sigma_block": 0.07}, {"gain_error": 0.1}, {"tau": 0.005}):
        values = VALUES | more
        assert of_term(term, "log_likelihood", values)[0] == pytest.approx(integrated(term, values), abs=1e-6)


def test_the_likelihood_is_close_to_the_integrated_one_where_the_loop_goes_slack(tmp_path):
    """To first order about the effect that suits best, which leaves a few hundredths even where the values are far off."""
    term = term_of(folder_of(tmp_path, [recorded(amplitude=90.0, exponent=HALF_TURN + 0.02, seconds=8.0)]))
    for more in ({}, {"mu": 0.14}, {"preload": 21.0}, {"mu": 0.11, "sigma_block": 0.3}):
        values = VALUES | more
        assert of_term(term, "log_likelihood", values)[0] == pytest.approx(integrated(term, values), abs=0.02)


def test_residuals_vanish_at_the_truth_of_a_recording_without_noise(tmp_path):
    """With offsets and a gain error, which the term must undo as the load cells do them."""
    columns = recorded("triangle", 60.0, noise=0.0, seconds=3.0)
    truth = VALUES | {"input_offset": 0.8, "output_offset": -0.5, "gain_error": 0.02}
    columns["input_force_N"] = columns["input_force_N"] + 0.8
    columns["output_force_N"] = columns["output_force_N"] * math.exp(-0.02) - 0.5
    sensors = '[sensors]\ninput_gain_error_sd = 0\noutput_gain_error_sd = 0.02\noffset_sd = { value = 1, unit = "N" }'
    more = f'{sensors}\n[tables]\nrecordings = {{ prepare = {{ block = "none" }} }}'
    term = term_of(folder_of(tmp_path, [columns], more=more))
    assert np.abs(of_term(term, "residuals", truth)).max() < 1e-3
    for name in ("input_offset", "output_offset", "gain_error", "mu", "preload"):
        assert np.abs(of_term(term, "residuals", truth | {name: truth[name] * 1.2})).max() > 0.1, name


def test_an_error_of_the_delay_shifts_the_output(tmp_path):
    columns = recorded("triangle", 60.0, noise=0.0, seconds=3.0)
    time, output = columns["time_s"], columns["output_force_N"]
    more = '[tables]\nrecordings = { prepare = { block = "none" } }'
    term = term_of(folder_of(tmp_path, [columns | {"output_force_N": np.interp(time - 0.01, time, output)}], more=more))
    found = {
        late: np.mean(of_term(term, "residuals", VALUES | {"delay_error": late}) ** 2) for late in (-0.01, 0.0, 0.01)
    }
    assert found[0.01] < 0.05 * found[0.0] < 0.05 * found[-0.01]


def test_expected_loss_is_the_observed_one_and_mountings_scatter_it(tmp_path):
    term = term_of(
        folder_of(tmp_path, [recorded(noise=0.01, seconds=8.0), recorded(noise=0.01, seconds=4.0, amplitude=80.0)])
    )
    expected = of_term(term, "expected", VALUES)
    np.testing.assert_allclose(expected, term.observed(), rtol=3e-3)
    assert np.all(expected >= 2 * PRELOAD * HALF_TURN)
    more = of_term(term, "expected", VALUES | {"mu": MU + 1e-4 / math.pi})
    keys = jax.random.split(jax.random.key(0), 4000)
    named = {name: jnp.asarray(value) for name, value in VALUES.items()}
    draws = np.asarray(jax.jit(jax.vmap(term.simulate, in_axes=(None, None, 0)))(named, term.data, keys))
    np.testing.assert_allclose(draws.mean(axis=0), expected, atol=0.1)
    np.testing.assert_allclose(draws.std(axis=0), VALUES["tau"] * (more - expected) / 1e-4, rtol=0.05)


def test_a_likelihood_is_finite_where_the_loop_could_not_have_moved(tmp_path):
    nothing = {"tells_loss": np.array([False]), "tells_exponent": np.array([False])}
    term = term_of(folder_of(tmp_path, [recorded(amplitude=25.0, seconds=6.0)]))
    term = replace(term, data=term.data | nothing)
    named = {name: jnp.asarray(value) for name, value in (VALUES | {"mu": 3.0, "preload": 300.0}).items()}
    value, slope = jax.jit(jax.value_and_grad(lambda v, data: term.log_likelihood(v, data).sum()))(named, term.data)
    assert np.isfinite(value)
    assert all(np.isfinite(s) for s in slope.values())


def test_a_fit_without_preload_finds_the_friction(tmp_path):
    """The recording by itself does not tell the loss then, and the preload runs to its lower end."""
    fit = bf.fit(folder_of(tmp_path, [recorded(preload=0.0, seconds=6.0)]), mcmc=False)
    estimate = fit.least_squares.estimates["mu"]
    assert estimate.value == pytest.approx(MU, abs=3 * estimate.standard_error)
    assert estimate.standard_error < 0.07 * MU  # one mounting: what its prior says of tau, over half a turn


def test_long_recordings_are_joined_to_a_few_hundred_blocks(tmp_path):
    more = '[tables]\nrecordings = { prepare = { block = "none" } }'
    term = term_of(folder_of(tmp_path, [recorded(seconds=16.0, noise=0.02)], more=more))
    assert len(term.data["weight"]) < 1000
    assert np.argmax([of_term(term, "log_likelihood", VALUES | {"mu": mu})[0] for mu in (0.11, 0.12, 0.13)]) == 1


def test_blocks_at_the_end_of_a_load_cell_s_range_are_no_readings(tmp_path):
    columns = {n: np.clip(v, -60, 60) if n != "time_s" else v for n, v in recorded(amplitude=60.0, seconds=8.0).items()}
    more = '[tables]\nrecordings = { prepare = { limits = { low = -60, high = 60, unit = "N" } } }'
    term = term_of(folder_of(tmp_path, [columns], more=more))
    cut = np.abs(term.data["input_force"]) > 59.9
    assert cut.any()
    assert not term.data["weight"][cut].any()
    assert term.data["restart"].any()
    scores = [of_term(term, "log_likelihood", VALUES | {"mu": mu})[0] for mu in (0.11, 0.12, 0.13)]
    assert np.argmax(scores) == 1


# Fits -------------------------------------------------------------------------------------------------------------


def test_least_squares_recovers_friction_and_preload(several):
    fit = bf.fit(several, mcmc=False)
    for name, truth, relative in (("mu", MU, 0.03), ("preload", PRELOAD, 0.01)):
        estimate = fit.least_squares.estimates[name]
        assert estimate.standard_error < relative * truth, name
        assert abs(estimate.value - truth) < 2.5 * estimate.standard_error, name
    assert fit.least_squares.residual_sd["recorded_loss"] < 0.03
    measured = next(t for t in fit.model.terms if t.name == "recorded_loss").observed()
    np.testing.assert_allclose(fit.least_squares.readings["recorded_loss"], measured, rtol=0.08)


def test_least_squares_of_recordings_without_noise_is_exact(tmp_path):
    each = [recorded("triangle", 60.0, noise=0.0, seconds=8.0), recorded("sine", 90.0, noise=0.0, seconds=8.0)]
    fit = bf.fit(folder_of(tmp_path, each), mcmc=False)
    assert fit.least_squares.estimates["mu"].value == pytest.approx(MU, rel=1e-3)
    assert fit.least_squares.estimates["preload"].value == pytest.approx(PRELOAD, rel=1e-3)


def test_a_short_posterior_holds_the_truth(sampled):
    posterior = sampled.posterior
    for name, truth in (("mu", MU), ("preload", PRELOAD)):
        draws = posterior.values[name]
        assert abs(draws.mean() - truth) < 3 * draws.std(), name
    assert posterior.values["mu"].std() < 0.02
    assert posterior.values["preload"].std() < 1.0
    assert posterior.expected["recorded_loss"].shape[-1] == 2


def test_recordings_of_a_loop_come_back_from_a_saved_fit(sampled):
    measurements = sampled.dataset.measurements
    page = json.loads(json.dumps(_measurements_page(measurements), allow_nan=False))
    again = _measurements(page).table(Recordings)
    assert again.loop
    for one, other in zip(again.each, measurements.table(Recordings).each, strict=True):
        assert one.strokes.drag == other.strokes.drag
        np.testing.assert_equal(one.strokes.exponent, other.strokes.exponent)
        assert np.array_equal(one.blocks.output_force, other.blocks.output_force)
    assert np.isnan(again.each[0].strokes.exponent)


@pytest.mark.parametrize("follows", [False, True])
def test_recordings_are_fitted_together_with_a_loop_table(tmp_path, follows):
    """Also of a cable whose preload follows its stretch: then what the bent rope is preloaded to is lost with it."""
    stiffness, lengthening, bends = 50.0, 0.1 if follows else 0.0, (90, 180, 270)
    preloads = [PRELOAD + stiffness * lengthening * math.radians(bend) for bend in bends]
    each = [
        recorded(amplitude=90.0, exponent=MU * math.radians(bend), preload=preload, seconds=6.0, seed=i)
        for i, (bend, preload) in enumerate(zip(bends, preloads, strict=True))
    ]
    rows = ["input_force_N,output_force_N,bend_deg,stroke"]
    generator = np.random.default_rng(3)
    for force in (5.0, 20.0, 40.0, 60.0, 90.0):
        exponent = MU * math.pi
        output = min(force - 2 * preloads[1] * exponent, force * math.exp(-exponent))
        rows.append(
            f"{force + 0.2 * generator.standard_normal():.4f},{output + 0.2 * generator.standard_normal():.4f},180,pull"
        )
    (tmp_path / "loop.csv").write_text("\n".join(rows) + "\n")
    more = "[tables]\nrecordings = {}\nloop = { file = 'loop.csv' }"
    if follows:
        known = f"bedding_stretch.fixed = 1e-6\nstiffness.fixed = {stiffness}\nlengthening.fixed = {math.radians(lengthening)}"
        more = f"[preload]\nmodel = 'stretch'\n[prior]\n{known}\n{more}"
    fit = bf.fit(folder_of(tmp_path, each, angles=bends, more=more), mcmc=False)
    for name, truth in (("mu", MU), ("preload", PRELOAD)):
        estimate = fit.least_squares.estimates[name]
        assert estimate.value == pytest.approx(truth, abs=max(4 * estimate.standard_error, 0.003 * truth)), name
        assert estimate.standard_error < 0.02 * truth
    assert {"recorded_loss", "loop_output_force"} <= set(fit.least_squares.readings)


# Results ----------------------------------------------------------------------------------------------------------


def test_the_report_speaks_of_moving_forward_and_back(several):
    text = check_text(load_dataset(several))
    for words in ("forward", "between", "back", "loss", "2 x preload x exponent", "not estimated for a loop"):
        assert words in text
    for words in ("pulling", "switching", "sliding"):
        assert words not in text
    line = next(line for line in text.splitlines() if line.strip().startswith("r1 "))
    assert line.split()[-1] == "-"
    assert line.split()[-2] == "N"


def test_traces_follow_the_recorded_output(sampled):
    for trace in traces(sampled):
        assert np.median(np.abs(trace.fitted - trace.output_force)) < 0.2
        low, _, high = trace.predicted
        assert np.mean((trace.output_force > low - 0.5) & (trace.output_force < high + 0.5)) > 0.9
        assert trace.output_force.min() < -1
        assert trace.loop


def test_traces_show_what_load_cells_with_known_errors_read(tmp_path):
    columns = recorded("triangle", 60.0, noise=0.0, seconds=6.0)
    columns["input_force_N"] = columns["input_force_N"] + 2.0
    columns["output_force_N"] = columns["output_force_N"] * math.exp(-0.05) - 1.5
    known = {"mu": MU, "preload": PRELOAD, "input_offset": 2.0, "output_offset": -1.5, "gain_error": 0.05}
    prior = "\n".join(f"{name}.fixed = {value}" for name, value in known.items() if name != "mu")
    more = f"[prior]\n{prior}\n[friction.mu]\nfixed = {MU}\n"
    sensors = '[sensors]\ninput_gain_error_sd = 0\noutput_gain_error_sd = 0.1\noffset_sd = { value = 1, unit = "N" }'
    fit = bf.fit(folder_of(tmp_path, [columns], more=f"{sensors}\n{more}[tables]\nrecordings = {{}}"), mcmc=False)
    trace = traces(fit)[0]
    assert len(trace.predicted) == 1
    assert np.abs(trace.predicted[0] - trace.output_force).max() < 0.3
    assert np.median(np.abs(trace.predicted[0] - trace.output_force)) < 0.02


def test_only_the_figures_that_make_sense_for_a_loop_are_drawn(sampled):
    shown = dict(figures_of(sampled))
    assert {"recordings", "autocorrelation"} <= set(shown)
    assert not set(shown) & {"hysteresis", "sample_efficiency", "dependence"}
    figure = FIGURES["recordings"].draw(shown["recordings"])
    words = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"Moving forward", "Moving back", "Between"} <= words
    assert not words & {"Pulling", "Returning"}


def test_points_of_a_loop_s_plane_are_gathered_by_wrap_angle(several):
    fit = bf.fit(several, mcmc=False)
    angle, force_in, force_out = loop_points(fit)
    np.testing.assert_allclose(np.rad2deg(np.unique(angle)), [90, 180, 270])
    assert set(loop_points(fit, contact=0)[0]) == set(angle)
    for of_one in np.unique(angle):
        here = angle == of_one
        assert here.sum() > 100
        exponent = MU * of_one
        widest = np.maximum(2 * PRELOAD * exponent, np.abs(force_in[here]) * (math.exp(exponent) - 1))
        assert np.all(np.abs(force_in[here] - force_out[here]) < widest * 1.1 + 1)
