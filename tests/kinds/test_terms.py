"""What every kind of measurement declares of its half in the likelihood."""

from pathlib import Path

import pytest

from bowdenfit.dataset import load_dataset
from bowdenfit.kinds import KINDS, find_readings, iterate_tables
from bowdenfit.kinds.candidate import CandidateKind
from bowdenfit.kinds.kind import FrictionKind, Kind, PlannedKind, RopeKind
from bowdenfit.kinds.term import TermKind
from bowdenfit.kinds.terms import TERMS
from bowdenfit.models import build_model

READINGS = [(name, readings) for name, kind in KINDS.items() for readings in kind.readings]


def test_every_kind_of_table_has_a_term_of_the_same_name():
    assert list(TERMS) == list(KINDS)


@pytest.mark.parametrize(
    ("base", "needed"),
    [
        (Kind, {"describe", "name", "read", "readings", "table"}),
        (FrictionKind, {"conditions"}),
        (RopeKind, {"bends"}),
        (PlannedKind, {"design", "empty_table", "file_rows"}),
        (TermKind, {"draw", "name", "parameters", "terms"}),
        (CandidateKind, {"candidates", "name", "needs", "order", "simulation", "unknown"}),
    ],
)
def test_a_kind_that_lacks_what_it_must_give_is_refused_by_python_itself(base, needed):
    of_every_kind = dict.fromkeys(Kind.__abstractmethods__ - needed)
    incomplete = type("Incomplete", (base,), of_every_kind)
    assert incomplete.__abstractmethods__ == needed
    with pytest.raises(TypeError) as refusal:  # each Python has words of its own for it
        incomplete()
    assert all(name in str(refusal.value) for name in needed)


def test_no_two_kinds_call_their_readings_alike():
    names = [readings.name for _, readings in READINGS]
    assert len(names) == len(set(names))


@pytest.mark.parametrize(("kind", "readings"), READINGS, ids=lambda value: getattr(value, "name", value))
def test_every_table_is_called_as_the_description_calls_it(kind, readings):
    assert readings.table.split()[-1] == kind
    assert find_readings(readings.name) is readings


@pytest.mark.parametrize(("kind", "readings"), READINGS, ids=lambda value: getattr(value, "name", value))
def test_readings_say_all_that_sentences_and_figures_need(kind, readings):
    assert readings.one.count("{}") == 1
    assert readings.words
    assert readings.axis[0].isupper()


@pytest.mark.parametrize("name", ["on-body-exoskeleton", "synthetic-bench", "synthetic-haptic-loop"])
def test_every_term_is_named_by_its_kind(name):
    dataset = load_dataset(Path(__file__).parents[2] / "datasets" / name)
    named = {readings.name for kind, _ in iterate_tables(dataset.measurements) for readings in kind.readings}
    assert {term.name for term in build_model(dataset).terms} <= named
