"""Channels of one file that start at different moments are read at their own times; runs one after the other are not moved."""

import h5py
import numpy as np
import pytest

from bowdenfit.files.channels import Channel, align_starts
from bowdenfit.files.formats import read_channels

MOMENT = 1.8e9  # Unix time [s]


def channel(name, start, seconds=10.0):
    time = np.arange(0.0, seconds, 0.1)
    return Channel(name, "N", np.sin(time), time, "wf_increment", start)


def test_a_channel_that_starts_later_counts_from_the_first_start():
    (first, second), apart = align_starts([channel("input", MOMENT + 1.5), channel("output", MOMENT)])
    assert apart == pytest.approx(1.5)
    assert (first.time[0], second.time[0]) == pytest.approx((1.5, 0.0))
    assert first.start == second.start == MOMENT


def test_runs_one_after_the_other_keep_their_times():
    runs = [channel("run 1", MOMENT), channel("run 2", MOMENT + 60.0)]
    aligned, apart = align_starts(runs)
    assert apart == 0.0 and aligned == runs


def test_channels_without_a_date_keep_their_times():
    undated = [channel("input", None), channel("output", MOMENT)]
    assert align_starts(undated) == (undated, 0.0)


def test_starts_of_a_tdms_file_are_used(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    path, dates = tmp_path / "starts.tdms", np.array([MOMENT, MOMENT + 1.5]) * 1e6
    with nptdms.TdmsWriter(str(path)) as file:
        file.write_segment(
            [
                nptdms.ChannelObject(
                    "bench", name, np.arange(100.0),
                    {"wf_increment": 0.1, "wf_start_offset": 0.0, "wf_start_time": date.astype("datetime64[us]")},
                )
                for name, date in zip(("input", "output"), dates.astype(np.int64), strict=True)
            ]
        )  # fmt: skip
    read = read_channels(path)
    assert [channel.time[0] for channel in read.channels] == pytest.approx([0.0, 1.5])
    assert any("start up to 1.5 s apart" in remark for remark in read.remarks)


def two_channels(path, **late):
    """An HDF5 file of two channels with their own intervals, and attributes of the second."""
    with h5py.File(path, "w") as file:
        for name, attributes in (("input", {}), ("output", late)):
            dataset = file.create_dataset(name, data=np.arange(100.0))
            dataset.attrs["dt"] = 0.1
            dataset.attrs["t0"] = 0.0
            dataset.attrs.update(attributes)
    return read_channels(path)


def test_the_start_that_a_channel_of_an_hdf5_file_states_is_used(tmp_path):
    read = two_channels(tmp_path / "late.h5", t0=1.1)
    assert [channel.time[0] for channel in read.channels] == pytest.approx([0.0, 1.1])
    assert any("start up to 1.1 s apart" in remark for remark in read.remarks)


def test_equal_starts_change_nothing(tmp_path):
    read = two_channels(tmp_path / "together.h5")
    assert [channel.time[0] for channel in read.channels] == [0.0, 0.0]
    assert not any("apart" in remark for remark in read.remarks)


def test_dates_of_starts_are_used_in_any_unit(tmp_path):
    path = tmp_path / "dated.h5"
    with h5py.File(path, "w") as file:
        for name, start in (("input", "2026-03-02T10:15:32.000Z"), ("output", 1772446533500)):
            dataset = file.create_dataset(name, data=np.arange(100.0))
            dataset.attrs["dt"], dataset.attrs["start_time"] = 0.1, start
    assert [channel.time[0] for channel in read_channels(path).channels] == pytest.approx([0.0, 1.5])
