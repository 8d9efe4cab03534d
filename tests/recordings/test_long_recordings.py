"""Recordings of many samples: how much memory they take, and that working in pieces changes nothing."""

import os
import subprocess
import sys
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bowdenfit.description import Preparation
from bowdenfit.description.cable_parts import Pulleys
from bowdenfit.files import csv_recording, pieces, read_channels
from bowdenfit.recordings.forces import to_recording
from bowdenfit.recordings.preparation import prepare
from bowdenfit.recordings.preparation.blocks import main_frequency
from bowdenfit.recordings.preparation.clock import spread_repeated
from bowdenfit.recordings.recording import RawRecording
from bowdenfit.recordings.strokes import find_strokes

pytestmark = pytest.mark.extended

EXPONENT = 0.24


def cycles(samples, rate=1000.0, period=4.0, noise=0.2, seed=1):
    """A rope pulled and let go in equal cycles, written from its closed form: the output stands still while the force turns."""
    time = np.arange(samples) / rate
    phase = (time / period) % 1
    pulled = 20 + 60 * np.abs(2 * phase - 1)
    falling, rising = np.exp(EXPONENT) * pulled, np.exp(-EXPONENT) * pulled
    output = np.where(phase < 0.5, np.minimum(80 * np.exp(-EXPONENT), falling), np.maximum(20 * np.exp(EXPONENT), rising))
    noises = noise * np.random.default_rng(seed).standard_normal((2, samples))
    forces, velocity = (pulled + noises[0], output + noises[1]), np.where(phase < 0.5, -20.0, 20.0)
    return RawRecording("long", "long.csv", time, forces[0], time, forces[1], time, velocity)


def with_faults(raw):
    """The recording with spikes, missing and frozen samples, clipping, and a clock of the output that has gaps and is late."""
    output, n = raw.output_force.copy(), len(raw.output_force)
    output[np.arange(300, n, 517)] += 80
    output[(np.arange(n) % 311) < 4] -= 60  # four in a row are no spike
    output[900:930] = output[-3:] = np.nan
    output[2000:2200] = output[2000]
    mask = np.random.default_rng(0).random(n) > 0.2
    mask[5000:5100] = False
    moved = np.where(np.arange(n) % 701 == 5, np.nan, raw.velocity)
    times = np.floor(raw.input_time * 600) / 600
    changes = {"input_time": times, "input_force": np.minimum(raw.input_force, 76.0), "velocity": moved}
    raw = replace(raw, **changes)
    object.__setattr__(raw, "output_time", raw.output_time[mask] + 0.02)  # past the check that all arrays are equally long
    object.__setattr__(raw, "output_force", output[mask])
    return raw


ON = Preparation(delay="estimated")


@pytest.mark.parametrize("piece", [53, 997])
def test_working_in_pieces_changes_nothing(piece, monkeypatch):
    raw = with_faults(cycles(20_000))
    whole, account = prepare(raw, ON)
    monkeypatch.setattr(pieces, "PIECE", piece)
    parted, again = prepare(raw, ON)
    for name in ("time", "input_force", "output_force", "velocity", "samples", "saturated"):
        np.testing.assert_allclose(getattr(parted, name), getattr(whole, name), rtol=1e-12, err_msg=name)
    assert again.counts == account.counts and min(account.counts[kind] for kind in ("spike", "saturated", "dropout")) > 20
    assert again.noise == pytest.approx(account.noise)
    assert (again.delay, again.bandwidth) == pytest.approx((account.delay, account.bandwidth))
    assert again.flagged.kind == account.flagged.kind and again.remarks == account.remarks


def test_what_plenty_of_samples_tell_is_what_all_of_them_do(monkeypatch):
    whole, account = prepare(cycles(200_000), ON)
    monkeypatch.setattr(pieces, "PLENTY", 1 << 14)
    some, again = prepare(cycles(200_000), ON)
    assert again.noise == pytest.approx(account.noise, rel=0.02)
    assert again.delay == pytest.approx(account.delay, abs=account.delay_sd / 3)
    exponents = [find_strokes(blocks, "long.csv", "long").exponent for blocks in (whole, some)]
    assert exponents == pytest.approx([EXPONENT, EXPONENT], rel=0.01)


def memory_of(samples):
    """Most memory that the preparation takes beside the recording [bytes]."""
    raw = cycles(samples)
    raw.input_force[::1000] = np.nan
    tracemalloc.start()
    prepare(raw, ON)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most


def test_a_sample_more_takes_hardly_more_memory_than_it_is_kept_in():
    """It took 125 bytes beside the 32 of the recording itself, and takes 12; in a process where nothing checks types."""
    code = (
        "from bowdenfit.files import pieces; pieces.PIECE = pieces.PLENTY = 1 << 14; import test_long_recordings as t;"
        "print((t.memory_of(500_000) - t.memory_of(300_000)) / 200_000)"
    )
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    environment = os.environ | {"PYTHONPATH": path}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert float(done.stdout) < 25


def test_a_long_file_is_kept_in_half_the_bits_and_read_once(tmp_path, monkeypatch):
    raw, file = cycles(6000), tmp_path / "long.csv"
    columns = np.column_stack([raw.input_time, raw.input_force, raw.output_force, raw.velocity])
    np.savetxt(file, columns, "%.4f", ",", header="time_s,input_force_N,output_force_N,velocity_mm/s", comments="")

    def made():
        channels = read_channels(file)
        return to_recording(channels, "long", {}, Pulleys(), is_loop=False)[0], channels

    whole = made()[0]
    monkeypatch.setattr(csv_recording, "_MANY_ROWS", 1000)
    half, channels = made()
    assert [channel.values.dtype for channel in channels.channels] == [np.float64, np.float32, np.float32, np.float32]
    assert half.input_force is channels.channels[1].values and half.input_time is half.velocity_time
    assert read_channels(file) is channels
    file.write_text(file.read_text() + "6.0000,50.0000,40.0000,0.0000\n")
    assert len(read_channels(file).channels[0].values) == 6001
    first, other = (prepare(item, ON)[0] for item in (whole, half))
    np.testing.assert_allclose(other.input_force, first.input_force, rtol=1e-7)
    np.testing.assert_allclose(other.output_force, first.output_force, rtol=1e-7)


@pytest.mark.parametrize(("rate", "period"), [(250.0, 4.0), (5000.0, 8.0), (20_000.0, 2.0)])
def test_the_main_motion_is_found_at_any_rate(rate, period):
    """Looked for in 8192 samples, one of 20 s at 5 kHz was taken for one of 1.6 s, and long recordings of it were refused."""
    raw = cycles(round(40 * period * rate), rate, period)
    frequency = main_frequency(raw.input_force, raw.output_force, rate)
    assert frequency == pytest.approx(1 / period, rel=0.15)


def test_repeated_times_are_spread_in_pieces_as_in_one(monkeypatch):
    time = np.floor(np.arange(5000) / 7) / 10
    whole = spread_repeated(time)
    monkeypatch.setattr(pieces, "PIECE", 333)
    np.testing.assert_array_equal(spread_repeated(time), whole)
    np.testing.assert_allclose(np.diff(whole), 0.1 / 7, rtol=1e-6)
