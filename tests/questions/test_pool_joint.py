"""Pooling draws of single fits against NUTS on all readings of all cables at once, and the limits in which both are known."""

from pathlib import Path

import jax
import numpy as np
import pytest
from joint_fleets import joint_draws

import bowdenfit as bf
from bowdenfit.inference.diagnostics import diagnose
from bowdenfit.inference.population.sampling import draw_population
from bowdenfit.questions.pool.inspected import given
from bowdenfit.questions.simulate.fleet import read_fleet_plan, simulate_fleet, write_fleet
from bowdenfit.results.fleet_folder import read_fleet_draws

PLAN = "datasets/synthetic-fleet/bench.toml"


@pytest.mark.slow
@pytest.mark.parametrize("cables", [10, 40, 100])
def test_pooled_draws_are_those_of_all_readings_at_once(cables, tmp_path):
    """Means within 0.2 standard deviations and standard deviations within 15 %, of the population and of every cable's wear.

    Of cables, nine in ten: with a thousand effective draws Monte Carlo error alone is 0.045 and 2 % of them.
    """
    with jax.enable_x64(True):
        plan = read_fleet_plan(Path(PLAN))
        plan = type(plan)(plan.bench, plan.fleet.model_copy(update={"cables": cables}))
        made, truth = simulate_fleet(plan, 20 + cables)
        write_fleet(plan, made, truth, tmp_path / "fleet")
        bf.fleet(tmp_path / "fleet", output=tmp_path / "fits", seed=1)
        known = given(read_fleet_draws(tmp_path / "fits"))
        pooled = draw_population(known.inspected, 2)
        z, joint = joint_draws(tmp_path / "fleet", known, 30, 3)
    count = 2 * known.inspected.coefficients + 4
    worth = [diagnose(np.ascontiguousarray(z[:, :, i]), len(z)) for i in range(count)]
    print(cables, "R-hat", max(d.r_hat for d in worth), "effective", min(d.ess_bulk for d in worth))
    ours = pooled.mean, pooled.spread, pooled.effects
    theirs = [np.asarray(each) for each in joint]
    for one, other in zip(ours, (*theirs[:2], theirs[2][:, :-1]), strict=True):
        away = (one.mean(axis=0) - other.mean(axis=0)) / other.std(axis=0)
        wider = one.std(axis=0) / other.std(axis=0) - 1
        print(np.round(away, 3), np.round(wider, 3))
    of_cables = np.abs(pooled.cables.mean(axis=0) - theirs[3].mean(axis=0)) / theirs[3].std(axis=0)
    widths = np.abs(pooled.cables.std(axis=0) / theirs[3].std(axis=0) - 1)
    print("cables", np.quantile(of_cables, (0.5, 0.9, 1), axis=0).round(3), np.quantile(widths, (0.5, 0.9, 1), axis=0).round(3))
    for one, other in zip(ours, (*theirs[:2], theirs[2][:, :-1]), strict=True):
        assert np.all(np.abs(one.mean(axis=0) - other.mean(axis=0)) < 0.2 * other.std(axis=0))
        assert np.all(np.abs(one.std(axis=0) / other.std(axis=0) - 1) < 0.15)
    assert np.all(np.quantile(of_cables, 0.9, axis=0) < 0.2) and np.all(np.quantile(widths, 0.9, axis=0) < 0.15)
