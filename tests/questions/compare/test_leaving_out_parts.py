"""Comparisons of fits with few mountings: parts of a run left out, the effect of its mounting integrated out."""

from dataclasses import replace
from itertools import product

import hand_bench
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from conftest import QUICK
from slow_cases import some_slow

import bowdenfit as bf
from bowdenfit.dataset import load_dataset
from bowdenfit.errors import UsageError
from bowdenfit.inference.leave_one_out import LooDensity
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.run_parts import split_runs
from bowdenfit.kinds.runs import sum_runs
from bowdenfit.models import build_model

pytestmark = pytest.mark.extended

LOADS = (20, 40, 60, 80, 100, 120)


def bench(folder, runs=1, drag=0.0, seed=1):
    rows = hand_bench.pull(
        np.random.default_rng(seed), [180.0] * runs, [0.12 * np.pi] * runs, LOADS,
        repeats=5, noise=(0.4, 0.4), drag=drag, scatter=0.02,
    )  # fmt: skip
    return hand_bench.write(folder, rows)


@pytest.mark.parametrize(
    ("unit", "friction"),
    some_slow(product(("load", "reading"), ("capstan", "drag")), [("load", "drag"), ("reading", "capstan")]),
)
def test_leaving_out_a_part_is_the_likelihood_of_the_other_readings(tmp_path, friction, unit):
    """Against the term of a table without those readings, at several places of the posterior."""
    with jax.enable_x64(True):
        posterior = LogDensity(build_model(load_dataset(bench(tmp_path, runs=3), [f'friction_model="{friction}"'])))
        (term,) = posterior.model.terms
        parts = split_runs(term, unit)
        readings = LooDensity(posterior, parts={term.name: parts})
        z = 0.5 * np.random.default_rng(2).standard_normal((5, posterior.model.space.size))
        assert len(parts.labels) == (3 * 2 * 8 if unit == "load" else 180)
        i = len(parts.labels) // 2
        selected_rows = _without(term.rows, i, unit)
        remaining = replace(term, data=sum_runs(term.cable, selected_rows), rows=selected_rows)
        computed, _ = readings.evaluate(z, i)
        for density, item in zip(computed, z, strict=True):
            values = posterior.model.space.constrain(jnp.asarray(item))
            exact = jnp.sum(remaining.log_likelihood(values, remaining.data)) - 0.5 * item @ item
            assert density == pytest.approx(float(exact), abs=1e-8)
        assert parts.event_keys[i, 0] == len(term.rows.run) - len(selected_rows.run)


def _without(rows, i, unit):
    """Readings without part i, found by what parts are called: in the order of run, stroke and load."""
    run = np.unique(rows.run, return_inverse=True)[1]
    groups = []
    for r in np.unique(run):
        for stroke in (-1, 1):
            mask = np.flatnonzero((run == r) & (rows.stroke == stroke))
            mask = mask[np.argsort(rows.input_force[mask], kind="stable")]
            groups += np.array_split(mask, 8) if unit == "load" else [np.array([k]) for k in np.sort(mask)]
    selected = ~np.isin(np.arange(len(run)), groups[i])
    arrays = {name: value[selected] for name, value in vars(rows).items() if name not in ("angles", "unused")}
    return replace(rows, **arrays, angles=rows.angles.select(selected))


@pytest.fixture(scope="module")
def one_run(tmp_path_factory):
    folder = bench(tmp_path_factory.mktemp("one run"), drag=6.0)
    return {name: bf.fit(folder, friction=name, seed=1, settings=QUICK) for name in ("capstan", "drag")}


@pytest.mark.slow
def test_with_one_run_its_loads_are_left_out_and_the_right_model_is_preferred(one_run):
    comparison = bf.compare(one_run)
    assert comparison.best == "drag" and comparison.verdict("capstan") == "clear"
    assert comparison.left_out == "load" and len(comparison.readings) == 16
    text = " ".join(str(comparison).split())
    assert "there is one run" in text and "The data prefer drag over capstan" in text
    assert "inf" not in text.replace("inform", "")


@pytest.mark.slow
def test_a_single_run_left_out_whole_is_refused(one_run):
    with pytest.raises(UsageError, match="nothing predicts it once it is left out"):
        bf.compare(one_run, leave_out="run")


def test_too_many_readings_are_refused_with_what_to_do_instead(tmp_path):
    with jax.enable_x64(True):
        (term,) = build_model(load_dataset(bench(tmp_path, runs=10))).terms
        with pytest.raises(UsageError, match="--leave-out load"):
            split_runs(term, "reading")
