"""What is printed in per cent is stated as a fraction: a number of per cent is refused, and not taken for far more."""

import pytest

import bowdenfit as bf
from bowdenfit.errors import DescriptionError


@pytest.mark.parametrize(
    ("setting", "key", "fraction"),
    [
        ("prior.tau.prior.half_normal.sd=2", "prior.half_normal.sd: 2 would be 200 %", "write 0.02 for 2 %"),
        ("prior.tau.prior.half_cauchy.scale=1.0", "prior.half_cauchy.scale: 1 would be 100 %", "write 0.01 for 1 %"),
        ("prior.tau.prior.lognormal={median=3, log_sd=0.5}", "lognormal.median: 3 would", "write 0.03 for 3 %"),
        ("prior.tau.fixed=1.5", "fixed: 1.5 would be 150 %", "write 0.015 for 1.5 %"),
        ("prior.tau.measured={value=2, sd=0.5}", "measured: 2 would be 200 %", "write 0.02 for 2 %"),
        ("prior.gain_error.prior.normal={mean=0, sd=2}", "prior.normal.sd: 2 would be 200 %", "write 0.02 for 2 %"),
    ],
)
def test_a_share_in_per_cent_is_refused(on_body, setting, key, fraction):
    with pytest.raises(DescriptionError) as refused:
        bf.read(on_body, settings=(setting,))
    assert key in str(refused.value)
    assert fraction in str(refused.value)


@pytest.mark.parametrize("setting", ["prior.tau.prior.half_normal.sd=0.5", "prior.tau.fixed=0"])
def test_a_large_scatter_and_none_are_taken(on_body, setting):
    assert bf.read(on_body, settings=(setting,)).description.prior.keys() == {"tau"}
