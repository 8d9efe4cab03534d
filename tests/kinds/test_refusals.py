"""Bad input: one sentence that names the place and the remedy, exit code 2, and nothing written."""

import sys
from pathlib import Path

import pytest
from spoiled_input import copied, spoil

from bowdenfit import cli
from bowdenfit.dataset import read_dataset
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.tables import Measurements


@pytest.fixture
def dataset(on_body, tmp_path):
    """A copy of the on-body data set to spoil."""
    folder = copied(on_body, ("cable.toml", "angles.csv", "efficiencies.csv"), tmp_path / "cable")
    (folder / "forces.csv").write_text(
        "cable_length_mm,run,stroke,input_force_N,output_force_N\n440,1,pull,50,38\n470,2,return,50,62\n"
    )
    return folder


FORCES = ('efficiencies = { file = "efficiencies.csv" }', 'forces = { files = "forces.csv" }')
TABLES = [
    # file, what is replaced, by what, what the sentence must name
    (
        "efficiencies.csv",
        "440,77",
        "440,seventy",
        ["efficiencies.csv", "row 3", "efficiency_percent", "seventy", "plain number"],
    ),
    ("efficiencies.csv", "440,77", "440,NaN", ["row 3", "not a finite number"]),
    ("efficiencies.csv", "440,77", "440,inf", ["row 3", "not a finite number"]),
    ("efficiencies.csv", "440,77", "440,", ["row 3", "blank"]),
    ("efficiencies.csv", "440,77", "440,-77", ["row 3", "not possible"]),
    ("efficiencies.csv", "440,77", "440,177", ["row 3", "above 1"]),
    ("efficiencies.csv", "efficiency_percent", "efficiency", ["row 3", "above 1", "efficiency_percent"]),
    ("efficiencies.csv", "efficiency_percent", "score", ["no column efficiency", "columns ="]),
    ("efficiencies.csv", "efficiency_percent", "cable_length_mm", ["cable_length_mm", "twice"]),
    ("efficiencies.csv", "cable_length_mm", "cable_length", ["cable_length", "unit"]),
    ("efficiencies.csv", "cable_length_mm", "cable_length_N", ["cable_length", "N"]),
    ("efficiencies.csv", "550,67.8", "560,67.8", ["efficiencies.csv, row 6", "560", "outside", "measure"]),
    ("efficiencies.csv", "440,77", "440,77,5", ["row 3", "3 cells", "decimal comma"]),
    ("angles.csv", "430,58,<10", "430,58,-10", ["angles.csv", "row 3", "free_sheath_angle_deg", "negative"]),
    ("angles.csv", "430,58,<10", "430,2058,<10", ["row 3", "squeezed_sheath_angle_deg", "2000 deg"]),
    ("angles.csv", "free_sheath_angle_deg", "free_sheath_angle_N", ["free_sheath_angle_N", "angle"]),
    ("angles.csv", "free_sheath_angle_deg", "free_sheath_angle", ["free_sheath_angle", "unit"]),
    ("angles.csv", "free_sheath_angle_deg", "other_deg", ["no column free_sheath_angle"]),
    ("angles.csv", "free_sheath_angle_deg", "free_sheath_angle [blob]", ["blob"]),
]


@pytest.mark.parametrize(("file", "old", "new", "names"), TABLES)
def test_a_spoiled_table_is_refused_by_name(dataset, refuse, file, old, new, names):
    spoil(dataset / file, old, new)
    message = refuse("check", dataset)
    for name in names:
        assert name in message, message


@pytest.mark.parametrize(
    ("old", "new", "names"),
    [
        ("440,1,pull,50,38", "440,1,pull,-50,38", ["forces.csv", "row 2", "input_force_N", "-50", "not positive"]),
        ("440,1,pull,50,38", "440,1,pull,50,0", ["row 2", "output_force_N", "not positive"]),
        ("440,1,pull,50,38", "440,1,push,50,38", ["row 2", "stroke", "push", "pull"]),
        ("input_force_N", "input_force_kg", ["input_force", "kgf"]),
        ("input_force_N", "input_force_mm", ["input_force", "force"]),
        ("440,1,pull,50,38", "640,1,pull,50,38", ["row 2", "640", "outside"]),
    ],
)
def test_spoiled_forces_are_refused_by_name(dataset, refuse, old, new, names):
    spoil(dataset / "cable.toml", *FORCES)
    spoil(dataset / "forces.csv", old, new)
    message = refuse("check", dataset)
    for name in names:
        assert name in message, message


DESCRIPTIONS = [
    ('name = "On', 'nam = "On', ["unknown key 'nam'", "name"]),
    ("range = [430", "rang = [430", ["unknown key 'route.rang'", "range"]),
    ('curve = "gaussian"', 'curv = "gaussian"', ["unknown key", "curv"]),
    ("range = [430, 530]", "range = [530, 430]", ["range"]),
    ("value = 45", "value = -45", ["wrap_angle"]),
    ("value = 45", "value = 4500", ["2000 deg"]),
    ('unit = "deg" }\n\n[tables]', 'unit = "mm" }\n\n[tables]', ["bracket edge", "angle"]),
    ('file = "angles.csv"', 'file = "angle.csv"', ["angle.csv", "does not exist"]),
    ('column = "free_sheath_angle"', 'column = "upper_angle"', ["upper_angle", "no column"]),
    (
        'curve = "gaussian", column = "free_sheath_angle", published_range = [450, 530]',
        'column = "edge_angle"',
        ["edge_angle"],
    ),
    ("schema = 1", "schema = 2", ["schema", "update"]),
    ("schema = 1", "schema = = 1", ["not valid TOML", "line 1"]),
]


EVERYWHERE = ("rang = [430", 'curv = "gaussian"')  # two contacts have them


@pytest.mark.parametrize(("old", "new", "names"), DESCRIPTIONS)
def test_a_spoiled_description_is_refused_by_key(dataset, refuse, old, new, names):
    spoil(dataset / "cable.toml", old, new)
    message = refuse("check", dataset, faults=2 if new in EVERYWHERE else 1)
    for name in names:
        assert name in message, message


@pytest.mark.parametrize(
    "content",
    [b"", b"\n\n", b"# only a remark\n", b"cable_length_mm,efficiency_percent\n", b"\x00\x01\x02", b"PK\x03\x04"],
)
def test_an_empty_or_foreign_file_is_refused(dataset, refuse, content):
    (dataset / "efficiencies.csv").write_bytes(content)
    assert "efficiencies.csv" in refuse("check", dataset)


def test_a_missing_file_is_refused(dataset, refuse):
    (dataset / "efficiencies.csv").unlink()
    assert "does not exist" in refuse("check", dataset)


def test_two_columns_for_one_quantity_are_refused(dataset, refuse):
    path = dataset / "efficiencies.csv"
    rows = path.read_text().splitlines()
    path.write_text(
        "\n".join([rows[0], "cable_length_mm,efficiency_percent,Efficiency [%]", *(f"{r},50" for r in rows[2:])])
    )
    assert "both look like efficiency" in refuse("check", dataset)


@pytest.mark.parametrize("verb", ["check", "fit"])
def test_nothing_is_written_after_bad_input(dataset, refuse, tmp_path, verb):
    spoil(dataset / "efficiencies.csv", "440,77", "440,177")
    output = ["--output", tmp_path / "results"] if verb == "fit" else []
    files_at_start = sorted(tmp_path.rglob("*"))
    refuse(verb, dataset, *output)
    assert sorted(tmp_path.rglob("*")) == files_at_start


def test_what_only_the_model_can_judge_leaves_an_earlier_fit_alone(dataset, refuse, tmp_path):
    results = tmp_path / "results"
    results.mkdir()
    (results / "fit.json").write_text("{}")
    refuse("fit", dataset, "--set", "prior.tua.fixed=1", "--output", results, "--force")
    assert (results / "fit.json").read_text() == "{}"


def test_decimal_commas_byte_order_marks_and_excel_are_no_bad_input(dataset, monkeypatch, capsys):
    (dataset / "efficiencies.csv").write_bytes(
        "sep=;\r\nCable length (mm);Efficiency (%);;\r\n440;77,0;;\r\n470;78,5;;\r\n;;;\r\n".encode("utf-8-sig")
    )
    (dataset / "angles.csv").write_text((dataset / "angles.csv").read_text().replace(",", "\t"), encoding="utf-16")
    monkeypatch.setattr(sys, "argv", ["bowdenfit", "check", str(dataset)])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    out = capsys.readouterr().out
    assert stop.value.code == 0, out
    assert "2 efficiencies, 77.0 % to 78.5 %" in out


def read_forces(folder: Path, *files: str) -> Measurements:
    """Tables of forces of a cable of one known wrap angle."""
    contact = {"name": "cable", "friction": "mu", "wrap_angle": {"value": 45, "unit": "deg"}}
    raw = {"name": "forces", "contact": [contact], "tables": {"forces": {"files": files}}}
    return read_dataset(parse_description(raw), folder, {}).measurements


def test_velocities_of_the_rope_in_one_table_and_of_the_motor_in_another_are_refused(tmp_path):
    from bowdenfit.errors import DatasetError

    rope, motor = tmp_path / "rope.csv", tmp_path / "motor.csv"
    rope.write_text("input_force_N,output_force_N,velocity_mm_per_s\n50,40,10\n")
    motor.write_text("input_force_N,output_force_N,velocity [r/min]\n50,40,20\n")
    with pytest.raises(DatasetError, match=r"rope\.csv and motor\.csv give velocities of different kinds"):
        read_forces(tmp_path, "rope.csv", "motor.csv")
    table = read_forces(tmp_path, "motor.csv").table(ForceTable)
    assert table.velocity_unit == "rad/s"
    assert table.velocity[0] == pytest.approx(20 * 2 * 3.141592653589793 / 60)


def test_a_coefficient_of_no_contact_is_refused_with_the_nearest_name():
    from bowdenfit.errors import DescriptionError

    contact = {"name": "cable", "friction": "mu", "wrap_angle": {"value": 45, "unit": "deg"}}
    raw = {
        "name": "a",
        "contact": [contact],
        "tables": {"forces": {"file": "f.csv"}},
        "friction": {"mu1": {"fixed": 0.1}},
    }
    with pytest.raises(DescriptionError, match="did you mean 'mu'"):
        parse_description(raw)


def test_held_readings_are_said_to_be_bounds(tmp_path):
    path = tmp_path / "held.csv"
    path.write_text("input_force_N,output_force_N,stroke,run\n50,40,hold,1\n50,45,hold,1\n50,35,pull,1\n")
    remarks = read_forces(tmp_path, "held.csv").remarks
    assert any("2 readings are held" in remark and "lower bound" in remark for remark in remarks)
