"""A delay that sliding wants far from where it is put, and what becomes of the verdict."""

import pytest
from recorded_benches import RecordedBench, write

import bowdenfit as bf

pytestmark = pytest.mark.extended

BENCH = RecordedBench(rate=100, length=40, wave="sine", noise=0.002)


def ending(folder, delay):
    """Verdict of a fit that is told a delay with an error of 2 ms."""
    file = write(BENCH, folder, 1) / "cable.toml"
    setting = f'recordings = {{ prepare = {{ delay = {{ value = {delay}, sd = 2, unit = "ms" }} }} }}'
    file.write_text(file.read_text().replace("recordings = {}", setting))
    return bf.fit(folder, mcmc=False, seed=1).verdict()


def test_a_delay_that_sliding_contradicts_is_said_in_the_verdict(tmp_path):
    assert ending(tmp_path / "right", 0).trusted
    wrong = ending(tmp_path / "wrong", 60)
    assert not wrong.trusted
    assert "ms earlier than it was taken to be" in " ".join(wrong.reasons) and "State the delay" in " ".join(wrong.reasons)
