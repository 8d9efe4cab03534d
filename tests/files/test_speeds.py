"""Units of speeds in headings of tables and recordings."""

import pytest

from bowdenfit.files.headings import Quantity, find_candidates, heading_of


@pytest.mark.parametrize("heading", ["velocity_mm_s", "velocity_mm_per_s", "velocity (mm/s)", "velocity mm_s"])
def test_a_speed_is_read_per_second_however_its_unit_is_written(heading):
    assert heading_of(heading).unit == "mm/s"
    (match,) = find_candidates([(heading, "")], [Quantity("velocity", "speed")])["velocity"]
    assert match.unit == "mm/s"
