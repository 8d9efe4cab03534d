"""Recordings that were once misread without a word: clocks, units, missing samples, and rows that were taken for remarks."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.files import read_channels
from bowdenfit.files.tables import read_csv


def test_a_ratio_of_two_symbols_is_no_clock():
    from bowdenfit.files.clocks import names_time

    assert not names_time("T/t")
    assert names_time("bench/Time") and names_time("t (s)")


def test_an_index_beside_a_tdms_file_is_not_believed(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    def write(path, *names):
        channels = [nptdms.ChannelObject("bench", name, np.arange(10.0) + 100 * (name == "in")) for name in names]
        with nptdms.TdmsWriter(path, index_file=True) as writer:
            writer.write_segment(channels)

    write(str(tmp_path / "b.tdms"), "out", "in")
    write(str(tmp_path / "a.tdms"), "in", "out")
    (tmp_path / "b.tdms_index").replace(tmp_path / "a.tdms_index")
    read = {channel.name: channel.values[0] for channel in read_channels(tmp_path / "a.tdms").channels}
    assert read == {"bench/in": 100.0, "bench/out": 0.0}


def recording(tmp_path, step, heading, missing=0):
    """A file of three strokes with one sample each `step` in the column of time."""
    force = 30 + 20 * np.sin(np.linspace(0, 6 * np.pi, 600))
    output = np.where(np.gradient(force) > 0, 0.7, 1.4) * force
    output[: 20 * missing : 20] = -9999
    rows = [f"{step * i:g},{force[i]:.3f},{output[i]:.3f}" for i in range(600)]
    (tmp_path / "log.csv").write_text("\n".join([f"{heading},input_force_N,output_force_N", *rows]) + "\n")
    return tmp_path / "log.csv"


def test_a_clock_in_milliseconds_without_a_unit_is_asked_about(tmp_path, run):
    path = recording(tmp_path, 20, "time")
    code, out, _ = run("check", path)
    assert code == 2 and "the clock 'time' does not state its unit" in " ".join(out.split())
    assert run("check", path, "--channel", "time=time:ms")[0] == 0
    assert run("check", recording(tmp_path, 0.02, "time"))[0] == 0


@pytest.mark.parametrize(("step", "start", "unit"), [(2.314815e-7, 46083.4951, "day"), (0.02 / 60, 0.0, "min")])
def test_a_clock_in_days_or_minutes_without_a_unit_is_asked_about(tmp_path, run, step, start, unit):
    path = clock_recording(tmp_path, [f"{start + i * step:.9f}" for i in range(600)], "Time")
    code, out, _ = run("check", path)
    words = " ".join(out.split())
    assert code == 2 and f"time=Time:{unit}" in words
    assert "does not state its unit; in seconds the recording would last" in words
    assert "a recording of 12 s" in " ".join(run("check", path, "--channel", f"time=Time:{unit}")[1].split())


def test_a_code_for_missing_samples_is_named(tmp_path, run):
    code, out, _ = run("check", recording(tmp_path, 0.02, "time_s", missing=12))
    assert code == 2 and "12 samples of output_force are exactly -9999 N" in " ".join(out.split())


def test_a_time_under_the_upper_of_two_rows_of_headings_is_kept(tmp_path, run):
    text = recording(tmp_path, 0.02, "time_s").read_text().splitlines()[1:]
    rows = [f"{line},{line.split(',', 1)[1]}" for line in text]
    head = ["Time (s),Run 1,,Run 2,", ",F_in (N),F_out (N),F_in (N),F_out (N)"]
    (tmp_path / "two.csv").write_text("\n".join([*head, *rows]) + "\n")
    _, out, _ = run("check", tmp_path / "two.csv")
    assert "a recording of 12 s" in " ".join(out.split())


def clock_recording(tmp_path, times, heading="time", forces="input_force_N,output_force_N"):
    """A file of three strokes with these times."""
    force = 30 + 20 * np.sin(np.linspace(0, 6 * np.pi, len(times)))
    output = np.where(np.gradient(force) > 0, 0.7, 1.4) * force
    rows = [f"{time},{first:.3f},{other:.3f}" for time, first, other in zip(times, force, output, strict=True)]
    (tmp_path / "log.csv").write_text("\n".join([f"{heading},{forces}", *rows]) + "\n", encoding="utf-8")
    return tmp_path / "log.csv"


def twelve_hours(second, form="{h:02d}:{m:02d}:{s:02d} {half}"):
    """A second of the day as a clock of twelve hours shows it."""
    h = second // 3600 % 24
    return form.format(h=h % 12 or 12, m=second // 60 % 60, s=second % 60, half="AM" if h < 12 else "PM")


@pytest.mark.parametrize(
    "form", ["{h:02d}:{m:02d}:{s:02d} {half}", "{h}:{m:02d}:{s:02d}.000\u202f{half}", "3/1/2024 {h}:{m:02d}:{s:02d} {half}",
             "2024-03-01 {h}:{m:02d}:{s:02d} {half}"],
)  # fmt: skip
@pytest.mark.parametrize("start", [43200 - 100, 46800 - 100])
def test_a_clock_of_twelve_hours_is_read(tmp_path, form, start):
    path = clock_recording(tmp_path, [twelve_hours(start + i, form) for i in range(200)])
    channel = next(channel for channel in read_channels(path).channels if channel.name == "input_force_N")
    assert np.array_equal(channel.time, np.arange(200.0))


def test_a_clock_of_twelve_hours_passes_midnight_with_small_letters_and_stops():
    from bowdenfit.files.clocks import parse_dates

    texts = ["11:59:59.250 p.m.", "11:59:59.750 P.M.", "12:00:00.250 am", "12:00:00,750am", ""]
    assert np.array_equal(parse_dates(texts, "log.csv")[0][:4], [0, 0.5, 1.0, 1.5])


def test_a_time_without_am_or_pm_among_others_is_refused(tmp_path, run):
    times = [twelve_hours(3600 + i) for i in range(200)]
    times[120] = times[120][:8]
    code, out, err = run("check", clock_recording(tmp_path, times))
    assert code == 2 and "lacks the AM or PM that others have" in " ".join((out + err).split())


FALLS = [
    ([f"{0.02 * (i % 300):.2f}" for i in range(600)], "two recordings in one file"),
    ([f"{12 - 0.02 * i:.2f}" for i in range(600)], "a file whose last sample comes first"),
    ([twelve_hours(46800 - 100 + i)[:8] for i in range(300)], "a 12-hour clock written without AM and PM"),
]


@pytest.mark.parametrize(("times", "cause"), FALLS)
@pytest.mark.parametrize("forces", ["input_force_N,output_force_N", "cell A,cell B"])
def test_a_clock_that_runs_backwards_is_said_by_check(tmp_path, run, times, cause, forces):
    code, out, err = run("check", clock_recording(tmp_path, times, "time", forces))
    words = " ".join((out + err).split())
    assert code == 2 and "runs backwards at sample" in words and cause in words


@pytest.mark.parametrize("heading", ["input_force_N,output_force_N", "cell A,cell B", "Sample,cell A,cell B"])
def test_a_recording_without_a_clock_is_asked_about(tmp_path, run, heading):
    force = 30 + 20 * np.sin(np.linspace(0, 6 * np.pi, 600))
    noise = np.random.default_rng(1).normal(0, 0.1, (600, 2))
    output = np.where(np.gradient(force) > 0, 0.7, 1.4) * force
    index = "{0}," if heading.startswith("Sample") else ""
    rows = [(index + "{1:.3f},{2:.3f}").format(i, force[i] + noise[i, 0], output[i] + noise[i, 1]) for i in range(600)]
    (tmp_path / "log.csv").write_text("\n".join([heading, *rows]) + "\n")
    code, out, _ = run("check", tmp_path / "log.csv")
    assert code == 2 and "To fit it as a table:" in out and "--channel time=1000Hz" in out
    if "cell A" in heading:
        assert "--channel input_force='cell A:N'" in out


def loop_forces(n=600):
    """Forces at both ends over three cycles."""
    force = 30 + 20 * np.sin(np.linspace(0, 6 * np.pi, n))
    noise = np.random.default_rng(1).normal(0, 0.1, (n, 2))
    return force + noise[:, 0], np.where(np.gradient(force) > 0, 0.7, 1.4) * force + noise[:, 1]


def log(tmp_path, heading, times, forces=None, below=()):
    """Write a recording."""
    force, output = forces or loop_forces(len(times))
    rows = [f"{t:g},{a:.3f},{b:.3f}" for t, a, b in zip(times, force, output, strict=True)]
    (tmp_path / "log.csv").write_text("\n".join([heading, *rows, *below]) + "\n", encoding="utf-8")
    return tmp_path / "log.csv"


@pytest.mark.parametrize(("name", "step"), [("millis", 20), ("ms", 20), ("micros", 20000), ("µs", 20000), ("Seconds", 0.02)])
def test_a_clock_may_be_called_by_its_unit(tmp_path, run, name, step):
    code, out, _ = run("check", log(tmp_path, f"{name},F_in (N),F_out (N)", step * np.arange(600)))
    assert code == 0 and "a recording of 12 s" in " ".join(out.split()), out


def test_the_command_for_a_clock_in_milliseconds_names_its_unit_and_works(tmp_path, run):
    times = np.sort(20 * np.arange(600) + np.random.default_rng(2).integers(-10, 11, 600))
    path = log(tmp_path, "time,F_in (N),F_out (N)", times)
    code, out, _ = run("check", path)
    assert code == 2 and "--channel time=time:ms" in out and "only" not in out
    assert "a recording of 12 s" in " ".join(run("check", path, "--channel", "time=time:ms")[1].split())


def test_a_second_heading_in_a_recording_is_named_as_one(tmp_path, run):
    below = ["time_s,cell A,cell B", "20,30,21", "20.02,31,22"]
    _, _, err = run("check", log(tmp_path, "time_s,F_in (N),F_out (N)", 0.02 * np.arange(600), below=below))
    assert "row 602: every column has words ('time_s cell A cell B'), as headings do, but not those at the top" in err
    _, _, err = run("check", log(tmp_path, "time_s,F_in (N),F_out (N)", 0.02 * np.arange(600), below=["20,bad,22", "21,30,22"]))
    assert "row 602, column 'F_in': 'bad' is not a number" in err


def test_tensions_of_a_pull_pull_pair_are_called_so(tmp_path, run):
    force, _ = loop_forces()
    path = log(tmp_path, "time_s,F_in (N),F_out (N)", 0.02 * np.arange(600), (force, 61 - force))
    _, out, _ = run("check", path)
    assert "the output falls where the input rises" in " ".join(out.split()) and "pull-pull pair" in " ".join(out.split())
    rows = "".join(f"{f},{80 - f}\n" for f in (20, 30, 40, 50, 60, 25, 35, 45))
    (tmp_path / "table.csv").write_text(f"input_force_N,output_force_N\n{rows}")
    with pytest.raises(bf.BowdenfitError, match="the two tensions of a pull-pull pair"):
        bf.read(tmp_path / "table.csv", wrap_angle="180deg")


def test_units_in_the_header_of_an_lvm_file_are_read(tmp_path):
    head = ["LabVIEW Measurement", "***End_of_Header***", "Channels\t2", "Y_Unit_Label\tNewton\tN", "***End_of_Header***"]
    force, output = loop_forces()
    rows = [f"{0.02 * i:.6f}\t{force[i]:.6f}\t{output[i]:.6f}\t" for i in range(600)]
    (tmp_path / "a.lvm").write_text("\n".join([*head, "X_Value\tF_in\tF_out\tComment", *rows]) + "\n")
    bf.read(tmp_path / "a.lvm", wrap_angle="180deg")
    assert [channel.unit for channel in read_channels(tmp_path / "a.lvm").channels] == ["", "Newton", "N"]


def test_a_description_of_recordings_alone_needs_no_tables(tmp_path):
    log(tmp_path, "time_s,F_in (N),F_out (N)", 0.02 * np.arange(600))
    (tmp_path / "cable.toml").write_text(
        'schema = 1\nname = "x"\n[[contact]]\nname = "sheath"\nfriction = "mu"\n'
        'wrap_angle = { value = 180, unit = "deg" }\n[[recording]]\nfile = "log.csv"\n'
    )
    assert len(bf.read(tmp_path).measurements.tables) == 1


def sampled(count, separator=","):
    return [separator.join((f"{0.02 * i:.2f}", f"{20 + i % 9}.5", f"{15 + i % 7}.25")) for i in range(count)]


@pytest.mark.parametrize("separator", [";", "\t", " "])
@pytest.mark.parametrize(("first", "second"), [(400, 200), (30, 600), (600, 1)])
def test_samples_behind_another_separator_are_no_statistics(tmp_path, separator, first, second):
    rows = ["time_s,input_force_N,output_force_N", *sampled(first), *sampled(second, separator)]
    (tmp_path / "log.csv").write_text("\n".join(rows) + "\n")
    with pytest.raises(bf.DatasetError, match="looks like a row of readings"):
        read_channels(tmp_path / "log.csv")


def test_statistics_and_remarks_in_recordings_are_left_out_as_before(tmp_path):
    rows = ["Bench 3; 1,2", "time_s,input_force_N,output_force_N", *sampled(100), "rope changed; 2 of 3 screws", *sampled(50)]
    (tmp_path / "log.csv").write_text("\n".join([*rows, "", "mean,21.5,17.3", "Measured on Monday"]) + "\n")
    assert {len(channel.values) for channel in read_channels(tmp_path / "log.csv").channels} == {150}


TWO_UNITS = [("N", "Output force (kgf)", "daN"), ("N", "Output force (N)", "lbf"), ("N", "Output force (N)", "mm")]


@pytest.mark.parametrize(("first", "heading", "below"), TWO_UNITS)
def test_a_unit_below_a_heading_that_contradicts_it_is_refused(tmp_path, first, heading, below):
    (tmp_path / "t.csv").write_text(f"Input force (N),{heading}\n{first},{below}\n10,1\n20,2\n30,3\n")
    rows = [f"{row}" for row in sampled(60)]
    (tmp_path / "log.csv").write_text("\n".join([f"time,Input force (N),{heading}", f"s,{first},{below}", *rows]) + "\n")
    for read, name in ((read_csv, "t.csv"), (read_channels, "log.csv")):
        with pytest.raises(bf.DatasetError, match=f"the row of units says {below} below it"):
            read(tmp_path / name)
