"""No row of a file leaves uncounted: rows read, headings and rows named as unused are all of the file."""

from pathlib import Path

import pytest

import bowdenfit as bf
from bowdenfit.questions.check.data_set_words import describe_data_set

DATASETS = sorted(path.parent for path in (Path(__file__).parents[2] / "datasets").glob("*/cable.toml"))


@pytest.mark.parametrize("folder", DATASETS, ids=lambda path: path.name)
def test_every_row_of_every_data_set_is_read_or_named(folder):
    data = bf.read(folder)
    files = {path.name: path for path in folder.rglob("*.csv")}
    assert data.accounts
    for account in data.accounts:
        assert account.rows == len(files[account.file].read_bytes().splitlines()) == account.accounted
    read = {account.file for account in data.accounts}
    assert read == {Path(name).name for name in data.sha256 if name.endswith(".csv")}
    words = describe_data_set(data)
    for account in data.accounts:
        assert f"{account.file}: of {account.rows} rows {account.read} hold readings" in words
