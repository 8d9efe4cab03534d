"""Bad recordings through the command line: a sentence with a remedy, exit code 2, and nothing written."""

import json
import subprocess
import sys
import zipfile
from dataclasses import replace

import numpy as np
import pandas
import pytest
import scipy.io
from spoiled_input import replaced

from bowdenfit.dataset import load_dataset
from bowdenfit.errors import DatasetError
from bowdenfit.files import csv_recording
from bowdenfit.kinds import KINDS
from bowdenfit.questions.simulate.bench import (
    BenchFriction,
    BenchSettings,
    LoadCellFaults,
    MotorProfile,
    simulate_recording,
)
from bowdenfit.recordings.recording import PULL, RETURN, Recordings

pytestmark = pytest.mark.extended

NEWTONS_PER_POUND = 4.4482216152605
SWAP = ["--channel input_force=output_force_N --channel output_force=input_force_N", "swapped"]
TOML = """schema = 1
name = "bench"

[route]
variable = "cable_length"
unit = "mm"
range = [430, 530]

[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { curve = "gaussian", column = "angle" }

[tables]
angles = { file = "angles.csv" }
recordings = { likelihood = "whole" }

[[recording]]
file = "run.csv"
at = 470
"""
OF_TABLE = 'recordings = { likelihood = "whole" }'
ENTRY = '\n[[recording]]\nfile = "run.csv"\nat = 470\n'
GLOB = [(ENTRY, "")]


@pytest.fixture(scope="module")
def simulated():
    """One cycle with little noise, friction exponent 0.3."""
    noise = LoadCellFaults(input_noise=0.3, output_noise=0.3)
    profile, generator = MotorProfile(speed=1.0, cycles=1), np.random.default_rng(0)
    return simulate_recording(0.3, BenchFriction(), profile, BenchSettings(), noise, generator)


@pytest.fixture
def columns(simulated):
    """The channels of a good recording, by heading."""
    return {
        "time_s": simulated.time,
        "input_force_N": simulated.input_force,
        "output_force_N": simulated.output_force,
        "velocity_mm/s": simulated.velocity,
    }


def write(path, columns):
    pandas.DataFrame({name: pandas.Series(values) for name, values in columns.items()}).to_csv(
        path, index=False, float_format="%.4f"
    )
    return path


def renamed(columns, old, new):
    return {name.replace(old, new): values for name, values in columns.items()}


def exchanged(columns):
    forces = {"input_force_N": columns["output_force_N"], "output_force_N": columns["input_force_N"]}
    return {**columns, **forces}


def without_velocity(columns):
    return {name: values for name, values in columns.items() if "velocity" not in name}


def during(columns, simulated, stroke):
    """Only the samples from the first to the last of a stroke."""
    first, last = np.flatnonzero(simulated.stroke == stroke)[[0, -1]]
    return {name: values[first:last] for name, values in columns.items()}


def alone(path):
    return path, "--wrap-angle", "180deg"


def test_good_recordings_are_accepted(columns, accept, tmp_path):
    for channels in (columns, without_velocity(columns)):
        out = accept("check", *alone(write(tmp_path / "run.csv", channels)))
        assert "Recordings:" in out
        assert "Nothing is wrong" in out


def test_a_clock_that_runs_backwards_is_refused(columns, refuse, tmp_path):
    columns["time_s"] = np.where(np.arange(len(columns["time_s"])) < 300, columns["time_s"], columns["time_s"] - 2.0)
    message = refuse("check", *alone(write(tmp_path / "run.csv", columns)))
    for part in ("run.csv", "input_force", "backwards", "sample 301", "from 2.99 s to 1 s", "Split"):
        assert part in message


@pytest.mark.parametrize("name", ["input_force", "output_force"])
def test_a_constant_channel_is_refused(columns, refuse, tmp_path, name):
    columns[f"{name}_N"] = np.full(len(columns["time_s"]), 5.0)
    message = refuse("check", *alone(write(tmp_path / "run.csv", columns)))
    for part in ("run.csv", name, "5 N in every sample", "unplugged", "leave the recording out"):
        assert part in message


def test_a_channel_that_ends_early_counts_as_missing_from_there(columns, accept, tmp_path):
    columns["output_force_N"] = columns["output_force_N"][:-100]
    assert "no overlap" in accept("check", *alone(write(tmp_path / "run.csv", columns)))


def test_channels_and_clocks_of_different_length_are_refused(columns, refuse, tmp_path):
    path = tmp_path / "run.mat"
    clock, force_in, force_out, _ = columns.values()
    scipy.io.savemat(path, {"t": clock[:-7], "fin": force_in, "fout": force_out})
    channels = ["--channel", "input_force=fin:N", "--channel", "output_force=fout:N", "--channel", "time=t:s"]
    message = refuse("check", *alone(path), *channels)
    for part in ("run.mat", "'fin'", f"{len(clock)} samples", str(len(clock) - 7), "--channel time=1000Hz"):
        assert part in message


@pytest.mark.parametrize("verb", ["check", "fit"])
@pytest.mark.parametrize("velocity", [True, False])
@pytest.mark.parametrize("part", ["cycle", "pull"])
def test_swapped_channels_are_refused_with_the_way_to_swap_them(
    columns, simulated, refuse, tmp_path, velocity, part, verb
):
    columns = columns if velocity else without_velocity(columns)
    columns = during(columns, simulated, PULL) if part == "pull" else columns
    path = write(tmp_path / "run.csv", exchanged(columns))
    output = ["--output", tmp_path / "results"] if verb == "fit" else []
    message = refuse(verb, *alone(path), *output)
    for words in ("run.csv", *SWAP):
        assert words in message


def test_swapping_swapped_channels_is_accepted(columns, accept, tmp_path):
    path = write(tmp_path / "run.csv", exchanged(columns))
    channels = ["--channel", "input_force=output_force_N", "--channel", "output_force=input_force_N"]
    assert "Nothing is wrong" in accept("check", *alone(path), *channels)


def test_the_wrong_sign_is_refused_and_can_be_turned(columns, refuse, accept, tmp_path):
    columns["input_force_N"] = -columns["input_force_N"]
    path = write(tmp_path / "run.csv", columns)
    message = refuse("check", *alone(path))
    for part in ("run.csv", "input_force", "negative", "sign convention", "--channel input_force=input_force_N:-N"):
        assert part in message
    assert "0.30" in accept("check", *alone(path), "--channel", "input_force=input_force_N:-N")


def test_a_lone_pull_is_accepted_with_a_remark(columns, simulated, accept, tmp_path):
    path = write(tmp_path / "run.csv", during(columns, simulated, PULL))
    assert "run is pulling throughout" in accept("check", *alone(path))


@pytest.mark.parametrize("velocity", [True, False])
def test_a_lone_return_is_refused_unless_set_by_hand(columns, simulated, refuse, accept, tmp_path, velocity):
    columns = columns if velocity else without_velocity(columns)
    path = write(tmp_path / "run.csv", during(columns, simulated, RETURN))
    message = refuse("check", *alone(path))
    for part in ("run.csv", "return stroke alone", "cable.toml", 'stroke = "return"', *SWAP):
        assert part in message
    start, end = simulated.time[np.flatnonzero(simulated.stroke == RETURN)[[0, -1]]]
    describe(tmp_path, ("at = 470", f'at = 470\nstrokes = [{{ start = {start}, end = {end}, stroke = "return" }}]'))
    describe(tmp_path, ('"whole"', '"runs"'), text=(tmp_path / "cable.toml").read_text())
    assert "run is returning throughout" in accept("check", tmp_path)


def test_a_whole_recording_without_a_reversal_is_refused(columns, simulated, refuse, tmp_path):
    write(tmp_path / "run.csv", during(columns, simulated, PULL))
    describe(tmp_path)
    message = refuse("fit", tmp_path, "--output", tmp_path / "results")
    for part in ("run.csv", "no reversal", 'likelihood = "runs"'):
        assert part in message


HEADINGS = [
    ("input_force_N", "input_force", ["'input_force'", "does not state its unit", "--channel input_force=input_force:N"]),
    ("input_force_N", "input_force_mm", ["'input_force_mm'", "'mm'", "force", "lbf"]),
    ("input_force_N", "input_force_kg", ["'kg'", "kgf"]),
    ("input_force_N", "input_force [quux]", ["'quux'", "not known"]),
    ("time_s", "time_N", ["'time_N'", "'N'", "time", "ms"]),
    ("velocity_mm/s", "velocity_N", ["'velocity_N'", "'N'", "mm/s"]),
    ("output_force_N", "ai1", ["no channel output_force", "'ai1'", "--channel output_force=ai1:N", "cable.toml"]),
]


@pytest.mark.parametrize(("old", "new", "parts"), HEADINGS)
def test_a_heading_that_does_not_say_enough_is_refused(columns, refuse, tmp_path, old, new, parts):
    message = refuse("check", *alone(write(tmp_path / "run.csv", renamed(columns, old, new))))
    for part in ("run.csv", *parts):
        assert part in message, message


def test_two_channels_of_one_name_are_refused_until_one_is_chosen(columns, refuse, accept, tmp_path):
    path = write(tmp_path / "run.csv", {**columns, "Input force (N)": columns["input_force_N"] + 1})
    message = refuse("check", *alone(path))
    for part in ("run.csv", "'input_force_N', 'Input force'", "--channel input_force=input_force_N", "cable.toml"):
        assert part in message
    accept("check", *alone(path), "--channel", "input_force=input_force_N")


def test_a_copy_of_a_channel_is_refused(columns, refuse, tmp_path):
    columns["output_force_N"] = columns["input_force_N"]
    message = refuse("check", *alone(write(tmp_path / "run.csv", columns)))
    assert "copies of each other" in message
    assert "'output_force_N'" in message


CHANNELS = [
    (["input_force"], ["'input_force' is not of the form QUANTITY=CHANNEL:UNIT"]),
    (["input_force="], ["not of the form"]),
    (["=ai0:N"], ["not of the form"]),
    (["inputforce=input_force_N:N"], ["no quantity is called 'inputforce'", "did you mean 'input_force'?"]),
    (["temperature=x"], ["no quantity is called 'temperature'", "input_force, output_force, velocity, time"]),
    (["input_force=Input_Force_N"], ["run.csv", "no channel 'Input_Force_N'", "did you mean 'input_force_N'?"]),
    (["input_force=ai0:N"], ["no channel 'ai0'", "known here: time_s, input_force_N"]),
    (["input_force=input_force_N:mm"], ["run.csv", "'input_force_N'", "'mm'", "force"]),
    (["input_force=input_force_N:quux"], ["'quux'", "not known"]),
    (
        ["input_force=output_force_N"],
        ["run.csv", "the same channel ('output_force_N')", "--channel input_force=input_force_N."],
    ),
    (["input_force=input_force_N", "input_force=output_force_N"], ["input_force twice", "keep one"]),
    (["velocity=input_force_N"], ["'input_force_N'", "'N'", "mm/s"]),
    (["time=0Hz"], ["run.csv", "0Hz", "above 0", "time=1000Hz"]),
    (["time=-5 Hz"], ["-5 Hz", "above 0"]),
    (["time=1e999Hz"], ["1e999Hz", "not possible"]),
    (["time=1.2.3Hz"], ["no channel '1.2.3Hz'"]),
    (["time=5"], ["no channel '5'"]),
]


@pytest.mark.parametrize(("channels", "parts"), CHANNELS)
def test_a_wrong_channel_option_is_refused(columns, refuse, tmp_path, channels, parts):
    path = write(tmp_path / "run.csv", columns)
    message = refuse("check", *alone(path), *(word for c in channels for word in ("--channel", c)))
    for part in parts:
        assert part in message, message


def test_channels_of_a_data_set_without_recordings_are_refused(on_body, refuse):
    assert "has none" in refuse("check", on_body, "--channel", "input_force=a:N")


@pytest.mark.parametrize("angle", ["180", "180mm", "-180deg", "deg"])
def test_a_wrong_wrap_angle_is_refused(columns, refuse, tmp_path, angle):
    assert "--wrap-angle" in refuse("check", write(tmp_path / "run.csv", columns), f"--wrap-angle={angle}")


def test_a_recording_without_its_wrap_angle_is_not_fitted(columns, refuse, tmp_path):
    path = write(tmp_path / "run.csv", columns)
    assert "--wrap-angle 180deg" in refuse("fit", path, "--output", tmp_path / "results")


def content(kind, path, columns):
    """Bytes of a file as it should be."""
    if kind == ".mat":
        scipy.io.savemat(path, {"fin": columns["input_force_N"], "fout": columns["output_force_N"]})
    elif kind == ".parquet":
        pandas.DataFrame(columns).to_parquet(path)
    elif kind == ".zip":
        with zipfile.ZipFile(path, "w") as file:
            file.writestr("run.csv", "time_s,input_force_N\n")
    else:
        write(path, columns)
    data = path.read_bytes()
    path.unlink()
    return data


FILES = [
    # ending of the file, what is in it, how much of that, what the sentence must name
    (".mat", ".mat", 0.5, ["run.mat", "cut off or damaged", "copy it again"]),
    (".parquet", ".parquet", 0.5, ["run.parquet", "cut off or damaged", "copy it again"]),
    (".mat", ".csv", 1.0, ["run.mat"]),
    (".xlsx", ".csv", 1.0, ["run.xlsx", "is not a .xlsx file but text", "rename it to .csv"]),
    (".parquet", ".mat", 1.0, ["run.parquet", "is not a .parquet file but"]),
    (".csv", ".zip", 1.0, ["run.csv"]),
    (".csv", ".csv", 0.0, ["run.csv is empty"]),
    (".mat", ".csv", 0.0, ["run.mat is empty", "copy it again"]),
    ("", ".csv", 1.0, ["run has no ending", ".csv"]),
    (".foo", ".csv", 1.0, ["run.foo has the ending .foo", ".csv"]),
]


@pytest.mark.parametrize(("ending", "kind", "share", "parts"), FILES)
def test_a_file_that_is_no_recording_is_refused(columns, refuse, tmp_path, ending, kind, share, parts):
    data = content(kind, tmp_path / f"whole{kind}", columns)
    path = tmp_path / f"run{ending}"
    path.write_bytes(data[: int(len(data) * share)])
    for arguments in (("check",), ("fit", "--output", tmp_path / "results")):
        message = refuse(*arguments, *alone(path))
        for part in parts:
            assert part in message, message


def test_a_csv_cut_off_in_the_middle_is_read_up_to_there_and_says_so(columns, accept, tmp_path):
    path = write(tmp_path / "run.csv", columns)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4 + 3])
    assert "breaks off" in " ".join(accept("check", path).split())


def test_missing_files_and_folders_are_refused(refuse, tmp_path):
    for name in ("none.csv", "none.mat"):
        message = refuse("check", *alone(tmp_path / name))
        assert name in message
        assert "does not exist" in message
    assert "is a folder, not a recording" in refuse("check", *alone(tmp_path))


def test_a_file_that_is_too_large_is_refused(columns, refuse, tmp_path, monkeypatch):
    path = write(tmp_path / "run.csv", columns)
    monkeypatch.setattr(csv_recording, "LARGEST_BYTES", 1000)
    message = refuse("check", *alone(path))
    for part in ("run.csv", "more than", "Parquet", "cut it into runs"):
        assert part in message


def describe(folder, *changes, text=TOML):
    """Write a description in which something is replaced, and the table of angles."""
    (folder / "cable.toml").write_text(replaced(text, *changes))
    (folder / "angles.csv").write_text("cable_length_mm,angle_deg\n430,60\n450,70\n470,90\n500,110\n530,140\n550,150\n")


def test_the_description_that_is_spoiled_below_is_a_good_one(columns, accept, tmp_path):
    write(tmp_path / "run.csv", columns)
    describe(tmp_path)
    assert "Recordings:" in accept("check", tmp_path)


def with_key(text):
    return [("at = 470", f"at = 470\n{text}")]


DESCRIPTIONS = [
    ([("at = 470", "att = 470")], ["unknown key", "'recording.0.att'", "did you mean 'at'?"]),
    ([("likelihood", "likelyhood")], ["unknown key", "likelyhood", "did you mean 'likelihood'?"]),
    ([('"whole"', '"hole"')], ["tables.recordings.likelihood", "'runs' or 'whole'", "'hole'"]),
    (with_key('wrap_angles = { angel = { value = 9, unit = "deg" } }'), ["'run.csv'", "'angel'", "'angle'?"]),
    (with_key('wrap_angles = { angle = { value = 9, unit = "mm" } }'), ["'run.csv'", "wrap_angles, angle", "'mm'"]),
    (
        [
            *with_key('wrap_angles = { angle = { value = 9, unit = "deg" } }'),
            ('{ curve = "gaussian", column = "angle" }', '{ value = 90, unit = "deg" }'),
            ('angles = { file = "angles.csv" }\n', ""),
        ],
        ["'angle' is not a column", "give its contact wrap_angle = { column = 'angle' }"],
    ),
    ([("at = 470", "")], ["'run'", "at which cable_length", "at = 470", "pattern"]),
    (
        [('curve = "gaussian", ', ""), ('angles = { file = "angles.csv" }\n', "")],
        ["'run'", "'sheath'", "wrap_angles ="],
    ),
    (with_key('[[recording]]\nfile = "run.csv"'), ["both called 'run'", "another name"]),
    (GLOB, ["names no file", 'files = "recordings/*.csv"']),
    ([*GLOB, (OF_TABLE, 'recordings = { files = "r/*.csv" }')], ["no file", "'r/*.csv'", "cable.toml"]),
    (
        [*GLOB, (OF_TABLE, 'recordings = { files = "run.csv", pattern = "{at}mm" }')],
        ["run.csv does not follow the pattern '{at}mm'", "[[recording]]"],
    ),
    (
        [*GLOB, (OF_TABLE, 'recordings = { files = "run.csv", pattern = "{att}mm" }')],
        ["pattern", "'att' is unknown", "did you mean 'at'?"],
    ),
    (
        [*GLOB, (OF_TABLE, 'recordings = { files = "run.csv", pattern = "{at}_{at}" }')],
        ["pattern", "{at} twice", "keep one"],
    ),
    (
        [*GLOB, (OF_TABLE, 'recordings = { files = "run.csv", pattern = "{velocity:N}" }')],
        ["pattern, {velocity:N}", "'N'", "mm/s"],
    ),
    (
        [*GLOB, (OF_TABLE, 'recordings = { files = "run.csv", pattern = "{angle:mm}" }')],
        ["pattern, {angle:mm}", "'mm'", "deg"],
    ),
    (with_key('strokes = [{ start = 3, end = 1, stroke = "pull" }]'), ["strokes.0", "start before it ends"]),
    (with_key('strokes = [{ start = 1, end = 3, stroke = "push" }]'), ["strokes.0", "'pull', 'return'", "'push'"]),
    (with_key('strokes = [{ start = 90, end = 99, stroke = "pull" }]'), ["run.csv", "from 90 to 99 s", "goes from"]),
    (with_key('prepare = { tare = "interval", quiet = [2, 1] }'), ["prepare", "quiet must be [start, end]"]),
    (with_key('prepare = { tare = "interval" }'), ["prepare", "needs quiet = [start, end]"]),
    (with_key('prepare = { tare = "interval", quiet = [90, 99] }'), ["run.csv", "from 90 to 99 s", "inside"]),
    (with_key('prepare = { tare = "interval", quiet = [0.1, 2] }'), ["run.csv", "input_force moves", "no tare"]),
    (with_key('prepare = { delay = { value = 1, unit = "N" } }'), ["'run.csv'", "prepare, delay", "'N'", "time"]),
    (with_key('prepare = { delay = "guess" }'), ["prepare.delay", "'estimated'", "'guess'"]),
    (with_key('prepare = { limits = { low = 0, high = 9, unit = "mm" } }'), ["prepare, limits", "'mm'", "force"]),
    (
        with_key('prepare = { limits = { low = 9, high = 0, unit = "N" } }'),
        ["prepare, limits", "low = 9", "below high = 0"],
    ),
    (with_key('prepare = { block = { value = 1, unit = "mm" } }'), ["prepare, block", "'mm'", "time"]),
    (with_key('prepare = { block = { value = -1, unit = "s" } }'), ["prepare, block", "-1 s", 'block = "none"']),
    (with_key('prepare = { block = { value = 90, unit = "s" } }'), ["run.csv", "too few blocks", "shorter block"]),
    (with_key('velocity = { value = 20, unit = "N" }'), ["'run.csv'", "velocity", "'N'"]),
    (
        with_key('channels = { inputforce = { name = "x" } }'),
        ["channels", "'inputforce'", "did you mean 'input_force'?"],
    ),
    (with_key('channels = { input_force = { name = "x" } }'), ["run.csv", "no channel 'x'", "input_force_N"]),
    ([('"run.csv"', '"."')], ["is a folder, not a recording"]),
    ([('"run.csv"', '"none.csv"')], ["none.csv", "does not exist"]),
]


@pytest.mark.parametrize(("changes", "parts"), DESCRIPTIONS)
def test_a_spoiled_description_of_recordings_is_refused(columns, refuse, tmp_path, changes, parts):
    write(tmp_path / "run.csv", columns)
    describe(tmp_path, *changes)
    message = refuse("check", tmp_path)
    for part in parts:
        assert part in message, message


def test_velocities_of_the_rope_and_of_the_motor_do_not_mix(columns, refuse, tmp_path):
    write(tmp_path / "run.csv", columns)
    write(tmp_path / "motor.csv", renamed(columns, "mm/s", "rpm"))
    describe(tmp_path, *with_key('[[recording]]\nfile = "motor.csv"\nat = 500'))
    message = refuse("check", tmp_path)
    for part in ("run.csv and motor.csv", "rope", "motor", "mm/s or both in r/min"):
        assert part in message


@pytest.mark.parametrize(("index", "refused"), [(470, False), (550, False), (640, True)])
def test_a_recording_outside_the_curves_needs_a_row_of_angles(columns, tmp_path, index, refused):
    write(tmp_path / "run.csv", columns)
    describe(tmp_path)
    data = load_dataset(tmp_path)
    moved = replace(data.measurements.table(Recordings).items[0], route=float(index))
    recordings = replace(data.measurements.table(Recordings), items=(moved,))
    if not refused:
        KINDS["recordings"].check(recordings, data.description, data.measurements)
        return
    with pytest.raises(DatasetError, match=r"'run' was made at 640 mm, outside the range 430 to 530 mm"):
        KINDS["recordings"].check(recordings, data.description, data.measurements)


SINGLE = {
    ".csv": ["input_force=ai0:-lbf", "output_force=ai1:lbf", "time=100Hz"],
    ".mat": ["input_force=ai0:-lbf", "output_force=ai1:lbf", "time=clock:s"],
    ".parquet": ["input_force=ai0:-lbf", "output_force=ai1:lbf", "time=0.1kHz"],
}


@pytest.mark.parametrize("ending", SINGLE)
def test_a_single_recording_of_each_kind_is_checked_and_fitted(columns, accept, tmp_path, ending):
    path = tmp_path / f"run{ending}"
    channels = {
        "clock": columns["time_s"],
        "ai0": -columns["input_force_N"] / NEWTONS_PER_POUND,
        "ai1": columns["output_force_N"] / NEWTONS_PER_POUND,
    }
    if ending == ".mat":
        scipy.io.savemat(path, channels)
    elif ending == ".parquet":
        pandas.DataFrame(channels).to_parquet(path)
    else:
        write(path, channels)
    options = [*alone(path), *(word for c in SINGLE[ending] for word in ("--channel", c))]
    assert "Nothing is wrong" in accept("check", *options)
    results = tmp_path / "results"
    out = accept("fit", *options, "--no-mcmc", "--no-figures", "--seed", "1", "--output", results, "--json")
    assert (results / "fit.json").exists()
    mu = json.loads(out)["parameters"]["mu"]
    assert mu["least_squares"]["value"] == pytest.approx(0.3 / np.pi, rel=0.03)


def test_a_refusal_from_a_real_process_is_one_sentence(columns, tmp_path):
    path = write(tmp_path / "run.csv", exchanged(columns))
    done = subprocess.run(
        [sys.executable, "-m", "bowdenfit", "check", path, "--wrap-angle", "180deg"],
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("Error: run.csv: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("likelihood", ["runs", "whole"])
def test_a_run_of_which_nothing_can_be_used_is_refused(on_body, likelihood):
    """The blocks of one recording are all taken for flagged, as a wrong tare makes them."""
    import jax

    from bowdenfit.models import build_model

    folder = on_body.parent / "synthetic-recordings"
    data = load_dataset(folder, [f'tables.recordings.likelihood="{likelihood}"'])
    first, *remaining = data.measurements.table(Recordings).items
    blocks = replace(first.blocks, output_force=-np.abs(first.blocks.output_force))
    recordings = replace(data.measurements.table(Recordings), items=(replace(first, blocks=blocks), *remaining))
    bad = replace(data, measurements=data.measurements.with_tables(recordings))
    with jax.enable_x64(True), pytest.raises(DatasetError, match=r"nothing of the run .* can be used") as error:
        build_model(bad)
    assert first.file in str(error.value)
