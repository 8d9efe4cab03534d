"""What is wrong with a fleet, or with those who are to fit it, is a sentence, and what is done is kept."""

import errno
import shutil
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest

import bowdenfit as bf
from bowdenfit.addons.fleet import clusters
from bowdenfit.addons.fleet.folder import FLEET_DRAWS, FLEET_TABLE
from bowdenfit.addons.fleet.inspections import read_cases, read_inspections
from bowdenfit.addons.fleet.store import PIECES_FOLDER, FleetStore
from bowdenfit.inference import engines
from bowdenfit.inference.engines import Engine, EngineError, installed_versions

pytestmark = pytest.mark.extended

FLEET = Path(__file__).parents[3] / "datasets" / "synthetic-fleet"
HEADING, *ROWS = (FLEET / FLEET_TABLE).read_text().splitlines()


@pytest.fixture
def fleet(tmp_path):
    """Writes a fleet with the rows that are given."""

    def write(*rows):
        folder = tmp_path / "fleet"
        shutil.copytree(FLEET / "readings", folder / "readings")
        shutil.copy(FLEET / "fleet.toml", folder)
        (folder / FLEET_TABLE).write_text("\n".join([HEADING, *rows]) + "\n")
        return folder

    return write


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ((ROWS[0], ROWS[1], ROWS[0]), "cable-01 after 0 cycles appears twice: fleet.csv, row 2 and fleet.csv, row 4"),
        ((ROWS[1], ROWS[0]), "cycles run backwards: fleet.csv, row 3 (cable-01: 0 after 25000 in row 2)"),
        ((ROWS[0].replace(",0,", ",-5,"),), "-5' cycles cannot be"),
        ((ROWS[0].replace("yes", "perhaps"),), "does not say whether the cable was lubricated"),
        ((ROWS[0].replace("28.6", "900"),), "is not a temperature"),
        ((ROWS[0].replace("readings/", "gone/"),), "none of 1 inspections can be fitted"),
    ],
)
def test_a_wrong_table_is_refused_and_nothing_is_written(refuse, fleet, tmp_path, rows, message):
    assert message in refuse("fleet", fleet(*rows), "-o", tmp_path / "results")


@pytest.mark.parametrize(
    ("engine", "code", "message"),
    [
        ("dask://127.0.0.1:9", 1, "does not answer"),
        ("slurm", 2, "there is no Slurm here"),
        ("ray", 2, "there is no engine 'ray'"),
    ],
)
def test_an_engine_that_cannot_be_had_leaves_nothing_behind(run, fleet, tmp_path, monkeypatch, engine, code, message):
    monkeypatch.setenv("PATH", str(tmp_path))  # no Slurm on any machine
    monkeypatch.setattr(clusters, "_CONNECT_SECONDS", 1.0)
    results = tmp_path / "results"
    exit_code, _, error = run("fleet", fleet(ROWS[0]), "-o", results, "--engine", engine)
    assert exit_code == code and message in " ".join(error.split()) and "Traceback" not in error
    assert not results.exists()


def test_broken_inspections_are_named_and_the_others_go_on(fleet):
    """A file that is missing, one that is no table, one that is copied, and one with a description of its own."""
    other = fleet(ROWS[0], *ROWS[3:5], ROWS[6].replace("cable-03-0", "cable-01-0"), "own,0,20,no,own")
    (other / "readings" / "cable-02-0.csv").unlink()
    (other / "readings" / "cable-02-25000.csv").write_bytes(b"\x00\xff\x13 no table")
    own_density = other / "own"
    (own_density / "readings").mkdir(parents=True)
    text = (
        (FLEET / "fleet.toml")
        .read_text()
        .replace("mu_edge", "mu_ring")
        .replace("forces.csv", "readings/cable-04-0.csv")
    )
    (own_density / "cable.toml").write_text(text)
    shutil.copy(FLEET / "readings" / "cable-04-0.csv", own_density / "readings")
    cases = list(read_cases(other, read_inspections(other), {}))
    broken = {case.inspection: case.why for case in cases if hasattr(case, "why")}
    assert set(broken) == {"cable-02 after 0 cycles", "cable-02 after 25000 cycles", "cable-03 after 0 cycles"}
    assert "has the readings of cable-01 after 0 cycles to the last digit" in broken["cable-03 after 0 cycles"]
    fitted = [case for case in cases if not hasattr(case, "why")]
    assert [item.inspection.cable for item in fitted] == ["cable-01", "own"]
    assert len({item.shaped.key for item in fitted}) == 2


class Dying(ThreadPoolExecutor):
    """Loses the first so many pieces, as where workers die."""

    def __init__(self, lost):
        super().__init__(1)
        self.lost = lost

    def submit(self, function, /, *arguments, **named):
        self.lost -= 1
        return super().submit(function, *arguments, **named) if self.lost < 0 else super().submit(_die)


def _die():
    raise ConnectionError("the worker is gone")


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_work_of_a_worker_that_dies_is_done_again(lost):
    with Dying(lost) as executor:
        assert sorted(Engine(lambda: executor, 1, "here").results(abs, [-1, -2, -3])) == [1, 2, 3]


def test_work_that_kills_every_worker_is_a_sentence():
    with Dying(1000) as executor, pytest.raises(EngineError, match="lost 3 times at the same work"):
        list(Engine(lambda: executor, 1, "here").results(abs, [-1]))


class Waiting(ThreadPoolExecutor):
    """Takes work and does none, as a cluster whose last worker is gone."""

    def submit(self, function, /, *arguments, **named):
        return Future()


class Gone(ThreadPoolExecutor):
    """Takes no work, as a client whose scheduler is gone."""

    def submit(self, function, /, *arguments, **named):
        raise ConnectionError("Client is closed")


def refuse_nobody():
    raise EngineError("nobody is left")


def test_a_cluster_in_which_nobody_is_left_is_not_waited_for(monkeypatch):
    monkeypatch.setattr(engines, "_PATIENCE", 0.01)
    with Waiting(1) as executor, pytest.raises(EngineError, match="nobody is left"):
        list(Engine(lambda: executor, 1, "here", check=refuse_nobody).results(abs, [-1, -2]))


def test_a_cluster_that_takes_no_more_work_is_a_sentence():
    with Gone(1) as executor, pytest.raises(EngineError, match=r"no more work \(ConnectionError: Client is closed\)"):
        list(Engine(lambda: executor, 1, "here").results(abs, [-1]))


@pytest.mark.slow
def test_a_scheduler_without_workers_is_a_sentence(monkeypatch):
    from distributed import LocalCluster

    monkeypatch.setattr(engines, "_WORKER_SECONDS", 1)
    with LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address=None) as cluster:
        address = cluster.scheduler_address.replace("tcp://", "dask://")
        with pytest.raises(EngineError, match=r"has no worker; start some"), engines.open_engine(address):
            pass


def test_a_worker_with_other_versions_is_refused(fleet, monkeypatch):
    """The work says with which versions it was made."""
    installed = installed_versions()
    monkeypatch.setattr("bowdenfit.addons.fleet.fitting.installed_versions", lambda: installed | {"jax": "0.0.1"})
    with pytest.raises(bf.UsageError, match=r"a worker has other versions: jax .* \(here 0\.0\.1\)"):
        bf.fleet(fleet(ROWS[0]), seed=1)


def test_a_full_disk_is_a_sentence_and_what_was_kept_goes_on(run, fleet, tmp_path, monkeypatch):
    folder, results = fleet(*ROWS[:20]), tmp_path / "results"
    begin = ("fleet", folder, "-o", results, "--seed", 7)
    history, keep = list[int](), FleetStore.keep

    def full(store, fits):
        if history:
            raise OSError(errno.ENOSPC, "No space left on device")
        history.append(len(fits))
        keep(store, fits)

    with monkeypatch.context() as disk:
        disk.setattr(FleetStore, "keep", full)
        code, _, error = run(*begin)
    assert code == 1 and "No space left" in error and "Traceback" not in error
    assert len(list((results / PIECES_FOLDER).glob("*.npz"))) == 1 and not (results / FLEET_DRAWS).exists()
    code, _, error = run(*begin)
    assert code == 2 and "go on with --resume" in " ".join(error.split())
    code, out, _ = run(*begin, "--resume")
    assert code == 0 and "every fit may be" in " ".join(out.split())


def test_a_fleet_begun_with_other_versions_is_not_gone_on_with(run, fleet, tmp_path, monkeypatch):
    folder, results = fleet(ROWS[0]), tmp_path / "results"
    FleetStore(results, {"seed": 7, "versions": installed_versions() | {"jax": "0.0.1"}}).open(False, False)
    code, _, error = run("fleet", folder, "-o", results, "--resume")
    refusal = f"a version of bowdenfit or of a library changed since (jax from '0.0.1' to {installed_versions()['jax']!r})"
    assert code == 2 and refusal in " ".join(error.split())
    FleetStore(results, {"seed": 7, "versions": installed_versions()}).open(False, True)
    code, _, error = run("fleet", folder, "-o", results, "--resume", "--seed", 8)
    assert code == 2 and "because the seed changed since from 7 to 8; undo the change" in " ".join(error.split())
