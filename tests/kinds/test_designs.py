"""What plans say of measurements: read by the kinds that are measured, and refused where it cannot be."""

import numpy as np
import pytest
from cables import CONTACTS, cable
from elastic_cables import elastic_cable

from bowdenfit.errors import DescriptionError
from bowdenfit.kinds.descriptions import make_design, read_design
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.tables import StretchTable
from bowdenfit.questions.simulate.tables import empty_tables

CLAMPED = cable(1, ("forces",), contact=[CONTACTS[4]])


@pytest.mark.parametrize(
    ("page", "sentence"),
    [
        ({"runs": [430]}, "bench.toml, design: runs need input_forces, such as [20, 40, 60] (in N)."),
        ({"loop": {"wrap_angles": [90]}}, "design.loop: wrap_angles need input_forces, such as [5, 10, 20] (in N)."),
        ({"run": [430]}, "bench.toml: unknown key 'design.run'; did you mean 'runs'?"),
        ({"stretch": {"loads": [10]}}, "the key 'design.stretch.wrap_angles' is missing"),
        ({"strokes": ["push"]}, "bench.toml, design.strokes.0: input should be 'pull' or 'return' (found 'push')."),
        ({"runs": [430, 440], "input_forces": [20], "own_angles": {"clamp_angle": [10]}}, "1 angles for 2 runs; write one"),
        ({"own_angles": {"clamp_angel": []}}, "design.own_angles.clamp_angel: no contact has that column; did you m"),
    ],
)  # fmt: skip
def test_a_design_that_cannot_be_is_refused_in_a_sentence(page, sentence):
    with pytest.raises(DescriptionError) as refused:
        read_design(page, CLAMPED, "bench.toml")
    assert sentence in str(refused.value)


def test_a_plan_says_the_wrap_angles_of_its_runs():
    page = {"runs": [430, 440], "input_forces": [20, 40, 60], "own_angles": {"clamp_angle": [10, 90]}}
    table = empty_tables(CLAMPED, read_design(page, CLAMPED, "bench.toml")).table(ForceTable)
    assert np.rad2deg(table.own.column("clamp_angle")[0]).round(9).tolist() == [10] * 6 + [90] * 6
    assert table.stroke.tolist() == [1, 1, 1, -1, -1, -1] * 2


def test_loads_of_a_stretched_rope_grow_whatever_their_order():
    design = make_design(stretch={"loads": (30, 10), "wrap_angles": (0,), "unloading": True})
    table = empty_tables(elastic_cable(("stretch",), kind="single"), design).table(StretchTable)
    assert table.load.tolist() == [10, 30, 10]
    assert table.unloading.tolist() == [False, False, True]
