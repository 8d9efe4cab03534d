"""Profile likelihoods and contours are the likelihood of the model itself, with the other parameters fitted again."""

from pathlib import Path

import jax
import numpy as np
import pytest

import bowdenfit as bf

DATASETS = Path(__file__).parents[3] / "datasets"


def test_a_profile_is_the_likelihood_of_the_model():
    fit = bf.fit(DATASETS / "yarn-on-cylinder", mcmc=False)
    profile = fit.profile("mu")
    with jax.enable_x64(True):
        model = bf.model(DATASETS / "yarn-on-cylinder")
        tau = float(model.constrain(np.zeros(2))["tau"])  # the median of its prior
        likelihood = np.array([float(model.log_likelihood({"mu": mu, "tau": tau})) for mu in profile.values])
    # The scatter of runs depends a little on mu too.
    assert profile.rise == pytest.approx(2 * (likelihood.max() - likelihood), rel=0.01, abs=0.01)
    low, high = profile.limits
    assert low < fit.least_squares.estimates["mu"].value < high
    assert np.interp([low, high], profile.values, profile.rise) == pytest.approx(2.706, abs=0.01)
    assert profile.plot().axes[0].get_xlabel() == "mu"
    assert list(profile.to_frame()) == ["mu", "rise"]
    for ask, words in ((lambda: fit.profile("tau"), "scale of noise"), (lambda: fit.profile("nu"), "no free parameter"),
                       (lambda: fit.contour("mu", "mu"), "different")):  # fmt: skip
        with pytest.raises(bf.UsageError, match=words):
            ask()


@pytest.mark.extended
def test_a_contour_lowest_along_one_parameter_is_the_profile_of_the_other():
    fit = bf.fit(DATASETS / "on-body-exoskeleton", mcmc=False)
    profile, contour = fit.profile("mu1"), fit.contour("mu1", "mu3")
    lowest = np.min(contour.rise, axis=1)
    inside = lowest < 4
    expected = np.interp(contour.values[0], profile.values, profile.rise)
    assert lowest[inside] == pytest.approx(expected[inside], abs=0.05)
    low, high = contour.edges(2.279)
    assert np.isfinite(low).sum() > 5
    assert np.all((low <= high)[np.isfinite(low)])
    assert contour.plot().axes[0].get_ylabel() == "mu3"
