"""A results folder in which links lie, as one that somebody sent may be: nothing is written through them."""

import json
import os
import shutil

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.addons.fleet.clusters import make_slurm_executor
from bowdenfit.addons.fleet.store import PIECES_FOLDER
from bowdenfit.inference.checkpoint import append_record, checkpoint_header, read_records
from bowdenfit.inference.engines import JOBS_FOLDER
from bowdenfit.outputs import write_text
from bowdenfit.questions.calibrate.replications import Replication, append_replication, open_replications
from bowdenfit.results.answer_cache import CAPTIONS, write_captions
from bowdenfit.results.folder import CHAIN, FIGURES, REPLICATIONS, reserve_folder

REFUSED = "would change what is there"
YARN = "datasets/yarn-on-cylinder"


@pytest.fixture
def elsewhere(tmp_path):
    """A folder with files of somebody else, which must all stay as they are."""
    place = tmp_path / "elsewhere"
    (place / "folder").mkdir(parents=True)
    for name in ("a", "folder/b"):
        (place / name).write_text("precious")
    (place / CHAIN).write_bytes(checkpoint_header({"seed": 3}))
    files_at_start = {path: path.read_bytes() for path in place.rglob("*") if path.is_file()}
    yield place
    assert {path: path.read_bytes() for path in place.rglob("*") if path.is_file()} == files_at_start


@pytest.fixture(scope="module")
def results(least_squares_of, tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "fit"
    least_squares_of("yarn-on-cylinder").save(folder)
    return folder


def test_a_temporary_name_cannot_be_planted_and_a_link_is_replaced_itself(tmp_path, elsewhere):
    folder = tmp_path / "fit"
    folder.mkdir()
    planted = [folder / name for name in (".fit.json.partial", ".fit.json.part", "fit.json")]
    for link in planted:
        link.symlink_to(elsewhere / "a")
    write_text(folder / "fit.json", "new")
    assert (folder / "fit.json").read_text() == "new" and not (folder / "fit.json").is_symlink()
    assert all(link.is_symlink() for link in planted[:2])
    (folder / "second").hardlink_to(elsewhere / "a")
    write_text(folder / "second", "new")


def test_files_are_as_readable_as_others(tmp_path):
    write_text(tmp_path / "a", "x")
    (tmp_path / "b").write_text("x")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode


def link_softly(link, target):
    link.symlink_to(target)


def link_hard(link, target):
    link.hardlink_to(target)


@pytest.mark.parametrize("link", [link_softly, link_hard])
def test_a_linked_checkpoint_is_not_appended_to(tmp_path, elsewhere, link):
    link(tmp_path / CHAIN, elsewhere / CHAIN)
    with pytest.raises(bf.StoreError, match=REFUSED):
        append_record(tmp_path / CHAIN, {"z": np.zeros(2)})
    with pytest.raises(bf.StoreError, match=REFUSED):  # which cuts off what stands behind the last whole record
        read_records(tmp_path / CHAIN, {"z": (2,)})


@pytest.mark.parametrize("link", [link_softly, link_hard])
def test_linked_replications_are_not_appended_to(tmp_path, elsewhere, link):
    link(tmp_path / REPLICATIONS, elsewhere / "a")
    with pytest.raises(bf.StoreError, match=REFUSED):
        append_replication(tmp_path, Replication(1, {}, ("failed",), {}, 1.0))


@pytest.mark.parametrize("name", [FIGURES, CHAIN, PIECES_FOLDER, JOBS_FOLDER, ".lock", "anything"])
@pytest.mark.parametrize("target", ["folder", "a", "nowhere"])
def test_a_folder_in_which_links_lie_is_not_written_into(tmp_path, elsewhere, name, target):
    (tmp_path / "fit").mkdir()
    (tmp_path / "fit" / name).symlink_to(elsewhere / target)
    with pytest.raises(bf.StoreError, match=REFUSED), reserve_folder(tmp_path / "fit"):
        pass
    assert not (elsewhere / "nowhere").exists()


def test_a_lock_with_a_second_name_is_not_emptied(tmp_path, elsewhere):
    (tmp_path / ".lock").hardlink_to(elsewhere / "a")
    with pytest.raises(bf.StoreError, match=REFUSED), reserve_folder(tmp_path):
        pass


def test_notes_may_be_links_and_so_may_the_folder_that_is_named(tmp_path, elsewhere):
    (tmp_path / "fit").mkdir()
    (tmp_path / "fit" / "notes.md").symlink_to(elsewhere / "a")
    (tmp_path / "named").symlink_to(tmp_path / "fit")
    with reserve_folder(tmp_path / "named"):
        assert (tmp_path / "fit" / ".lock").exists()


@pytest.mark.parametrize("options", [{"force": True}, {"resume": True}, {"force": True, "mcmc": False}])
def test_fit_writes_through_no_linked_figures(tmp_path, elsewhere, results, options):
    folder = shutil.copytree(results, tmp_path / "fit")
    (folder / FIGURES).symlink_to(elsewhere / "folder")
    with pytest.raises(bf.StoreError, match=REFUSED):
        bf.fit(YARN, output=folder, **options)


def test_plot_writes_through_no_linked_figures(tmp_path, elsewhere, results):
    folder = shutil.copytree(results, tmp_path / "fit")
    (folder / FIGURES).symlink_to(elsewhere / "folder")
    with pytest.raises(bf.StoreError, match=REFUSED):
        bf.plot(folder, figures=["forces"])


def test_linked_captions_are_neither_changed_nor_copied(tmp_path, elsewhere):
    (tmp_path / CAPTIONS).symlink_to(elsewhere / "a")
    write_captions({"forces": "What is drawn."}, tmp_path)
    assert (tmp_path / CAPTIONS).read_text() == "forces: What is drawn.\n"


@pytest.mark.extended  # several seconds
def test_jobs_answer_in_a_folder_that_is_new(tmp_path, elsewhere):
    """What they answer is unpickled, so that nothing may have lain there before."""
    pytest.importorskip("submitit")
    (tmp_path / JOBS_FOLDER).mkdir()
    (tmp_path / JOBS_FOLDER / "1_0_result.pkl").write_text("planted")
    with make_slurm_executor(tmp_path / JOBS_FOLDER, 1, "local") as executor:
        assert executor.submit(os.path.basename, "a/b").result() == "b"
    (new,) = (path for path in (tmp_path / JOBS_FOLDER).iterdir() if path.is_dir())
    assert list(new.iterdir())
    shutil.rmtree(tmp_path / JOBS_FOLDER)
    (tmp_path / JOBS_FOLDER).symlink_to(elsewhere / "folder")
    with pytest.raises(bf.StoreError, match=REFUSED):
        make_slurm_executor(tmp_path / JOBS_FOLDER, 1, "local")


def test_what_an_ended_run_left_half_written_goes_when_it_is_resumed(tmp_path):
    open_replications(tmp_path, {"seed": 3}, resume=False, force=False)
    for name in (".replications.jsonl.0.partial", ".replications.jsonl.1.partial"):
        (tmp_path / name).write_text(json.dumps("half"))
    open_replications(tmp_path, {"seed": 3}, resume=True, force=False)
    assert [path.name for path in tmp_path.iterdir()] == [REPLICATIONS]
