"""Units at the border: what is usual is known without pint, and is what pint says."""

import subprocess
import sys

import pytest

from bowdenfit import DatasetError, units


@pytest.mark.parametrize("unit", units._COMMON_UNITS)
def test_usual_units_are_what_pint_says(unit, monkeypatch):
    dimension, factor = units._COMMON_UNITS[unit]
    assert units.is_unit(unit)
    assert units.dimension_of(unit) == dimension
    assert units.conversion_factor(unit, dimension) == factor
    monkeypatch.setattr(units, "_COMMON_UNITS", {})
    assert units.dimension_of(unit) == dimension
    assert units.conversion_factor(unit, dimension) == factor  # to the last bit
    assert units.route_conversion_factor(unit, unit) == 1.0


def test_a_table_in_usual_units_is_read_without_pint(on_body):
    code = f"import sys, bowdenfit as bf; bf.read({str(on_body)!r}); print('pint' in sys.modules, 'jax' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


def test_a_degree_in_german_is_no_giga_radian_and_what_may_be_a_gon_is_refused():
    assert units.conversion_factor("Grad", "angle") == pytest.approx(units.conversion_factor("deg", "angle"), rel=1e-15)
    assert units.dimension_of("Grad/s") == "angular_velocity"
    with pytest.raises(DatasetError, match="a degree in German and a hundredth of a right angle elsewhere; write deg"):
        units.conversion_factor("grad", "angle")
