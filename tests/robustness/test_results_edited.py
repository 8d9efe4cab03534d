"""Results folders that somebody edited or damaged, and requests with impossible numbers: sentences, exit code 2."""

import json
import os
import shutil
import subprocess
import sys

import pytest
from forged_fits import sealed

import bowdenfit as bf
from bowdenfit.arguments import read_quantity
from bowdenfit.results.answer_cache import CHECKSUM

pytestmark = pytest.mark.extended


@pytest.fixture(scope="module")
def whole(quick_fit, tmp_path_factory):
    folder = tmp_path_factory.mktemp("edited") / "fit"
    quick_fit.save(folder)
    return folder


def other(page, key, value):
    return sealed({**page, key: value})


@pytest.mark.parametrize(
    "edit",
    [
        lambda page: "",
        lambda page: "null",
        lambda page: "[1, 2]",
        lambda page: "[" * 100_000,
        lambda page: '{"schema": ' + "9" * 5000 + "}",
        lambda page: other(page, "schema", "x"),
        lambda page: other(page, "description", {}),
        lambda page: other(page, "description", None),
        lambda page: other(page, "measurements", [1]),
        lambda page: other(page, "least_squares", {"estimates": 3}),
        lambda page: other(page, "posterior", {"n_ensembles": "many"}),
        lambda page: other(page, "verdict", []),
        lambda page: other(page, "provenance", 5),
        lambda page: other(page, "sha256", None)[:-40],
        lambda page: json.dumps({**page, "sha256": {}}),
        lambda page: json.dumps({key: value for key, value in page.items() if key != CHECKSUM}),
        lambda page: json.dumps(page).replace("0.9", "0.8", 1),
    ],
)
def test_an_edited_fit_is_a_sentence(whole, tmp_path, edit):
    folder = shutil.copytree(whole, tmp_path / "fit")
    (folder / "fit.json").write_text(edit(json.loads((folder / "fit.json").read_text())))
    with pytest.raises(bf.StoreError) as refused:
        bf.load(folder)
    assert "damaged" in str(refused.value) or "another" in str(refused.value)
    assert len(str(refused.value)) < 600


def test_a_fit_that_was_only_spaced_otherwise_is_read(whole, tmp_path):
    folder = shutil.copytree(whole, tmp_path / "fit")
    (folder / "fit.json").write_text(json.dumps(json.loads((folder / "fit.json").read_text()), indent=3))
    assert bf.load(folder).summary() == bf.load(whole).summary()


def test_draws_of_another_fit_are_refused(whole, loop_results, tmp_path):
    folder = shutil.copytree(whole, tmp_path / "fit")
    shutil.copy(loop_results / "posterior.nc", folder)
    with pytest.raises(bf.StoreError, match=r"posterior\.nc has changed since it was written"):
        bf.load(folder)


@pytest.mark.parametrize("length", [float("nan"), float("inf"), (float("nan"), "mm")])
def test_what_is_no_length_is_refused(whole, length):
    with pytest.raises(bf.UsageError, match="is not a length"):
        bf.predict(bf.load(whole), [length])
    assert len(bf.predict(bf.load(whole), [(455, "mm"), 460])) == 2


@pytest.mark.parametrize(
    ("text", "value"),
    [("1e3N", (1000.0, "N")), ("180deg", (180.0, "deg")), ("-.5 mm", (-0.5, "mm")), ("2.5E-1 in", (0.25, "in"))],
)
def test_numbers_with_units_are_read_as_people_write_them(text, value):
    assert read_quantity(text, "--input-force", "100N") == value


@pytest.mark.parametrize("text", ["N", "1e3", "nanN", "1e999N", "1..2N", "- 5N", "٣N", ""])
def test_what_is_no_number_with_a_unit_is_refused(text):
    with pytest.raises(bf.UsageError, match="write it as 100N"):
        read_quantity(text, "--input-force", "100N")


@pytest.mark.parametrize("closed", ["1", "2"])
def test_a_closed_output_is_no_failure(on_body, closed):
    command = f'exec "{sys.executable}" -m bowdenfit check "{on_body}" {closed}>&-'
    done = subprocess.run(
        ["sh", "-c", command], env={**os.environ}, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 0, done.stderr
