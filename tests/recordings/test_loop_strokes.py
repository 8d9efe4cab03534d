"""What a recording of a pull-pull loop says by itself: its strokes, loss and exponent; and what it is refused for."""

import math
from dataclasses import replace

import numpy as np
import pytest
from loop_benches import HALF_TURN, PRELOAD, RATE, folder_of, motor, output_of, prepared, recorded, strokes_of

from bowdenfit.dataset import load_dataset
from bowdenfit.description import Phase
from bowdenfit.errors import DatasetError, DescriptionError
from bowdenfit.models import build_model
from bowdenfit.recordings.loop_strokes import LoopStrokes
from bowdenfit.recordings.recording import Recordings
from bowdenfit.recordings.strokes import find_strokes

SLACK_FROM = 2 * PRELOAD * HALF_TURN / (1 - math.exp(-HALF_TURN))


@pytest.mark.parametrize("shape", ["sine", "triangle"])
def test_loss_and_exponent_of_a_recording_without_noise_are_found(shape):
    strokes = strokes_of(recorded(shape, 60.0, noise=0.0))
    assert strokes.drag == pytest.approx(2 * PRELOAD * HALF_TURN, rel=2e-3)
    assert strokes.exponent == pytest.approx(HALF_TURN, rel=2e-3)
    assert strokes.center == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("amplitude", [20.0, 60.0, 120.0])
def test_phases_are_where_the_loop_moves(amplitude):
    columns = recorded(amplitude=amplitude, noise=0.3)
    blocks, _ = prepared(columns)
    strokes = find_strokes(blocks, "run.csv", "run", cable=LoopStrokes())
    time, force = motor("sine", amplitude)
    rate = np.interp(blocks.time, time, np.gradient(output_of(force, PRELOAD, HALF_TURN), time))
    assert strokes.used_sliding.any()
    assert np.all(np.sign(rate[strokes.used_sliding]) == strokes.stroke[strokes.used_sliding])
    assert strokes.noise < 0.3


def test_without_slack_a_recording_tells_the_loss_and_not_the_exponent():
    columns = recorded(amplitude=25.0)
    assert np.abs(columns["input_force_N"]).max() < SLACK_FROM
    strokes = strokes_of(columns)
    assert strokes.drag == pytest.approx(2 * PRELOAD * HALF_TURN, rel=0.01)
    assert np.isnan(strokes.exponent)
    assert any("does not go slack" in remark for remark in strokes.remarks)
    stated_strokes = strokes_of(columns, preload=PRELOAD)
    assert stated_strokes.exponent == pytest.approx(strokes.drag / (2 * PRELOAD))
    assert not any("does not go slack" in remark for remark in stated_strokes.remarks)


def test_without_preload_a_recording_tells_the_exponent_and_not_the_loss():
    strokes = strokes_of(recorded(preload=0.0))
    assert strokes.exponent == pytest.approx(HALF_TURN, rel=0.01)
    assert np.isnan(strokes.drag)


@pytest.mark.parametrize(("amplitude", "outcome"), [(60.0, True), (20.0, False)])
def test_either_sign_of_the_forces_is_right(amplitude, outcome):
    columns = recorded(amplitude=amplitude)
    strokes, turned = strokes_of(columns), strokes_of({n: v if n == "time_s" else -v for n, v in columns.items()})
    assert turned.drag == pytest.approx(strokes.drag, rel=1e-4)
    assert np.isfinite(strokes.exponent) == np.isfinite(turned.exponent) == outcome
    assert np.mean(turned.stroke == -strokes.stroke) > 0.99


def test_a_recording_of_one_direction_is_enough():
    time = np.arange(0, 8, 1 / RATE)
    force = 5 + 9 * time
    noise = 0.2 * np.random.default_rng(0).standard_normal((2, len(time)))
    columns = {
        "time_s": time,
        "input_force_N": force + noise[0],
        "output_force_N": output_of(force, PRELOAD, HALF_TURN) + noise[1],
    }
    strokes = strokes_of(columns)
    assert set(strokes.stroke[strokes.used_sliding]) == {1}
    assert strokes.drag == pytest.approx(2 * PRELOAD * HALF_TURN, rel=0.03)
    assert strokes.exponent == pytest.approx(HALF_TURN, rel=0.03)
    assert any("moves forward throughout" in remark for remark in strokes.remarks)


def test_load_cells_that_disagree_shift_the_center_and_not_the_loss():
    columns = recorded(amplitude=60.0)
    columns["output_force_N"] = columns["output_force_N"] - 5.0
    strokes = strokes_of(columns)
    assert strokes.center == pytest.approx(5.0, abs=0.1)
    assert strokes.drag == pytest.approx(2 * PRELOAD * HALF_TURN, rel=0.02)
    assert any("off the output force by +" in remark for remark in strokes.remarks)


def test_phases_set_by_hand_replace_those_found():
    columns = recorded()
    blocks, _ = prepared(columns)
    spans = (
        Phase(start=1.0, end=2.0, stroke="hold"),
        Phase(start=3.0, end=3.5, stroke="return"),
        Phase(start=5.0, end=5.5, stroke="pull"),
    )
    strokes = find_strokes(blocks, "run.csv", "run", spans, LoopStrokes())
    plain = find_strokes(blocks, "run.csv", "run", cable=LoopStrokes())
    inside = [(blocks.time >= s.start) & (blocks.time <= s.end) for s in spans]
    assert [set(strokes.stroke[part]) for part in inside] == [{0}, {-1}, {1}]
    assert not strokes.used_sliding[inside[0]].any()
    outside = ~np.any(inside, axis=0)
    assert np.array_equal(strokes.stroke[outside], plain.stroke[outside])
    assert strokes.by_hand


def test_the_motor_s_overtones_are_not_taken_for_noise():
    """The output has corners that a smooth input has not: blocks must stay short enough for them."""
    _, account = prepared(recorded(amplitude=120.0, noise=0.05, seconds=30.0))
    assert account.block < 0.05


def test_a_delay_is_not_estimated_but_a_stated_one_is_applied(tmp_path):
    columns = recorded(seconds=6.0, noise=0.1)
    late = columns | {
        "output_force_N": np.interp(columns["time_s"] - 0.05, columns["time_s"], columns["output_force_N"])
    }
    plain = load_dataset(folder_of(tmp_path, [late, recorded(seconds=6.0, seed=1)])).measurements
    assert plain.table(Recordings) is not None
    assert [r.account.delay for r in plain.table(Recordings).items] == [0.0, 0.0]
    assert sum("not estimated for a loop" in remark for remark in plain.remarks) == 1
    assert any('delay = { value = 10, unit = "ms" }' in remark for remark in plain.remarks)
    setting = 'recordings = { prepare = { delay = { value = 50, unit = "ms", sd = 2 } } }'
    dataset = load_dataset(folder_of(tmp_path, [late], more=f"[tables]\n{setting}"))
    assert dataset.measurements.table(Recordings) is not None
    strokes = dataset.measurements.table(Recordings).items[0].strokes
    assert strokes.exponent == pytest.approx(HALF_TURN, rel=0.02)
    assert "delay_error" in {p.name for p in build_model(dataset).space.free}
    assert not any("not estimated" in remark for remark in dataset.measurements.remarks)


# What is refused --------------------------------------------------------------------------------------------------


def test_swapped_channels_are_refused():
    for shape, amplitude in (("sine", 60.0), ("triangle", 25.0)):
        columns = recorded(shape, amplitude)
        swapped = columns | {"input_force_N": columns["output_force_N"], "output_force_N": columns["input_force_N"]}
        with pytest.raises(DatasetError, match="exchange the channels of input and output"):
            strokes_of(swapped)


def test_channels_that_count_opposite_directions_are_refused():
    columns = recorded()
    blocks, _ = prepared(columns | {"output_force_N": -columns["output_force_N"]})
    with pytest.raises(DatasetError, match="--channel 'output_force=load cell:-N'"):
        find_strokes(blocks, "run.csv", "run", (), LoopStrokes(None, ("motor", "load cell")))


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
