"""What is made of several files is there whole or not at all, and lies in the folder that was named."""

import pytest

import bowdenfit as bf
from bowdenfit.addons.fleet import simulation as fleet
from bowdenfit.errors import DiskError
from bowdenfit.plots import write
from bowdenfit.plots.layout import empty_page
from bowdenfit.questions.check import show_priors
from bowdenfit.questions.simulate import tables
from bowdenfit.questions.writing import write_answer
from bowdenfit.results.folder import fill_folder_atomically


@pytest.fixture
def room_for_one(monkeypatch):
    """A disk that has room for one file."""
    written = []

    def write(path, text):
        if written:
            raise OSError(28, "No space left on device", str(path))
        written.append(path)
        path.write_text(text)

    monkeypatch.setattr(tables, "write_text", write)
    monkeypatch.setattr(fleet, "write_text", write)
    return written


@pytest.mark.parametrize(
    ("name", "options"),
    [("synthetic-bench", {}), ("synthetic-fleet", {"fleet": True})],
)
def test_a_simulated_data_set_that_finds_no_room_leaves_nothing(on_body, tmp_path, room_for_one, name, options):
    bench = on_body.parent / name / "bench.toml"
    with pytest.raises(DiskError, match=r"made cannot be written \(No space left on device\)"):
        bf.simulate(bench, output=tmp_path / "made", seed=3, **options)
    assert room_for_one
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["/elsewhere/x.csv", "../x.csv", "a/../../x.csv"])
def test_a_plan_writes_nothing_outside_its_folder(on_body, tmp_path, name):
    plan = (on_body.parent / "synthetic-bench" / "bench.toml").read_text()
    assert '"angles.csv"' in plan
    (tmp_path / "bench.toml").write_text(plan.replace('"angles.csv"', f'"{name}"'))
    files_at_start = sorted(tmp_path.parent.iterdir())
    with pytest.raises(bf.DescriptionError, match="outside of what is made"):
        bf.simulate(tmp_path / "bench.toml", output=tmp_path / "made" / "deep", seed=3)
    assert sorted(tmp_path.parent.iterdir()) == files_at_start
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["bench.toml"]


def write_some_answer(folder):
    class Drawn:
        HEADING = "A figure"

        def draw(self, outcome):
            return empty_page(3.0, 2.0)

        def caption(self, outcome):
            return "What is drawn."

    write_answer(folder, "answer", {"x": 1.0}, "text", {"answer": Drawn(), "traces": Drawn()})


def write_priors(folder):
    show_priors(bf.read("datasets/yarn-on-cylinder"), folder)


@pytest.mark.parametrize("ask", [write_some_answer, write_priors])
def test_an_answer_that_finds_no_room_leaves_nothing_and_an_earlier_one_stays(tmp_path, monkeypatch, ask):
    room = []

    def save(figure, target, ending):
        if len(room) != 1:
            target.write_bytes(b"a figure")
            room.append(target)
            return
        target.write_bytes(b"half")
        raise OSError(28, "No space left on device", str(target))

    monkeypatch.setattr(write, "save", save)
    for folder in (tmp_path / "new", tmp_path / "there"):
        if folder.name == "there":
            folder.mkdir()
            (folder / "captions.txt").write_text("other: of another figure.\n")
        files_at_start = {path: path.read_bytes() for path in tmp_path.rglob("*.*")}
        room.clear()
        with pytest.raises(DiskError, match=r"cannot be written \(No space left on device\)"):
            ask(folder)
        assert {path: path.read_bytes() for path in tmp_path.rglob("*.*")} == files_at_start
    assert room
    monkeypatch.setattr(write, "save", lambda figure, target, ending: target.write_bytes(b"a figure"))
    ask(tmp_path / "there")
    assert "other: of another figure." in (tmp_path / "there" / "captions.txt").read_text()
    assert len(list((tmp_path / "there").iterdir())) >= 4


def test_what_lay_in_a_folder_stays_beside_what_is_filled_in(tmp_path):
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "bench.toml").write_text("plan")
    with fill_folder_atomically(tmp_path / "made") as place:
        (place / "a").write_text("x")
    assert sorted(path.name for path in (tmp_path / "made").iterdir()) == ["a", "bench.toml"]
    assert [path.name for path in tmp_path.iterdir()] == ["made"]
