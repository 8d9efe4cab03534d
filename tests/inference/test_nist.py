"""The solver on NIST's certified nonlinear regressions: 27 problems from two starts each, the far one first.

The certified values were computed in quadruple precision and have 11 digits. Certified numbers are of the readings as they
stand; where readings leave a residual of 1e-13 of themselves (Lanczos1), double precision cannot know its size to more than
three digits, and with it the standard errors.
"""

from functools import cache

import numpy as np
import pytest
from strd import FOLDER, MODELS, Certification, certify, problem

DIGITS_OF_PARAMETERS, DIGITS_OF_ERRORS = 6.0, 4.0
ROUNDED = {"lanczos1": 2.5}  # problems whose residuals double precision rounds away, and digits of errors that are left


@cache
def certified(name: str) -> tuple[Certification, Certification]:
    return certify(problem(name))


def test_there_are_27_problems_each_with_its_source():
    files = sorted(FOLDER.glob("*.toml"))
    assert [path.stem for path in files] == sorted(MODELS)
    assert len(files) == 27
    for path in files:
        assert f'source = "NIST StRD, nonlinear regression, {problem(path.stem).name}"' in path.read_text()


@pytest.mark.parametrize("name", sorted(set(MODELS) - set(ROUNDED)))
def test_readings_leave_the_certified_sum_of_squares_at_the_certified_parameters(name):
    """A reading or a certified value copied wrong would not."""
    regression = problem(name)
    residuals, _ = regression.evaluate()(regression.certified)
    assert float(residuals @ residuals) == pytest.approx(regression.residual_sum_of_squares, rel=2e-10)


@pytest.mark.parametrize("name", sorted(MODELS))
@pytest.mark.parametrize("start", [1, 2])
def test_parameters_and_standard_errors_have_the_certified_digits(name, start):
    certified_fit = certified(name)[start - 1]
    assert certified_fit.succeeded
    assert certified_fit.parameters >= DIGITS_OF_PARAMETERS
    assert certified_fit.standard_errors >= ROUNDED.get(name, DIGITS_OF_ERRORS)
    assert certified_fit.sum_of_squares >= ROUNDED.get(name, 8.0)


def test_at_least_52_of_54_runs_have_the_parameters_and_50_their_standard_errors():
    runs = [run for name in MODELS for run in certified(name)]
    assert sum(run.parameters >= DIGITS_OF_PARAMETERS for run in runs) >= 52
    assert sum(run.standard_errors >= DIGITS_OF_ERRORS for run in runs) >= 50


def test_a_reading_changed_in_its_fourth_digit_would_be_noticed():
    regression = problem("misra1a")
    changed = regression.y.copy()
    changed[3] *= 1.001
    residuals, _ = regression.evaluate()(regression.certified)
    wrong = residuals + regression.y - changed
    assert abs(float(wrong @ wrong) / regression.residual_sum_of_squares - 1) > 1e-3
    assert np.all(np.isfinite(residuals))
