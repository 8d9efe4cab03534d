"""An output that does not follow the input is refused with its cause; what a rope may do, however noisy, is not."""

from dataclasses import replace

import numpy as np
import pytest
from hand_bench import Readings, pull

from bowdenfit.errors import DatasetError
from bowdenfit.kinds.forces.impossible_forces import check_following
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.rows import OwnAngles, RowOrigin

pytestmark = pytest.mark.extended

LOADS = (20.0, 40.0, 60.0, 80.0, 100.0, 120.0)


def bench(seed=0, noise=0.4, loss=0.4, **more):
    """Three mountings."""
    generator = np.random.default_rng(seed)
    return pull(generator, (180.0,) * 3, (loss,) * 3, LOADS, noise=(noise, noise), repeats=4, scatter=0.02, **more)


def table(rows: Readings) -> ForceTable:
    n, run = len(rows.stroke), np.unique(rows.label, return_inverse=True)[1]
    origin = RowOrigin.below_heading("forces.csv", n)
    unknown = np.full(n, np.nan)
    return ForceTable(
        unknown, rows.force_in, rows.force_out, run, tuple(np.unique(rows.label)), rows.stroke, OwnAngles.none((), n), origin,
        unknown,
    )  # fmt: skip


def with_output(rows: Readings, force: np.ndarray) -> Readings:
    return replace(rows, force_out=force)


@pytest.mark.parametrize("strokes", [(1,), (-1,), (1, -1)])
def test_a_dead_cell_and_a_column_that_is_no_force_are_refused_with_their_cause(strokes):
    rows = bench(strokes=strokes)
    n = len(rows.stroke)
    dead = 12 + 0.3 * np.random.default_rng(1).standard_normal(n)
    for force in (np.full(n, 12.0), dead, 40 + 30 * np.sin(np.arange(n) / 3)):
        with pytest.raises(
            DatasetError, match=r"(?s)forces.csv, row 2.*does not follow input_force.*dead load cell.*no force"
        ):
            check_following(table(with_output(rows, force)))


def test_what_a_rope_may_do_is_not_refused():
    """Much friction, one that is the same at any load, noise of a third of the force, loads that hardly differ."""
    rows = bench()
    for force in (
        rows.force_in * np.exp(-3.0 * rows.stroke),
        np.maximum(rows.force_in - 15 * rows.stroke, 1.0),
        rows.force_in + 200.0 * (rows.stroke < 0),
    ):
        check_following(table(with_output(rows, force)))
    alike = replace(rows, force_in=60 + 0.01 * rows.force_in, force_out=40 + 0.01 * rows.force_in[::-1])
    check_following(table(alike))


def test_fewer_than_one_noisy_bench_of_a_thousand_is_refused():
    """Noise of 15 N on 20 to 120 N; if one of 1000 were, none of 3000 would be with a chance of 5 %."""
    for seed in range(3000):
        check_following(table(bench(seed, noise=15.0)))
