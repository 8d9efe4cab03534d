"""A fleet is the same file to the last bit whichever cluster fits it, and whoever dies meanwhile."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import bowdenfit as bf
from bowdenfit.addons.fleet.clusters import make_slurm_executor
from bowdenfit.addons.fleet.folder import FLEET_DRAWS
from bowdenfit.addons.fleet.simulation import read_fleet_plan, simulate_fleet, write_fleet
from bowdenfit.addons.fleet.store import PIECES_FOLDER

pytestmark = pytest.mark.extended

BENCH = Path(__file__).parents[3] / "datasets" / "synthetic-fleet" / "bench.toml"
SEED = 7
MORE = {  # a contact that hardly any run tells from the others
    "[tables]": '[[contact]]\nname = "clamp"\nfriction = "mu_clamp"\nwrap_angle = { column = "clamp_angle" }\n\n[tables]',
    "mu_edge = 0.15": "mu_edge = 0.15\nmu_clamp = 0.12",
    "own_angles = {": "own_angles = { clamp_angle = [60, 62, 58, 60, 64, 57],",
    "cables = 40\ncycles = [0, 25000, 50000]": "cables = 96\ncycles = [0]",
}


@pytest.fixture(scope="module")
def fleet(tmp_path_factory) -> Path:
    """A fleet of cables with three coefficients, of which a quarter go on from weighted draws to walkers."""
    folder, text = tmp_path_factory.mktemp("fleet"), BENCH.read_text()
    for initial, after in MORE.items():
        assert initial in text
        text = text.replace(initial, after)
    (folder / "bench.toml").write_text(text)
    plan = read_fleet_plan(folder / "bench.toml")
    write_fleet(plan, *simulate_fleet(plan, 5), folder / "fleet")
    return folder / "fleet"


@pytest.fixture(scope="module")
def whole(fleet, tmp_path_factory) -> bytes:
    """The file of the whole fleet, fitted in this process."""
    folder = tmp_path_factory.mktemp("whole") / "results"
    assert set(bf.fleet(fleet, output=folder, seed=SEED).engines) == {"laplace", "ensembles"}
    return (folder / FLEET_DRAWS).read_bytes()


@pytest.fixture(scope="module")
def cluster():
    """A Dask cluster on this machine: two workers, which are replaced when they die."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as local_cluster:
        yield local_cluster


def by_dask(cluster) -> str:
    return cluster.scheduler_address.replace("tcp://", "dask://")


@pytest.mark.slow
def test_a_dask_cluster_writes_the_same_file(whole, fleet, cluster, tmp_path):
    bf.fleet(fleet, output=tmp_path, seed=SEED, engine=by_dask(cluster))
    assert (tmp_path / FLEET_DRAWS).read_bytes() == whole


@pytest.mark.slow
def test_jobs_as_slurm_has_them_write_the_same_file(whole, fleet, tmp_path):
    with make_slurm_executor(tmp_path / "jobs", 2, "local") as executor:
        bf.fleet(fleet, output=tmp_path / "results", seed=SEED, engine=executor, workers=2)
    assert (tmp_path / "results" / FLEET_DRAWS).read_bytes() == whole


@pytest.mark.slow
@pytest.mark.parametrize("after", [1, 3])
def test_a_dask_worker_that_is_killed_in_the_middle_changes_nothing(whole, fleet, cluster, tmp_path, after):
    """Both are killed, so that one of them was at work."""
    from distributed import Client

    pieces, killed = list[int](), list[int]()

    def kill(done, total, _):
        pieces.append(done)
        if len(pieces) == after:
            assert done < total
            with Client(cluster.scheduler_address, set_as_default=False) as client:
                killed.extend(client.run(os.getpid).values())
            for process in killed:
                os.kill(process, signal.SIGKILL)

    bf.fleet(fleet, output=tmp_path, seed=SEED, engine=by_dask(cluster), progress=kill)
    assert len(killed) == 2
    assert (tmp_path / FLEET_DRAWS).read_bytes() == whole


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["local", "dask"])
def test_a_client_that_is_killed_goes_on_and_writes_the_same_file(whole, fleet, tmp_path, engine, request):
    engine_used = by_dask(request.getfixturevalue("cluster")) if engine == "dask" else engine
    words = [sys.executable, "-m", "bowdenfit", "fleet", fleet, "-o", tmp_path / "results", "--engine", engine_used]
    pieces = tmp_path / "results" / PIECES_FOLDER
    with subprocess.Popen([*words, "--seed", str(SEED)], stderr=subprocess.DEVNULL) as client:
        while client.poll() is None and not list(pieces.glob("*.npz")):
            time.sleep(0.005)
        client.kill()
    assert client.returncode == -signal.SIGKILL and not (tmp_path / "results" / FLEET_DRAWS).exists()
    count = len(list(pieces.glob("*.npz")))
    subprocess.run([*words, "--resume"], check=True, capture_output=True)
    assert count > 0 and (tmp_path / "results" / FLEET_DRAWS).read_bytes() == whole
