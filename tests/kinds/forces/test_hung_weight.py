"""Benches against a hung weight: input forces that differ by friction alone are not loads that differ."""

import jax
import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.term import LOAD
from bowdenfit.models import build_model


def covariates(folder, weights):
    """Covariates of twelve runs, which scatter by 10 %, against these weights in turns."""
    generator, rows = np.random.default_rng(1), ["run,input_force_N,output_force_N,wrap_angle_deg"]
    for run in range(12):
        weight = weights[run % len(weights)]
        exponent = 0.2 * np.pi * (1 + 0.1 * generator.standard_normal())
        rows.append(f"r{run},{weight * np.exp(exponent):.4f},{weight},180")
    (folder / "table.csv").write_text("\n".join(rows) + "\n")
    with jax.enable_x64(True):
        return build_model(bf.read(folder / "table.csv")).covariates["run_efficiency"].numbers


@pytest.mark.parametrize(("weights", "differ"), [((50.0,), False), ((20.0, 50.0), True)])
def test_loads_differ_where_both_forces_do(tmp_path, weights, differ):
    assert (LOAD in covariates(tmp_path, weights)) == differ


@pytest.mark.parametrize(("weights", "load_matters"), [([100.0] * 12, False), (np.geomspace(20, 200, 12), True)])
def test_a_dependence_on_load_inside_a_run_needs_loads_that_differ(tmp_path, weights, load_matters):
    """Of one run against one weight, whose input force takes two values as a load cell with few digits has it."""
    generator = np.random.default_rng(2)
    output = np.asarray(weights)
    drag = 0.1 * output.min() if load_matters else 0.0
    force = output * np.exp(0.19 * np.pi) + drag
    force *= 1 + 0.05 * generator.choice([-1, 1], 12) if not load_matters else 1 + 0.001 * generator.standard_normal(12)
    rows = [f"{a:.6g},{b:.6g}" for a, b in zip(force, output, strict=True)]
    (tmp_path / "table.csv").write_text("\n".join(["input_force_N,output_force_N", *rows]) + "\n")
    reasons = bf.fit(tmp_path / "table.csv", wrap_angle=(180, "deg"), mcmc=False, seed=1).verdict().reasons
    assert any("around a load" in reason for reason in reasons) == load_matters, reasons
