"""When the clock of a file starts: by dates, by Unix time, by what acquisition programs write beside the samples, or not."""

import datetime

import numpy as np
import pytest

from bowdenfit.files import read_channels

NOON = datetime.datetime(2026, 3, 2, 12, 0, tzinfo=datetime.UTC).timestamp()


def start(path):
    """When the time of the force is 0."""
    return next(channel for channel in read_channels(path).channels if "force" in channel.name).start


def csv(path, clock, heading):
    path.write_text("\n".join([f"{heading},input_force_N", *(f"{time},{20 + i}" for i, time in enumerate(clock))]) + "\n")
    return path


@pytest.mark.parametrize(
    ("heading", "first", "expected"),
    [
        ("timestamp", "2026-03-02 12:00:0{}.000", NOON),
        ("timestamp", "2026-03-02T13:00:0{}+01:00", NOON),
        ("timestamp", "02.03.2026 12:00:0{}", NOON),
        ("time", "12:00:0{}.5", 12 * 3600 + 0.5),
        ("time", "00:00:0{}.0", None),
        ("timestamp", f"{NOON:.0f}"[:-1] + "{}", NOON),
        ("timestamp_ms", f"{NOON:.0f}"[:-1] + "{}000", NOON),
        ("time_s", "{}", None),
    ],
)
def test_dates_unix_times_and_times_of_day_start_a_clock(tmp_path, heading, first, expected):
    clock_start = start(csv(tmp_path / "log.csv", [first.format(i) for i in range(9)], heading))
    assert clock_start == (expected if expected is None else pytest.approx(expected, abs=1e-6))


def test_files_of_acquisition_programs_say_when_they_start(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    pandas, force = pytest.importorskip("pandas"), np.arange(20.0)
    waveform = {"wf_increment": 0.1, "wf_start_offset": 0.0, "wf_start_time": np.datetime64("2026-03-02T12:00:00")}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([nptdms.ChannelObject("bench", "force", force, properties=waveform)])
    dates = pandas.date_range("2026-03-02 12:00", periods=20, freq="100ms")
    pandas.DataFrame({"time": dates, "force": force}).to_parquet(tmp_path / "a.parquet")
    assert start(tmp_path / "a.tdms") == pytest.approx(NOON)
    assert start(tmp_path / "a.parquet") == pytest.approx(NOON)


def test_a_measurement_file_of_a_vehicle_logger_says_when_it_starts(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    file = asammdf.MDF(version="4.10")
    file.header.start_time = datetime.datetime(2026, 3, 2, 12, 0, tzinfo=datetime.UTC)
    file.append([asammdf.Signal(np.arange(20.0), np.arange(20.0) / 10, name="force", unit="N")])
    file.save(tmp_path / "a.mf4")
    assert start(tmp_path / "a.mf4") == pytest.approx(NOON)
