"""Readings that are equal because a range ended are named by `check` and the verdict; others are not."""

import shutil
from dataclasses import replace
from pathlib import Path

import hand_bench
import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.measured_columns import MeasuredColumn, find_cut_off, pair_forces
from bowdenfit.questions.check.data_set_words import describe_cut_off_readings
from bowdenfit.questions.summary.verdict import CUT_OFF

DATASETS = Path(__file__).parents[2] / "datasets"
LOADS = (20.0, 40.0, 60.0, 80.0, 100.0)
ROUTE = np.arange(0.0, 200.0, 10.0)


def _with_protractor(folder, longest):
    """The synthetic bench, its lower sheath read with a protractor that ends at so many degrees."""
    shutil.copytree(DATASETS / "synthetic-bench", folder)
    heading, *rows = (folder / "angles.csv").read_text().splitlines()
    cells = [row.split(",") for row in rows]
    for row in cells:
        row[2] = row[2] if row[2].startswith("<") or float(row[2]) < longest else str(longest)
    (folder / "angles.csv").write_text("\n".join([heading, *(",".join(row) for row in cells)]) + "\n")
    return folder


def test_angles_cut_off_by_the_protractor_are_named_and_their_fit_is_not_trusted(tmp_path, run):
    """mu_sheath of the bench is 0.10; with six angles cut off it would be 0.157."""
    code, out, _ = run("check", _with_protractor(tmp_path / "cut", 49.4))
    printed = " ".join(out.split())
    assert code == 0 and "1 warning, at the end" in printed
    assert (
        "angles.csv, rows 10, 11, 12, 13, 14 and 15, column 'lower_sheath_angle': the highest value, 49.4 deg, is there 6 times"
        in printed
    )
    assert "record one more digit" in printed
    code, out, _ = run("fit", tmp_path / "cut", "--no-mcmc", "--no-figures", "-o", tmp_path / "fit")
    assert code == 3
    assert "some of the readings are cut off where a range ends" in " ".join(out.split())
    assert "column 'lower_sheath_angle': the highest value, 49.4 deg" in " ".join(out.split())
    twin = bf.fit(_with_protractor(tmp_path / "twin", 180.0), mcmc=False)
    assert twin.verdict().trusted


def test_forces_beyond_the_range_of_a_load_cell_are_named_and_those_of_its_twin_trusted(tmp_path):
    rows = hand_bench.pull(
        np.random.default_rng(5), [90.0, 180.0, 180.0], [0.19, 0.38, 0.38], LOADS, noise=(0.1, 0.1), scatter=0.01
    )
    rows = replace(rows, force_in=rows.force_in.round(2), force_out=rows.force_out.round(2))
    twin = bf.fit(hand_bench.write(tmp_path / "twin", rows), mcmc=False)
    assert CUT_OFF not in twin.verdict().troubles and twin.verdict().trusted
    cut = hand_bench.write(tmp_path / "cut", replace(rows, force_out=np.minimum(rows.force_out, 90.0)))
    (sentence,) = bf.fit(cut, mcmc=False).verdict().troubles[CUT_OFF]
    assert "forces.csv, rows " in sentence and "column 'output_force': the highest value, 90 N" in sentence


def test_no_published_table_is_said_to_be_cut_off():
    for path in sorted(DATASETS.glob("*/cable.toml")):
        assert describe_cut_off_readings(bf.read(path.parent)) == (), path.parent.name


def _named(values, along=ROUTE):
    return any(len(rows) > 0 for rows in find_cut_off(MeasuredColumn("angle", "deg", np.asarray(values, dtype=float), along)))


def _bell(height, middle, width, seed=1, noise=1.0):
    noise = noise * np.random.default_rng(seed).standard_normal(len(ROUTE))
    return height * np.exp(-(((ROUTE - middle) / width) ** 2)) + noise


def test_equal_readings_with_another_reason_are_not_said_to_be_cut_off():
    """The top of a wide bell, whole degrees, steps of 5 deg, readings of nothing, and repeats of one set bend."""
    assert _named(np.minimum(_bell(90, 140, 90), 61.3).round(1))
    assert not _named(_bell(90, 100, 400, noise=0.0).round())
    assert not _named(np.minimum(90.0 + 0 * ROUTE, ROUTE))  # a guide around which the sheath lies, without noise
    assert not _named(np.minimum(_bell(90, 140, 90), 61.0).round() // 5 * 5)
    assert not _named(np.maximum(_bell(90, 140, 40), 0.0).round(1))
    assert not _named(np.repeat([90.0, 180.0, 180.0, 180.0], 5))
    assert _named(np.maximum(_bell(90, 140, 90), 30.7).round(1))
    undetected = np.maximum(_bell(90, 140, 40), 5.0)
    assert not _named(np.where(undetected > 5, undetected, np.nan).round(1))


@pytest.mark.parametrize("end", [0, 1])
def test_set_points_are_not_said_to_be_cut_off(end):
    """Weights at one end, and a ramp that always stops at the same reading; the other end follows in proportion."""
    generator, group = np.random.default_rng(2), np.repeat(np.arange(6), len(LOADS))
    loads = np.tile(LOADS, 6)
    ramp = np.where(loads == 100.0, 100.0, (loads + generator.standard_normal(30)).round(2))
    for arguments in (loads, ramp):
        read = (
            0.7 * arguments * np.exp(0.02 * generator.standard_normal(6))[group] + 0.2 * generator.standard_normal(30)
        ).round(2)
        columns = pair_forces(*((arguments, read) if end == 0 else (read, arguments)), group)
        assert not any(len(rows) for column in columns for rows in find_cut_off(column))


def _route_and_angles(generator):
    """Healthy angles at 5 to 40 lengths, along a bell, a line or a rise to a guide, read to 0.1, 0.5, 1 or 5 deg."""
    along = np.sort(generator.uniform(0, 1, generator.integers(5, 41)))
    height, middle, width = generator.uniform(20, 120), generator.uniform(0, 1.2), generator.uniform(0.2, 1.5)
    curves = (height * np.exp(-(((along - middle) / width) ** 2)), height * along, height * np.clip(along / width, 0, 1))
    digit = generator.choice([0.1, 0.5, 1.0, 5.0])
    noise = generator.choice([0.0, 0.2, 1.0, 2.0])
    angle = np.maximum(curves[generator.integers(3)] + noise * generator.standard_normal(len(along)), 0.0)
    return along, angle, digit, noise


@pytest.mark.extended
def test_of_healthy_angles_at_most_one_in_a_thousand_is_named_and_most_that_are_cut_off():
    """Of 20,000 healthy columns none was; of 1483 cut off, with noise of five digits or more and five lengths beyond, 1153."""
    generator, healthy, detected = np.random.default_rng(11), 0, []
    for _ in range(2000):
        along, angle, digit, noise = _route_and_angles(generator)
        healthy += _named((angle / digit).round() * digit, along)
        limit = digit * round(generator.uniform(0.5, 0.8) * angle.max() / digit)
        if noise >= 5 * digit and 5 <= np.sum(angle > limit + noise) <= len(angle) - 6:
            detected.append(_named((np.minimum(angle, limit) / digit).round() * digit, along))
    assert healthy <= 2
    assert len(detected) > 100 and np.mean(detected) > 0.6, (len(detected), np.mean(detected))
