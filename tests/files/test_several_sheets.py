"""Workbooks with several sheets: each is listed, and none is read without a word."""

import numpy as np
import pytest
from workbooks import write_workbook

import bowdenfit as bf
from bowdenfit.files import read_channels
from bowdenfit.files.tables import read_table

MU = 0.12
ANGLES = {300: 60, 340: 75, 380: 85, 420: 100, 460: 120, 500: 150}
RUNS = [(run, load) for run in (1, 2, 3) for load in (20.0, 40.0, 60.0)]


def angles():
    return [["Länge [mm]", "Winkel [deg]"], *map(list, ANGLES.items())]


def forces(lengths, seed=1):
    rng = np.random.default_rng(seed)
    rows = [["Länge [mm]", "Montage", "Kraft Eingang [N]", "Kraft Ausgang [N]"]]
    for length in lengths:
        for run, load in RUNS:
            loss = MU * np.deg2rad(ANGLES[length]) + 0.01 * run + rng.normal(0, 0.003)
            rows.append([length, run, round(load * np.exp(loss), 2), load])
    return rows


def recording(as_text=False, seed=2):
    rng, time = np.random.default_rng(seed), np.arange(600) / 50
    pull, band = 30 + 15 * np.sin(2 * np.pi * time / 4), np.exp(MU * np.pi)
    load = [pull[0] / band]
    for force in pull[1:]:
        load.append(min(max(load[-1], force / band), force * band))
    columns = (time, pull + rng.normal(0, 0.1, 600), np.array(load) + rng.normal(0, 0.1, 600))
    rows = np.column_stack(columns).tolist()
    cells = [[f"{value:.2f}".replace(".", ",") for value in row] for row in rows] if as_text else rows
    return [["Zeit (s)", "F_in (N)", "F_out (N)"], *cells]


def test_angles_and_forces_on_two_sheets_are_fitted_by_what_init_writes(run, tmp_path):
    path = write_workbook(tmp_path / "bench.xlsx", {"Winkel": angles(), "Kraft": forces(ANGLES), "Notizen": [["von Eva"]]})
    code, out, _ = run("check", path)
    assert code == 0 and "a workbook of 3 sheets" in out and f"bowdenfit init my-cable --from {path}" in out
    assert "wrap angles at 6 lengths" in out and "54 readings" in out and "--sheet Kraft" in out and "'Notizen'" in out
    code, out, err = run("init", tmp_path / "cable", "--from", path)
    assert code == 0, err
    assert "Sheet 'Notizen' of bench.xlsx is left out." in out + err
    data = bf.read(tmp_path / "cable")
    tables = data.description.tables.stated
    assert (tables["angles"].sheet, tables["forces"].sheet) == ("Winkel", "Kraft")
    fit = bf.fit(data, mcmc=False, seed=1)
    assert fit.least_squares.estimates["mu"].value == pytest.approx(MU, rel=0.15)


def test_of_several_sheets_that_can_be_fitted_none_is_read_until_one_is_stated(run, tmp_path):
    path = write_workbook(tmp_path / "bench.xlsx", {"Tag 1": forces([300]), "Tag 2": forces([500])})
    code, out, _ = run("check", path)
    assert code == 2 and "--sheet 'Tag 1'" in out and "--sheet 'Tag 2'" in out
    with pytest.raises(bf.DatasetError, match="sheets that can be fitted, 'Tag 1', 'Tag 2'; state which, such as --sheet"):
        bf.read(path, wrap_angle=(60, "deg"))
    for sheet, length in (("Tag 1", 300), ("Tag 2", 500)):
        fit = bf.fit(path, wrap_angle=(ANGLES[length], "deg"), sheet=sheet, mcmc=False, seed=1)
        assert fit.least_squares.estimates["mu"].value == pytest.approx(MU, rel=0.2)
    with pytest.raises(bf.DatasetError, match=r"bench\.xlsx has no sheet 'Tag2'; did you mean 'Tag 2'"):
        read_table(path, sheet="Tag2")


def test_forces_on_several_sheets_are_one_table_whose_mountings_stay_apart(run, tmp_path):
    sheets = {"Winkel": angles(), "Tag 1": forces([300, 340]), "Tag 2": forces([460, 500])}
    write_workbook(tmp_path / "bench_90deg.xlsx", sheets)
    code, _, err = run("init", tmp_path / "cable", "--from", tmp_path / "bench_90deg.xlsx")
    assert code == 0, err
    data = bf.read(tmp_path / "cable")
    assert data.description.tables.stated["forces"].sheet == ("Tag 1", "Tag 2")
    table = next(table for table in data.measurements.tables if hasattr(table, "run_names"))
    assert len(table.run_names) == 12 and {name.partition(":")[0] for name in table.run_names} == {"Tag 1", "Tag 2"}


def test_a_stated_sheet_is_read_alone_in_recordings_too(run, tmp_path):
    path = write_workbook(tmp_path / "bench.xlsx", {"Lauf 1": recording(), "Lauf 2": recording(seed=3)})
    assert run("check", path)[0] == 2
    assert [channel.name for channel in read_channels(path, "Lauf 2").channels] == ["Zeit", "F_in", "F_out"]
    (tmp_path / "cable.toml").write_text(
        'schema = 1\nname = "c"\n[[contact]]\nname = "a"\nfriction = "mu"\nwrap_angle = { value = 180, unit = "deg" }\n'
        + "".join(f'[[recording]]\nfile = "bench.xlsx"\nsheet = "Lauf {i}"\n' for i in (1, 2))
    )
    fit = bf.fit(tmp_path, mcmc=False, seed=1)
    assert fit.least_squares.estimates["mu"].value == pytest.approx(MU, abs=0.01)
    with pytest.raises(bf.DatasetError, match="is not a workbook and has no sheet 'Lauf 1'"):
        read_channels(write_text(tmp_path), "Lauf 1")


def write_text(folder):
    (folder / "log.csv").write_text("time (s),F_in (N)\n0,1\n1,2\n")
    return folder / "log.csv"


def test_decimals_that_are_stored_as_text_are_read_and_reported_and_thousands_are_not(tmp_path):
    file = read_channels(write_workbook(tmp_path / "text.xlsx", {"a": recording(as_text=True)}))
    assert file.channels[0].values[1] == 0.02
    assert "stored as text with a comma" in " ".join(file.remarks)
    rows = [["time (s)", "F_in (N)"], *([i, f"{1 + i},000"] for i in range(9))]
    with pytest.raises(bf.DatasetError, match="no sheet with columns of numbers"):
        read_channels(write_workbook(tmp_path / "thousands.xlsx", {"a": rows}))
