"""A data set that is brought as it is: files beside their cable.toml, each put where that names it, and nowhere else."""

import shutil
from pathlib import Path

import pytest
from half_turn_bench import TABLE, describe_half_turn

import bowdenfit as bf
from bowdenfit.addons.app.brought_folder import put_in_place
from bowdenfit.addons.app.draft import Draft
from bowdenfit.addons.app.workbench import refuse_module_name
from bowdenfit.errors import UsageError

DATASETS = Path(__file__).parents[3] / "datasets"


@pytest.fixture
def draft(tmp_path):
    """An empty draft."""
    (tmp_path / "draft").mkdir()
    return Draft(tmp_path / "draft")


def bring(draft, **contents):
    """Bring files, all in one place, and a cable.toml that names them."""
    for name, content in contents.items():
        file = "cable.toml" if name == "cable" else f"{name}.csv"
        draft.new_file(file).write_text(content)
    return draft.understand()


def test_a_shipped_data_set_that_is_chosen_file_by_file_is_written_as_it_is(draft, tmp_path):
    source = DATASETS / "on-body-exoskeleton"
    for path in [path for path in source.iterdir() if path.suffix != ".md"]:
        shutil.copyfile(path, draft.new_file(path.name))
    with pytest.raises(UsageError, match=r"'README\.md' is left out, because its extension"):
        draft.new_file("README.md")
    understanding = draft.understand()
    assert understanding.refusals == ()
    assert understanding.report == str(bf.check(source))
    assert draft.proposed_name == bf.read(source).description.name.replace(" ", "-")
    draft.write(tmp_path / "kept")
    saved, brought = ({path.name: path.read_bytes() for path in folder.iterdir()} for folder in (tmp_path / "kept", source))
    assert saved == {name: content for name, content in brought.items() if name != "README.md"}


def test_recordings_go_into_the_folder_that_their_cable_toml_names(draft):
    source = DATASETS / "synthetic-recordings"
    shutil.copyfile(source / "cable.toml", draft.new_file("cable.toml"))
    for path in (source / "angles.csv", *(source / "recordings").iterdir()):
        draft.new_file(path.name).write_text("")
    put_in_place(draft.folder)
    assert {path.parent.name for path in draft.files if path.name != "angles.csv"} == {"recordings"}
    assert (draft.folder / "angles.csv").is_file()


def test_points_of_a_route_go_where_cable_toml_names_them(draft):
    angle = '{ route = "shape/points.csv" }'
    cable = f'name = "c"\n[[contact]]\nname = "s"\nfriction = "mu"\nwrap_angle = {angle}\n'
    draft.new_file("cable.toml").write_text(f'schema = 1\n{cable}[tables]\nforces = {{ file = "forces.csv" }}\n')
    draft.new_file("forces.csv").write_text("input_force_N,output_force_N\n20,15\n40,29.5\n60,44\n")
    draft.new_file("points.csv").write_text("x_mm,y_mm\n0,0\n50,0\n50,80\n")
    understanding = draft.understand()
    assert understanding.refusals == ()
    assert "wrap angle 90.0 deg" in " ".join(understanding.report.split())
    assert (draft.folder / "shape" / "points.csv").is_file()


def test_a_file_goes_where_a_pattern_finds_it_and_comes_back_when_the_description_changes(draft):
    assert bring(draft, cable=describe_half_turn('files = "runs/*/**/*.csv"'), one=TABLE).refusals == ()
    assert [path.relative_to(draft.folder).as_posix() for path in draft.files] == ["runs/files/one.csv"]
    assert bring(draft, cable=describe_half_turn('files = "*.csv"')).refusals == ()
    assert [path.relative_to(draft.folder).as_posix() for path in draft.files] == ["one.csv"]
    draft.remove_file("cable.toml")
    assert draft.understand().entries[-1].words.startswith("By which angle")


@pytest.mark.parametrize(
    "name",
    [
        "/etc/passwd", "../outside.csv", "a/../../outside.csv", "~/x.csv", "C:/x.csv", "a\\\\..\\\\x.csv", "a/b/c/d/e/x.csv",
        "..", "x" * 300,
    ],
)  # fmt: skip
def test_what_a_description_names_elsewhere_is_refused_before_it_is_opened(draft, tmp_path, name):
    (tmp_path / "outside.csv").write_text(TABLE)
    (refusal,) = bring(draft, cable=describe_half_turn(f'files = "{name}"'), one=TABLE).refusals
    assert "is not in its own folder; put that file next to cable.toml" in refusal.sentence
    with pytest.raises(UsageError, match="cannot be read yet"):
        draft.write(tmp_path / "kept")
    assert not (tmp_path / "kept").exists()


def test_a_file_that_two_folders_could_hold_is_refused(draft):
    files = '["pull/*.csv", "return/*.csv"]'
    (refusal,) = bring(draft, cable=describe_half_turn(f"files = {files}"), one=TABLE).refusals
    assert "names 'one.csv' in several folders" in refusal.sentence


def test_a_file_that_is_called_like_a_folder_is_refused(draft):
    draft.new_file("a.csv").write_text("x")
    (refusal,) = bring(draft, cable=describe_half_turn('files = "a.csv/one.csv"'), one=TABLE).refusals
    assert "names a folder 'a.csv', which cannot be made" in refusal.sentence


def test_a_cell_that_cannot_be_read_is_shown_wherever_its_file_lies(draft):
    wrong = TABLE.replace("30.9", "many")
    refusals = bring(draft, cable=describe_half_turn('files = "runs/one.csv"'), one=wrong).refusals
    assert [(refusal.row, refusal.cells[1]) for refusal in refusals] == [(5, ("F_out (N)", "many"))]


def test_files_without_end_are_refused(draft):
    for number in range(300):
        (draft.folder / f"{number}.csv").write_text("")
    with pytest.raises(UsageError, match="one file more than the 300"):
        draft.new_file("more.csv")


@pytest.mark.parametrize("name", ["__init__.py", "numpy.py", "scipy.so", "x.pth", "metadata.yaml", "README.md", "a"])
def test_a_file_that_is_not_measured_by_its_extension_is_left_out_with_the_reason(draft, name):
    with pytest.raises(UsageError, match="left out, because its extension"):
        draft.new_file(name)
    assert draft.files == []


def test_a_file_whose_content_is_not_what_its_extension_says_is_left_out_and_named(draft, tmp_path):
    draft.new_file("program.csv").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(200))
    understanding = bring(draft, cable=describe_half_turn('file = "one.csv"'), one=TABLE)
    assert (understanding.refusals, understanding.left_out) == ((), ("program.csv",))
    draft.write(tmp_path / "kept")
    assert sorted(path.name for path in (tmp_path / "kept").iterdir()) == ["cable.toml", "one.csv"]


@pytest.mark.parametrize("name", ["scipy", "h5py", "numpy", "json", "bowdenfit"])
def test_a_data_set_may_not_have_the_name_of_a_module(name):
    with pytest.raises(UsageError, match=f"'{name}' is also the name of a Python module.* such as {name}-cable"):
        refuse_module_name(name)


@pytest.mark.parametrize("name", ["my-cable", "bench 1", "knee", "Seil_3"])
def test_usual_names_of_data_sets_are_taken(name):
    refuse_module_name(name)


def test_nothing_is_written_while_files_are_on_their_way(draft, tmp_path):
    assert bring(draft, cable=describe_half_turn(), forces=TABLE).report
    draft.is_arriving = True
    with pytest.raises(UsageError, match="still on their way"):
        draft.write(tmp_path / "written")
    assert not (tmp_path / "written").exists()
