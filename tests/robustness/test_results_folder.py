"""The results folder while a fit is written: one at a time, on a disk that may be full, ended at any moment."""

import errno
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

import bowdenfit as bf
from bowdenfit.addons.fleet.store import FleetStore
from bowdenfit.errors import DiskError
from bowdenfit.inference.checkpoint import append_record, checkpoint_header, read_fingerprint, read_records
from bowdenfit.outputs import write_text
from bowdenfit.questions.calibrate.replications import open_replications
from bowdenfit.results import store
from bowdenfit.results.folder import fill_folder_atomically, folder_to_write, refuse_unwritable, reserve_folder

pytestmark = pytest.mark.extended

YARN = Path(__file__).resolve().parents[2] / "datasets" / "yarn-on-cylinder"
SHAPES = {"z": (5, 2), "place": ()}
QUICK = ("sampler.n_walkers=32", "sampler.max_steps=200", "sampler.target_ess=100")


@pytest.fixture
def checkpoint(tmp_path):
    path = tmp_path / "chain.checkpoint"
    path.write_bytes(checkpoint_header({"seed": 3}))
    for i in range(4):
        append_record(path, {"z": np.full((5, 2), float(i)), "place": np.asarray(i)})
    return path


def test_a_checkpoint_gives_its_records_back(checkpoint):
    assert read_fingerprint(checkpoint) == {"seed": 3}
    assert [int(r["place"]) for r in read_records(checkpoint, SHAPES)] == [0, 1, 2, 3]


def test_a_checkpoint_cut_anywhere_keeps_every_whole_record(checkpoint):
    whole, start = checkpoint.read_bytes(), len(checkpoint_header({"seed": 3}))
    chunk = (len(whole) - start) // 4
    for length in range(start, len(whole), 97):
        checkpoint.write_bytes(whole[:length])
        assert len(read_records(checkpoint, SHAPES)) == (length - start) // chunk
        append_record(checkpoint, {"z": np.zeros((5, 2)), "place": np.asarray(9)})
        assert int(read_records(checkpoint, SHAPES)[-1]["place"]) == 9


def test_a_flipped_bit_ends_a_checkpoint_before_its_record(checkpoint):
    content = bytearray(checkpoint.read_bytes())
    content[-30] ^= 1
    checkpoint.write_bytes(content)
    assert [int(r["place"]) for r in read_records(checkpoint, SHAPES)] == [0, 1, 2]


def _fit(on_body: Path, place: Path, compiled: Path, *initial: str, more: tuple[str, ...] = ()):
    """A fit in a process of its own, which keeps what is compiled where it is told."""
    fit = ["-m", "bowdenfit", "fit", str(on_body), "-o", str(place), "--seed", "3", "--no-figures"]
    command = [*initial, sys.executable, *fit, *(f"--set={setting}" for setting in QUICK), *more]
    # Python takes half a file of byte code for a whole one.
    environment = os.environ | {"JAX_COMPILATION_CACHE_DIR": str(compiled), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=240)


@pytest.fixture(scope="module")
def whole(on_body, tmp_path_factory) -> tuple[bf.Fit, Path]:
    """A fit that nothing stopped, and all that it compiled: a limit of size cuts that off too."""
    place = tmp_path_factory.mktemp("whole")
    done = _fit(on_body, place / "fit", place / "compiled")
    assert done.returncode in {0, 3}, done.stderr
    return bf.load(place / "fit"), place / "compiled"


@pytest.mark.parametrize("limit", [20_000, pytest.param(400_000, marks=pytest.mark.slow)])
def test_a_fit_that_may_not_write_more_keeps_what_it_sampled_and_is_resumed(on_body, whole, tmp_path, limit):
    """A limit of the file's size stands for a full disk."""
    uninterrupted, compiled = whole
    limit_size = "r.setrlimit(r.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)"
    limited = f"import os, resource as r, sys; {limit_size}; os.execv(sys.argv[2], sys.argv[2:])"
    full = _fit(on_body, tmp_path / "fit", compiled, sys.executable, "-c", limited, str(limit))
    assert full.returncode == 1, full.stderr
    assert "File too large" in full.stderr
    assert "--resume" in full.stderr
    assert len(full.stderr.splitlines()) == 1
    resumed = _fit(on_body, tmp_path / "fit", compiled, more=("--resume",))
    assert resumed.returncode in {0, 3}, resumed.stderr
    np.testing.assert_array_equal(bf.load(tmp_path / "fit").posterior.z, uninterrupted.posterior.z)


def test_a_disk_without_room_is_no_mistake_of_the_user(tmp_path):
    with pytest.raises(DiskError, match="No space left on device") as full, folder_to_write(tmp_path / "fit"):
        raise OSError(28, os.strerror(28))
    assert full.value.exit_code == 1


def test_two_fits_into_one_folder_are_told_apart_at_the_start(on_body, tmp_path):
    with reserve_folder(tmp_path / "fit"), pytest.raises(bf.StoreError, match="another fit or calibration is being written"):
        bf.fit(on_body, output=tmp_path / "fit", mcmc=False, figures=False)
    assert not (tmp_path / "fit").exists()
    bf.fit(on_body, output=tmp_path / "fit", mcmc=False, figures=False)


def test_what_is_left_of_an_ended_fit_is_replaced_with_force(on_body, tmp_path):
    (tmp_path / "fit" / "figures").mkdir(parents=True)
    (tmp_path / "fit" / ".posterior.nc.partial").write_text("half")
    with pytest.raises(bf.StoreError, match="the remains of an unfinished fit"):
        bf.fit(on_body, output=tmp_path / "fit", mcmc=False, figures=False)
    bf.fit(on_body, output=tmp_path / "fit", mcmc=False, figures=False, force=True)
    assert not (tmp_path / "fit" / ".posterior.nc.partial").exists()


def opened_calibration(folder, force):
    open_replications(folder, {"seed": 3}, resume=False, force=force)


def opened_fleet(folder, force):
    FleetStore(folder, {"seed": 3, "versions": {}}).open(resume=False, force=force)


LEFT = {
    opened_calibration: ("figures", "report.html", "summary.txt", "calibration.json", "jobs"),
    opened_fleet: ("fleet.nc", "fleet.json", "summary.txt", "kept", "jobs"),
}


@pytest.mark.parametrize(("begin", "name"), [(begin, name) for begin, names in LEFT.items() for name in names])
def test_what_is_left_of_an_ended_calibration_or_fleet_is_replaced_with_force(tmp_path, begin, name):
    left = tmp_path / "made" / name
    (left / "inside" if "." not in name else left.parent).mkdir(parents=True)
    (left / "inside" / "x" if left.is_dir() else left).write_text("half")
    with pytest.raises(bf.StoreError, match="--force"):
        begin(tmp_path / "made", False)
    begin(tmp_path / "made", True)
    assert not (left / "inside").exists() and not left.is_file()


@pytest.mark.parametrize("begin", LEFT)
def test_temporary_names_that_an_ended_run_left_are_in_nobody_s_way(tmp_path, begin):
    (tmp_path / "made" / ".made.x.partial").mkdir(parents=True)
    for name in (".replications.jsonl.partial", ".begun.json.partial", ".made.x.partial/fleet.nc", "notes.md"):
        (tmp_path / "made" / name).write_text("half")
    begin(tmp_path / "made", False)
    assert not list((tmp_path / "made").glob(".*")) and (tmp_path / "made" / "notes.md").exists()


@pytest.mark.parametrize("begin", LEFT)
def test_what_a_person_put_into_a_folder_is_replaced_by_nothing(tmp_path, begin):
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "mine.csv").write_text("x")
    for force in (False, True):
        with pytest.raises(bf.StoreError, match="exists and holds no"):
            begin(tmp_path / "made", force)
    assert [path.name for path in (tmp_path / "made").iterdir()] == ["mine.csv"]


def test_a_fit_that_is_written_again_counts_as_finished_only_when_all_of_it_is(on_body, tmp_path, monkeypatch):
    fit = bf.fit(on_body, output=tmp_path / "fit", mcmc=False, figures=False, seed=3)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(store, "write_answers", full)
    with pytest.raises(DiskError):
        store.save(fit, fit.summary(), tmp_path / "fit", force=True)
    assert not (tmp_path / "fit" / "fit.json").exists()


@pytest.mark.parametrize("place", ["file/x", "link", "link/x", "n" * 300, "/dev/null/x", "pipe/x/y"])
def test_what_cannot_be_written_is_refused_before_anything_is_computed(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("x")
    (tmp_path / "link").symlink_to("link")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(bf.StoreError, match="cannot be written"):
        refuse_unwritable(Path(place))


@pytest.mark.parametrize("place", [".", "new", "new/one/below", "full", "full/file", "full/new"])
def test_what_can_be_written_is_not_refused(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").write_text("x")
    refuse_unwritable(Path(place))
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["file", "full"]


def test_nothing_but_files_is_replaced_by_a_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "null").symlink_to("/dev/null")
    (tmp_path / "folder").mkdir()
    for name in ("pipe", "null", "folder"):
        with pytest.raises(bf.StoreError, match="is not a file and stays as it is"):
            write_text(tmp_path / name, "x")
    with pytest.raises(bf.StoreError, match="a device or a pipe"):
        refuse_unwritable(tmp_path / "pipe")
    assert (tmp_path / "pipe").is_fifo() and (tmp_path / "null").is_char_device() and (tmp_path / "folder").is_dir()
    assert not list(tmp_path.glob(".*"))


def test_a_calibration_is_refused_where_something_else_is_being_written(tmp_path):
    with reserve_folder(tmp_path / "cal"), pytest.raises(bf.StoreError, match="another fit or calibration is being written"):
        bf.calibrate(YARN, replications=2, workers=1, output=tmp_path / "cal", seed=3)
    assert not (tmp_path / "cal").exists()


def refuse_permission(*_, **__):
    raise PermissionError(errno.EACCES, "Permission denied", "x")


@pytest.mark.parametrize(("use", "patched"), [(reserve_folder, FileLock.acquire), (fill_folder_atomically, tempfile.mkdtemp)])
def test_a_folder_that_its_umask_closes_is_not_left_behind(tmp_path, monkeypatch, use, patched):
    monkeypatch.setattr(FileLock if patched is FileLock.acquire else tempfile, patched.__name__, refuse_permission)
    with pytest.raises(bf.StoreError, match="cannot be written"), use(tmp_path / "a" / "b"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_filled_whatever_the_umask_is(tmp_path):
    initial = os.umask(0o777)
    try:
        with fill_folder_atomically(tmp_path / "a") as temporary:
            assert temporary.stat().st_mode & 0o700 == 0o700
    finally:
        os.umask(initial)
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
