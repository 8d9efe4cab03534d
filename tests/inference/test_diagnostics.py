"""Effective draws, counted where it is known how many there are."""

import numpy as np
import pytest
from arviz_stats.base import array_stats
from terminal_pages import jargon

from bowdenfit.inference.diagnostics import (
    MAXIMUM_DRIFT,
    Diagnostics,
    as_chains,
    describe_convergence_shortfalls,
    diagnose,
)

ENSEMBLES, WALKERS = 4, 256


def paths(remembered, length, seed):
    """Paths of walkers of which each draw remembers a share of the one before, and how many draws their mean is worth."""
    generator = np.random.default_rng(seed)
    z = generator.standard_normal((ENSEMBLES * WALKERS, length))
    for i in range(1, length):
        z[:, i] = remembered * z[:, i - 1] + np.sqrt(1 - remembered**2) * z[:, i]
    lags = np.arange(1, length)
    return z, z.size / (1 + 2 * np.sum((1 - lags / length) * remembered**lags))


@pytest.mark.parametrize("remembered", [0.0, 0.3, 0.5, 0.7, 0.85])
@pytest.mark.parametrize("length", [20, 60])
def test_effective_draws_of_walkers_are_as_many_as_there_are(remembered, length):
    """Of 20 seeds each, 200 ratios, the least was 0.87 and the largest 1.10; the seed here is fixed."""
    z, worth = paths(remembered, length, 1)
    diagnostics = diagnose(z, ENSEMBLES)
    assert 0.85 < diagnostics.ess_bulk / worth < 1.15
    assert diagnostics.mcse_mean == pytest.approx(1 / np.sqrt(worth), rel=0.1)


def test_walkers_taken_for_chains_would_pass_for_more_than_they_are():
    """So the test above can fail."""
    z, worth = paths(0.3, 20, 1)
    assert array_stats.ess(z, method="bulk", chain_axis=0, draw_axis=1) > 1.2 * worth


def kinked(z):
    """Draws of which many are equal, as of an optimum at an end."""
    return np.minimum(np.round(z, 1), 0.5)


@pytest.mark.parametrize("change", [np.asarray, kinked, np.exp], ids=["normal", "with ties", "skewed"])
def test_rank_normalized_diagnostics_are_those_of_arviz(change):
    draws, axes = change(paths(0.5, 20, 1)[0]), {"chain_axis": 0, "draw_axis": 1}
    diagnostics, ensembles = diagnose(draws, ENSEMBLES), np.repeat(np.arange(ENSEMBLES), WALKERS)
    assert diagnostics.r_hat == array_stats.rhat_nested(draws, superchain_ids=ensembles, method="rank", **axes)
    assert diagnostics.ess_bulk == array_stats.ess(as_chains(draws, ENSEMBLES), method="bulk", **axes)


HALF = 14  # of the draws of each of fifty walkers
DRIFTS = {
    "none": (lambda z: z, 0.0, 0.22),
    "a shift": (lambda z: z + 0.16 * (np.arange(2 * HALF) >= HALF), 0.88, 1.0),
    "a narrower half": (lambda z: z * np.where(np.arange(2 * HALF) < HALF, 1.15, 1.0), 0.88, 1.0),
    "three walkers that come in from far out": (
        lambda z: z * np.where((np.arange(50)[:, None] < 3) & (np.arange(2 * HALF) < HALF), 4.0, 1.0), 0.85, 1.0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("drift", DRIFTS)
def test_a_drift_is_told_from_chance(drift):
    """Shares of 300 quantities of 1400 draws; 0.16, 0.93, 0.93 and 0.90 of many more, so that 300 err by 0.02 (one sd).

    Medians and quantiles of as many draws saw 0.31 where there was none, and 0.88, 0.94 and 0.57.
    """
    change, least, most = DRIFTS[drift]
    generator = np.random.default_rng(7)
    diagnostics = [diagnose(change(generator.standard_normal((50, 2 * HALF))), 2).drift for _ in range(300)]
    assert least <= np.mean(np.array(diagnostics) > MAXIMUM_DRIFT) <= most


def test_one_draw_elsewhere_of_an_optimum_at_an_end_is_no_drift():
    draws = np.full((50, 2 * HALF), 430.0)
    draws[3, 2] = 431.0
    assert diagnose(draws, 2).drift == 0
    assert diagnose(np.where(np.arange(2 * HALF) < HALF, 430.0, draws + 1.0), 2).drift == 1


def test_what_keeps_draws_from_being_trusted_is_said_in_plain_words():
    message = describe_convergence_shortfalls({"mu1": Diagnostics(1.037, 812.3, 640.0, 0.01, 0.12)}, 1.01, 1000)
    assert message == (
        "mu1 spreads 3.7 % wider over all chains than within one (R-hat minus 1), and the limit is 1.0 %",
        "mu1 still drifts during sampling, by 12 % of its spread",
        "the effective sample size of the tails of mu1 is 640 (independent draws), and should be at least 1000",
    )
    assert not jargon(". ".join(message))
    assert describe_convergence_shortfalls({"mu1": Diagnostics(1.0099, 1000.0, 1000.0, 0.01, 0.07)}, 1.01, 1000) == ()
