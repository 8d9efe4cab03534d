"""What is printed is readable where it is printed: in UTF-8 where the terminal has it, in ASCII where not."""

import io

import pytest

from bowdenfit.cli import terminal
from bowdenfit.inference.interval import Interval
from bowdenfit.words import WIDTH, few, filled, in_ascii, significant


@pytest.mark.parametrize(
    ("encoding", "printed"),
    [("utf-8", "0.2 ± 0.1, 5 µm"), ("ascii", "0.2 +- 0.1, 5 um"), ("cp1252", "0.2 ± 0.1, 5 µm"), ("?", "0.2 +- 0.1, 5 um")],
)
def test_a_terminal_is_given_the_letters_that_it_has(encoding, printed, monkeypatch):
    monkeypatch.delenv("LC_ALL", raising=False)
    text = "0.2 ± 0.1, 5 µm"
    assert (text if terminal.can_show(text, encoding) else in_ascii(text)) == printed


def test_the_locale_c_is_taken_at_its_word(monkeypatch):
    monkeypatch.setenv("LC_ALL", "C")
    stream = io.StringIO()
    monkeypatch.setattr("sys.stdout", stream)
    terminal.say("1 ± 2")
    assert stream.getvalue() == "1 +- 2\n"


@pytest.mark.parametrize("start", range(60, 80))
def test_no_number_loses_its_unit_or_its_error_to_the_next_line(start):
    text = "a" * start + " 0.25 ± 0.03 N and 95 % of it, with --friction rate-dependent"
    lines = filled(text).splitlines()
    assert all(len(line) <= max(WIDTH, start) for line in lines)
    assert not any(line.startswith(("±", "%", "N ")) or line.endswith("±") for line in lines)
    assert " ".join(" ".join(lines).split()) in (text, text[:WIDTH] + " " + text[WIDTH:])


@pytest.mark.parametrize(
    ("value", "shown"),
    [(1036.4, "1040"), (19_951.0, "20000"), (0.01234, "0.0123"), (99.96, "100"), (-5.6e3, "-5600"), (3e9, "3e+09")],
)
def test_large_numbers_have_zeros_and_no_powers_of_ten(value, shown):
    assert significant(value) == shown
    assert float(shown) == float(f"{value:.3g}")


def test_what_is_certain_is_said_without_zeros_behind_the_point():
    """The best length is an end of the range in every draw where a bell is cut off there."""
    certain = Interval(600.0, 0.0, 600.0, 600.0, 600.0)
    assert str(certain) == "600 (90 % interval 600 to 600)"
    assert str(Interval(0.25, 0.0, 0.25, 0.25, 0.25)).startswith("0.25 ")
    assert str(Interval(1.0, 0.02, 1.0, 0.98, 1.02)) == "1.000 (90 % interval 0.980 to 1.020)"


def test_names_with_commas_are_listed_with_semicolons():
    assert few(["a", "b", "c", "d"], most=2) == "a, b and 2 more"
    assert few(["550 mm, 20 r/min", "b", "c", "d"], most=2) == "550 mm, 20 r/min; b; and 2 more"
    assert few(["550 mm, 20 r/min"]) == "550 mm, 20 r/min"
