"""Files of a results folder are opened where they are: a link may lead to any file of this machine."""

import shutil

import pytest

from bowdenfit.errors import StoreError
from bowdenfit.results.folder import kept_file, read_page


@pytest.mark.parametrize("name", ["fit.json", "posterior.nc", "summary.txt"])
def test_links_in_a_results_folder_are_refused_by_name(quick_results, tmp_path, run, name):
    copy = shutil.copytree(quick_results, tmp_path / "copy")
    (copy / name).rename(tmp_path / name)
    (copy / name).symlink_to(tmp_path / name)
    with pytest.raises(StoreError, match=f"{name} is a link"):
        kept_file(copy, name)
    code, out, err = run("summary", copy)
    assert (code, out) == (2, "")
    assert f"{name} is a link" in err


def test_a_linked_folder_inside_is_refused_and_a_results_folder_that_is_a_link_is_not(quick_results, tmp_path):
    (tmp_path / "linked").symlink_to(quick_results)
    assert read_page(kept_file(tmp_path / "linked", "fit.json"))["schema"]
    copy = shutil.copytree(quick_results, tmp_path / "copy")
    shutil.rmtree(copy / "figures")
    (copy / "figures").symlink_to(quick_results / "figures")
    with pytest.raises(StoreError, match="figures is a link"):
        kept_file(copy, "figures", "efficiency.png")
