"""Fits, calibrations and fleets that are ended at any moment, by `scripts/check_kills.py`."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "check_kills.py"


@pytest.mark.slow
def test_nothing_is_lost_by_a_kill_at_any_moment(cases):
    numbers = cases(range(1, 61))
    command = [sys.executable, str(SCRIPT), "--kills", str(len(numbers)), "--seed", str(numbers.start)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-2000:]
