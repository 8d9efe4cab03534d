"""Refusals that name the likely cause: dead weights, counters that overflow; and zeros of a multiplexer, which are left out."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.errors import DatasetError
from bowdenfit.recordings.recording import Recordings

EXPONENT = 0.377
TIME = np.arange(0, 48, 0.02)


def write(path, load=60.0, *, weight=False, time=TIME, heading="time_s"):
    """A recording at 50 Hz of cycles of 8 s; of a dead weight the input follows the motor's direction."""
    going, level, output = np.interp(TIME % 8, [0, 4, 8], [0.2, 1.0, 0.2]) * load, 0.0, []
    for value in going:
        level = min(max(level, value * np.exp(-EXPONENT)), value * np.exp(EXPONENT))
        output.append(level)
    forces = np.stack([going, output])
    if weight:
        side = np.clip(10 * np.sin(2 * np.pi * TIME / 8), -1, 1)
        forces = load / 3 * np.stack([np.exp(EXPONENT * side), np.ones(len(TIME))])
    forces += np.random.default_rng(0).normal(0, 0.003 * load, forces.shape)
    return path, heading, time, forces


def save(path, heading, time, forces):
    table = np.column_stack([time, *forces])
    headings = f"{heading},input_force_N,output_force_N"
    np.savetxt(path, table, "%.7g" if heading == "time_s" else "%.10g", ",", header=headings, comments="")
    return path


def read(path):
    (recording,) = bf.read(path, wrap_angle="180deg").measurements.table(Recordings).items
    return recording


@pytest.mark.parametrize("load", [1.0, 60.0, 1e4])
def test_a_dead_weight_is_named_with_the_exponent_that_it_shows(tmp_path, load):
    with pytest.raises(DatasetError, match=r"dead weight at the output \(a friction exponent of about 0.3[78]\)"):
        read(save(*write(tmp_path / "r.csv", load, weight=True)))


def test_a_dead_load_cell_is_still_called_dead(tmp_path):
    path, heading, time, forces = write(tmp_path / "r.csv")
    forces[1] = np.random.default_rng(1).normal(5, 0.2, len(time))
    with pytest.raises(DatasetError, match="dead load cell"):
        read(save(path, heading, time, forces))


@pytest.mark.parametrize("load", [1.0, 60.0, 1e4])
@pytest.mark.parametrize("every", [5, 17])
def test_zeros_of_a_multiplexer_are_left_out_and_counted(tmp_path, load, every):
    path, heading, time, forces = write(tmp_path / "r.csv", load)
    forces[1, ::every] = 0.0
    recording = read(save(path, heading, time, forces))
    zeros = len(forces[1, ::every])
    assert zeros - 5 < recording.account.counts["dropout"] < 2 * zeros + 5  # a delay puts both channels between samples
    assert recording.strokes.exponent == pytest.approx(EXPONENT, rel=0.03)


@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize("reading", [0.0, 0.7, np.nan])
@pytest.mark.parametrize(("places", "samples"), [(60, 6), (5, 75)])
def test_dropouts_of_either_end_are_left_out_and_named(tmp_path, end, reading, places, samples):
    """They passed for a wrong gain, or for a delay of several periods."""
    path, heading, time, forces = write(tmp_path / "r.csv")
    starts = np.random.default_rng(places).integers(100, len(time) - 300, places)
    dropped = np.unique(starts[:, None] + np.arange(samples))
    forces[end, dropped] = reading
    recording = read(save(path, heading, time, forces))
    assert recording.account.counts["dropout"] >= len(dropped) and abs(recording.account.delay) < 0.05
    assert recording.strokes.exponent == pytest.approx(EXPONENT, rel=0.03)
    name = ("input_force", "output_force")[end]
    assert any(f"samples of {name} are missing" in r and f"(sample {dropped[0] + 1})" in r for r in recording.account.remarks)


@pytest.mark.parametrize("rate", [1, 5])
def test_a_healthy_recording_loses_no_sample(tmp_path, rate):
    """Nor does one that is slack, at 0 N, in each of its cycles, and is sampled slowly."""
    assert read(save(*write(tmp_path / "r.csv"))).account.counts["dropout"] == 0
    path, heading, time, forces = write(tmp_path / "slack.csv")
    slack = np.maximum(forces - 20.0, 0.0)[:, ::rate]
    assert read(save(path, heading, time[::rate], slack)).account.counts["dropout"] == 0


@pytest.mark.parametrize(("heading", "second", "words"), [("time_us", 1e6, "micros"), ("time_ms", 1e3, "millis")])
def test_a_counter_that_overflows_is_named_with_what_to_add(tmp_path, heading, second, words):
    time = np.round(TIME * second + 2**32 - 20 * second) % 2**32
    with pytest.raises(DatasetError, match=rf"{words}\(\), that overflows.* Add {2**32 / second:.10g} s"):
        read(save(*write(tmp_path / "r.csv", time=time, heading=heading)))


def test_two_recordings_in_one_file_are_still_named(tmp_path):
    time = np.where(TIME < 24, TIME, TIME - 24)
    with pytest.raises(DatasetError, match="two recordings in one file"):
        read(save(*write(tmp_path / "r.csv", time=time)))


def test_swapped_ends_are_named_with_the_channels_to_exchange(tmp_path):
    path, _, time, forces = write(tmp_path / "r.csv")
    np.savetxt(path, np.column_stack([time, *forces[::-1]]), "%.7g", ",", header="time_s,Motor (N),Load (N)", comments="")
    with pytest.raises(DatasetError, match="N above the input force") as refused:
        bf.read(path, wrap_angle="180deg", channels=["input_force=Motor", "output_force=Load"])
    assert "exchange them by --channel input_force=Load --channel output_force=Motor" in str(refused.value)
    right = bf.read(path, wrap_angle="180deg", channels=["input_force=Load", "output_force=Motor"])
    assert right.measurements.table(Recordings).items[0].strokes.exponent == pytest.approx(EXPONENT, rel=0.03)
