"""Layouts that programs of laboratories export, each beside a twin that must be read, or refused, as before."""

import numpy as np
import openpyxl
import pytest
import scipy.io

import bowdenfit as bf
from bowdenfit.files import read_channels
from bowdenfit.files.tables import read_table

pytestmark = pytest.mark.extended

TIME = np.arange(0, 16, 0.02)
INPUT = 40 + 20 * np.sin(2 * np.pi * TIME / 8)
OUTPUT = np.empty_like(INPUT)
state = INPUT[0] / 1.4
for row, force in enumerate(INPUT):
    OUTPUT[row] = state = min(max(state, force / 1.4), force * 1.4)
ROWS = list(zip(TIME.tolist(), INPUT.tolist(), OUTPUT.tolist(), strict=True))
EXPONENT = pytest.approx(np.log(1.4), rel=0.02)


def write(folder, text, name="log.csv", encoding="utf-8"):
    (folder / name).write_bytes(text.encode(encoding))
    return folder / name


def exponent(path, **options):
    """The friction exponent that a recording shows by itself."""
    return bf.read(path, wrap_angle="180deg", **options).measurements.tables[0].items[0].strokes.exponent


def test_a_row_of_units_with_sec_names_no_columns(tmp_path):
    head = "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A\n\nData Acquisition: Cyclic\t\t\t\tTime:\t3.21\tSec\t5/11/2023 2:02:33 PM\n\n"
    names, body = "Time\tInput Force\tOutput Force\n", "".join(f"{t:.4f}\t{a:.4f}\t{b:.4f}\n" for t, a, b in ROWS)
    for units in ("Sec\tN\tN\n", "s\tN\tN\n"):
        path = write(tmp_path, head + names + units + body, "log.txt")
        assert [(c.name, c.unit) for c in read_channels(path).channels][1:] == [("Input Force", "N"), ("Output Force", "N")]
        assert exponent(path) == EXPONENT


def test_marks_of_missing_samples_in_other_languages_are_no_words(tmp_path):
    marks = ("n.a.", "k.A.", "#NV", "#WERT!", "NaN", "-")
    body = [f"{t:.2f},{a:.3f},{marks[i // 50 % 6] if i % 50 == 7 else f'{b:.3f}'}" for i, (t, a, b) in enumerate(ROWS)]
    path = write(tmp_path, "\n".join(["time_s,F_in_N,F_out_N", *body]) + "\n")
    assert int(np.isnan(read_channels(path).channels[2].values).sum()) == len(ROWS) // 50
    assert exponent(path) == EXPONENT
    with pytest.raises(bf.DatasetError, match="row 9, column 'F_out_N': 'bad' is not a number"):
        read_channels(write(tmp_path, "\n".join(["time_s,F_in_N,F_out_N", *body]).replace("n.a.", "bad", 1)))


def test_channels_of_two_rates_without_an_offset_have_their_own_times(tmp_path):
    nptdms = pytest.importorskip("nptdms")

    def save(name, **extra):
        forces = {"F_in": (INPUT, 0.02), "F_out": (OUTPUT[::4].copy(), 0.08)}
        channels = [
            nptdms.ChannelObject("Bench", title, values, {"wf_increment": step, "unit_string": "N", **extra})
            for title, (values, step) in forces.items()
        ]
        with nptdms.TdmsWriter(str(tmp_path / name)) as writer:
            writer.write_segment(channels)
        return tmp_path / name

    assert exponent(save("without.tdms")) == exponent(save("with.tdms", wf_start_offset=0.0)) == pytest.approx(0.336, rel=0.06)
    assert read_channels(save("late.tdms", wf_start_offset=1.5)).channels[0].time[0] == 1.5


def test_a_time_inside_a_structure_is_offered_as_no_force(tmp_path, run):
    scipy.io.savemat(tmp_path / "run.mat", {"data": {"t": TIME, "Fin": INPUT, "Fout": OUTPUT}})
    _, out, _ = run("check", tmp_path / "run.mat")
    assert "--channel input_force=data.Fin:N" in out and "--channel output_force=data.Fout:N" in out
    scipy.io.savemat(tmp_path / "run.mat", {"data": {"a": INPUT, "Fout": OUTPUT}})  # no clock: every channel may be a force
    assert "input_force=data.a:N" in run("check", tmp_path / "run.mat")[1]


def test_two_clocks_side_by_side_of_which_one_ends_earlier_time_their_own_channels(tmp_path):
    later = ROWS[::2]
    rows = [f"{t:.2f},{a:.3f}," + (f"{later[i][0]:.2f},{later[i][2]:.3f}" if i < len(later) else ",")
            for i, (t, a, _) in enumerate(ROWS)]  # fmt: skip
    path = write(tmp_path, "\n".join(["t_in (s),F_in (N),t_out (s),F_out (N)", *rows]) + "\n")
    assert [c.clock for c in read_channels(path).channels] == ["", "t_in", "", "t_out"]
    assert exponent(path) == EXPONENT


def test_the_rate_alone_below_the_name_of_a_block_is_that_of_vicon(tmp_path):
    rows = "".join(f"{i},0,{a:.3f},{b:.3f}\n" for i, (_, a, b) in enumerate(ROWS))
    body = "Frame,Sub Frame,Force in,Force out\n,,N,N\n" + rows
    file = read_channels(write(tmp_path, "Devices\n50\n" + body))
    assert "50 samples a second" in " ".join(file.remarks)
    for other in ("Subject\n50\n", "50\n", "Devices\nA-50\n"):
        assert read_channels(write(tmp_path, other + body)).channels[2].time is None


def test_boot_lines_with_commas_over_numbers_are_no_headings(tmp_path, run):
    body = "".join(f"{1000 * t:.0f},{a:.2f},{b:.2f}\n" for t, a, b in ROWS)
    path = write(tmp_path, "HX711 init... ok\nTaring, remove weights\nready\n" + body, "log.txt")
    assert [c.name for c in read_channels(path).channels] == ["column1", "column2", "column3"]
    code, out, _ = run("check", path)
    assert code == 2 and "--channel time=column1:ms" in out
    named = read_channels(write(tmp_path, "ready\nmillis,F_in,F_out\n" + body, "log.txt"))
    assert [c.name for c in named.channels] == ["millis", "F_in", "F_out"]
    with pytest.raises(bf.DatasetError, match="3 cells where"):  # headings right over the data, too few
        read_channels(write(tmp_path, "millis,F_in\n" + body, "log.txt"))


def test_a_label_alone_between_headings_and_data_is_no_sample(tmp_path):
    head = '"trace_names","Model Root/Time","Model Root/ADC/F_in","Model Root/ADC/F_out"\n"units","s","N","N"\n'
    body = "".join(f'"",{t:.3f},{a:.4f},{b:.4f}\n' for t, a, b in ROWS)
    file = read_channels(write(tmp_path, '"type","RAW"\n' + head + '"trace_values"\n' + body))
    assert [len(channel.values) for channel in file.channels] == [len(ROWS)] * 3
    assert exponent(file.path) == EXPONENT
    missing = read_channels(write(tmp_path, "time_s,F_in_N,F_out_N\n0.00,NaN,NaN\n" + body.replace('"",', "")))
    assert len(missing.channels[0].values) == len(ROWS) + 1  # a first sample without forces is one


MERGED = ("Wrap angle [deg]", "Force [N]", ""), ("", "input", "output")


def save_blocks(folder, upper, lower):
    """A workbook of three rows at each angle, which is merged, with their mean and standard deviation below them."""
    book = openpyxl.Workbook()
    rows = [("Sheath B",), upper, lower]
    for angle in (90, 180, 270):
        loads = [(30.0 * np.exp(0.12 * np.radians(angle)) + i, 30.0 + i) for i in range(3)]
        rows += [(angle if i == 0 else None, *pair) for i, pair in enumerate(loads)]
        rows += [("Mean", *np.mean(loads, axis=0).tolist()), ("SD", 1.0, 1.0)]
    for line in rows:
        book.active.append(line)
    book.save(folder / "blocks.xlsx")
    return folder / "blocks.xlsx"


def test_merged_headings_that_complete_each_other_are_joined_and_statistics_of_blocks_left_out(tmp_path):
    table = read_table(save_blocks(tmp_path, *MERGED))
    assert table.header == ("Wrap angle [deg]", "Force [N] input", "Force [N] output")
    (forces,) = bf.read(tmp_path / "blocks.xlsx").measurements.tables
    np.testing.assert_allclose(np.degrees(np.nansum(forces.own.angle, axis=1)), np.repeat([90, 180, 270], 3))
    text = "Operator,LK,\n,Fin (N),Fout (N)\n1,20,14\n2,40,28\n3,60,42\n"
    assert read_table(write(tmp_path, text)).header == ("", "Fin (N)", "Fout (N)")  # words over a column of numbers are none


def test_names_over_units_in_brackets_and_the_ends_are_joined_and_merged_angles_proposed(tmp_path, run):
    path = save_blocks(tmp_path, ("Angle", "Forces", ""), ("[deg]", "in [N]", "out [N]"))
    assert read_table(path).header == ("Angle [deg]", "Forces in [N]", "Forces out [N]")
    code, out, _ = run("check", path)
    assert code == 2 and "--column wrap_angle='Angle [deg]'" in out
    (forces,) = bf.read(path, columns=["wrap_angle=Angle [deg]"]).measurements.tables
    np.testing.assert_allclose(np.degrees(np.nansum(forces.own.angle, axis=1)), np.repeat([90, 180, 270], 3))
    untouched = "Bench B,,\nangle [deg],Fin [N],Fout [N]\n90,30,24\n180,30,20\n"
    assert read_table(write(tmp_path, untouched)).header == ("angle [deg]", "Fin [N]", "Fout [N]")


def test_headings_of_a_table_may_be_the_last_comment_over_it(tmp_path):
    body = "".join(f"  {angle:6.1f}  {30 * np.exp(0.12 * np.radians(angle)):8.3f}  30.000\n" for angle in (90, 180, 270, 360))
    table = read_table(write(tmp_path, "# sheath: PTFE\n# angle[deg]   Fin[N]   Fout[N]\n" + body, "log.dat"))
    assert table.header == ("angle[deg]", "Fin[N]", "Fout[N]")
    assert (len(table.rows), table.account.headings, table.account.accounted) == (4, (2,), 6)
    with pytest.raises(bf.DatasetError, match="it holds numbers only"):
        read_table(write(tmp_path, "# sheath: PTFE\n" + body, "log.dat"))


def test_a_hanging_mass_is_the_output_beside_a_pulling_force_and_a_unit_may_follow_a_line(tmp_path, run):
    rows = "".join(f"{angle},{19.62 * np.exp(0.12 * np.radians(angle)):.2f},2000\n" for angle in (90, 180, 270))
    code, out, _ = run("check", write(tmp_path, "angle (deg),pull force (N),hanging mass (g)\n" + rows))
    assert code == 2 and "--column output_force='hanging mass (g):gf'" in out and "are swapped" not in out
    body = "".join(f"{t:.2f};{a:.3f};{b:.3f}\n".replace(".", ",") for t, a, b in ROWS)
    for names in ("Zeit / s;Eingangskraft / N;Ausgangskraft / N\n", "Zeit / s;Bench/F_in [N];Bench/F_out [N]\n"):
        assert exponent(write(tmp_path, names + body)) == EXPONENT


def as_text(number, mark):
    return f"{number:.3f}".replace(".", mark)


@pytest.mark.parametrize(
    ("time", "mark", "separator", "scale", "outcome"),
    [
        ("0,01", ".", ";", 0.1, "may mean 4000 or 4.000, because elsewhere the file has '0,0"),
        ("0.01", ",", "\t", 0.1, "may mean 4000 or 4.000, because elsewhere the file has '0.0"),
        ("10", ".", ";", 0.1, "if these are thousands"),  # nothing in the file says which
        ("10", ".", ";", 0.03, ""),  # the output falls below 1, so that these are decimals
        ("0.01", ".", ";", 0.1, ""),
        ("0,01", ",", ";", 0.1, ""),
        ("10", ".", ",", 0.1, ""),
    ],
)
def test_three_decimals_in_every_sample_are_asked_about_as_in_tables(tmp_path, run, time, mark, separator, scale, outcome):
    step, digits = float(time.replace(",", ".")), 2 if time != "10" else 0
    clock = [f"{step * i:.{digits}f}".replace(".", time[1]) for i in range(1, 1 + len(ROWS))]
    body = [separator.join((clock[i], as_text(scale * a, mark), as_text(scale * b, mark))) for i, (_, a, b) in enumerate(ROWS)]
    heading = separator.join(("time (ms)" if digits == 0 else "time (s)", "F_in (N)", "F_out (N)"))
    path = write(tmp_path, "\n".join([heading, *body]) + "\n")
    if "because" in outcome:
        with pytest.raises(bf.DatasetError, match=outcome.replace(".", r"\.")):
            read_channels(path)
        return
    remarks = " ".join(read_channels(path).remarks)
    assert ("if these are thousands" in remarks) == bool(outcome)
    if outcome:
        fit = bf.fit(path, wrap_angle="180deg", mcmc=False)
        assert "if these are thousands" in " ".join(str(fit.summary()).split())
        assert fit.verdict().trusted


def test_thousands_are_asked_about_before_the_wrap_angle_is_known(tmp_path, run):
    text = "Winkel [Grad];Eingangskraft [N];Ausgangskraft [N]\n90;2.920;2.626\n180;3.920;2.626\n270;4.920;2.627\n"
    code, out, _ = run("check", write(tmp_path, text))
    assert code == 2 and "if these are thousands" in " ".join(out.split())
    assert "these are thousands" not in run("check", write(tmp_path, text.replace("2.626", "2.63")))[1]


def test_counts_of_a_converter_are_no_newtons_and_volts_are_told_their_gain(tmp_path):
    def counts(scale):
        rows = [f"{1000 * t:.0f},{scale * a + 1000:.0f},{scale * b - 1000:.0f}" for t, a, b in ROWS]
        return write(tmp_path, "\n".join(["millis,raw_in,raw_out", *rows]) + "\n")

    named = ["input_force=raw_in:N", "output_force=raw_out:N"]
    with pytest.raises(bf.DatasetError, match=r"channel 'raw_in': whole numbers up to 60\d{4} are the counts.* gain = "):
        exponent(counts(10_000), channels=named)
    exponent(counts(1000), channels=named)  # of 60 kN: counts or newtons
    path = counts(10_000)
    (tmp_path / "cable.toml").write_text(
        'schema = 1\nname = "counts"\n[[contact]]\nname = "cable"\nfriction = "mu"\n'
        'wrap_angle = { value = 180, unit = "deg" }\n[tables.recordings]\nfiles = "log.csv"\n[tables.recordings.channels]\n'
        'input_force = { name = "raw_in", gain = 1e-4, offset = 1000, unit = "N" }\n'
        'output_force = { name = "raw_out", gain = 1e-4, offset = -1000, unit = "N" }\n'
    )
    assert bf.read(path.parent).measurements.tables[0].items[0].strokes.exponent == EXPONENT
    volts = write(tmp_path, "Time (s),Input force (V),Output force (V)\n0,1,1\n0.1,2,1\n")
    with pytest.raises(bf.DatasetError, match=r"does not measure a force; use one such as N.* gain = "):
        exponent(volts)
