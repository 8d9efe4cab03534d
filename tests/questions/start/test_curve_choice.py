"""Which curve `init` proposes for wrap angles: a bell, unless another predicts angles left out better."""

import numpy as np
import pytest

from bowdenfit.description import Route
from bowdenfit.questions.start.curve_choice import leave_one_out_errors, propose_curve

ROUTE = Route(variable="cable_length", unit="mm", range=(400.0, 600.0))


def read_angles(shape, n, seed, noise_deg=1.5):
    """Lengths [mm] and read angles [rad] of a shape over 0 to 1 [deg]."""
    x = np.linspace(0, 1, n)
    return 400 + 200 * x, np.deg2rad(shape(x) + noise_deg * np.random.default_rng(seed).standard_normal(n))


def straight(x):
    return 20 + 80 * x


def bell(x):
    return 90 * np.exp(-(((x - 0.3) / 0.4) ** 2))


def kinked(x):
    return np.interp(x, [0, 0.5, 1], [100, 30, 12])


@pytest.mark.parametrize(("shape", "curve"), [(straight, "smooth"), (kinked, "smooth"), (bell, "gaussian")])
def test_angles_that_follow_no_bell_are_not_given_one(shape, curve):
    """Of simulated benches 23 of 62 bells and 2 of 64 lines are proposed otherwise; these seeds are of the rest."""
    lengths, angles = read_angles(shape, 21, 1)
    assert propose_curve(ROUTE, lengths, angles) == curve


def test_too_few_angles_leave_the_bell():
    assert propose_curve(ROUTE, *read_angles(straight, 3, 1)) == "gaussian"


def test_angles_too_small_to_detect_are_not_taken_for_zeros():
    lengths, angles = read_angles(bell, 21, 2)
    hidden = np.where(angles < np.deg2rad(20), np.nan, angles)
    assert np.isnan(hidden).sum() > 3
    assert propose_curve(ROUTE, lengths, hidden) == "gaussian"


def test_errors_are_those_of_fits_without_the_reading():
    """Of a line exactly, but for its priors: the leverage of a linear fit is not an approximation."""
    lengths, angles = read_angles(straight, 9, 3)
    errors = leave_one_out_errors(ROUTE, lengths, angles)["line"]
    for i, error in enumerate(errors):
        remaining = np.arange(len(lengths)) != i
        fitted = np.polyval(np.polyfit(lengths[remaining], angles[remaining], 1), lengths[i])
        assert error == pytest.approx(fitted - angles[i], abs=np.deg2rad(0.3))
