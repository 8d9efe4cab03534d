"""Which measurements are named as equally good."""

from dataclasses import replace

import numpy as np

from bowdenfit.questions.next.ranking import is_as_good
from bowdenfit.questions.next.variance_reduction import Explained, error_of_difference


def test_a_gain_of_zero_is_no_tie_however_large_its_monte_carlo_error():
    """As 530 mm in the on-body data: a share of 0, known to 0.2 of the variance, beside a best of 0.3."""
    groups = np.arange(32) % 2 - 0.5
    best, nothing, alike = (Explained(share, 0.02, share + np.zeros(32)) for share in (0.3, 0.0, 0.29))
    nothing, alike = replace(nothing, error=0.2, without=0.072 * groups), replace(alike, without=0.29 + 0.01 * groups)
    assert 2 * error_of_difference(best, nothing) > 0.3  # within the error of the difference
    assert not is_as_good(best, nothing)
    assert is_as_good(best, alike)
    assert not is_as_good(best, replace(alike, share=0.1))  # clearly above 0, and clearly below the best
