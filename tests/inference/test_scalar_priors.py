"""Single numbers through a prior, there and back."""

import pytest

from bowdenfit.inference.scalar_priors import value_at, z_at
from bowdenfit.parameters.priors import HalfCauchy, HalfNormal, LogNormal, Normal, TruncatedNormal, Uniform

PRIORS = (
    Normal(0.3, 2.0), LogNormal(0.12, 1.4), HalfNormal(0.02), HalfCauchy(0.025), HalfCauchy(0.5, 2.0), Uniform(-2.0, 3.0),
    TruncatedNormal(0.1, 0.05),
)  # fmt: skip


@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("z", [-3.0, 0.0, 2.5])
def test_a_number_comes_back_and_is_what_the_prior_itself_makes_of_it(prior, z):
    value = value_at(prior, z)
    assert value == pytest.approx(float(prior.constrain(z)), rel=1e-6)  # that may be in 32 bits
    assert z_at(prior, value) == pytest.approx(z, rel=1e-9, abs=1e-9)


def test_priors_of_one_kind_with_other_numbers_give_other_values():
    assert value_at(LogNormal(0.2, 1.4), 0.0) == pytest.approx(2 * value_at(LogNormal(0.1, 1.4), 0.0), rel=1e-12)
