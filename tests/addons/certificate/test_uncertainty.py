"""Uncertainties of a certificate: against the GUM's own end gauge, JCGM 101's rectangular inputs, and t distributions."""

import math

import numpy as np
import pytest
from scipy import stats

from bowdenfit.addons.certificate.answer import CertifiedQuantity
from bowdenfit.addons.certificate.uncertainty import (
    UncertaintyComponent,
    combined_standard_uncertainty,
)
from bowdenfit.inference.degrees_of_freedom import coverage_factor, effective_degrees_of_freedom, fit_t_distribution

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
    combined = combined_standard_uncertainty(END_GAUGE)
    degrees = effective_degrees_of_freedom([part.standard for part in END_GAUGE], [part.degrees for part in END_GAUGE])
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


@pytest.mark.parametrize("degrees", [1.5, 3, 8, 25])
def test_scale_and_degrees_of_a_t_distribution_are_those_it_has(degrees):
    scale, fitted = fit_t_distribution(0.1 + 0.02 * stats.t(degrees).ppf(GRID))
    assert scale == pytest.approx(0.02, rel=1e-3)
    assert fitted == pytest.approx(degrees, rel=0.01)


def test_tails_that_are_no_wider_than_normal_ones_have_infinitely_many_degrees():
    for law in (stats.norm(), stats.uniform(), stats.triang(0.5), stats.t(200)):
        assert fit_t_distribution(law.ppf(GRID))[1] == math.inf
    assert fit_t_distribution(stats.t(0.5).ppf(GRID))[1] == 1.0
    assert effective_degrees_of_freedom([2.0], [math.inf]) == math.inf
    assert coverage_factor(math.inf, 0.95) == pytest.approx(1.95996, abs=1e-5)
