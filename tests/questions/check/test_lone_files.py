"""A file without a description: a table or a recording, why, and the one command that fits it as it stands."""

import shlex

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.file_kind import guess_file_kind
from bowdenfit.kinds.forces.table import ForceTable, count_loads
from bowdenfit.recordings.recording import Recordings

pytestmark = pytest.mark.extended

GENERATOR = np.random.default_rng(3)
LOADS = np.repeat([10.0, 20.0, 40.0, 60.0, 80.0, 100.0], 10)


def write(folder, headings, columns, name="file.csv"):
    texts = [[f"{cell:.5g}" if isinstance(cell, float) else str(cell) for cell in column] for column in columns]
    rows = (",".join(row) for row in zip(*texts, strict=True))
    (folder / name).write_text("\n".join([",".join(headings), *rows]) + "\n", encoding="utf-8")
    return folder / name


def trials(n=60, exponent=0.3):
    """Readings of trials in a shuffled order of loads, with the noise of a hand-held scale."""
    load = GENERATOR.permutation(np.resize(LOADS, n)) * (1 + 0.002 * GENERATOR.normal(size=n))
    return load * np.exp(exponent) + 0.05 * GENERATOR.normal(size=n), load


def recorded(seconds=12.0, rate=50.0, exponent=0.3):
    """Time and forces of a pull and a return, again and again."""
    time = np.arange(0, seconds, 1 / rate)
    force = 60 + 40 * np.sin(2 * np.pi * time / 4)
    output = np.empty_like(force)
    state = force[0] * np.exp(-exponent)
    for i, value in enumerate(force):
        state = min(max(state, value * np.exp(-exponent)), value * np.exp(exponent))
        output[i] = state
    return time, force + 0.1 * GENERATOR.normal(size=len(time)), output + 0.1 * GENERATOR.normal(size=len(time))


def command(text):
    """What `check` says to paste, over one line or several, as words."""
    lines = [line.strip() for line in text.replace("\\\n", " ").splitlines() if line.strip().startswith("bowdenfit fit ")]
    return [shlex.split(line)[1:] for line in lines]


def test_sixty_trials_are_a_table_at_six_loads_and_the_command_fits_them(run, tmp_path):
    path = write(tmp_path, ("Trial", "Force input (N)", "Force output (N)"), (range(1, 61), *trials()))
    code, out, _ = run("check", path)
    assert code == 0
    assert out.startswith("file.csv: a table of 60 readings at 6 loads, because it has no column of time.")
    (words,) = command(out)
    code, out, _ = run(*words, "--no-mcmc", "--no-figures", "--seed", 1, "--output", tmp_path / "fit")
    assert code in (0, 3)
    assert bf.load(tmp_path / "fit").least_squares.estimates["mu"].value == pytest.approx(0.3 / np.pi, rel=0.02)


def test_more_than_two_hundred_rows_do_not_make_a_recording(tmp_path):
    path = write(tmp_path, ("No.", "Fin (N)", "Fout (N)"), (range(500), *trials(500)))
    assert guess_file_kind(path).kind == "forces" and not guess_file_kind(path).other
    assert len(bf.read(path, wrap_angle=(180, "deg")).measurements.table(ForceTable).run) == 500


def test_an_index_is_no_clock(tmp_path):
    time, force, output = recorded()
    path = write(tmp_path, ("Index", "Fin (N)", "Fout (N)"), (range(len(time)), force, output))
    guess = guess_file_kind(path)
    assert (guess.kind, guess.other) == ("forces", "recordings")
    with pytest.raises(bf.DatasetError, match=r"could be a table of readings or a recording.*--channel time=1000Hz"):
        bf.read(path, wrap_angle=(180, "deg"))


def test_a_time_column_makes_a_recording(run, tmp_path):
    path = write(tmp_path, ("Zeit [s]", "Kraft Motor [N]", "Kraft Last [N]"), recorded())
    _, out, _ = run("check", path)
    assert out.startswith("file.csv: a recording of 11.9 s, because it has a column of time, 'Zeit [s]'")
    (words,) = command(out)
    assert bf.read(path, wrap_angle=(180, "deg")).measurements.table(Recordings) is not None
    assert run("check", *words[1:])[0] == 0


def test_tensions_called_t1_and_t2_are_no_clocks(tmp_path):
    path = write(tmp_path, ("T1 (N)", "T2 (N)"), trials())
    assert guess_file_kind(path).kind == "forces"
    time, force, output = recorded()
    path = write(tmp_path, ("t", "T1", "T2"), (time, force, output))
    (table,) = bf.read(path, wrap_angle=(180, "deg"), channels=["input_force=T1:N", "output_force=T2:N"]).measurements.tables
    assert table.items[0].account.samples == len(time)


@pytest.mark.parametrize(("step", "n"), [(30.0, 12), (5.0, 20)])
def test_few_rows_with_a_slow_clock_could_be_either_and_each_command_works(run, tmp_path, step, n):
    path = write(tmp_path, ("time (s)", "F_in (N)", "F_out (N)"), (step * np.arange(n), *trials(n)))
    _, out, _ = run("check", path)
    message = f"a table of readings or a recording; it has a column of time, 'time (s)', but only {n} rows"
    assert message in " ".join(out.split())
    of_table, of_recording = command(out)
    assert "--column" in of_table and "--channel" in of_recording
    assert run("check", *of_table[1:])[0] == 0
    code, _, err = run("fit", path, "--wrap-angle", "180deg")
    assert code == 2
    assert shlex.join(of_table[1:3]) in err.replace("'", "") or "bowdenfit fit" in err


def test_a_time_column_beside_runs_or_strokes_leaves_readings(tmp_path):
    path = write(tmp_path, ("time (s)", "run", "F_in (N)", "F_out (N)"), (20.0 * np.arange(60), range(60), *trials()))
    guess = guess_file_kind(path)
    assert (guess.kind, guess.other) == ("forces", "")
    assert "run" in guess.why


@pytest.mark.parametrize("extra", ["direction", "run", "Efficiency (%)"])
def test_samples_of_a_fast_clock_are_not_taken_for_readings_whatever_stands_beside_them(tmp_path, extra):
    time, force, output = recorded()
    columns = ("time (s)", extra, "Cell A (N)", "Cell B (N)"), (time, 50.0 + 0 * time, force, output)
    assert guess_file_kind(write(tmp_path, *columns)).kind == "recordings"
    with pytest.raises(bf.DatasetError, match="could be a table of readings or a recording"):
        bf.read(write(tmp_path, *columns), wrap_angle=(180, "deg"))


def test_samples_without_a_clock_are_not_readings_because_they_have_a_direction_and_sorted_readings_are(tmp_path):
    _, force, output = recorded()
    path = write(tmp_path, ("direction", "F_in (N)", "F_out (N)"), (["pull"] * len(force), force, output))
    assert guess_file_kind(path).other == "recordings"
    force, load = trials(300)
    order = np.argsort(load)
    guess = guess_file_kind(write(tmp_path, ("F_in (N)", "F_out (N)"), (force[order], load[order])))
    assert (guess.kind, guess.other) == ("forces", "")


def test_a_stated_rate_makes_a_recording(tmp_path):
    time, force, output = recorded()
    path = write(tmp_path, ("F_in (N)", "F_out (N)"), (force, output))
    path.write_text("Sampling rate: 50 Hz\n" + path.read_text())
    assert guess_file_kind(path).kind == "recordings"


def test_rows_have_the_wrap_angles_of_their_column_and_no_other(tmp_path, run):
    angles = np.repeat([90.0, 180.0], 30)
    _, load = trials()
    force = load * np.exp(0.1 * np.deg2rad(angles))
    path = write(tmp_path, ("F_in (N)", "F_out (N)", "Wrap angle (deg)"), (force, load, angles))
    _, out, _ = run("check", path)
    assert command(out) == [["fit", str(path)]]
    fit = bf.fit(path, mcmc=False, seed=1)
    assert fit.least_squares.estimates["mu"].value == pytest.approx(0.1, rel=1e-3)
    with pytest.raises(bf.DatasetError, match="'Wrap angle \\(deg\\)', and --wrap-angle states one angle"):
        bf.read(path, wrap_angle=(180, "deg"))


def test_a_column_that_may_be_the_wrap_angle_is_proposed_and_not_taken(tmp_path, run):
    path = write(tmp_path, ("F_in (N)", "F_out (N)", "Angle (deg)"), (*trials(), np.repeat([90.0, 180.0], 30)))
    _, out, _ = run("check", path)
    assert command(out) == [["fit", str(path), "--column", "wrap_angle=Angle (deg)"]]
    with pytest.raises(bf.DescriptionError, match="--wrap-angle 180deg"):
        bf.read(path)


def test_forces_that_no_heading_tells_apart_are_proposed_by_their_size(tmp_path, run):
    force, load = trials()
    path = write(tmp_path, ("Force 1 (N)", "Force 2 (N)"), (load, force))
    _, out, _ = run("check", path)
    (words,) = command(out)
    assert words[-4:] == ["--column", "input_force=Force 2 (N)", "--column", "output_force=Force 1 (N)"]
    assert run("check", *words[1:])[0] == 0


@pytest.mark.parametrize(
    ("forces", "count"),
    [
        ([10.0, 10.0, 20.0, 20.0], 2),
        ([50.0, 50.1, 49.9, 50.2], 1),
        ([10.1, 9.9, 10.0, 99.0, 101.0, 100.0, 1000.0, 1010.0, 990.0], 3),
        (np.linspace(10, 100, 40).tolist(), None),
        ([12.0], 1),
    ],
)
def test_loads_are_counted_where_readings_fall_together(forces, count):
    assert count_loads(np.array(forces)) == count


def test_what_the_user_has_named_is_kept_and_the_other_end_found(tmp_path, run):
    force, load = trials()
    path = write(tmp_path, ("Cell A (N)", "Cell B (N)", "Cell C (N)"), (load, force, 2 * force))
    code, out, _ = run("check", path, "--column", "input_force=Cell B (N)")
    assert code == 2 and "no column output_force" in out
    assert "'Cell A (N)' is the output_force rather than 'Cell C (N)'" in " ".join(out.split())
    path = write(tmp_path, ("Cell A (N)", "Cell B (N)"), (load, force), "two.csv")
    _, out, _ = run("check", path, "--column", "input_force=Cell B (N)")
    (words,) = command(out)
    assert words[4:] == ["--column", "input_force=Cell B (N)", "--column", "output_force=Cell A (N)"]


@pytest.mark.parametrize(
    ("line", "angle"),
    [
        ("Wrap angle: 90 deg", "90deg"),
        ("Umschlingungswinkel [°]: 270", "270deg"),
        ("angle d'enroulement = 1,57 rad", "1.57rad"),
        ("Ángulo de abrazamiento;120;°", "120deg"),
        ("Radius: 25 mm, 90 readings", "180deg"),
        ("Wrap angle: 90 deg, then wrap angle: 180 deg", "180deg"),
    ],
)
def test_a_wrap_angle_that_stands_in_the_file_is_proposed(tmp_path, run, line, angle):
    path = write(tmp_path, ("F_in (N)", "F_out (N)"), trials())
    path.write_text(f"# {line}\n" + path.read_text(), encoding="utf-8")
    _, out, _ = run("check", path)
    assert command(out)[0][2:] == ["--wrap-angle", angle]
    with pytest.raises(bf.DescriptionError, match="give the angle"):
        bf.read(path)


def test_a_wrap_angle_in_the_name_of_a_file_is_proposed(tmp_path, run):
    path = write(tmp_path, ("F_in (N)", "F_out (N)"), trials(), "cable 3, 135 deg.csv")
    _, out, _ = run("check", path)
    assert command(out) == [["fit", str(path), "--wrap-angle", "135deg"]]
    assert "as its name says" in " ".join(out.split())


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--column", "force=F_in (N)"], "did you mean input_force"),
        (["--column", "input_force=F_in"], "no column 'F_in'"),
        (["--column", "input_force=F_in (N):mm"], "does not measure a force"),
        (["--friction", "nonsense"], "nonsense"),
        (["--set", "a.b=1"], "unknown key 'a'"),
    ],
)
def test_what_the_user_asks_of_a_lone_file_and_cannot_be_is_refused(tmp_path, refuse, options, says):
    assert says in refuse("check", write(tmp_path, ("F_in (N)", "F_out (N)"), trials()), *options)


def test_the_command_keeps_what_the_user_has_set(tmp_path, run):
    path = write(tmp_path, ("F_in (N)", "F_out (N)"), trials())
    _, out, _ = run("check", path, "--noise", "student", "--set", "friction.mu.fixed=0.1")
    assert command(out)[0][4:] == ["--set", "friction.mu.fixed=0.1", "--noise", "student"]


def test_one_force_and_a_position_are_a_table_of_their_own_with_or_without_a_clock(tmp_path, run):
    x = np.concatenate([np.linspace(1.0, 20.0, 20), np.linspace(19.0, 1.0, 19)])
    force = np.where(np.arange(len(x)) < 20, 0.8 * x, 0.4 * x)
    for head, clock in (("", ""), ("time_s,", "{:.1f},")):
        path = tmp_path / "tip.csv"
        rows = [f"{clock.format(0.1 * i)}{a:.2f},{b:.3f}" for i, (a, b) in enumerate(zip(x, force, strict=True))]
        path.write_text("\n".join([f"{head}Displacement [mm],Motor force (N)", *rows]) + "\n")
        code, out, _ = run("check", path)
        text = " ".join(out.split())
        assert code == 0
        assert "it has one force and a displacement" in text
        assert "taken for a spring whose stiffness is fitted" in text and "bowdenfit fit" in text
    path.write_text(path.read_text().replace("Motor force (N)", "Motor force (N)").replace("time_s", "output_force_N"))
    assert "one force and a displacement" not in run("check", path)[1]


def test_what_the_command_could_not_fit_ends_with_2_and_says_so(run, tmp_path):
    output, load = trials()
    more_out_than_in = write(tmp_path, ("Fin (N)", "Fout (N)"), (load, output), "swapped.csv")
    without_unit = write(tmp_path, ("Fin (N)", "Fout"), (load, output), "both.csv")
    above_one = write(tmp_path, ("cable_length_mm", "efficiency_percent"), ((440, 470), (77, 177)), "above.csv")
    both = ("does not state its unit", "are swapped")
    for path, message in ((more_out_than_in, ("are swapped",)), (without_unit, both), (above_one, ("is above 1",))):
        code, out, _ = run("check", path)
        assert code == 2 and "To fit it once that is corrected:" in out
        assert all(words in " ".join(out.split()) for words in message), out
        (words,) = command(out)
        assert run(*words, "--no-mcmc", "--output", tmp_path / "fit")[0] == 2


@pytest.mark.parametrize("rows", [1, 4])
def test_no_other_column_is_taken_for_a_force_whose_column_holds_words(run, tmp_path, rows):
    """The label of a run was."""
    path = tmp_path / "words.csv"
    path.write_text("run,input force [N],output force [N]\n" + "".join(f"{i},{50 + i},low\n" for i in range(rows)))
    code, out, _ = run("check", path)
    assert code == 2 and "'low' is not a number" in out
    assert "output_force=" not in out, out


def test_the_label_of_a_run_is_not_taken_for_a_force(run, tmp_path):
    path = tmp_path / "words.csv"
    path.write_text("run,in,out\n1,50,low\n2,60,high\n")
    code, out, _ = run("check", path)
    assert code == 2 and "No column is left that could be the output_force" in out, out


def test_what_the_command_names_ends_with_2_until_it_is_named(run, tmp_path):
    output, load = trials()
    code, out, _ = run("check", write(tmp_path, ("Fin (N)", "Fout"), (output, load)))
    assert code == 2 and "\nTo fit it:\n" in out


def test_a_recording_that_cannot_be_used_ends_with_2(run, tmp_path):
    time, force, output = recorded()
    path = write(tmp_path, ("Time (s)", "Fin (N)", "Fout (N)"), (time, force, np.full(len(time), 3.0)))
    code, out, _ = run("check", path)
    assert code == 2 and "To fit it once that is corrected:" in out, out


PLACEHOLDERS = ("NAME", "RATE")


@pytest.mark.parametrize(
    ("headings", "named"),
    [
        (("Sample", "Elapsed Time (s)", "Input (lb)", "Output (lb)"), ("Input:lbf", "Output:lbf")),
        (("Sample", "time (s)", "Cell A (N)", "Cell B (N)", "Cell C (N)"), ("Cell A", "Cell B")),
        (("Sample", "time (s)", "ai0", "ai1", "Temperature (degC)"), ("ai0:N", "ai1:N")),
    ],
)
def test_the_command_names_the_likeliest_columns_and_never_a_placeholder(run, tmp_path, headings, named):
    time, force, output = recorded()
    columns = (range(1, len(time) + 1), time, force, output, 0 * time + 21.5 + np.sin(time))[: len(headings)]
    code, out, _ = run("check", write(tmp_path, headings, columns))
    (words,) = command(out)
    assert words[-4:] == ["--channel", f"input_force={named[0]}", "--channel", f"output_force={named[1]}"]
    assert not any(placeholder in out for placeholder in PLACEHOLDERS)
    assert code == 2 and run("check", *words[1:])[0] == 0


def test_neither_a_counter_nor_noise_about_zero_is_proposed_as_a_force(run, tmp_path):
    time, force, output = recorded()
    headings = ("time (s)", "in.header.seq", "in.force.x", "in.force.z", "temperature", "out.force.z")
    columns = (time, range(412, 412 + len(time)), np.sin(7 * time) / 50, force, 0 * time + 21.5, output)
    _, out, _ = run("check", write(tmp_path, headings, columns))
    (words,) = command(out)
    assert words[-4:] == ["--channel", "input_force=in.force.z:N", "--channel", "output_force=out.force.z:N"]
    assert run("check", *words[1:])[0] == 0


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "s"), (1000.0, "ms")])
def test_columns_without_headings_are_named_by_place_and_one_that_rises_evenly_is_the_clock(run, tmp_path, scale, unit):
    time, force, output = recorded()
    path = write(tmp_path, ("0", "60", "58"), ((scale * time)[1:], force[1:], output[1:]), "log.csv")
    _, out, _ = run("check", path)
    assert f"time=column1:{unit}" in out and "input_force=column2:N" in out and "output_force=column3:N" in out, out
    assert not any(placeholder in out for placeholder in PLACEHOLDERS)
    assert run("check", *next(words for words in command(out) if "--channel" in words)[1:])[0] == 0


def test_without_a_column_that_could_be_a_force_there_is_no_command(run, tmp_path):
    path = write(tmp_path, ("time (s)", "Fin (N)"), recorded()[:2])
    code, out, _ = run("check", path)
    assert code == 2 and command(out) == [] and "No column is left that could be the output_force" in out


def test_readings_at_several_lengths_are_proposed_to_init_with_the_table_of_angles(run, tmp_path):
    lengths, load = np.repeat([300, 400, 500], 2), np.tile([20.0, 40.0], 3)
    headings = ("Länge [mm]", "Kraft Eingang [N]", "Kraft Ausgang [N]")
    forces = write(tmp_path, headings, (lengths, load, 0.7 * load), "forces.csv")
    code, out, _ = run("check", forces)
    assert code == 0 and "Its rows are at 3 lengths." in out
    assert f"bowdenfit init my-cable --from {tmp_path / 'angles.csv'} {forces}" in out
    angles = write(tmp_path, ("Länge [mm]", "Winkel [deg]"), ([300, 400, 500], [80, 100, 130]), "winkel.csv")
    for path in (forces, angles):
        assert f"bowdenfit init my-cable --from {angles} {forces}" in run("check", path)[1]
    columns = (lengths, 0 * lengths + 90, load, 0.7 * load)
    with_angles = write(tmp_path, ("Länge [mm]", "wrap_angle_deg", "Fin (N)", "Fout (N)"), columns)
    assert "bowdenfit init" not in run("check", with_angles)[1]
