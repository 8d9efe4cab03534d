"""A delay of a creeping rope that was estimated too wrongly to be corrected in proportion: named, with what to state."""

import re

import pytest
from creeping_rope import SPEED, Truth, write_bench

import bowdenfit as bf

RISES = Truth(0.3, 25.0, 0.01, 0.3, 8.0, 0.002, SPEED)  # friction that rises toward standstill


@pytest.mark.slow
def test_wrong_delay_is_named_and_the_one_to_state_is_right(tmp_path):
    write_bench(tmp_path / "rope", "lugre", RISES, slower=2)
    fit = bf.fit(tmp_path / "rope", mcmc=False, figures=False)
    (sentence,) = [reason for reason in fit.verdict().reasons if "shifted" in reason]
    delay_to_state = float(re.search(r"value=(-?[\d.]+)", sentence)[1])
    assert abs(delay_to_state) < 8  # there is none
    description = tmp_path / "rope" / "cable.toml"
    delay = re.search(r"delay=(\{.*?\})", sentence)[1].replace("=", " = ")
    description.write_text(f"{description.read_text()}prepare = {{ delay = {delay} }}\n")
    again = bf.fit(tmp_path / "rope", mcmc=False, figures=False)
    assert not any("shifted" in reason for reason in again.verdict().reasons)
    assert again.least_squares.estimates["presliding_stiffness"].value == pytest.approx(25, rel=0.05)


@pytest.mark.extended
def test_delay_of_a_rope_without_such_friction_is_not_doubted(tmp_path):
    write_bench(tmp_path / "rope", "dahl", Truth(0.3, 25.0))
    fit = bf.fit(tmp_path / "rope", mcmc=False, figures=False)
    assert not any("shifted" in reason for reason in fit.verdict().reasons)
