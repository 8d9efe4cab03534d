"""How residuals scatter: what counts as a reading."""

from types import SimpleNamespace

import numpy as np
import pytest

from bowdenfit.inference.linearized import estimate_scatter

RESIDUALS = np.array([0.5, -0.5, 0.3, 0.0, 0.0])
LEVERAGE = np.array([0.0, 0.0, 0.0, 1.0, 0.0])  # the fourth has a parameter to itself; the fifth is a bound that is met
TERMS = [SimpleNamespace(name="table", residual_blocks=((5, 5),))]


@pytest.mark.parametrize("rounding", [0.0, 1e-17, -2e-16])
def test_whether_rounding_leaves_an_exact_fit_a_residual_decides_nothing(rounding):
    residuals = RESIDUALS + rounding * LEVERAGE
    _, spread = estimate_scatter(TERMS, {"table": residuals}, LEVERAGE)
    assert spread["table"] == pytest.approx(np.sqrt(np.sum(RESIDUALS**2) / 3), rel=1e-12)
