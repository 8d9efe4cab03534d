"""Certificates of load cells: read as they say, and refused in a sentence where they are odd or hostile."""

import os
import random
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from exchanged_texts import write_exchanged

import bowdenfit as bf
from bowdenfit.addons.certificate.calibrated_cell import read_load_cell
from bowdenfit.errors import DatasetError

EXAMPLE = Path(__file__).parents[3] / "docs" / "files" / "cell.xml"
TEXT = EXAMPLE.read_text(encoding="utf-8")
SHOWN = "0.0501 0.1002 0.2004 0.3006 0.4008 0.5010"
UNCERTAIN = "0.00020 0.00024 0.00040 0.00060 0.00080 0.00100"


@pytest.fixture
def write(tmp_path):
    """Write the example with some texts exchanged."""
    return partial(write_exchanged, tmp_path / "cell.xml", TEXT)


def test_the_example_says_gain_uncertainty_and_who_found_them(accept):
    """The cell shows 0.2 % too much; 0.24 N at 100 N with k = 2 is the largest relative uncertainty from 20 % of 500 N on."""
    cell = bf.cell(EXAMPLE, end="output")
    assert (cell.number, cell.issued, cell.issued_by) == ("K-2026-0815", "2026-03-02", "Example force laboratory")
    assert cell.gain == pytest.approx(1.002, rel=1e-12)
    assert cell.gain_error_sd == pytest.approx(0.24 / 100 / 2, rel=1e-12)
    lines = accept("cell", EXAMPLE, "--end", "output").splitlines()
    assert lines[0] == "[sensors]"
    assert lines[1].startswith("output_ratio = 0.998004 ")
    assert lines[2].startswith("output_gain_error_sd = 0.0012 ")


def test_what_is_printed_is_read_by_a_fit(accept, tmp_path):
    forces = "input_force_N,output_force_N\n10,8\n20,16.1\n30,23.9\n40,32.1\n50,39.9\n60,48.1\n"
    (tmp_path / "forces.csv").write_text(forces)
    contact = '[[contact]]\nname = "sheath"\nfriction = "mu"\nwrap_angle = { value = 180, unit = "deg" }\n'
    tables = '[tables]\nforces = { file = "forces.csv" }\n'
    lines = [accept("cell", EXAMPLE, "--end", end) for end in ("input", "output")]
    settings = lines[0] + lines[1].removeprefix("[sensors]\n")
    (tmp_path / "cable.toml").write_text(f'schema = 1\nname = "x"\n{contact}{tables}{settings}')
    sensors = bf.read(tmp_path).description.sensors
    assert (sensors.input_gain_error_sd, sensors.output_gain_error_sd) == (0.0012, 0.0012)
    assert sensors.input_ratio == pytest.approx(1 / 1.002, abs=1e-6)


def test_errors_in_place_of_shown_forces_say_the_same(write):
    errors = write((SHOWN, "0.0001 0.0002 0.0004 0.0006 0.0008 0.0010"), ("basic_measuredValue", "basic_measurementError"))
    cell = read_load_cell(errors)
    assert (cell.gain, cell.gain_error_sd) == (pytest.approx(1.002), pytest.approx(0.0012))


def test_uncertainties_of_a_later_version_of_d_si_are_read(write):
    later = "si:measurementUncertaintyUnivariateXMLList"
    path = write(
        ("<si:expandedUncXMLList>", f"<{later}><si:expandedMUXMLList>"),
        ("</si:expandedUncXMLList>", f"</si:expandedMUXMLList></{later}>"),
        ("si:uncertaintyXMLList", "si:valueExpandedMUXMLList"),
    )
    assert read_load_cell(path).gain_error_sd == pytest.approx(0.0012)


def test_a_single_force_is_enough(write):
    def single(value, unit, uncertainty=""):
        return f"<si:real><si:value>{value}</si:value><si:unit>{unit}</si:unit>{uncertainty}</si:real>"

    start, end = TEXT.index("<si:realListXMLList>"), TEXT.index("</si:realListXMLList>") + len("</si:realListXMLList>")
    uncertainty = (
        "<si:expandedUnc><si:uncertainty>0.5</si:uncertainty><si:coverageFactor>2.5</si:coverageFactor>"
        "<si:coverageProbability>0.98</si:coverageProbability></si:expandedUnc>"
    )
    first = TEXT[start:end]
    last = TEXT[TEXT.rindex("<si:realListXMLList>") : TEXT.rindex("</si:realListXMLList>") + len("</si:realListXMLList>")]
    path = write((first, single(400, r"\newton")), (last, single(399, r"\newton", uncertainty)))
    cell = read_load_cell(path)
    assert (cell.gain, cell.gain_error_sd) == (pytest.approx(399 / 400), pytest.approx(0.5 / 2.5 / 400))
    assert cell.coverage_factor == 2.5


ODD = {
    "no reference": (("basic_referenceValue", "basic_other"), "refType basic_referenceValue: no force in newton has it"),
    "no shown force": (("basic_measuredValue", "x"), "refType basic_measuredValue or basic_measurementError"),
    "another unit": ((r"\kilo\newton", r"\volt"), "no force in newton has it"),
    "a shortened list": ((SHOWN, "0.0501 0.1002"), "2 values, 1 units, 6 uncertainties, 1 coverage factors"),
    "both lists shortened": ((f"{SHOWN}</si:valueXMLList>", "1</si:valueXMLList>"), "1 values"),
    "a decimal comma": ((SHOWN, SHOWN.replace(".", ",")), "valueXMLList: '0,0501"),
    "not a number": ((SHOWN, SHOWN.replace("0.5010", "NaN")), "must be numbers"),
    "a negative uncertainty": ((UNCERTAIN, f"-{UNCERTAIN}"), "an uncertainty is negative"),
    "no coverage factor": (("si:coverageFactorXMLList", "si:other"), "no expanded uncertainty is stated; the usual cause"),
    "a factor of 0": (("<si:coverageFactorXMLList>2", "<si:coverageFactorXMLList>0"), "not above 0"),
    "lists in other units": ((r"\kilo\newton", r"\newton"), "shown over true force is 0.001"),
    "forces of 0": (("50 100 200 300 400 500", "0 0 0 0 0 0"), "shown over true force is nan"),
    "no values": (("50 100 200 300 400 500", " "), "0 values"),
}


@pytest.mark.parametrize("name", ODD)
def test_an_odd_certificate_is_refused_with_file_element_cause_and_fix(refuse, write, name):
    exchanged, words = ODD[name]
    sentence = refuse("cell", write(exchanged))
    assert sentence.startswith("Error: cell.xml, ")
    assert words in sentence
    assert "the usual cause is" in sentence


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaa">' + "".join(
    f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
HOSTILE = {
    "a bomb of entities": (f"{BOMB}]><x>&i;</x>", "<!DOCTYPE x>"),
    "an entity from a file": ('<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><x>&a;</x>', "<!DOCTYPE x>"),
    "an entity from the network": ('<!DOCTYPE y SYSTEM "http://127.0.0.1/x.dtd"><y/>', "<!DOCTYPE y>"),
    "a document type before a good one": (TEXT.replace(HEAD, f"{HEAD}<!DOCTYPE dcc:x>"), "<!DOCTYPE dcc:x>"),
    "an entity that is not there": (TEXT.replace(SHOWN, "&a;"), "undefined entity"),
    "depth": ("<a>" * 5000 + "</a>" * 5000, "more than 100 levels"),
    "many elements": (f"<a>{'<b/>' * 300_000}</a>", "more than 200,000 elements"),
    "another kind of XML": ("<svg/>", "the first element is 'svg'"),
    "another namespace": (TEXT.replace("https://ptb.de/dcc", "https://ptb.example/dcc"), "the first element is"),
    "half of it": (TEXT[: len(TEXT) // 2], "not well-formed XML"),
    "nothing": ("", "not well-formed XML"),
    "a PDF": ("%PDF-1.7\n", "a PDF under this name"),
    "an unknown encoding": ('<?xml version="1.0" encoding="ebcdic-7"?><a/>', "not well-formed XML"),
    "control characters": (TEXT.replace("4711", "47\x0011"), "not well-formed XML"),
    "two roots": (TEXT + "<a/>", "not well-formed XML"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_xml_is_refused_and_reads_no_other_file(refuse, tmp_path, name):
    text, words = HOSTILE[name]
    (tmp_path / "cell.xml").write_text(text, encoding="utf-8")
    sentence = refuse("cell", tmp_path / "cell.xml")
    assert sentence.startswith("Error: cell.xml")
    assert words in sentence
    assert "root:" not in sentence


def test_files_that_are_missing_folders_pipes_or_too_large_are_refused(refuse, tmp_path):
    assert "does not exist" in refuse("cell", tmp_path / "none.xml")
    assert "cannot be read" in refuse("cell", tmp_path)
    os.mkfifo(tmp_path / "pipe.xml")
    assert "named pipe" in refuse("cell", tmp_path / "pipe.xml")
    with (tmp_path / "large.xml").open("wb") as file:
        file.truncate(17_000_000)
    assert "17 MB" in refuse("cell", tmp_path / "large.xml")


def test_names_in_a_certificate_steer_no_terminal(accept, write):
    printed = accept("cell", write(("K-2026-0815", "K\u202e\u0085[2J"), ("2026-03-02", "2026\n\n[sensors]\ninput_ratio = 5")))
    assert "\u202e" not in printed and "\x85" not in printed
    assert len(printed.splitlines()) == 3


def test_certificates_mangled_at_random_are_read_or_refused(tmp_path):
    """400 of them; whatever is read is a gain that a cell can have."""
    chance, data, refused = random.Random(1), TEXT.encode(), []
    for _ in range(400):
        mangled = bytearray(data)
        for _ in range(chance.choice((1, 1, 3, 20))):
            index = chance.randrange(len(mangled))
            piece = chance.choice((b"", b"\x00", b"<", b">", b"&", b"9", b"-", b" ", b"e9", bytes([chance.randrange(256)])))
            mangled[index : index + chance.choice((1, 1, 40))] = piece
        (tmp_path / "cell.xml").write_bytes(mangled)
        try:
            cell = read_load_cell(tmp_path / "cell.xml")
        except DatasetError as error:
            refused.append(str(error))
        else:
            assert 0.5 < cell.gain < 2 and 0 <= cell.gain_error_sd < 1 and np.isfinite(cell.coverage_factor)
    assert 100 < len(refused) < 400
    assert all(sentence.startswith("cell.xml") and sentence.endswith(".") for sentence in refused)
