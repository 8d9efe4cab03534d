"""A fit says which of its data have changed since, to every command that is asked of it, and looks nowhere else for them."""

import json
import shutil
from pathlib import Path

import pytest

import bowdenfit as bf
from bowdenfit.results.data_changes import DataChanges, find_data_changes, locate_data_set

DATASETS = Path(__file__).parents[2] / "datasets"
FILES = {"cable.toml", "angles.csv", "efficiencies.csv"}


@pytest.fixture
def bench(tmp_path, quick_results, monkeypatch):
    """The working folder, with a data set two levels down and a fit of it."""
    folder = tmp_path / "bench"
    shutil.copytree(DATASETS / "on-body-exoskeleton", folder / "measured" / "on-body")
    shutil.copytree(quick_results, folder / "fits" / "knee")
    state(folder / "fits" / "knee", **locate_data_set(folder / "measured" / "on-body", folder / "fits" / "knee"))
    monkeypatch.chdir(folder)
    return folder


def state(results, **keys):
    """Change keys of fit.json, whose checksum nobody looks at here."""
    page = json.loads((results / "fit.json").read_text())
    (results / "fit.json").write_text(json.dumps(page | keys))


def test_a_fit_keeps_where_its_data_are_and_finds_them_changed_added_and_gone(bench, quick_results):
    results, data = bench / "fits" / "knee", bench / "measured" / "on-body"
    page = json.loads((results / "fit.json").read_text())
    assert page["data_set"] == "measured/on-body"
    assert {*page["sha256"]} == FILES and find_data_changes(results) == DataChanges(data)
    (data / "angles.csv").write_text((data / "angles.csv").read_text() + "# more\n")
    (data / "efficiencies.csv").unlink()
    assert find_data_changes(results).files == ("angles.csv", "efficiencies.csv")
    description = (data / "cable.toml").read_text().replace('file = "efficiencies.csv"', 'files = "eff*.csv"')
    (data / "cable.toml").write_text(description)
    for name in ("efficiencies.csv", "efficiencies-2.csv"):
        shutil.copy(DATASETS / "on-body-exoskeleton" / "efficiencies.csv", data / name)
    shutil.copy(DATASETS / "on-body-exoskeleton" / "angles.csv", data)
    assert find_data_changes(results).files == ("cable.toml", "efficiencies-2.csv")
    words = find_data_changes(results).describe("the fit of June")
    assert words.startswith("Changed since the fit of June: 'cable.toml' and 'efficiencies-2.csv'")


def test_a_folder_elsewhere_is_not_said(bench, tmp_path):
    assert locate_data_set(tmp_path, bench / "fits" / "knee") == {} == locate_data_set(None, bench)
    assert locate_data_set(bench / "measured", tmp_path / "elsewhere" / "fits" / "knee") == {}
    assert locate_data_set(bench / "measured", tmp_path / "fits" / "knee") == {"data_set": "bench/measured"}
    published = json.loads((DATASETS.parent / "fits" / "published" / "on-body-exoskeleton" / "fit.json").read_text())
    assert "data_set" not in published, "no path of the machine that made it"


def test_nothing_is_reported_of_data_that_are_gone_or_elsewhere(bench, tmp_path):
    results = bench / "fits" / "knee"
    shutil.copytree(bench / "measured" / "on-body", tmp_path / "elsewhere")
    (tmp_path / "elsewhere" / "angles.csv").write_text("")
    (bench / "measured" / "link").symlink_to(tmp_path / "elsewhere")
    for data_set in (None, 7, "", "measured", "../..", "\0", "../elsewhere", "/", "measured/link", str(bench / "measured")):
        state(results, data_set=data_set)
        assert find_data_changes(results) == DataChanges(), data_set
    shutil.move(bench / "measured", tmp_path / "moved")
    state(results, data_set="measured/on-body")
    assert find_data_changes(results) == DataChanges()


def test_a_hostile_fit_has_nothing_else_opened(bench):
    results, opened = bench / "fits" / "knee", list[Path]()
    names = ("../../secret", "/etc/passwd", "..\\x", ".", "", "a" * 5000, "\0")
    page = json.loads((results / "fit.json").read_text())
    state(results, sha256=page["sha256"] | dict.fromkeys(names, "0"))

    def note(path):
        opened.append(path)
        return "0"

    find_data_changes(results, note)
    assert opened and {path.parent for path in opened} == {bench / "measured" / "on-body"}
    for sha256 in ([], "x", None, {"cable.toml": []}, {}):
        state(results, sha256=sha256)
        find_data_changes(results)
    (results / "fit.json").write_text("[")
    assert find_data_changes(results) == DataChanges()


_LONG = [pytest.param(words, marks=pytest.mark.extended) for words in ("compare FIT FIT-2", "report FIT")]


@pytest.mark.parametrize("words", ["summary FIT", "length FIT", "predict FIT 470", *_LONG])
def test_commands_that_read_a_fit_name_the_data_that_have_changed(run, bench, quick_results, words):
    for name in ("on-body", "on-body-2"):
        shutil.copytree(quick_results, bench / "fits" / name)
    shutil.copytree(DATASETS / "on-body-exoskeleton", bench / "on-body")
    arguments = [word.replace("FIT", "fits/on-body") for word in words.split()]
    assert "Changed since" not in run(*arguments)
    (bench / "on-body" / "angles.csv").write_text("changed")
    printed = run(*arguments)[2]
    assert printed.count("Changed since the fit fits/on-body: 'angles.csv'.") == 1, printed
    assert printed.count("Changed since") == len([word for word in arguments if word.startswith("fits/")])
    if words.startswith("report"):
        assert "Changed since this fit" in (bench / "fits" / "on-body" / "report.html").read_text()


@pytest.mark.parametrize("words", ["length FIT", pytest.param("predict FIT 470", marks=pytest.mark.extended)])
def test_programs_are_told_as_well(run, bench, quick_results, words):
    results = shutil.copytree(quick_results, Path("fits") / "on-body")
    shutil.copytree(bench / "measured" / "on-body", "on-body")
    arguments = words.replace("FIT", str(results)).split()

    def parts():
        answer = json.loads(run(*arguments, "--json")[1])
        return answer if isinstance(answer, list) else [answer]

    bf.load(results)  # a warning is an error here
    assert not any("changed_since_fit" in part for part in parts())
    Path("on-body", "angles.csv").write_text("changed")
    assert all(part["changed_since_fit"] == {"fits/on-body": ["angles.csv"]} for part in parts())
    with pytest.warns(UserWarning, match=r"^Changed since the fit fits/on-body: 'angles\.csv'") as warned:
        bf.load(results)
    assert [Path(warning.filename) for warning in warned] == [Path(__file__)]
