"""A fit that is cancelled before it samples leaves nothing that claims to be a fit."""

import shutil
import time
from pathlib import Path

import pytest

from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.errors import UsageError
from bowdenfit.results.folder import remove_empty_results

DATASETS = Path(__file__).parents[3] / "datasets"


def wait_for(condition):
    """Wait until something is so, for a minute at most."""
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_a_fit_cancelled_before_sampling_leaves_no_folder_and_no_name(tmp_path):
    shutil.copytree(DATASETS / "yarn-on-cylinder", tmp_path / "bench" / "yarn")
    (tmp_path / "scratch").mkdir()
    workbench = Workbench(tmp_path / "bench", tmp_path / "scratch")
    folder = tmp_path / "bench" / "fits" / "yarn"
    job = workbench.start_fit(workbench.request_fit("yarn", "yarn", seed=1))
    wait_for(folder.is_dir)
    job.cancel()
    wait_for(lambda: not job.running)
    assert job.is_void
    assert (workbench.fits(), folder.exists(), workbench.free_name("yarn")) == ([], False, "yarn")
    with pytest.raises(UsageError, match="there is no fit 'yarn'"):
        workbench.results("yarn")
    workbench.close()


@pytest.mark.parametrize("left", [(), (".lock",), (".lock", ".chain.checkpoint.1f.partial")])
def test_a_folder_in_which_a_fit_had_finished_no_file_is_removed(tmp_path, left):
    folder = _folder_with(tmp_path, left)
    remove_empty_results(folder)
    assert not folder.exists()


@pytest.mark.parametrize("left", [("chain.checkpoint", ".lock"), ("notes.md",)])
def test_a_folder_that_holds_a_file_stays_as_it_is(tmp_path, left):
    folder = _folder_with(tmp_path, left)
    remove_empty_results(folder)
    assert sorted(path.name for path in folder.iterdir()) == sorted(left)


def _folder_with(tmp_path, names):
    folder = tmp_path / "yarn"
    folder.mkdir()
    for name in names:
        (folder / name).touch()
    return folder
