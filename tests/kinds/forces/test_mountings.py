"""Runs numbered anew at each length or bend are mountings of their own, and that is said."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from hand_bench import BENDS, LENGTHS, pull, write

from bowdenfit.dataset import load_dataset
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.covariates import route_values
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.models import build_model

ALONG = {"lengths": (LENGTHS, "cable_length_mm"), "bends": (BENDS, "wrap_angle_deg")}


def _folder(path, labels, along="lengths", more=""):
    """Three runs at each of six places, whatever they are called."""
    description, column = ALONG[along]
    places = np.repeat([440, 460, 480, 500, 520, 540], 3).astype(float)
    loss = 0.2 * np.deg2rad(180 - places / 5)
    rows = pull(np.random.default_rng(3), places, loss, [20, 40, 60], labels=labels, noise=(0.2, 0.2), scatter=0.01)
    folder = write(path, rows, description.replace('file = "forces.csv"', f'file = "forces.csv"{more}'), column)
    angles = "\n".join(f"{length},{180 - length / 5}" for length in range(440, 541, 10))
    (folder / "angles.csv").write_text(f"cable_length_mm,sheath_angle_deg\n{angles}\n")
    return folder


@pytest.mark.extended
@pytest.mark.parametrize("along", ALONG)
def test_labels_that_come_back_elsewhere_equal_labels_of_their_own(tmp_path, accept, along):
    again = _folder(tmp_path / "again", ["1", "2", "3"] * 6, along)
    own_density = _folder(tmp_path / "own", [str(i) for i in range(18)], along)
    densities = [LogDensity(build_model(load_dataset(folder))) for folder in (again, own_density)]
    for seed in range(3):
        z = jnp.asarray(0.5 * np.random.default_rng(seed).standard_normal(densities[0].model.space.size))
        first, other = (float(density.log_density(z, density.data)) for density in densities)
        assert first == pytest.approx(other, abs=1e-9)
    output = accept("check", again)
    assert "18 mountings in all" in " ".join(output.split()) and f"across {along}" in output
    assert "mountings in all" not in accept("check", own_density)
    labels = next(term.labels for term in densities[0].model.terms if term.name == "run_efficiency")
    assert len(set(labels)) == 18


@pytest.mark.parametrize("along", ALONG)
def test_a_cable_that_stayed_mounted_is_one_run_across_places(tmp_path, along):
    folder = _folder(tmp_path, ["1", "2", "3"] * 6, along, f', run = "across {along}"')
    table = load_dataset(folder).measurements.table(ForceTable)
    assert isinstance(table, ForceTable) and table.run_names == ("1", "2", "3")


def test_no_run_is_shown_at_a_length_where_nothing_was_measured(tmp_path):
    folder = _folder(tmp_path / "across", ["1", "2", "3"] * 6, more=', run = "across lengths"')
    across = build_model(load_dataset(folder)).terms[-1]
    assert np.isnan(route_values(across)).all()
    once = build_model(load_dataset(_folder(tmp_path / "once", ["1", "2", "3"] * 6))).terms[-1]
    assert set(route_values(once)) == {440.0, 460.0, 480.0, 500.0, 520.0, 540.0}


def test_wrap_angles_read_anew_in_every_row_do_not_part_a_run(tmp_path):
    rows = pull(np.random.default_rng(4), [90.0, 180.0], [0.2, 0.4], [20, 40, 60], labels=["1", "1"], noise=(0.2, 0.2))
    rows = replace(rows, place=rows.place + 0.3 * np.random.default_rng(5).standard_normal(len(rows.place)))
    table = load_dataset(write(tmp_path, rows)).measurements.table(ForceTable)
    assert isinstance(table, ForceTable) and len(table.run_names) == 2
    assert [float(name[3:-5]) for name in table.run_names] == pytest.approx([90, 180], abs=0.5)


@pytest.mark.parametrize(("along", "label"), [("lengths", "440 mm"), ("bends", "88 deg")])
def test_runs_without_names_are_called_by_their_place_in_a_unit(tmp_path, along, label):
    folder = _folder(tmp_path, ["1", "2", "3"] * 6, along)
    rows = [line.split(",") for line in (folder / "forces.csv").read_text().splitlines()]
    keep = [i for i, head in enumerate(rows[0]) if head != "run"]
    place = rows[0].index(ALONG[along][1])
    for row in rows[1:]:
        row[place] = str(float(row[place]) / (1 if along == "lengths" else 5))
    (folder / "forces.csv").write_text("\n".join(",".join(row[i] for i in keep) for row in rows) + "\n")
    labels = next(term.labels for term in build_model(load_dataset(folder)).terms if term.name == "run_efficiency")
    assert labels[0] == label and len(labels) == 6
