"""Small files as laboratories write them: each is understood as it must be, and the command that `check` prints fits it."""

import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import openpyxl
import pytest

import bowdenfit as bf
from bowdenfit.files import read_channels
from bowdenfit.files.tables import read_table
from bowdenfit.kinds.efficiencies.kind import EfficiencyTable
from bowdenfit.kinds.forces.table import ForceTable

pytestmark = pytest.mark.extended

CORPUS = Path(__file__).parent / "corpus"
UNDERSTOOD = tomllib.loads((CORPUS / "understood.toml").read_text(encoding="utf-8"))
FITTED = ("excel_german.csv", "t1_t2_wrap.csv", "tendon_strokes.csv", "wirkungsgrad.csv")
ANY_DIGITS = 2e-4  # relative; what a file does not print


def test_the_corpus_has_forty_files_and_every_one_is_described():
    files = {path.name for path in CORPUS.iterdir()} - {"understood.toml"}
    assert files == set(UNDERSTOOD)
    assert len(files) >= 40


@pytest.mark.parametrize("name", UNDERSTOOD)
def test_a_file_is_said_to_be_what_it_is_and_its_command_reads_it(run, monkeypatch, name):
    monkeypatch.chdir(CORPUS)
    truth = UNDERSTOOD[name]
    code, out, _ = run("check", name)
    text = " ".join(out.split())
    assert code == (2 if "cannot be" in text else 0)
    words = truth.get("says", "a " + truth["kind"])
    of_sheet = rf"{re.escape(name)}: a workbook of \d sheets\. .*{re.escape(name)}, sheet '\w+': {re.escape(words)}"
    assert text.startswith(f"{name}: {words}") or re.match(of_sheet, text), text
    (table,) = bf.read(Path(name), **command_of(out)[1]).measurements.tables
    if isinstance(table, EfficiencyTable):
        assert [table.efficiency[0], table.efficiency[-1]] == pytest.approx([*truth["first"], *truth["last"]], rel=ANY_DIGITS)
    elif isinstance(table, ForceTable):
        ends = [[table.input_force[i], table.output_force[i]] for i in (0, -1)]
        np.testing.assert_allclose(ends, [truth["first"], truth["last"]], rtol=ANY_DIGITS)
        assert len(table.run) == truth["readings"]
    else:
        assert table.items[0].account.samples == truth["readings"]
        assert table.items[0].strokes.exponent == pytest.approx(np.pi * truth["mu"], rel=0.05)


@pytest.mark.parametrize("name", UNDERSTOOD)
def test_every_row_of_a_file_is_read_or_named_with_its_reason(name):
    truth, path = UNDERSTOOD[name], CORPUS / name
    account = read_channels(path).account if truth["kind"] == "recording" else read_table(path).account
    assert account.rows == account.accounted == rows_of(path)
    assert account.read == truth.get("rows", truth["readings"])  # two clocks that were joined share the rows
    assert len(account.beside) == truth.get("beside", 0)
    if "headings" in truth:
        assert list(account.headings) == truth["headings"]
        assert {item.why: item.count for item in account.left_out} == truth["unused"]


@pytest.mark.parametrize("name", [n if n in FITTED else pytest.param(n, marks=pytest.mark.slow) for n in UNDERSTOOD])
def test_the_command_that_check_prints_fits_a_file(run, monkeypatch, tmp_path, name):
    monkeypatch.chdir(CORPUS)
    words, _ = command_of(run("check", name)[1])
    code, _, err = run(*words, "--no-mcmc", "--no-figures", "--seed", 1, "--output", tmp_path / "fit")
    assert code in (0, 3), err
    estimate = bf.load(tmp_path / "fit").least_squares.estimates["mu"]
    assert estimate.value == pytest.approx(UNDERSTOOD[name]["mu"], rel=0.03)


def rows_of(path):
    """How many rows a file has."""
    if path.suffix == ".xlsx":
        return max(sheet.max_row for sheet in openpyxl.load_workbook(path))
    text = path.read_bytes()
    is_wide = text.startswith(b"\xff\xfe")
    return len(text.decode("utf-16").splitlines() if is_wide else text.rstrip(b"\x00").splitlines())


def command_of(text):
    """The one command that `check` prints, as words, and as keywords for notebooks."""
    (line,) = [line.strip() for line in text.replace("\\\n", " ").splitlines() if line.strip().startswith("bowdenfit fit ")]
    words = shlex.split(line)[1:]
    named = {}
    for option, value in zip(words[2::2], words[3::2], strict=True):
        named.setdefault(option, []).append(value)
    keywords = {"--column": "columns", "--channel": "channels", "--wrap-angle": "wrap_angle", "--sheet": "sheet"}
    options = {keywords[option]: values for option, values in named.items()}
    if "sheet" in options:
        (options["sheet"],) = options["sheet"]
    if "wrap_angle" in options:
        options["wrap_angle"] = (float(options["wrap_angle"][0].removesuffix("deg")), "deg")
    return words, options
