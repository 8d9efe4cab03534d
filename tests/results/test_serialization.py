"""Any dataclass as plain data, and stored data back bit for bit."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from bowdenfit.results.serialization import deserialize, plain_data, serialize
from bowdenfit.types import Flags, Labels, Matrix, Vector


@dataclass(frozen=True)
class Inner:
    value: float
    words: str

    JSON: ClassVar = ("words", "twice")

    @property
    def twice(self) -> float:
        return 2 * self.value


@dataclass(frozen=True)
class Outer:
    inner: tuple[Inner, ...]
    by_name: dict[str, Inner]
    vector: Vector
    matrix: Matrix
    flags: Flags
    labels: Labels
    pair: tuple[float, float]
    perhaps: Inner | None


OUTER = Outer(
    (Inner(1 / 3, "a"),),
    {"b": Inner(float("inf"), "c")},
    np.array([0.1, np.nan, -np.inf]),
    np.zeros((0, 0)),
    np.array([True]),
    np.array([3]),
    (float("nan"), -float("inf")),
    None,
)


def test_an_answer_gives_the_attributes_that_its_json_names_and_no_number_where_there_is_none():
    assert plain_data(OUTER)["inner"] == [{"words": "a", "twice": 2 / 3}]
    assert plain_data(OUTER)["by_name"] == {"b": {"words": "c", "twice": None}}
    assert plain_data(OUTER)["vector"] == [0.1, None, None]
    assert plain_data({"sd": np.float64(0.5), "n": np.int64(2)}) == {"sd": 0.5, "n": 2}


def test_stored_data_come_back_bit_for_bit():
    again = deserialize(Outer, json.loads(json.dumps(serialize(OUTER), allow_nan=False)))
    for name in vars(OUTER):
        first, other = getattr(OUTER, name), getattr(again, name)
        assert type(first) is type(other), name
        np.testing.assert_equal(other, first, err_msg=name)
        if isinstance(first, np.ndarray):
            assert (first.dtype, first.shape) == (other.dtype, other.shape), name


@dataclass(frozen=True)
class WithColumns:
    vector: Vector
    columns: Mapping[str, Vector] = field(default_factory=dict)


def test_arrays_by_name_come_back_as_arrays_and_may_be_missing_in_older_data():
    again = deserialize(WithColumns, serialize(WithColumns(np.array([1.0]), {"Trial": np.array([2.0, 3.0])})))
    assert isinstance(again.columns["Trial"], np.ndarray) and again.columns["Trial"].tolist() == [2.0, 3.0]
    assert deserialize(WithColumns, {"vector": [1.0]}).columns == {}
