"""Names that people choose: whatever is in them works in tables, files and figures, or `check` refuses it."""

import csv
import json
import shutil
import warnings

import numpy as np
import pytest
from matplotlib.mathtext import MathTextParser

import bowdenfit as bf
from bowdenfit.cli import bowdenfit
from bowdenfit.csv_tables import csv_comment, csv_table
from bowdenfit.display import csv_text
from bowdenfit.errors import DiskError
from bowdenfit.parameters.symbols import make_symbol
from bowdenfit.plots.layout import empty_page
from bowdenfit.plots.write import write_all
from bowdenfit.results.netcdf import read_groups, write_groups
from bowdenfit.words import printable

pytestmark = pytest.mark.extended

QUICK = ("sampler.n_walkers=32", "sampler.max_steps=200", "sampler.target_ess=100")
ODD = [
    "a/b",
    ".",
    "..",
    "mu%",
    "a#b",
    "{x",
    "}",
    "mu_",
    "_",
    "a^b_c",
    "$x_$",
    "\\frac",
    "a b",
    "50% & more",
    "%2F",
    'µ "~`',
]


def called(on_body, place, *names):
    """The data set, its first coefficients called something else."""
    folder = shutil.copytree(on_body, place / "cable")
    text = (folder / "cable.toml").read_text()
    for old, name in zip(("mu1", "mu2"), names, strict=False):
        quoted = name.replace("\\", "\\\\").replace('"', '\\"').replace("\x1b", "\\u001b").replace("\n", "\\n")
        assert f'friction = "{old}"' in text
        text = text.replace(f'"{old}"', f'"{quoted}"').replace(f"[friction.{old}]", f'[friction."{quoted}"]')
    (folder / "cable.toml").write_text(text)
    return folder


def test_letters_that_the_font_lacks_are_drawn_without_a_word_of_the_library(tmp_path, caplog):
    figure = empty_page(3.0, 2.0)
    figure.text(0.1, 0.1, make_symbol(r"\mu", "\u65e5\u672c"))
    figure.text(0.1, 0.5, "\u65e5")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        written = write_all(figure, tmp_path, "letters")
    assert len(written) == 3 and caplog.text == ""


@pytest.mark.parametrize("some", [range(0x20, 0x7F), pytest.param(range(0x7F, 0x250), marks=pytest.mark.slow)], ids=str)
def test_every_printable_letter_can_be_set_behind_a_symbol(some):
    """By default those of ASCII, and a few of every other kind."""
    parser = MathTextParser("path")
    letters = [chr(i) for i in (*some, 0xE9, 0x142, 0x3BC, 0x2116, 0x4E2D, 0x1F600) if chr(i).isprintable()]
    for letter in letters:
        parser.parse(make_symbol(r"\mu", f"x{letter}y"))
        parser.parse(make_symbol(r"\mu", letter))


def test_a_coefficient_s_name_stands_behind_its_letter_and_only_an_index_below_it():
    assert make_symbol(r"\mu", "sheath_edge") == r"$\mu$ sheath edge"
    assert make_symbol(r"\mu", "a $ b") == r"$\mu$ a \$ b"
    assert make_symbol(r"\mu", "1") == r"$\mu_\mathrm{1}$"


def test_odd_names_come_back_from_the_file_of_draws(tmp_path):
    groups = {"posterior": {name: np.full((2, 3), float(i)) for i, name in enumerate(ODD)}}
    write_groups(tmp_path / "posterior.nc", groups, {}, {}, {})
    group = read_groups(tmp_path / "posterior.nc")["posterior"]
    assert list(group) == ODD
    assert all(np.all(group[name] == i) for i, name in enumerate(ODD))


def test_a_fit_with_odd_names_is_written_drawn_and_read_again(on_body, tmp_path):
    names = ("a/b", "$x_$")
    fit = bf.fit(called(on_body, tmp_path, *names), output=tmp_path / "fit", seed=3, settings=QUICK)
    again = bf.load(tmp_path / "fit")
    for name in names:
        np.testing.assert_array_equal(again.posterior.values[name], fit.posterior.values[name])
    assert (tmp_path / "fit" / "figures" / "coefficients.png").exists()


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("", "the name is empty"),
        ("  ", "the name is empty"),
        ("\x1b[31mred", "cannot be printed, '\\\\x1b'"),
        ("a\nb", "cannot be printed"),
        ("x" * 81, "has 81 characters"),
        ("chain", "cannot be called 'chain'"),
        ("optimal_length", "cannot be called 'optimal_length'"),
        ("tau", "both called 'tau'"),
    ],
)
def test_names_that_cannot_be_are_refused_by_check(on_body, tmp_path, name, says):
    with pytest.raises(bf.DescriptionError, match=says):
        bf.check(called(on_body, tmp_path, name))


def test_a_fit_whose_figures_cannot_be_drawn_is_kept_and_drawn_later(on_body, tmp_path, monkeypatch):
    from bowdenfit.questions.figures import FIGURES

    figures, messages = FIGURES["wrap_angles"].draw, []
    monkeypatch.setattr(FIGURES["wrap_angles"], "draw", lambda *_: 1 / 0)
    bf.fit(on_body, output=tmp_path / "fit", seed=3, mcmc=False, report=messages.append)
    (sentence,) = messages
    assert "holds the whole fit, but its figure wrap_angles could not be drawn (division by zero)" in sentence
    assert bf.load(tmp_path / "fit").converged
    assert (tmp_path / "fit" / "summary.txt").exists()
    monkeypatch.setattr(FIGURES["wrap_angles"], "draw", figures)
    assert bf.plot(tmp_path / "fit", figures=["wrap_angles"])


def test_nothing_that_is_printed_steers_a_terminal():
    assert printable("a\x1b[31m\u202eb\tµ ± 1\u00a0N\n") == "a\\x1b[31m\\u202eb\tµ ± 1\u00a0N\n"


def _find_no_room(*_):
    raise OSError(28, "No space left on device")


def test_a_fit_whose_texts_find_no_room_is_kept_and_ends_as_a_failure_of_the_disk(on_body, tmp_path, monkeypatch):
    from bowdenfit.run import writing

    monkeypatch.setattr(writing, "printable", _find_no_room)
    with pytest.raises(DiskError, match=r"whole fit, but summary\.txt and details\.txt could not be written") as error:
        bf.fit(on_body, output=tmp_path / "fit", seed=3, mcmc=False)
    assert error.value.exit_code == 1
    assert bf.load(tmp_path / "fit").converged
    assert not (tmp_path / "fit" / "summary.txt").exists()


def test_a_fit_whose_figures_find_no_room_is_kept_and_ends_as_a_failure_of_the_disk(on_body, tmp_path, monkeypatch):
    from bowdenfit.questions.figures import FIGURES

    monkeypatch.setattr(FIGURES["wrap_angles"], "draw", _find_no_room)
    with pytest.raises(DiskError, match="figure wrap_angles could not be drawn") as error:
        bf.fit(on_body, output=tmp_path / "fit", seed=3, mcmc=False)
    assert error.value.exit_code == 1
    assert bf.load(tmp_path / "fit").converged
    assert (tmp_path / "fit" / "summary.txt").exists()


@pytest.mark.parametrize("name", ["angles[1].csv", "*.csv", "a?b.csv", "[a-.csv", 'a b\'s "c".csv'])
def test_files_may_be_called_like_patterns(on_body, tmp_path, name):
    folder = shutil.copytree(on_body, tmp_path / "cable")
    (folder / "angles.csv").rename(folder / name)
    text = (folder / "cable.toml").read_text()
    assert '"angles.csv"' in text
    (folder / "cable.toml").write_text(text.replace('"angles.csv"', json.dumps(name)))
    assert bf.read(folder).sha256.keys() >= {name, "cable.toml"}


@pytest.mark.parametrize("called", ["---", " ", "\udcff", "a\x1b[31m", "x" * 120])
def test_a_new_data_set_may_be_called_anything_that_a_folder_may(on_body, tmp_path, called):
    files = [str(on_body / f"{table}.csv") for table in ("angles", "efficiencies")]
    assert not bowdenfit(["init", str(tmp_path / called), "--from", *files])
    assert bf.read(tmp_path / called).measurements


@pytest.mark.parametrize("name", ["=1+1", "a,b", '"q', "@x", "-2+3", "+x", "cable length", "a;b"])
def test_csv_has_names_as_text_that_no_spreadsheet_computes(name):
    (heading, other), (cell, number) = csv.reader(csv_text([{name: name, "length_mm": -1.5}]).splitlines())
    assert other == "length_mm" and number == "-1.5"
    assert heading == cell and heading in {name, f"'{name}"}
    assert heading[0] not in "=+-@"


def test_numbers_and_plain_words_stay_as_they_are_in_csv():
    assert csv_text([{"low_W/kg": -0.5, "n": "-12.5"}]) == 'low_W/kg,n\n-0.5,"-12.5"\n'
    cells = ["run 1", "-1e-05", "+.5", "", "475/1", None, True, 3]
    assert csv_table(["a"], [cells]) == "a\nrun 1,-1e-05,+.5,,475/1,,true,3\n"


FORMULAS = ["=1+1", " =1+1", "\t=1+1", "@SUM(1)", "-2+3", "+x", "-5+cmd|' /C calc'!A0", "\uff1d1+1", '=HYPERLINK("http://x")']


@pytest.mark.parametrize("name", FORMULAS)
def test_no_cell_of_a_table_or_of_the_comment_above_it_is_a_formula(name):
    ((head,), cells) = csv.reader(csv_table([name], [[name, ["a", name]]]).splitlines())
    assert head == cells[0] == f"'{name}" and len(cells) == 2
    for initial, after in (("", ""), ("cable a,", ",b"), ("cable a;", ";b"), ('cable a,"', '"')):
        (line,) = csv_comment([f"{initial}{name}{after}"]).splitlines()
        assert line.startswith("# ")
        for cell in (cell for separator in ",;\t" for cell in next(csv.reader([line], delimiter=separator))):
            assert not cell.strip().startswith(tuple("=+@-\uff1d")), line
