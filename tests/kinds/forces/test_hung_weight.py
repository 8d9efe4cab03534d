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
