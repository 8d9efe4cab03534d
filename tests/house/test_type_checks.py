"""The checks of types and shapes that the other tests run under see what they are there for."""

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
