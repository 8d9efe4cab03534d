"""Fleets of like cables: in how many of them a cable is named all the same, and whether one that is unlike is still found.

Fleets are made here, and their populations drawn by Gibbs sampling (tests/support/populations.py), which shares no code with
the likelihood of readings or with the sampler of `bowdenfit pool`.
"""

import numpy as np
import pytest
from populations import gibbs
from scipy import stats

from bowdenfit.addons.fleet.pool import outlier_cables
from bowdenfit.addons.fleet.population.likelihoods import Summaries, summarize_likelihoods
from bowdenfit.addons.fleet.population.model import Inspections
from bowdenfit.addons.fleet.population.sampling import draw_population

pytestmark = pytest.mark.extended

COUNT, MEAN, SD = 2, np.full(2, np.log(0.12)), np.full(2, 0.7)
TURNED = np.linalg.cholesky(np.array([[1.0, -0.4], [-0.4, 1.0]]))  # coefficients of one inspection are told together


def like_cables(seed, cables, inspections=3, error=0.03, freedom=5.0, draws=0, shift=0.0):
    """A fleet of one normal population, its first cable off by a shift; summaries of draws, or as they are without draws."""
    g = np.random.default_rng(seed)
    start = np.log([0.1, 0.15]) + 0.2 * g.standard_normal((cables, COUNT))
    start[0] += shift
    wear, cycles = (
        0.2 + 0.08 * g.standard_normal(cables),
        np.linspace(0, 1, inspections) if inspections > 1 else np.zeros(1),
    )
    oiled = (g.uniform(size=(cables, inspections)) < 0.5) * 1.0
    true = (start[:, None] + (wear[:, None] * cycles - 0.2 * oiled)[..., None]).reshape(-1, COUNT)
    root = (np.exp(g.normal(np.log(error), 0.3, (len(true), 1))) * np.array([1.0, 2.0]))[:, :, None] * TURNED

    def errors(n):
        stretched = np.sqrt(freedom / g.chisquare(freedom, (len(true), n, 1)))
        return (root[:, None] @ g.standard_normal((len(true), n, COUNT, 1)))[..., 0] * stretched

    seen = true + errors(1)[:, 0]
    if draws:
        likely = seen[:, None] - errors(4 * draws)
        log = -np.sum(((likely - MEAN) / SD) ** 2, axis=2) / 2
        weights = np.exp(log - log.max(axis=1, keepdims=True))
        rows = [g.choice(len(w), draws, p=w / w.sum()) for w in weights]
        summaries = summarize_likelihoods(
            np.stack([item[row] for item, row in zip(likely, rows, strict=True)]), MEAN, SD
        )
    else:
        summaries = Summaries(seen, root @ root.transpose(0, 2, 1), np.full(len(true), freedom))
    worn = np.tile(cycles, cables) if inspections > 1 else None
    cable, mask = np.repeat(np.arange(cables), inspections), np.ones((len(true), COUNT), dtype=bool)
    return Inspections(cable, worn, {"lubrication": oiled.ravel()}, mask, summaries, MEAN, SD)


def least_chances(fleets, seed, sweeps=600):
    """The least chance in each fleet, and how many cables each is left with a name."""
    draws = gibbs(fleets, [()] * len(fleets), seed, sweeps)
    results = []
    for i, (fleet, population) in enumerate(zip(fleets, draws, strict=True)):

        def without(cables, fleet=fleet, i=i):
            return gibbs([fleet], [cables], seed + i, sweeps)[0]

        results.append(outlier_cables.separate_outliers(fleet, population, without, seed)[1])
    return np.array([chances.min() for chances in results]), results


@pytest.mark.slow
def test_who_is_named_is_unlike_a_population_that_was_drawn_without_it(monkeypatch):
    """In 40 fleets of eight like cables; draws of a population that holds the cable, weighted, named four at this seed.

    Chances of two sets of draws differ by less than a factor of two.
    """
    monkeypatch.setattr(outlier_cables, "_POPULATIONS", 250)
    fleets = [like_cables([1, i], 8) for i in range(40)]
    _, computed = least_chances(fleets, 1)
    named = [(i, int(cable)) for i, item in enumerate(computed) for cable in np.flatnonzero(item < outlier_cables.FALSE_ALARM)]
    remaining = gibbs([fleets[i] for i, _ in named], [(cable,) for _, cable in named], 77)
    for (i, cable), population in zip(named, remaining, strict=True):
        assert 8 * outlier_cables.outlier_p_values(fleets[i], population, 2, (cable,))[cable] < 2 * outlier_cables.FALSE_ALARM


def test_a_cable_that_is_unlike_few_others_is_found(monkeypatch):
    """Five spreads off among ten: in two fleets of three at the least; the seed is fixed."""
    monkeypatch.setattr(outlier_cables, "_POPULATIONS", 250)
    _, computed = least_chances([like_cables([2, i], 10, shift=1.0) for i in range(9)], 2)
    assert sum(chances[0] < outlier_cables.FALSE_ALARM for chances in computed) >= 6
    assert sum(int(np.argmin(chances)) == 0 for chances in computed) >= 8


def test_what_is_off_is_what_its_own_inspections_say(monkeypatch):
    """Of a cable inspected once, ten spreads off, which draws of the population pull to the others: its errors have tails."""
    monkeypatch.setattr(outlier_cables, "_POPULATIONS", 250)
    fleet = like_cables([5, 0], 20, inspections=1, freedom=3.0, shift=2.0)
    (core,) = gibbs([fleet], [(0,)], 5, 600)
    number, off = outlier_cables.find_departure(fleet, core, 0, 1)
    assert number in (0, 1) and 6 < off < 15


@pytest.mark.slow
def test_the_sampler_of_fleets_agrees_with_another():
    """Means within 0.15 standard deviations, these within 15 %: of 13 numbers with 600 effective draws each."""
    fleet = like_cables([3, 0], 10)
    (other,) = gibbs([fleet], [()], 3, 4000)
    ours = draw_population(fleet, 1)
    for name in ("mean", "spread", "effects"):
        first, two = getattr(ours, name), getattr(other, name)
        assert np.all(np.abs(first.mean(axis=0) - two.mean(axis=0)) < 0.15 * two.std(axis=0)), name
        assert np.all(np.abs(first.std(axis=0) / two.std(axis=0) - 1) < 0.15), name
    away = np.abs(ours.cables.mean(axis=0) - other.cables.mean(axis=0)) / other.cables.std(axis=0)
    assert np.quantile(away, 0.9) < 0.15


@pytest.mark.parametrize("freedom", [3.0, 5.0])
def test_degrees_of_freedom_are_found_without_bias(freedom):
    """Their mean logarithm over 120 inspections within 0.05, known to 0.012. Tails that are too light make false alarms."""
    computed = like_cables([4, 0], 40, freedom=freedom, draws=1024).summaries.freedom
    assert abs(np.mean(np.log(computed / freedom))) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fleets", "cables", "shape"),
    [
        (200, 10, {}),
        (200, 10, {"error": 0.12, "freedom": 4.0}),
        (200, 10, {"inspections": 1}),
        (100, 20, {}),
        (100, 6, {}),
        (40, 40, {}),
    ],
    ids=["ten", "few-readings", "inspected-once", "twenty", "six", "forty"],
)
def test_of_fleets_of_like_cables_one_in_twenty_has_a_cable_named(fleets, cables, shape):
    """No more than is chance in a thousand runs where one in twenty is meant; single fits give 1024 draws."""
    made = [like_cables([11, i], cables, draws=1024, **shape) for i in range(fleets)]
    least, _ = least_chances(made, 11, 1000)
    named = int(np.sum(least < outlier_cables.FALSE_ALARM))
    print(cables, shape, "named in", named, "of", fleets, "at 1 %", int(np.sum(least < 0.01)))
    assert stats.binom.sf(named - 1, fleets, outlier_cables.FALSE_ALARM) > 0.001
