"""Data frames in place of files: the same data set, whichever library they are of, and a sentence for what is none."""

import re

import numpy as np
import pandas as pd
import pytest

import bowdenfit as bf
from bowdenfit.errors import BowdenfitError
from bowdenfit.kinds.forces.table import ForceTable

ANGLE = "90deg"


@pytest.fixture
def frame():
    force = np.repeat([20.0, 40.0, 60.0], 4) * (1 + 0.01 * np.random.default_rng(1).standard_normal(12))
    return pd.DataFrame({"input force (N)": force, "output force (N)": 0.83 * force + np.arange(12) / 100})


def forces_of(source, **reading):
    table = bf.read(source, wrap_angle=ANGLE, **reading).measurements.table(ForceTable)
    assert table is not None
    return table


def test_a_frame_is_read_as_its_csv_file(frame, tmp_path):
    frame.to_csv(tmp_path / "bench.csv", index=False)
    expected, table = forces_of(tmp_path / "bench.csv"), forces_of(frame)
    np.testing.assert_array_equal(table.input_force, expected.input_force)
    np.testing.assert_array_equal(table.output_force, expected.output_force)
    assert "12 force readings" in str(bf.check(frame, wrap_angle=ANGLE))


def test_units_of_columns_may_be_attributes_also_of_columns_that_are_gone(frame):
    bare = frame.rename(columns=lambda name: name.removesuffix(" (N)"))
    bare.attrs["units"] = {"input force": "lbf", "output force": "lbf", "time": "s"}
    np.testing.assert_allclose(forces_of(bare).input_force, 4.4482216152605 * frame["input force (N)"])


def test_a_named_index_is_a_column(frame):
    runs = frame.set_index(pd.Index(np.repeat(["first", "second"], 6), name="run"))
    assert forces_of(runs).run_names == ("first", "second")


def test_a_frame_of_another_library_writes_itself(frame):
    class Polars:
        """What is used of a polars DataFrame."""

        columns = tuple(frame.columns)

        def write_csv(self, path):
            frame.to_csv(path, index=False)

    np.testing.assert_array_equal(forces_of(Polars()).input_force, frame["input force (N)"])


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (np.ones(3), "ndarray is not a data set"),
        (pd.DataFrame({("a", "N"): [1.0]}), "several levels of names"),
        (pd.DataFrame({"input force (N)": []}), "no measurements"),
        (pd.DataFrame({"input force (N)": [1.0, 2.0]}), r"dataframe\.csv has no column"),
    ],
)
def test_what_is_no_table_of_readings_is_a_sentence(source, words):
    with pytest.raises(bf.BowdenfitError, match=words):
        bf.read(source, wrap_angle=ANGLE)


def test_units_that_are_no_dictionary_are_a_sentence(frame):
    frame.attrs["units"] = "N"
    with pytest.raises(bf.UsageError, match="must be a dictionary by column"):
        bf.read(frame, wrap_angle=ANGLE)


@pytest.mark.parametrize(
    ("columns", "keywords", "words"),
    [
        ({"input_force_N": [20, 40], "output_force_N": [15, 30]}, {}, 'no description; .* such as wrap_angle="180deg"'),
        ({"a": [20, 40], "b": [15, 30]}, {"wrap_angle": "180deg"}, r"columns=\['input_force=a:N'\]"),
        ({"input_force_N": [20, -9999], "output_force_N": [15, 30]}, {"wrap_angle": "180deg"}, r"missing=\[-9999\]\."),
    ],
)
def test_a_refused_frame_names_keywords_of_python_and_no_options(columns, keywords, words):
    with pytest.raises(BowdenfitError, match=words) as refusal:
        bf.read(pd.DataFrame(columns), **keywords)
    assert "--" not in str(refusal.value) and "cable.toml" not in str(refusal.value)


def test_check_asks_no_more_of_a_frame_than_the_command_does_of_its_file(frame):
    frame["fish"] = np.repeat([1, 2, 3], 4)
    report = bf.check(frame.rename(columns={"input force (N)": "F1", "output force (N)": "F2"}))
    assert "the data frame: a table of 12" in str(report)
    call = re.search(r"bf\.fit\(frame, .*\)", str(report))[0]
    assert "wrap_angle='180deg'" in call
    assert "columns=['input_force=F1:N', 'output_force=F2:N']" in call
    assert bf.check(frame, wrap_angle=ANGLE).description.name
    with pytest.raises(BowdenfitError, match="fish"):
        bf.check(frame, columns=["input_force=fish:m"])


def test_help_lists_every_keyword_of_reading():
    for verb in (bf.fit, bf.check, bf.read, bf.model):
        assert "wrap_angle: Wrap angle of a single table" in verb.__doc__, verb
    assert "Example:" in bf.fit.__doc__
