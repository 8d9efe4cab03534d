"""What is read of `device.toml`, and what is refused of it, in sentences that say what to write."""

from dataclasses import astuple
from pathlib import Path

import pytest

from bowdenfit.addons.device.description import KEYS, Known, read_device
from bowdenfit.errors import DescriptionError

WHOLE = Path(__file__).parents[3] / "datasets" / "haptic-teleoperation" / "device.toml"


def written(folder, old, new):
    text = WHOLE.read_text()
    assert text.count(old) == 1, old
    path = folder / "device.toml"
    path.write_text(text.replace(old, new))
    return path


def refused(call):
    with pytest.raises(DescriptionError) as error:
        call()
    text = str(error.value)
    assert text[-1] in ".?"
    return text


def test_quantities_are_read_in_si_units(tmp_path):
    device = read_device(written(tmp_path, 'friction = { value = 0.01, unit = "N*m", sd = 0.002 }',
                                 'friction = { value = 10, unit = "N*mm", sd = 2 }'))  # fmt: skip
    needed = device.needed("an answer", "motor.friction", "controller.sample_time", "controller.dead_zone", "motor.inertia")
    assert astuple(needed["motor.friction"])[:2] == pytest.approx((0.01, 0.002))
    assert astuple(needed["controller.sample_time"])[:2] == pytest.approx((1e-3, 2e-5))
    assert needed["controller.dead_zone"] == Known(0.8)
    assert needed["motor.inertia"].value == 7e-4
    assert device.count == pytest.approx(2 * 3.14159265 / 2000)


def test_every_example_of_a_key_can_be_read(tmp_path):
    parts = {}
    for key, expected in KEYS.items():
        part, name = key.split(".")
        parts.setdefault(part, []).append(f"{name} = {expected.example}")
    lines = [line for part, text in parts.items() for line in (f"[{part}]", *text)]
    path = tmp_path / "device.toml"
    path.write_text("\n".join(['name = "all of it"', *lines]) + "\n")
    assert read_device(path).known(*KEYS).keys() == KEYS.keys()


def test_what_is_missing_is_asked_by_name_all_at_once(tmp_path):
    path = tmp_path / "device.toml"
    path.write_text('name = "bare"\n')
    text = refused(lambda: read_device(path).needed("the largest gain", "motor.inertia", "rope.damping"))
    assert text.startswith("2 things are wrong:")
    assert 'inertia = { value = 0.0007, unit = "kg*m^2", sd = 7e-05 } under [motor]' in text
    assert "under [rope]" in text
    assert "encoder_counts = 2000" in refused(lambda: read_device(path).count)


FAULTS = {
    "no unit": ('{ value = 7e-4, unit = "kg*m^2", sd = 0.7e-4 }', "{ value = 7e-4, sd = 0.7e-4 }", "the unit is missing"),
    "a bare number": ('{ value = 7e-4, unit = "kg*m^2", sd = 0.7e-4 }', "7e-4", 'unit = "kg*m^2"'),
    "another unit": ('unit = "kg*m^2", sd = 0.7e-4', 'unit = "kg", sd = 0.7e-4', "does not measure an inertia"),
    "without rad": ('value = 0.1, unit = "N*m*s/rad"', 'value = 0.1, unit = "N*m"', "angular damping"),
    "a misspelled key": ("filter_time", "filtertime", "did you mean 'filter_time'?"),
    "a negative one": ('friction = { value = 0.01', 'friction = { value = -0.01', "is not possible for the dry friction"),
    "no inertia": ("inertia = { value = 7e-4", "inertia = { value = 0", "is not possible for the inertia"),
    "an sd of a setting": ('value = 0.8, unit = "rad/s"', 'value = 0.8, unit = "rad/s", sd = 0.1', "is set, not measured"),
    "an sd beyond it": ("sd = 0.7e-4", "sd = 1", "nothing is known about it"),
    "not a number": ("value = 0.1, unit", "value = nan, unit", "finite"),
    "too few counts": ("encoder_counts = 2000", "encoder_counts = 0", "greater than or equal to 4"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_what_cannot_be_is_refused_with_what_to_write(fault, tmp_path):
    old, new, says = FAULTS[fault]
    text = refused(lambda: read_device(written(tmp_path, old, new)))
    assert text.startswith("device.toml")
    assert says in text


def test_a_measured_value_without_an_sd_is_refused_where_an_answer_needs_it(tmp_path):
    device = read_device(written(tmp_path, ", sd = 0.7e-4", ""))
    assert device.needed("an answer", "joint.inertia")
    text = refused(lambda: device.needed("an answer", "motor.inertia"))
    assert "motor.inertia: 0.0007 kg*m^2 has no sd" in text
    assert "sd = ..." in text


def test_a_file_that_is_not_there_is_asked_for(tmp_path):
    assert "does not exist" in refused(lambda: read_device(tmp_path / "device.toml"))
