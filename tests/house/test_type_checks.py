"""The checks of types and shapes that the other tests run under see what they are there for, and calls of users have types."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float, TypeCheckError, jaxtyped
from type_checks import check

pytestmark = pytest.mark.extended


@jaxtyped(typechecker=check)
def scaled(force: Float[np.ndarray, " rows"], factor: float, drop: int = 0) -> Float[np.ndarray, " rows"]:
    return (force * factor)[drop:]


@jaxtyped(typechecker=check)
def label(number: int) -> str:
    return "N" if number else number


def test_what_fits_is_let_through():
    np.testing.assert_array_equal(scaled(np.ones(3), np.float64(2.0)), np.full(3, 2.0))
    assert label(1) == "N"


@pytest.mark.parametrize("arguments", [(np.ones((3, 1)), 2.0), (np.ones(3), "2"), (np.ones(3), 2.0, "0")])
def test_what_is_given_is_checked(arguments):
    with pytest.raises(TypeCheckError, match="whilst checking the parameters"):
        scaled(*arguments)


def test_what_comes_back_is_checked_against_what_was_given():
    with pytest.raises(TypeCheckError, match="whilst checking the return value"):
        scaled(np.ones(3), 2.0, drop=1)
    with pytest.raises(TypeCheckError, match="whilst checking the return value"):
        label(0)


ROOT = Path(__file__).parents[2]
CALLS = ROOT / "tests" / "support" / "typed_calls.py"
MYPY = ("mypy", "--no-error-summary", "--hide-error-context")


@pytest.mark.parametrize("checker", [MYPY, ("basedpyright", "--level", "error")], ids=lambda command: command[0])
def test_type_checkers_accept_calls_as_users_write_them_and_refuse_what_does_not_run(checker):
    refused = [i for i, line in enumerate(CALLS.read_text(encoding="utf-8").splitlines(), 1) if line.endswith("# refused")]
    command = [sys.executable, "-m", *checker, str(CALLS)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)
    lines = re.findall(r"typed_calls\.py:(\d+)(?::\d+)?(?::| -) error", done.stdout)
    assert sorted(set(map(int, lines))) == refused and len(refused) == 10, done.stdout + done.stderr
