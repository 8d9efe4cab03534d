"""Each fit is kept with its date, answer, verdict and seed, and says so where its data have changed since."""

import json
import shutil
from pathlib import Path

import pytest

from bowdenfit.addons.app.history import GOOD, PastFit, read_past_fit
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.errors import BowdenfitError

DATASETS = Path(__file__).parents[3] / "datasets"


@pytest.fixture
def workbench(tmp_path, quick_results):
    """A folder with a data set and a fit of it."""
    shutil.copytree(DATASETS / "on-body-exoskeleton", tmp_path / "bench" / "on-body")
    shutil.copytree(quick_results, tmp_path / "bench" / "fits" / "on-body-2")
    (tmp_path / "scratch").mkdir()
    made = Workbench(tmp_path / "bench", tmp_path / "scratch")
    yield made
    made.close()


def test_a_fit_says_when_it_was_made_and_what_it_answers(workbench):
    past = read_past_fit(workbench, "on-body-2")
    folder = workbench.results("on-body-2")
    summary, page = (json.loads((folder / name).read_text()) for name in ("summary.json", "fit.json"))
    assert past.seed == str(summary["seed"]) and page["provenance"]["created"].startswith(past.date.replace(" ", "T"))
    assert " ".join((folder / "summary.txt").read_text().split()).startswith(past.answer) and len(past.answer) > 20
    assert (past.state == GOOD) <= summary["verdict"]["trusted"]
    assert (past.data_set, past.changes.files, past.changes.describe()) == ("on-body", (), "")


@pytest.mark.parametrize("name", ["cable.toml", "efficiencies.csv"])
def test_a_fit_whose_data_have_changed_says_so(workbench, name):
    path = workbench.data_set("on-body") / name
    path.write_text(path.read_text() + "\n# more\n")
    past = read_past_fit(workbench, "on-body-2")
    assert (past.data_set, past.changes.files) == ("on-body", (name,))
    again = "Fit again for an answer from the data as they are now."
    assert past.changes.describe() == f"Changed since this fit: '{name}'. {again}"


def test_a_file_that_is_gone_counts_as_changed(workbench):
    (workbench.data_set("on-body") / "efficiencies.csv").unlink()
    assert read_past_fit(workbench, "on-body-2").changes.files == ("efficiencies.csv",)


def test_a_damaged_fit_and_one_that_names_files_elsewhere_end_nothing(workbench):
    folder = workbench.results("on-body-2")
    page = json.loads((folder / "fit.json").read_text())
    (folder / "fit.json").write_text(json.dumps(page | {"sha256": page["sha256"] | {"../../secret": "0", "/etc/passwd": "0"}}))
    assert read_past_fit(workbench, "on-body-2").changes.files == ()
    for text in ("[]", "{}", "{"):
        (folder / "summary.json").write_text(text)
        assert read_past_fit(workbench, "on-body-2") == PastFit("on-body-2")


def test_fits_are_renamed_and_moved_into_the_bin(workbench):
    workbench.rename_fit("on-body-2", "first")
    assert [fit.name for fit in workbench.fits()] == ["first"]
    for name in ("../x", "first", ".deleted", "a/b"):
        with pytest.raises(BowdenfitError):
            workbench.rename_fit("first", name)
    place = workbench.discard_fit("first")
    assert workbench.fits() == [] and (place / "fit.json").is_file()
    assert place.parent == workbench.folder / "fits" / ".deleted"
    with pytest.raises(BowdenfitError, match="no fit"):
        workbench.discard_fit("first")
