"""What is made of several files is there whole or not at all, and lies in the folder that was named."""

import pytest

import bowdenfit as bf
from bowdenfit.errors import DiskError
from bowdenfit.questions.simulate import fleet, tables
from bowdenfit.results.folder import filled_when_whole


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
    before = sorted(tmp_path.parent.iterdir())
    with pytest.raises(bf.DescriptionError, match="outside of what is made"):
        bf.simulate(tmp_path / "bench.toml", output=tmp_path / "made" / "deep", seed=3)
    assert sorted(tmp_path.parent.iterdir()) == before
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["bench.toml"]


def test_what_lay_in_a_folder_stays_beside_what_is_filled_in(tmp_path):
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "bench.toml").write_text("plan")
    with filled_when_whole(tmp_path / "made") as place:
        (place / "a").write_text("x")
    assert sorted(path.name for path in (tmp_path / "made").iterdir()) == ["a", "bench.toml"]
    assert [path.name for path in tmp_path.iterdir()] == ["made"]
