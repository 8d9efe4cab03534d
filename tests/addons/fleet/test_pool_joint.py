"""Pooling draws of single fits against NUTS on all readings of all cables at once, and the limits in which both are known."""

from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest
from joint_fleets import joint_draws
from pooled_fleets import fleet_draws
from scipy import stats

import bowdenfit as bf
from bowdenfit.addons.fleet.folder import read_fleet_draws
from bowdenfit.addons.fleet.pool.pooled_data import select_inspections
from bowdenfit.addons.fleet.population.likelihoods import summarize_likelihoods
from bowdenfit.addons.fleet.population.model import (
    LUBRICATION,
    SPREAD,
    WEAR,
    WEAR_SPREAD,
    Inspections,
    PopulationDensity,
    log_likelihood,
)
from bowdenfit.addons.fleet.population.sampling import draw_population
from bowdenfit.addons.fleet.simulation import read_fleet_plan, simulate_fleet, write_fleet
from bowdenfit.inference.diagnostics import diagnose

pytestmark = pytest.mark.extended

PRIOR_MEAN, PRIOR_SD, FREEDOM = np.log(0.12), 0.7, 5.0
ANGLES = np.array([2.0, 0.5])  # rad
PLAN = "datasets/synthetic-fleet/bench.toml"


@pytest.mark.slow
@pytest.mark.parametrize("cables", [10, 40, 100])
def test_pooled_draws_are_those_of_all_readings_at_once(cables, tmp_path):
    """Means within 0.2 standard deviations and standard deviations within 15 %, of the population and of the cables.

    Of cables, nine in ten: with a thousand effective draws Monte Carlo error alone is 0.045 and 2 % of them.
    """
    with jax.enable_x64(True):
        plan = read_fleet_plan(Path(PLAN))
        plan = type(plan)(plan.bench, plan.fleet.model_copy(update={"cables": cables}))
        made, truth = simulate_fleet(plan, 20 + cables)
        write_fleet(plan, made, truth, tmp_path / "fleet")
        bf.fleet(tmp_path / "fleet", output=tmp_path / "fits", seed=1)
        selected = select_inspections(read_fleet_draws(tmp_path / "fits"))
        pooled = draw_population(selected.inspected, 2)
        joint = joint_draws(tmp_path / "fleet", selected.labels, selected.coefficients, pooled, 800, 3)
    every = joint.population.transpose(2, 0, 1)
    worth = [diagnose(np.ascontiguousarray(item), len(item)) for item in every]
    least = min(d.ess_bulk for d in worth)
    print(cables, "R-hat", max(d.r_hat for d in worth), "effective", least, "divergent", joint.divergent)
    assert max(d.r_hat for d in worth) < 1.02 and least > 400 and joint.divergent < 6 and not pooled.reasons
    ours = np.concatenate([pooled.mean, pooled.spread, pooled.effects], axis=1)
    theirs = joint.population.reshape(-1, len(every))
    away = (ours.mean(axis=0) - theirs.mean(axis=0)) / theirs.std(axis=0)
    wider = ours.std(axis=0) / theirs.std(axis=0) - 1
    print("away", np.round(away, 3), "wider", np.round(wider, 3))
    single = joint.cables.reshape(-1, *joint.cables.shape[2:])
    of_cables = np.abs(pooled.cables.mean(axis=0) - single.mean(axis=0)) / single.std(axis=0)
    widths = np.abs(pooled.cables.std(axis=0) / single.std(axis=0) - 1)
    print(
        "cables",
        np.quantile(of_cables, (0.5, 0.9, 1), axis=0).round(3),
        np.quantile(widths, (0.5, 0.9, 1), axis=0).round(3),
    )
    assert np.all(np.abs(away) < 0.2) and np.all(np.abs(wider) < 0.15)
    assert np.all(np.quantile(of_cables, 0.9, axis=0) < 0.2) and np.all(np.quantile(widths, 0.9, axis=0) < 0.15)


def drawn_fleet(generator, cables=20, inspections=3, draws=768):
    """Truths from the priors, and draws of single fits of them: t-distributed errors, under the prior of single fits."""
    count = 2
    mean = PRIOR_MEAN + PRIOR_SD * generator.standard_normal(count)
    spread, wear_spread = (
        abs(sd * generator.standard_normal(n)) for sd, n in ((SPREAD.sd, count), (WEAR_SPREAD.sd, 1))
    )
    wear, oil = WEAR.sd * generator.standard_normal(), LUBRICATION.sd * generator.standard_normal()
    start = mean + spread * generator.standard_normal((cables, count))
    wears = wear + wear_spread * generator.standard_normal(cables)
    cycles, oiled = (
        np.tile(np.linspace(0, 1, inspections), cables),
        generator.integers(0, 2, cables * inspections) * 1.0,
    )
    cable = np.repeat(np.arange(cables), inspections)
    true = start[cable] + (wears[cable] * cycles + oil * oiled)[:, None]
    error = np.exp(generator.normal(np.log(0.05), 0.5, (len(cable), 1))) * np.array([1.0, 2.0])

    def errors(n):
        stretch = np.sqrt(FREEDOM / generator.chisquare(FREEDOM, (len(cable), n, 1)))
        return error[:, None] * stretch * generator.standard_normal((len(cable), n, count))

    seen = true[:, None] + errors(1)
    likely = seen + errors(4 * draws)
    prior = -np.sum(((likely - PRIOR_MEAN) / PRIOR_SD) ** 2, axis=2) / 2
    weights = np.exp(prior - prior.max(axis=1, keepdims=True))
    chosen = [generator.choice(len(w), draws, p=w / w.sum()) for w in weights]
    logs = np.stack([item[places] for item, places in zip(likely, chosen, strict=True)])
    mask = np.ones((len(cable), count), dtype=bool)
    summaries = summarize_likelihoods(logs, np.full(count, PRIOR_MEAN), np.full(count, PRIOR_SD))
    means = np.full(count, PRIOR_MEAN), np.full(count, PRIOR_SD)
    inspected = Inspections(cable, cycles, {"lubrication": oiled}, mask, summaries, *means)
    return inspected, (wear, wear_spread[0], spread[0], oil, *lasting(start[0], wears[0])), logs


def lasting(start, wear):
    """How far beyond failing after the longest inspected cycles, and one over the life: 0 and below where it lasts for ever."""
    room = np.log(-np.log(0.6)) - np.log(np.exp(start) @ ANGLES)
    return wear - room, np.where(room > 0, wear / np.where(room > 0, room, 1.0), np.inf)


def asked_of(draws):
    """Draws of what the truths are of: wear, its spread, that of a coefficient, oil, and how long the first cable lasts."""
    numbers = draws.mean[:, 2], draws.spread[:, 2], draws.spread[:, 0], draws.effects[:, 0]
    return (*numbers, *lasting(draws.cables[:, 0, :2], draws.cables[:, 0, 2]))


@pytest.mark.slow
def test_ranks_of_truths_are_uniform_over_fleets():
    """Wear, its spread, that of a coefficient, oil, and life of the first cable, over 200 fleets of 20 from the priors.

    Kolmogorov's test of each at 0.001: by chance one of six fails once in 170 runs; the seed is fixed.
    """
    generator, ranks = np.random.default_rng(8), []
    ties = np.random.default_rng(9)
    with jax.enable_x64(True):
        for fleet in range(200):
            inspected, truths, _ = drawn_fleet(generator)
            population = draw_population(inspected, fleet)
            pairs = zip(asked_of(population), truths, strict=True)
            ranks.append([np.mean(draws < truth) + ties.uniform() * np.mean(draws == truth) for draws, truth in pairs])
            if fleet % 20 == 19:
                tests = [float(stats.kstest(column, "uniform").pvalue) for column in np.array(ranks).T]
                print(
                    fleet + 1, "fleets; p of uniform ranks", np.round(tests, 4), "mean", np.mean(ranks, axis=0).round(3)
                )
    assert min(stats.kstest(column, "uniform").pvalue for column in np.array(ranks).T) > 0.001


@pytest.mark.slow
def test_without_a_population_cables_are_as_single_fits_say():
    """With the population held at the prior of single fits, medians within 0.1 and ends of 90 % intervals within 0.2 sd."""
    inspected, _, logs = drawn_fleet(np.random.default_rng(5), cables=6, inspections=1, draws=2048)
    inspected, count = replace(inspected, cycles=None), inspected.coefficients
    density = PopulationDensity(count, False, (), inspected.cables)
    generator = np.random.default_rng(1)
    with jax.enable_x64(True):
        prior = {"mean": inspected.prior_mean, "spread": inspected.prior_sd, "effects": np.zeros(2)}

        def cables_of(z):
            return density.cables_at(z, inspected.data, prior)

        z = 1.5 * generator.standard_t(3, (100_000, density.size))  # tails as heavy as those of single fits
        values, _ = jax.vmap(cables_of)(z)
        log_densities = jax.vmap(lambda item: density.log_coefficients(item, prior, inspected.data))(values)
        of_readings = jax.vmap(lambda item: log_likelihood(item, inspected.data))(log_densities)
        inner = z[:, len(density.names) :].reshape(len(z), inspected.cables, count)
        away = (np.asarray(values) - prior["mean"]) / prior["spread"]
        log = np.asarray(of_readings)[:, :, 0] - np.sum(away**2 / 2 + stats.t.logpdf(inner / 1.5, 3), axis=2)
    for i in range(inspected.cables):
        weights = np.exp(log[:, i] - log[:, i].max())
        pooled = np.asarray(values)[generator.choice(len(z), 20_000, p=weights / weights.sum()), i]
        single = logs[i]
        ends = np.quantile(pooled, (0.05, 0.5, 0.95), axis=0) - np.quantile(single, (0.05, 0.5, 0.95), axis=0)
        assert np.all(np.abs(ends) < np.array([[0.2], [0.1], [0.2]]) * single.std(axis=0))


def test_the_density_is_that_of_the_model_written_out():
    """Differences of the log density between points, against the model in SciPy's words; no coordinates are shared."""
    fleet, _ = fleet_draws(4, cables=3, draws=256)
    inspected = select_inspections(fleet).inspected
    summaries = inspected.summaries
    density = PopulationDensity(2, True, ("lubrication",), 3)

    def written_out(computed, values):
        total = stats.norm.logpdf(computed["mean"][:2], inspected.prior_mean, inspected.prior_sd).sum()
        total += stats.norm.logpdf(computed["mean"][2], 0, 1) + stats.norm.logpdf(computed["effects"][0], 0, 1)
        total += stats.halfnorm.logpdf(computed["spread"], scale=[0.5, 0.5, 0.3]).sum()
        total += stats.norm.logpdf(values, computed["mean"], computed["spread"]).sum()
        for j, cable in enumerate(inspected.cable):
            expected = values[cable, :2] + values[cable, 2] * inspected.cycles[j] + computed["effects"][0] * fleet.lubricated[j]
            t = stats.multivariate_t(summaries.center[j], summaries.scale[j], summaries.freedom[j])
            total += t.logpdf(expected)
        return total

    with jax.enable_x64(True):
        data = inspected.data
        points = 0.5 * np.random.default_rng(2).standard_normal((4, density.size))

        @jax.jit
        def values_of(z):
            computed = density.population_at(z, data)
            return computed, density.cables_at(z, data, computed)[0]

        def of_values(z):
            computed, cables = values_of(z)
            return np.concatenate([computed["mean"], computed["spread"], computed["effects"][:1], cables.ravel()])

        log_density = jax.jit(density.log_density)

        sizes = []
        for z in points:
            step = 1e-5 * np.eye(density.size)
            slopes = np.array([(of_values(z + e) - of_values(z - e)) / 2e-5 for e in step])
            actual, values = jax.tree.map(np.asarray, values_of(z))
            direct = written_out(actual, values) + np.linalg.slogdet(slopes)[1]
            sizes.append(float(log_density(z, data)) - direct)
    np.testing.assert_allclose(sizes, sizes[0], atol=1e-4)
