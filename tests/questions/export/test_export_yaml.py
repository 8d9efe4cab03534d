"""The file of parameters, read back by PyYAML."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from exported_cables import CASES, HOSTILE, cable

from bowdenfit.questions.export.tables import LEVELS
from bowdenfit.questions.export.yaml import yaml_lines, yaml_parameters

pytestmark = pytest.mark.extended


def read(text):
    return yaml.safe_load(text)["/**"]["ros__parameters"]["bowden"]


@pytest.mark.parametrize("case", CASES)
def test_every_number_is_read_back_to_its_last_bit(case):
    tables = cable(case)
    page = read(yaml_parameters(tables))
    np.testing.assert_array_equal(page["place"]["values"], tables.points.values)
    for level in tables.levels:
        for row, stroke in enumerate(("pull", "return")):
            np.testing.assert_array_equal(page["friction_exponent"][stroke][level.name], level.exponent[row])
        if case == "loop":
            np.testing.assert_array_equal(page["coulomb_N"][level.name], level.taut_loss)
        if case == "load":
            assert page["load"]["drag_N"][level.name] == level.drag
            assert page["load"]["load_exponent"][level.name] == level.load_exponent
        if case == "rate":
            names = ("stribeck", "stribeck_speed_mm_per_s", "viscous_per_mm_per_s")
            assert tuple(page["rate"][name][level.name] for name in names) == level.rate
    assert (page["kind"], "coulomb_N" in page) == (("loop", True) if case == "loop" else ("rope", False))
    assert len(page["friction_exponent"]["pull"]) == len(LEVELS) + 3  # and draws


def test_what_may_be_fed_forward_is_a_torque_where_the_pulley_is_known():
    tables = replace(cable("loop"), radii=(20.0, 15.0))
    page = read(yaml_parameters(tables))
    least = tables.levels[LEVELS.index("mounting_q05")].taut_loss
    np.testing.assert_allclose(page["feed_forward"]["coulomb_N_m"], 0.015 * least, rtol=1e-15)
    np.testing.assert_allclose(page["coulomb_N_m"]["q50"], 0.015 * tables.median.taut_loss, rtol=1e-15)
    assert page["feed_forward"]["probability_that_friction_exceeds_it"] == 0.95
    assert "coulomb_N_m" not in read(yaml_parameters(cable("loop")))


def test_fit_seed_version_and_range_are_said_in_the_parameters_too():
    page, top = read(yaml_parameters(cable("rope"))), yaml_parameters(cable("rope"))
    assert (page["cable"], page["seed"], page["version"], page["trusted"]) == ("test cable", 7, "0.1.0", True)
    assert "# Fitted by bowdenfit 0.1.0, seed 7" in top and "# Range: wrap_angle" in top


def test_hostile_names_are_harmless_in_yaml():
    about = replace(
        cable("rope").about, cable=HOSTILE, group=HOSTILE, distrust=HOSTILE, version=HOSTILE, created=HOSTILE
    )
    tables = replace(cable("rope"), about=about, points=replace(cable("rope").points, variable=HOSTILE, unit=HOSTILE))
    text = yaml_parameters(tables, {HOSTILE: HOSTILE, "share": {"q05": 1e-7}})
    page = read(text)
    assert text.isascii()
    assert set(page) == {*read(yaml_parameters(cable("rope"), {"x": 1})), "warning", "group"}
    assert all(isinstance(page[name], str) for name in ("cable", "group", "warning", "version"))
    assert list(page["compensation"].values()) == [page["cable"], {"q05": 1e-7}]


@pytest.mark.parametrize(
    "value",
    [True, 1, 1.0, 1e-7, -2.5e30, 5e-324, float("inf"), "true", "1", "1e3", "no", "~", "", "2026-01-01", "a: b"],
)
def test_values_keep_their_kind(value):
    for name in ("name", "y", "no", "1", "on", "null"):
        page = yaml.safe_load("\n".join(yaml_lines({name: value, "several": [value, value]})))
        assert page == {name: value, "several": [value, value]}
        assert type(page[name]) is type(value)
