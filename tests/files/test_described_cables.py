"""Cables described in Python are those of a folder with the same words and numbers; what is wrong is said in a sentence."""

from typing import get_args

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT

import bowdenfit as bf
from bowdenfit.cable.registry import CURVES
from bowdenfit.described_cable import CurveName

ON_BODY = ROOT / "datasets" / "on-body-exoskeleton"
LIMIT = {"angles": {"detection_limit": {"value": 10, "unit": "deg"}}}
FREE, SQUEEZED = {"published_range": (450, 530)}, {"published_range": (430, 510)}
ROUTE = {"variable": "cable_length", "unit": "mm", "range": (430, 530)}


def on_body(**settings):
    contacts = [
        bf.Contact("free sheath", "mu1", curve="gaussian", column="free_sheath_angle", settings=FREE),
        bf.Contact("squeezed sheath", "mu2", curve="gaussian", column="squeezed_sheath_angle", settings=SQUEEZED),
        bf.Contact("bracket edge", "mu3", wrap_angle=(45, "deg")),
    ]
    return bf.Cable("On body", contacts, **{"route": ROUTE, "tables": LIMIT} | settings)


def table(name):
    return pd.read_csv(ON_BODY / f"{name}.csv", comment="#")


def arrays_of(readings):
    """The arrays of a table, by name."""
    return {name: value for name, value in vars(readings).items() if isinstance(value, np.ndarray)}


def test_readings_are_those_of_a_folder():
    data, same = on_body().read(angles=table("angles"), efficiencies=table("efficiencies")), bf.read(ON_BODY)
    for first, other in zip(data.measurements.tables, same.measurements.tables, strict=True):
        np.testing.assert_equal(arrays_of(first), arrays_of(other))
    assert data.description.contact == same.description.contact


def test_a_cable_that_was_written_is_read_as_it_was_described(tmp_path):
    cable, tables = on_body(noise="student"), {"angles": table("angles"), "efficiencies": table("efficiencies")}
    data, written = cable.read(**tables), bf.read(cable.write(tmp_path / "new" / "cable", **tables))
    for first, other in zip(data.measurements.tables, written.measurements.tables, strict=True):
        np.testing.assert_equal(arrays_of(first), arrays_of(other))
    assert written.description == data.description
    with pytest.raises(bf.UsageError, match="exists already"):
        cable.write(tmp_path / "new" / "cable", **tables)
    with pytest.raises(bf.UsageError, match="no table 'angle'"):
        cable.write(tmp_path / "other", angle=table("angles"))
    assert not (tmp_path / "other").exists()


def test_a_contact_declares_the_curves_that_there_are():
    assert get_args(CurveName) == tuple(CURVES)


def test_arrays_by_heading_are_a_table():
    forces = {"input force (N)": [20, 40.0, 60], "output force (N)": np.array([16.5, 33.1, 49.3])}
    data = bf.Cable("bench", [bf.Contact("sheath", "mu", wrap_angle=(90, "deg"))]).read(forces=forces)
    assert "3 force readings" in str(data)


FORCES = {"input force (N)": [20, 40], "output force (N)": [16, 33]}
SHEATH = bf.Contact("sheath", "mu", wrap_angle=(90, "deg"))


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: bf.Cable("x", []), "needs its contacts"),
        (lambda: bf.Cable("x", [{"name": "sheath"}]), "needs its contacts"),
        (lambda: bf.Cable("x", [bf.Contact("a", "mu", wrap_angle=45)]), "must be a number and its unit"),
        (lambda: bf.Cable("x", [SHEATH]).read(), "there are no readings"),
        (lambda: bf.Cable("x", [SHEATH]).read(force=FORCES), "no table 'force'; did you mean 'forces'"),
        (lambda: bf.Cable("x", [SHEATH]).read(forces=[20, 40]), "forces is a list and no table"),
        (lambda: bf.Cable("x", [SHEATH]).read(forces=FORCES | {"run": [1]}), "must be equally long"),
        (lambda: bf.Cable("x", [SHEATH], rout=ROUTE).read(forces=FORCES), "unknown key 'rout'; did you mean 'route'"),
        (lambda: bf.Cable("x", [SHEATH], tables={"angel": {}}).read(forces=FORCES), "unknown key 'tables.angel'"),
        (lambda: bf.Cable("x", [SHEATH]).read(forces={"input force (N)": [20], "out": [16]}), "no column output_force"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(call, says):
    with pytest.raises(bf.BowdenfitError, match=says):
        call()
