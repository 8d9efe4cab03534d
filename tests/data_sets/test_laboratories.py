"""Simulated laboratories unlike ours: only the right model is trusted, and any other end names its cause."""

import pytest
from bench_simulator import LABORATORIES
from laboratory_fits import ending, fault, held
from scipy.stats import binomtest

pytestmark = pytest.mark.extended

QUICK = (
    ("threads on weights of 0.5 to 3 N", "capstan"),
    ("a winch of 20 kN, mounted once", "capstan"),
    ("a tube with drag", "capstan"),
    ("a tube with drag", "drag"),
    ("a bench that warms up", "capstan"),
    ("a dead cell", "capstan"),
    ("swapped cells", "capstan"),
    ("a position taken for a force", "capstan"),
)
EVERY = [(name, model) for name, laboratory in LABORATORIES.items() for model in laboratory.models]


@pytest.mark.parametrize(("name", "model"), QUICK)
def test_only_the_right_model_is_trusted_and_the_cause_is_named(tmp_path, name, model):
    laboratory = LABORATORIES[name]
    assert not fault(laboratory, model, *ending(laboratory, laboratory.write(tmp_path / "0", 0), model))


def test_a_wrong_end_is_a_fault():
    laboratory = LABORATORIES["a tube with drag"]
    assert fault(laboratory, "capstan", 0, "") == "capstan: exit 0"
    assert fault(laboratory, "drag", 3, "") == "drag: exit 3"
    assert fault(laboratory, "capstan", 3, "look at the units") == "capstan: exit 3 without its cause"


def test_there_are_twelve_from_half_a_newton_to_twenty_kilonewtons():
    loads = [load for laboratory in LABORATORIES.values() for load in laboratory.loads]
    assert (len(LABORATORIES), min(loads), max(loads)) == (12, 0.5, 2e4)
    assert {1, 3, 20} <= {len(laboratory.places) for laboratory in LABORATORIES.values()}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "model"), EVERY)
def test_so_it_is_in_five_sessions_of_every_laboratory(tmp_path, name, model):
    laboratory = LABORATORIES[name]
    for seed in range(5):
        assert not fault(laboratory, model, *ending(laboratory, laboratory.write(tmp_path / str(seed), seed), model))


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, laboratory in LABORATORIES.items() if laboratory.right])
def test_intervals_of_the_right_model_hold_the_truth(tmp_path, name):
    """At their rate or more; each fails by chance in one of 1000 runs with other seeds."""
    coverage = held(LABORATORIES[name], 100, tmp_path)
    fitted = coverage.pop("")
    assert fitted >= 90
    for count in coverage.values():
        assert count >= 0.9 * fitted or binomtest(count, fitted, 0.9).pvalue > 2e-3
