"""Cables that are outliers are said by their own inspections alone: their truth lies there, not nearer to the others."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from test_pool_alarms import MEAN, SD, like_cables

from bowdenfit.addons.fleet.population.sampling import PopulationDraws, draw_unpooled

pytestmark = pytest.mark.extended

ODD = 1.8  # log coefficients of an odd cable above the others'; nine spreads


def truth_of(seed, inspections):
    """Of the first cable: what `like_cables` draws first of all."""
    g = np.random.default_rng(seed)
    start = np.log([0.1, 0.15]) + 0.2 * g.standard_normal((2, 2))
    wear = 0.2 + 0.08 * g.standard_normal(2)
    return np.append(start[0] + ODD, [wear[0]] * (inspections > 1))


@pytest.fixture(scope="module")
def population():
    """Draws of what the cables of `like_cables` are drawn from, known well."""
    g, n = np.random.default_rng(1), 200
    mean = np.append(np.log([0.1, 0.15]), 0.2) + 0.02 * g.standard_normal((n, 3))
    spread = np.array([0.2, 0.2, 0.08]) * np.exp(0.1 * g.standard_normal((n, 3)))
    return PopulationDraws(mean, spread, -0.2 + 0.01 * g.standard_normal((n, 1)), np.zeros((n, 2, 3)), (), 200.0)


@pytest.mark.parametrize("cables", [90, pytest.param(150, marks=pytest.mark.slow)])
@pytest.mark.parametrize("inspections", [1, 3])
def test_nine_of_ten_intervals_of_odd_cables_hold_their_truth(population, inspections, cables):
    """Of odd cables, in each number; a count as far from nine in ten comes in a thousand runs once, for one of all five."""
    inside = []
    for i in range(cables):
        fleet = like_cables([21, i], 2, inspections=inspections, error=0.1, freedom=4.0, shift=ODD)
        fleet = replace(fleet, prior_sd=np.full(2, 3.0))  # truths are not from the prior of single fits
        chosen_population = population
        if inspections == 1:
            chosen_population = replace(population, mean=population.mean[:, :2], spread=population.spread[:, :2])
        values, reported = draw_unpooled(fleet, chosen_population, 0, 1)
        assert reported == (inspections > 1)
        low, high = np.quantile(values, (0.05, 0.95), axis=0)
        truth = truth_of([21, i], inspections)
        inside.append((low < truth) & (truth < high))
    hits = np.sum(inside, axis=0)
    print(inspections, "inspections:", hits, "of", cables)
    chance = np.minimum(stats.binom.cdf(hits, cables, 0.9), stats.binom.sf(hits - 1, cables, 0.9))
    assert np.all(chance > 0.0001)


def test_one_inspection_is_what_the_single_fit_says(population):
    """Its draws under the prior of single fits, by weighing 400,000 of a flat one: five Monte Carlo errors of 200 draws."""
    fleet = like_cables([22, 0], 2, inspections=1, error=0.3, freedom=4.0, shift=ODD)
    ours, _ = draw_unpooled(fleet, replace(population, mean=population.mean[:, :2], spread=population.spread[:, :2]), 0, 1)
    s, shift = fleet.summaries, -0.2 * fleet.effects["lubrication"][0]
    flat = stats.multivariate_t(s.center[0] - shift, s.scale[0], s.freedom[0], seed=1).rvs(400_000)
    weights = np.exp(-np.sum(((flat - MEAN) / SD) ** 2, axis=1) / 2)
    mean = np.average(flat, axis=0, weights=weights)
    sd = np.sqrt(np.average((flat - mean) ** 2, axis=0, weights=weights))
    assert np.all(np.abs(ours.mean(axis=0) - mean) < 5 * sd / np.sqrt(200)) and np.all(np.abs(ours.std(axis=0) / sd - 1) < 0.25)


@pytest.mark.parametrize("after", [(0.0,), (0.0, 0.001)], ids=["once", "at-the-same"])
def test_wear_is_that_of_the_others_only_where_no_own_inspections_tell_it(population, after):
    """Of a cable inspected once, or twice within a thousandth of the reference cycles."""
    fleet = like_cables([23, 0], 2, inspections=max(len(after), 2), error=0.03, shift=ODD)
    cycles = np.tile(np.resize(after, 2), 2)
    values, reported = draw_unpooled(replace(fleet, cycles=cycles), population, 0, 1)
    assert not reported and abs(values[:, 2].mean() - 0.2) < 0.03 and 0.06 < values[:, 2].std() < 0.11
    values, reported = draw_unpooled(replace(fleet, cycles=np.array([0.0, 1.0, 0.0, 1.0])), population, 0, 1)
    assert reported
