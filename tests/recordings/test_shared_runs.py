"""Several recordings of one mounting of the cable."""

import shutil
from pathlib import Path

import pytest

import bowdenfit as bf
from bowdenfit.recordings.recording import Recordings

pytestmark = pytest.mark.extended

SOURCE = Path(__file__).resolve().parents[2] / "datasets" / "synthetic-recordings"


def test_two_recordings_may_share_a_run_without_names(tmp_path):
    folder = shutil.copytree(SOURCE, tmp_path / "cable")
    description = folder / "cable.toml"
    text = description.read_text()
    assert '"470 mm, 60 r/min"' in text and '"470 mm, 40 r/min"' in text
    description.write_text(text.replace('"470 mm, 60 r/min"', '"470 mm, 40 r/min"'))
    recordings = bf.read(folder).measurements.table(Recordings)
    shared = [item for item in recordings.items if item.run == "470 mm, 40 r/min"]
    assert [item.name for item in shared] == ["470 mm, 40 r/min, 470mm_40rpm", "470 mm, 40 r/min, 470mm_60rpm"]
