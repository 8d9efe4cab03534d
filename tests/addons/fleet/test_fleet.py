"""Fleets: many cables fitted by themselves, the same whoever fits them, and broken ones named."""

import json
import shutil
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.addons.fleet.folder import FLEET_DRAWS, FLEET_TABLE, read_fleet_draws

ENDS = (0.05, 0.95)
FLEET = Path(__file__).parents[3] / "datasets" / "synthetic-fleet"


def some(folder: Path, rows) -> Path:
    """A fleet of some inspections of the synthetic one, in another folder."""
    shutil.copytree(FLEET / "readings", folder / "readings")
    shutil.copy(FLEET / "fleet.toml", folder)
    heading, *lines = (FLEET / FLEET_TABLE).read_text().splitlines()
    (folder / FLEET_TABLE).write_text("\n".join([heading, *(lines[i] for i in rows)]) + "\n")
    return folder


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """Six inspections of two cables, and the folder of what came of them."""
    folder = tmp_path_factory.mktemp("fleet")
    results = folder / "results"
    return bf.fleet(some(folder / "fleet", range(6)), output=results, seed=7), results


def test_the_shipped_fleet_is_what_its_plan_makes(run, tmp_path):
    code, _, _ = run("simulate", FLEET / "bench.toml", "--fleet", "-o", tmp_path / "made", "--seed", 20261122)
    assert code == 0
    for path in sorted((tmp_path / "made").rglob("*.*")):
        assert path.read_text() == (FLEET / path.relative_to(tmp_path / "made")).read_text(), path.name


def test_every_inspection_finds_its_truth(fitted):
    """Within 4.5 standard deviations of the draws: of twelve coefficients one is outside by chance once in ten thousand."""
    answer, results = fitted
    assert answer.is_trusted
    page = json.loads((FLEET / "truth.json").read_text())
    population, fleet = page["population"], read_fleet_draws(results)
    (meanings,) = fleet.about["meanings"].values()
    assert meanings == {"mu_sheath": "friction of sheath", "mu_edge": "friction of edge"}
    for i, cable in enumerate(fleet.cable):
        truth = page["cables"][cable]
        more = truth["wear"] * fleet.cycles[i] / population["reference_cycles"]
        more += population["lubrication"] * fleet.lubricated[i]
        more += population["per_degree"] * (fleet.temperature[i] - population["reference_temperature"])
        for name, start in truth["log_start"].items():
            logs = np.log(fleet.values[name][i])
            assert abs(logs.mean() - start - more) < 4.5 * logs.std()


@pytest.mark.extended
def test_the_draws_are_those_of_single_fits(fitted):
    """Medians to 0.1 standard deviations and 90 % intervals to 15 %, whatever the few draws in the long tail of tau do."""
    _, results = fitted
    fleet = read_fleet_draws(results)
    table = FLEET / "readings" / "cable-01-0.csv"
    settings = ['tables.forces.file="readings/cable-01-0.csv"']
    single = bf.fit(FLEET / "fleet.toml", seed=1, settings=settings).posterior.values
    assert table.exists()
    for name in ("mu_sheath", "mu_edge", "tau", "sigma_F"):
        first, other = np.log(fleet.values[name][0]), np.log(single[name].ravel())
        assert abs(np.median(first) - np.median(other)) < 0.1 * other.std()
        assert abs(np.ptp(np.quantile(first, ENDS)) / np.ptp(np.quantile(other, ENDS)) - 1) < 0.15


def test_draws_depend_neither_on_order_nor_on_what_else_is_fitted(fitted, tmp_path):
    _, results = fitted
    together = read_fleet_draws(results)
    bf.fleet(some(tmp_path / "fleet", (4,)), output=tmp_path / "one", seed=7)
    alone = read_fleet_draws(tmp_path / "one")
    index = together.label.index(alone.label[0])
    for name, draws in alone.values.items():
        np.testing.assert_array_equal(draws[0], together.values[name][index])


@pytest.mark.extended
def test_a_process_that_is_started_anew_writes_the_same_file(fitted, tmp_path):
    """To the last bit; clusters are in test_fleet_engines.py."""
    _, results = fitted
    folder = some(tmp_path / "fleet", range(6))
    with ProcessPoolExecutor(1, get_context("spawn")) as executor:
        bf.fleet(folder, output=tmp_path / "results", seed=7, engine=executor, workers=1)
    assert (tmp_path / "results" / FLEET_DRAWS).read_bytes() == (results / FLEET_DRAWS).read_bytes()


@pytest.mark.extended
def test_a_fleet_can_be_continued_with_new_inspections_and_comes_out_the_same(fitted, tmp_path):
    _, results = fitted
    folder = some(tmp_path / "fleet", range(3))
    bf.fleet(folder, output=tmp_path / "results", seed=7)
    shutil.rmtree(folder)
    bf.fleet(some(folder, range(6)), output=tmp_path / "results", resume=True)
    assert (tmp_path / "results" / FLEET_DRAWS).read_bytes() == (results / FLEET_DRAWS).read_bytes()
