"""Uncertainties of a certificate: against the GUM's own end gauge, JCGM 101's rectangular inputs, and t distributions."""

import math

import numpy as np
import pytest
from scipy import stats

from bowdenfit.addons.certificate.answer import CertifiedQuantity
from bowdenfit.addons.certificate.uncertainty import (
    UncertaintyComponent,
    combined_standard_uncertainty,
    coverage_factor,
    effective_degrees_of_freedom,
    fit_t_distribution,
    propagate,
    symmetric_interval,
)

# JCGM 100:2008, table H.1 [nm]: the standard, the difference, and the differences of expansion and of temperature.
END_GAUGE = (
    UncertaintyComponent("length of the standard", "B", 25.0, 18),
    UncertaintyComponent("measured difference", "A", 9.7, 25.6),
    UncertaintyComponent("difference of expansion", "B", 2.9, 50),
    UncertaintyComponent("difference of temperature", "B", 16.6, 2),
)
GRID = (np.arange(200_000) + 0.5) / 200_000  # probabilities whose quantiles stand for draws without any scatter


def test_the_end_gauge_of_the_gum_comes_out_to_its_printed_digits():
    """JCGM 100:2008, H.1: 50.000838 mm, u_c = 32 nm, 16 degrees of freedom, t_99 = 2.92, U = 93 nm."""
    combined, degrees = combined_standard_uncertainty(END_GAUGE), effective_degrees_of_freedom(END_GAUGE)
    assert f"{combined:.0f}" == "32"
    assert math.floor(degrees) == 16  # H.1.6 rounds it down before it looks t up
    factor = coverage_factor(16, 0.99)
    assert f"{factor:.2f}" == "2.92"
    expanded = factor * round(combined)
    assert f"{expanded:.0f}" == "93"
    value, half = 50.000623 + 215e-6, expanded * 1e-6
    interval = (value - half, value + half)
    gauge = CertifiedQuantity("l", "length at 20 degC", "mm", value, combined * 1e-6, interval, 0.99, END_GAUGE)
    assert gauge.in_unit(gauge.value) == "50.000838 mm"
    assert gauge.in_unit(gauge.expanded) == "0.000093 mm"
    assert gauge.degrees == degrees


def test_four_rectangular_inputs_have_the_interval_of_jcgm_101():
    """JCGM 101:2008, 9.2.3.3: 2 sqrt(3) (2 - (3/5)^(1/4)) = 3.88; within 5 standard errors of a million draws."""
    exact = 2 * math.sqrt(3) * (2 - 0.6**0.25)
    assert f"{exact:.2f}" == "3.88"
    draws = propagate(np.zeros(10**6), dict.fromkeys("abcd", 1.0), seed=3)
    assert np.std(draws) == pytest.approx(2, abs=5 * math.sqrt(2) / 1000)
    assert symmetric_interval(draws, 0.95) == pytest.approx((-exact, exact), abs=0.03)


def test_errors_of_two_load_cells_are_triangular_together():
    draws = propagate(np.full(10**6, 7.0), {"gain": 0.1}, seed=4)
    assert np.std(draws) == pytest.approx(0.1, rel=0.005)
    assert np.ptp(draws) == pytest.approx(2 * 0.1 * math.sqrt(6), rel=0.005)  # twice as wide as half of a triangle
    assert stats.kurtosis(draws) == pytest.approx(-0.6, abs=0.02)


def test_what_is_propagated_keeps_the_scatter_of_the_readings():
    readings = stats.norm(3, 0.2).ppf(GRID)
    draws = propagate(readings, {"wrap angles": 0.15, "gain": 0.0}, seed=5)
    assert np.std(draws) == pytest.approx(0.25, rel=0.01)
    assert np.array_equal(propagate(readings, {"wrap angles": 0.15, "gain": 0.0}, seed=5), draws)
    assert np.array_equal(propagate(readings, {}, seed=5), readings)


@pytest.mark.parametrize("degrees", [1.5, 3, 8, 25])
def test_scale_and_degrees_of_a_t_distribution_are_those_it_has(degrees):
    scale, fitted = fit_t_distribution(0.1 + 0.02 * stats.t(degrees).ppf(GRID))
    assert scale == pytest.approx(0.02, rel=1e-3)
    assert fitted == pytest.approx(degrees, rel=0.01)


def test_tails_that_are_no_wider_than_normal_ones_have_infinitely_many_degrees():
    for law in (stats.norm(), stats.uniform(), stats.triang(0.5), stats.t(200)):
        assert fit_t_distribution(law.ppf(GRID))[1] == math.inf
    assert fit_t_distribution(stats.t(0.5).ppf(GRID))[1] == 1.0
    assert effective_degrees_of_freedom((UncertaintyComponent("limits", "B", 2.0, math.inf),)) == math.inf
    assert coverage_factor(math.inf, 0.95) == pytest.approx(1.95996, abs=1e-5)
