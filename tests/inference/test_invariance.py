"""Coefficients do not depend on how a table is written: units, order of rows and columns, spelling, separators."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import bowdenfit as bf
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.tables import AngleTable

pytestmark = pytest.mark.extended

ANGLES = [
    (430, 58, None),
    (440, 45, None),
    (450, 30, 11),
    (460, 26, 13),
    (470, 19, 19),
    (480, 17, 28),
    (490, 11, 40),
    (500, 10, 56),
    (510, None, 68),
    (520, None, 91),
    (530, None, 118),
]
FORCES = [
    (440, "a", "pull", 50.0, 38.5),
    (440, "a", "return", 40.0, 52.0),
    (470, "b", "pull", 60.0, 47.1),
    (470, "b", "pull", 80.0, 62.9),
    (510, "c", "pull", 70.0, 52.6),
    (525, "d", "return", 30.0, 42.0),
]
LENGTH_UNITS = {"mm": 1.0, "cm": 0.1, "m": 0.001, "inch": 1 / 25.4}
ANGLE_UNITS = {"deg": 1.0, "rad": np.pi / 180, "turn": 1 / 360, "°": 1.0}
FORCE_UNITS = {"N": 1.0, "kN": 0.001, "lbf": 1 / 4.4482216152605}


@st.composite
def spellings(draw):
    """One way to write all tables down."""
    delimiter, comma = draw(st.sampled_from([(",", False), (";", True), (";", False), ("\t", True), ("\t", False)]))
    return {
        "length": draw(st.sampled_from(list(LENGTH_UNITS))),
        "angle": draw(st.sampled_from(list(ANGLE_UNITS))),
        "force": draw(st.sampled_from(list(FORCE_UNITS))),
        "style": draw(st.sampled_from(["{}_{}", "{} [{}]", "{} ({})"])),
        "title": draw(st.booleans()),
        "delimiter": delimiter,
        "comma": comma,
        "seed": draw(st.integers(0, 2**20)),
        "encoding": draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16"])),
        "newline": draw(st.sampled_from(["\n", "\r\n"])),
        "remark": draw(st.booleans()),
        "strokes": draw(st.sampled_from([{"pull": "pull", "return": "return"}, {"pull": "+1", "return": "-1"}])),
    }


def written(path, spelling, columns):
    """Write columns (name, unit, cells), shuffled as the spelling says."""
    order = np.random.default_rng(spelling["seed"])
    names = [name.replace("_", " ").capitalize() if spelling["title"] else name for name, _, _ in columns]
    style = spelling["style"] if not (spelling["title"] and spelling["style"] == "{}_{}") else "{} [{}]"
    heads = [style.format(name, unit) if unit else name for name, (_, unit, _) in zip(names, columns, strict=True)]
    rows = list(zip(*(cells for _, _, cells in columns), strict=True))
    across, down = order.permutation(len(columns)), order.permutation(len(rows))
    lines = [[heads[i] for i in across], *([rows[j][i] for i in across] for j in down)]
    text = spelling["newline"].join(spelling["delimiter"].join(line) for line in lines) + spelling["newline"]
    remark = "# a remark" + spelling["newline"] if spelling["remark"] else ""
    path.write_bytes((remark + text).encode(spelling["encoding"]))


def number(value, factor, spelling):
    """A number with all its digits, in the unit and with the decimal sign of the spelling."""
    text = f"{value * factor:.15g}"
    if "." not in text and "e" not in text:
        text += ".0"
    return text.replace(".", ",") if spelling["comma"] else text


def dataset(folder, spelling, on_body):
    """The data set, written as the spelling says."""
    text = (
        (on_body / "cable.toml")
        .read_text()
        .replace('efficiencies = { file = "efficiencies.csv" }', 'forces = { files = "f.csv" }')
    )
    (folder / "cable.toml").write_text(text)
    length, angle, force = (
        LENGTH_UNITS[spelling["length"]],
        ANGLE_UNITS[spelling["angle"]],
        FORCE_UNITS[spelling["force"]],
    )

    def angles(k):
        return ["" if row[k] is None else number(row[k], angle, spelling) for row in ANGLES]

    def of(rows, k, factor):
        return [number(row[k], factor, spelling) for row in rows]

    written(
        folder / "angles.csv",
        spelling,
        [
            ("cable_length", spelling["length"], of(ANGLES, 0, length)),
            ("squeezed_sheath_angle", spelling["angle"], angles(1)),
            ("free_sheath_angle", spelling["angle"], angles(2)),
        ],
    )
    written(
        folder / "f.csv",
        spelling,
        [
            ("cable_length", spelling["length"], of(FORCES, 0, length)),
            ("run", "", [row[1] for row in FORCES]),
            ("stroke", "", [spelling["strokes"][row[2]] for row in FORCES]),
            ("input_force", spelling["force"], of(FORCES, 3, force)),
            ("output_force", spelling["force"], of(FORCES, 4, force)),
        ],
    )
    return bf.read(folder)


PLAIN = {
    "length": "mm",
    "angle": "deg",
    "force": "N",
    "style": "{}_{}",
    "title": False,
    "delimiter": ",",
    "comma": False,
    "seed": 0,
    "encoding": "utf-8",
    "newline": "\n",
    "remark": False,
    "strokes": {"pull": "pull", "return": "return"},
}


def sorted_tables(data):
    """All numbers of a data set, rows in a fixed order."""
    angles, forces = data.measurements.table(AngleTable), data.measurements.table(ForceTable)
    columns = np.nan_to_num(np.column_stack([angles.route, angles.angle, angles.limit]), nan=-1.0)
    names = np.array([ord(name) for name in forces.run_names])[forces.run]
    two = np.column_stack([forces.route, names, forces.stroke, forces.input_force, forces.output_force])
    return [table[np.lexsort(np.round(table.T[::-1], 9))] for table in (columns, two)]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(spellings())
def test_tables_are_the_same_however_they_are_written(tmp_path_factory, on_body, spelling):
    plain, other = (dataset(tmp_path_factory.mktemp("spelling"), s, on_body) for s in (PLAIN, spelling))
    for expected, computed in zip(sorted_tables(plain), sorted_tables(other), strict=True):
        np.testing.assert_allclose(computed, expected, rtol=1e-12, atol=1e-12)


ODD = PLAIN | {
    "length": "inch",
    "angle": "turn",
    "force": "lbf",
    "style": "{} ({})",
    "title": True,
    "delimiter": ";",
    "comma": True,
    "seed": 77,
    "encoding": "utf-16",
    "newline": "\r\n",
    "strokes": {"pull": "+1", "return": "-1"},
}


def test_coefficients_are_the_same_however_the_tables_are_written(tmp_path, on_body):
    folders = [tmp_path / "plain", tmp_path / "odd"]
    for folder, spelling in zip(folders, (PLAIN, ODD), strict=True):
        Path(folder).mkdir()
        dataset(folder, spelling, on_body)
    plain, odd = (bf.fit(folder, mcmc=False).least_squares for folder in folders)
    assert plain.estimates.keys() == odd.estimates.keys()
    for name, estimate in plain.estimates.items():
        assert odd.estimates[name].identified == estimate.identified
        assert odd.estimates[name].value == pytest.approx(estimate.value, rel=1e-7, nan_ok=True)
        assert odd.estimates[name].standard_error == pytest.approx(estimate.standard_error, rel=1e-5, nan_ok=True)
