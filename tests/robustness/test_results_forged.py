"""Results folders that somebody edited or forged, with checksums that are right: refused, never believed unread."""

import io
import shutil
import zipfile

import h5py
import numpy as np
import pytest
from forged_fits import edit_sealed
from forged_folders import ask_forged_folder, reseal
from fuzzing import try_cases

import bowdenfit as bf
from bowdenfit.inputs import open_arrays
from bowdenfit.results.answer_cache import captions_if_unchanged, file_checksum, installed_version
from bowdenfit.results.folder import read_page
from bowdenfit.results.serialization import deserialize, read_arrays


@pytest.fixture
def folder(quick_results, tmp_path):
    return shutil.copytree(quick_results, tmp_path / "fit")


def test_the_summary_is_printed_as_it_was_written(folder, run):
    code, out, _ = run("summary", folder)
    assert code in (0, 3) and out == (folder / "summary.txt").read_text()


@pytest.mark.parametrize("name", ["summary.txt", "details.txt", "summary.json"])
def test_an_edited_summary_is_not_printed(folder, refuse, name):
    text = (folder / name).read_text()
    (folder / name).write_text(text.replace("0.", "0.0"))
    assert f"{name} has changed since it was written" in refuse("summary", folder)


@pytest.mark.extended
def test_a_summary_that_was_removed_is_written_anew(folder, run):
    text = (folder / "summary.txt").read_text()
    (folder / "summary.txt").unlink()
    assert run("summary", folder)[1] == text


@pytest.mark.parametrize("damage", ["gone", "garbage"])
def test_a_summary_without_its_draws_is_not_printed(folder, refuse, damage):
    (folder / "posterior.nc").unlink()
    if damage == "garbage":
        (folder / "posterior.nc").write_text("garbage")
    assert "posterior.nc" in refuse("summary", folder)


def not_numbers(values):
    values.flat[3] = np.nan
    return values


DRAWS = {
    "text": lambda values: np.full(values.shape, b"x", dtype="S1"),
    "not numbers": not_numbers,
    "of 16 bits": lambda values: values.astype(np.float16),
    "fewer": lambda values: values[:, :-1],
    "of another parameter": lambda values: None,
}


@pytest.mark.parametrize("case", DRAWS)
def test_forged_draws_are_refused(folder, case):
    with h5py.File(folder / "posterior.nc", "a") as file:
        group = file["unconstrained_posterior"]
        name = next(name for name in group if group[name].ndim == 2)
        values = DRAWS[case](group[name][()])
        group.move(name, "other")
        if values is not None:
            del group["other"]
            group[name] = values
    reseal(folder)
    with pytest.raises(bf.StoreError, match="damaged"):
        bf.load(folder)


EDITS = {
    "seed": lambda page: page["provenance"].update(seed="three"),
    "versions": lambda page: page["provenance"].update(versions=[1]),
    "hashes": lambda page: page.update(sha256={"cable.toml": 7}),
    "no hashes": lambda page: page.update(sha256=None),
    "converged": lambda page: page["verdict"].update(converged="yes"),
    "reasons": lambda page: page["verdict"].update(reasons="yes"),
    "estimates": lambda page: page["least_squares"]["estimates"].update(other=page["least_squares"]["estimates"].popitem()[1]),
    "solution": lambda page: page["least_squares"].update(z=[0.0]),
    "steps": lambda page: page["posterior"].update(steps="many"),
    "ensembles": lambda page: page["posterior"].update(n_ensembles=0),
    "sampler": lambda page: page["posterior"].update(sampler="guess"),
}


@pytest.mark.parametrize("case", EDITS)
def test_a_forged_fit_is_refused(folder, case):
    edit_sealed(folder / "fit.json", EDITS[case])
    with pytest.raises(bf.StoreError, match="damaged"):
        bf.load(folder)


@pytest.mark.parametrize("text", ['{"a":' * 60 + "1" + "}" * 60, "[" * 100_000, '{"a": NaN}', "-Infinity"])
def test_json_that_is_never_written_here_is_refused(tmp_path, text):
    (tmp_path / "page.json").write_text(text)
    with pytest.raises(bf.StoreError, match="damaged"):
        read_page(tmp_path / "page.json")


@pytest.mark.parametrize(
    ("kind", "value"),
    [(int, True), (int, 1.5), (str, 1), (bool, 1), (float, "x"), (float, True), (dict[str, int], []), (tuple[str, ...], "ab")],
)
def test_values_of_another_type_are_refused(kind, value):
    with pytest.raises(TypeError):
        deserialize(kind, value)


def test_a_huge_array_in_place_of_an_archive_is_not_read(tmp_path):
    written = io.BytesIO()
    np.lib.format.write_array_header_1_0(written, {"descr": "<f8", "fortran_order": False, "shape": (10**11,)})
    (tmp_path / "figures.npz").write_bytes(written.getvalue())
    with pytest.raises(ValueError, match="no archive"):
        read_arrays(tmp_path / "figures.npz", {})


def test_arrays_of_an_archive_share_no_bytes():
    file = io.BytesIO()
    np.savez(file, a=np.ones(9), b=np.ones(9))
    with open_arrays(io.BytesIO(file.getvalue())) as arrays:
        assert set(arrays.files) == {"a", "b"}
    with zipfile.ZipFile(file) as archive:
        first, second = archive.infolist()
    content = bytearray(file.getvalue())
    index = content.rindex(b"PK\x01\x02") + 42  # where the second entry of the table of contents says that it begins
    content[index : index + 4] = first.header_offset.to_bytes(4, "little")
    assert second.header_offset > 0
    with pytest.raises(ValueError, match="shares bytes"), open_arrays(io.BytesIO(content)):
        pass


def test_names_of_figures_lead_nowhere_else(folder):
    (folder / "figures").mkdir(exist_ok=True)
    (folder / "mine.png").write_text("x")
    (folder / "figures" / "x.png").write_text("x")

    def draws_of(name):
        page = {"with": installed_version("matplotlib"), "captions": {name: "A figure."}}
        page["files"] = {f"{name}.png": file_checksum(folder / "figures" / f"{name}.png")}
        edit_sealed(folder / "answers.json", lambda answers: answers["answers"].update(drawn=page))
        return captions_if_unchanged(folder, (), ("png",))

    assert draws_of("x") == {"x": "A figure."}
    assert draws_of("../mine") is None


@pytest.mark.extended
def test_forged_folders_are_refused_or_read_and_nothing_else_is_written(quick_results, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert 6 < try_cases(range(24), lambda number: ask_forged_folder(tmp_path, quick_results, number)) < 24


@pytest.mark.slow
def test_many_more_forged_folders(quick_results, tmp_path, monkeypatch, cases):
    monkeypatch.chdir(tmp_path)
    try_cases(cases(range(100, 1100)), lambda number: ask_forged_folder(tmp_path, quick_results, number))
