"""What the verbs print fits into a terminal of 80 columns, and their tables come as CSV that programs read."""

import csv
import io
import shutil
from pathlib import Path

import pytest
from terminal_pages import faults, jargon

pytestmark = pytest.mark.extended

ROOT = Path(__file__).parents[2]
DATA_SETS = sorted(path.parent for path in (ROOT / "datasets").glob("*/cable.toml"))
CORPUS = [path for path in sorted((ROOT / "tests" / "files" / "corpus").glob("*.*")) if path.suffix != ".toml"]
WIDTH = 80


def too_wide(text):
    return [line for line in text.splitlines() if len(line) > WIDTH]


@pytest.fixture(scope="module")
def results(quick_results):
    return quick_results


@pytest.mark.parametrize("path", [*DATA_SETS, *CORPUS], ids=lambda path: path.name)
def test_check_keeps_to_the_terminal_whatever_it_reads(run, monkeypatch, path):
    monkeypatch.chdir(path.parent)
    code, out, err = run("check", path.name)
    assert (code, err) == (2 if "cannot be" in " ".join(out.split()) else 0, "")
    assert not too_wide(out)


def test_a_command_to_paste_goes_over_several_lines_as_a_shell_reads_it(run, monkeypatch):
    monkeypatch.chdir(ROOT)
    _, out, _ = run("check", "tests/files/corpus/unnamed_ends.csv")
    assert "--wrap-angle 180deg \\\n    --column input_force='Force 2 (N)' --column" in out


def test_every_verb_keeps_to_the_terminal(run, results, tmp_path):
    shutil.copytree(results, tmp_path / "other")
    printed = {verb: run(verb, results)[1] for verb in ("summary", "length", "identify", "next", "predict")}
    printed["compare"] = run("compare", results, tmp_path / "other")[1]
    for verb, out in printed.items():
        assert out and not too_wide(out), verb
        assert jargon(out) == [], verb


@pytest.mark.slow
@pytest.mark.parametrize("path", DATA_SETS, ids=lambda path: path.name)
def test_every_verb_answers_in_plain_words_whatever_the_data_set(run, tmp_path, path):
    """Each keeps to the terminal; what does not apply is refused in a sentence."""
    results, calibration = tmp_path / "fit", tmp_path / "calibration"
    texts = {"check": run("check", path), "fit": run("fit", path, "-o", results, "--seed", 1, "--no-figures")}
    shutil.copytree(results, tmp_path / "other")
    for verb in ("summary", "length", "identify", "next", "predict"):
        texts[verb] = run(verb, results)
    texts["plan"], texts["compare"] = run("identify", path), run("compare", results, tmp_path / "other")
    texts["calibrate"] = run("calibrate", path, "-n", 20, "--seed", 1, "-o", calibration)
    for verb, (code, out, err) in texts.items():
        assert code in (0, 3) or (verb in ("length", "next") and code == 2 and err.startswith("Error: ")), (verb, err)
        assert not too_wide(out), verb
        assert jargon(out) == [], verb
    assert not faults(texts["summary"][1])


@pytest.mark.parametrize(
    ("verb", "head"),
    [
        (("length",), "cable_length_mm"),
        (("identify",), "parameter"),
        (("next", "--top", "1"), "measurement"),
        (("predict",), "cable_length_mm"),
    ],
    ids=lambda part: part[0] if isinstance(part, tuple) else "",
)
def test_tables_come_as_csv_with_a_heading_and_a_cell_for_every_column(run, results, verb, head):
    code, out, _ = run(verb[0], results, *verb[1:], "--csv")
    assert code == 0
    heads, *rows = csv.reader(io.StringIO(out))
    assert heads[0] == head
    assert len(rows) > 1 and {len(row) for row in rows} == {len(heads)}
    assert "are two forms" in run(verb[0], results, "--csv", "--json")[2]


def test_comparisons_and_calibrations_come_as_csv(run, results, tmp_path):
    shutil.copytree(results, tmp_path / "other")
    heads, *rows = csv.reader(io.StringIO(run("compare", results, tmp_path / "other", "--csv")[1]))
    assert (heads[0], len(rows)) == ("name", 2)
    cable = ROOT / "datasets" / "yarn-on-cylinder"
    out = run("calibrate", cable, "-n", 3, "-j", 1, "--seed", 1, "-o", tmp_path / "calibration", "--csv")[1]
    heads, *rows = csv.reader(io.StringIO(out))
    assert heads[0] == "quantity" and "mu" in {row[0] for row in rows}
    assert not too_wide((tmp_path / "calibration" / "summary.txt").read_text())
