"""Numbers at known places, against NumPy's own indexing."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bowdenfit.parameters.places import put, taken

PLACES = {
    "all in order": [0, 1, 2, 3, 4, 5],
    "in the middle": [2, 3],
    "here and there": [0, 2, 3, 5],
    "in another order": [5, 1, 0, 4, 2, 3],
    "one of them": [4],
    "none": [],
}


@pytest.fixture(params=PLACES)
def places(request) -> np.ndarray:
    return np.array(PLACES[request.param], dtype=int)


@pytest.fixture
def whole() -> np.ndarray:
    return np.random.default_rng(1).standard_normal((3, 6))


def test_what_is_taken_is_what_an_index_takes(places, whole):
    np.testing.assert_array_equal(jax.jit(lambda x: taken(x, places))(whole), whole[:, places])
    np.testing.assert_array_equal(jax.jit(lambda x: taken(x, places))(whole[0]), whole[0, places])


def test_what_is_put_replaces_what_an_index_names_and_nothing_else(places, whole):
    part, expected = np.full((3, len(places)), 7.0) + np.arange(3)[:, None], whole.copy()
    expected[:, places] = part
    np.testing.assert_array_equal(jax.jit(lambda x, y: put(x, places, y))(whole, part), expected)


def test_slopes_go_through_both(places, whole):
    """The derivative of what is put and taken again, and none of what it replaced."""
    part = jnp.arange(1.0, 1.0 + len(places))
    of_part, of_whole = jax.jacobian(lambda x, y: taken(put(y, places, x), places), (0, 1))(part, jnp.asarray(whole[0]))
    np.testing.assert_array_equal(of_part, np.eye(len(places)))
    np.testing.assert_array_equal(of_whole, np.zeros((len(places), 6)))
