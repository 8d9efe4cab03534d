"""A force that is thousands of times the others is named before anything is fitted; an honest range of loads is not."""

from dataclasses import replace

import numpy as np
import pytest
from hand_bench import pull, write

import bowdenfit as bf
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.measured_columns import MeasuredColumn, pair_forces, refuse_far_forces
from bowdenfit.kinds.rows import RowOrigin

LOADS = (20.0, 30.0, 40.0)


def _bench(seed=1, strokes=(1, -1), loads=LOADS, repeats=1, mountings=3):
    """Rows of a bench, forces to a hundredth of a newton."""
    rows = pull(
        np.random.default_rng(seed), [180.0] * mountings, [0.3] * mountings, loads, strokes=strokes, repeats=repeats,
        noise=(0.1, 0.1), scatter=0.02,
    )  # fmt: skip
    return replace(rows, force_in=rows.force_in.round(2), force_out=rows.force_out.round(2))


def _with_force(rows, end, row, force):
    forces = getattr(rows, end).copy()
    forces[row] = force
    return replace(rows, **{end: forces})


@pytest.mark.parametrize("end", ["force_in", "force_out"])
@pytest.mark.parametrize("bench", [{"mountings": 8, "loads": (30.0,), "strokes": (1,)}, {"repeats": 2}, {"strokes": (-1,)}])
def test_a_force_of_600000_among_30_is_named_by_check_with_row_column_and_value(tmp_path, refuse, bench, end):
    """With one reading of each mounting nothing else shows it before the fit."""
    printed = refuse("check", write(tmp_path / "far", _with_force(_bench(**bench), end, 4, 600000.0)))
    column = {"force_in": "input_force", "force_out": "output_force"}[end]
    assert f"forces.csv, row 6, column '{column}': 600000 N is far from the other forces, half of which are at most" in printed
    assert "the usual cause is a missing decimal point or a wrong unit" in printed
    bf.check(write(tmp_path / "twin", _bench(**bench)))


def test_a_row_whose_forces_are_both_far_is_named_in_both_columns(tmp_path, refuse):
    rows = _with_force(_with_force(_bench(), "force_in", 4, 600000.0), "force_out", 4, 442000.0)
    printed = refuse("check", write(tmp_path, rows), faults=2)
    assert "column 'input_force': 600000 N" in printed and "column 'output_force': 442000 N" in printed


def test_a_load_of_a_table_of_stretch_that_is_far_from_the_others_is_named():
    origin = RowOrigin.below_heading("stretch.csv", 6)
    column = MeasuredColumn("load", "N", np.array([1, 3, 600000, 9, 0, 12.0]))
    with pytest.raises(DatasetError, match=r"stretch\.csv, row 4, column 'load': 600000 N is far"):
        refuse_far_forces([column], origin)
    refuse_far_forces([replace(column, values=np.array([1.0, 10, 100, 1000, 10000, 0]))], origin)


def _is_refused(force_in, force_out, group):
    try:
        refuse_far_forces(pair_forces(force_in, force_out, group), RowOrigin.below_heading("forces.csv", len(force_in)))
    except DatasetError:
        return True
    return False


def test_forces_from_1_n_to_10_kn_in_one_table_are_not_named_and_one_that_is_20000_times_too_large_is():
    """Loads of any size with drag, cells off by 0.3 N; none of 2,000 tables is refused, and all slips are found."""
    generator, is_refused = np.random.default_rng(3), []
    for _ in range(2000):
        n = int(generator.integers(4, 40))
        loads = [np.exp(generator.uniform(0, np.log(1e4), n)), generator.choice([1.0, 10.0, 100.0, 1e3, 1e4], n)]
        loads += [generator.choice([1.0, 1e4], n), np.where(generator.random(n) < 0.2, 10.0, 1.0) * generator.uniform(1, 1e3)]
        load, stroke = loads[generator.integers(4)], generator.choice([1, -1], n)
        out = (load + 0.5) * np.exp(-stroke * generator.uniform(0.01, 1.5)) - 0.5
        read_in, read_out = (np.maximum(force + 0.3 * generator.standard_normal(n), 1e-3) for force in (load, out))
        if np.sum(load > 5e3) != 1:  # a single load of 10 kN among loads of 1 N is as far as a slip
            assert not _is_refused(read_in, read_out, stroke)
        load = generator.uniform(10, 200, n)
        out = load * np.exp(-stroke * generator.uniform(0.01, 1.5))
        (load, out)[generator.integers(2)][generator.integers(n)] *= 20000
        is_refused.append(_is_refused(load, out, stroke))
    assert np.mean(is_refused) > 0.99, np.mean(is_refused)


@pytest.mark.parametrize(("stroke", "end"), [(1, "force_out"), (-1, "force_in")])
def test_a_force_in_kilonewtons_among_newtons_is_named_though_its_logarithm_says_little(tmp_path, refuse, stroke, end):
    """Noise of 0.1 N would let the logarithm of 0.03 N be anything."""
    rows = _bench(mountings=7, strokes=(stroke,))
    wrong = _with_force(rows, end, 4, round(getattr(rows, end)[4] / 1000, 3))
    assert "forces.csv, row 6: " in (printed := refuse("check", write(tmp_path / "kN", wrong)))
    assert "off the other readings of its run and stroke by a factor of more than two" in printed
    bf.check(write(tmp_path / "twin", rows))
    weak = pull(np.random.default_rng(3), [180.0] * 7, [0.3] * 7, (0.3, 3.0, 30.0), strokes=(stroke,), noise=(0.05, 0.05))
    bf.check(write(tmp_path / "weak", weak))  # a load of six times the noise is known to no factor of two
