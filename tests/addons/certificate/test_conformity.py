"""Decisions and risks: against JCGM 106, another program, and integration by SciPy."""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import dblquad
from scipy.optimize import brentq

from bowdenfit.addons.certificate.conformity import (
    ToleranceInterval,
    conformance_probability,
    decide,
    global_risks,
    normal_production,
    refuse_empty_acceptance,
)
from bowdenfit.errors import DescriptionError

GRID = stats.norm.ppf((np.arange(400_000) + 0.5) / 400_000)  # a standard normal distribution without scatter


@pytest.mark.parametrize(
    ("probability", "z"), [("0.80", "0.84"), ("0.90", "1.28"), ("0.95", "1.64"), ("0.99", "2.33"), ("0.999", "3.09")]
)
def test_distances_from_a_limit_have_the_probabilities_of_jcgm_106(probability, z):
    """JCGM 106:2012, 7.3, table 1: probability of conformity and (limit - value) / u, one limit, normal distribution."""
    value, u = 7.3, 0.05

    def conforms(distance):
        return conformance_probability(value + u * GRID, ToleranceInterval(upper=value + distance * u))

    limit = brentq(lambda distance: conforms(distance) - float(probability), 0.5, 3.5, xtol=1e-6)
    assert f"{limit:.2f}" == z
    lower = ToleranceInterval(lower=value - limit * u)
    assert conformance_probability(value + u * GRID, lower) == pytest.approx(float(probability), abs=1e-5)


@pytest.mark.parametrize(
    ("value", "u", "tolerance", "printed"),
    [
        (-5.47, 0.05, ToleranceInterval(upper=-5.40), "0.92"),  # example 1: breakdown voltage of a Zener diode, in V
        (509.7, 8.6, ToleranceInterval(lower=490.0), "0.99"),  # example 2: burst strength of a container, in kPa
    ],
)
def test_the_examples_of_one_limit_have_the_probabilities_that_jcgm_106_prints(value, u, tolerance, printed):
    """JCGM 106:2012, 7.4."""
    assert f"{conformance_probability(value + u * GRID, tolerance):.2f}" == printed


def test_the_acceptance_limit_of_the_speed_trap_is_that_of_jcgm_106():
    """JCGM 106:2012, 8.3.2.3: fined if faster than 100 km/h with a probability of at least 99.9 %; u is 2 % of the speed."""
    limit = ToleranceInterval(lower=100.0)
    fined = brentq(lambda speed: conformance_probability(speed + 0.02 * speed * GRID, limit) - 0.999, 101, 120, xtol=1e-6)
    assert f"{fined:.0f}" == "107"
    assert decide(106.0, ToleranceInterval(upper=100.0), fined - 100.0) == "conditional fail"


def test_the_ball_bearings_of_jcgm_106_have_the_risks_that_another_program_finds():
    """JCGM 106:2012, 9.5.4: radial error motion below 2 um, gamma(4, 4) over the production, u = 0.25 um, risk of 0.1 %.

    Suncal (Sandia National Laboratories, example notebook "Ball Bearing") prints 4.2380 % beyond the limit, 0.80191 % that are
    accepted all the same, and for 0.1 % an acceptance limit of 1.67183 um.
    """
    density, tolerance = stats.gamma(4, scale=0.25).pdf, ToleranceInterval(upper=2.0)
    consumer, producer = global_risks(density, (0.0, 20.0), tolerance, tolerance, 0.25)
    assert consumer == pytest.approx(0.008019111884303471, rel=1e-6)
    guarded = ToleranceInterval(upper=1.6718287715440068)
    risks = global_risks(density, (0.0, 20.0), tolerance, guarded, 0.25)
    assert risks[0] == pytest.approx(0.001, rel=1e-4)
    assert risks[1] > 4 * producer  # what the customer's safety costs the producer
    everything = ToleranceInterval()
    assert global_risks(density, (0.0, 20.0), tolerance, everything, 0.25)[0] == pytest.approx(0.04238011199168401, rel=1e-9)


@pytest.mark.parametrize("acceptance", [(1499.80, 1500.20), (1499.82, 1500.18), (-math.inf, 1500.1)])
def test_global_risks_are_those_of_the_double_integral(acceptance):
    """Resistors of 1500 +- 0.2 ohm, made with 0.12 ohm and measured with 0.04 ohm (JCGM 106:2012, 9.5)."""
    tolerance, accepts = ToleranceInterval(1499.8, 1500.2), ToleranceInterval(*acceptance)
    made, measured = stats.norm(1500, 0.12), stats.norm(0, 0.04)

    def mass(low, high, accepted):
        ends = (max(accepts.lower, 1499), accepts.upper)
        pieces = [ends] if accepted else [(1498, accepts.lower), (accepts.upper, 1502)]
        return sum(
            dblquad(lambda y, x: made.pdf(x) * measured.pdf(y - x), low, high, *piece, epsabs=1e-9)[0]
            for piece in pieces
            if piece[0] > -math.inf and piece[1] > piece[0]
        )

    expected = (
        mass(1499.2, tolerance.lower, accepted=True) + mass(tolerance.upper, 1500.8, accepted=True),
        mass(tolerance.lower, tolerance.upper, accepted=False),
    )
    assert global_risks(*normal_production(1500, 0.12), tolerance, accepts, 0.04) == pytest.approx(expected, rel=1e-5, abs=1e-9)


def test_risks_without_uncertainty_are_those_of_the_guard_band_alone():
    tolerance = ToleranceInterval(-1.0, 1.0)
    assert global_risks(*normal_production(0, 1), tolerance, tolerance, 1e-7) == pytest.approx((0, 0), abs=1e-6)
    consumer, producer = global_risks(*normal_production(0, 1), tolerance, tolerance.narrowed(0.5), 1e-7)
    assert consumer == pytest.approx(0, abs=1e-9)
    assert producer == pytest.approx(2 * (stats.norm.cdf(1) - stats.norm.cdf(0.5)), abs=1e-6)


def test_a_value_is_judged_by_where_it_lies():
    tolerance = ToleranceInterval(upper=0.12)
    zones = {0.09: "pass", 0.099: "pass", 0.11: "conditional pass", 0.13: "conditional fail", 0.15: "fail"}
    assert {value: decide(value, tolerance, 0.02) for value in zones} == zones
    both = ToleranceInterval(1.0, 2.0)
    zones = {0.8: "fail", 0.95: "conditional fail", 1.05: "conditional pass", 1.5: "pass", 1.95: "conditional pass"}
    assert {value: decide(value, both, 0.1) for value in zones} == zones
    assert (decide(0.1199, tolerance, 0.0), decide(0.1201, tolerance, 0.0)) == ("pass", "fail")


def test_guard_bands_that_leave_nothing_are_refused():
    assert refuse_empty_acceptance("mu", ToleranceInterval(0.1, 0.2), 0.04).lower == pytest.approx(0.14)
    with pytest.raises(DescriptionError, match=r"mu are 0\.1 apart, less than twice the guard band of 0\.06.*measure more"):
        refuse_empty_acceptance("mu", ToleranceInterval(0.1, 0.2), 0.06)
