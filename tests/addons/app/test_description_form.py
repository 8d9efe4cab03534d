"""The form has a field for every key of cable.toml, and what is typed into it is what a hand would write."""

import tomllib
from pathlib import Path

import pytest
from recorded_benches import RecordedBench, write

from bowdenfit.addons.app.describe import find_data_error, find_faults
from bowdenfit.addons.app.description_form import add_part, list_groups, set_field
from bowdenfit.addons.app.description_values import MENU, TOML, show_value
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.kinds.descriptions import CableDescription, parse_description

DATASETS = Path(__file__).parents[3] / "datasets"
BENCH = (DATASETS / "on-body-exoskeleton" / "cable.toml").read_text()


def fields_of(text):
    """Every field of the form of a description, by its keys."""
    return {field.path: field for group in list_groups(tomllib.loads(text)) for field in group.fields}


def test_every_top_level_key_has_a_field_that_says_what_it_does():
    fields = fields_of(add_part(add_part(BENCH, "friction", "mu3"), "prior", "tau"))
    keys = set(CableDescription.model_fields) - {"schema_", "recording"}
    assert {path[0] for path in fields} == keys
    silent = [path for path, field in fields.items() if not field.hint]
    assert silent == []


@pytest.mark.parametrize("name", ["on-body-exoskeleton", "synthetic-recordings", "yarn-on-cylinder", "synthetic-haptic-loop"])
def test_typing_what_stands_there_changes_nothing(name):
    text = (DATASETS / name / "cable.toml").read_text()
    for field in fields_of(text).values():
        if field.value:
            assert tomllib.loads(set_field(text, field, field.value)) == tomllib.loads(text), field.path


@pytest.mark.parametrize(
    ("path", "typed", "expected"),
    [
        (("sensors", "input_ratio"), "2", 2),
        (("sensors", "force_noise"), "0.5 N", {"value": 0.5, "unit": "N"}),
        (("contact", 0, "wrap_angle", "curve"), "smooth", "smooth"),
        (("route", "range"), "[420, 540]", [420, 540]),
        (("route", "range"), "420,5 540", [420.5, 540]),
        (("route", "choices"), "430, 440 450; 460", [430, 440, 450, 460]),
        (("contact", 1, "wrap_angle", "published_range"), "430 500", [430, 500]),
        (("tables", "efficiencies", "missing"), "-9999; n.d.; -1,5", [-9999, "n.d.", -1.5]),
        (("tables", "efficiencies", "sheet"), "Pull 1", "Pull 1"),
        (("tables", "efficiencies", "columns", "efficiency", "name"), "eta", "eta"),
        (("noise",), "student", "student"),
        (("sampler", "max_steps"), "40000", 40000),
        (("reference_force",), "50 N", {"value": 50, "unit": "N"}),
        (("reference_force",), "50,5 N", {"value": 50.5, "unit": "N"}),
        (("sensors", "input_ratio"), "0,5 %", 0.005),
    ],
)
def test_a_field_is_written_where_a_hand_would_write_it(path, typed, expected):
    text = set_field(BENCH, fields_of(BENCH)[path], typed)
    node = tomllib.loads(text)
    for part in path:
        node = node[part]
    assert node == expected
    parse_description(tomllib.loads(text))
    assert "# past 530 mm the cable flips" in text or path == ("route", "range")
    cleared = set_field(text, fields_of(text)[path], "")
    original = fields_of(BENCH)[path].value
    assert fields_of(cleared)[path].value == ("" if not original or path[0] in ("contact", "route") else original)
    assert original or tomllib.loads(cleared) == tomllib.loads(BENCH)


@pytest.mark.parametrize(
    ("name", "path", "entry"),
    [
        ("on-body-exoskeleton", ("tables", "efficiencies", "exclude", 0), {"rows": "4 5", "reason": "slipped"}),
        ("synthetic-recordings", ("tables", "recordings", "exclude", 0), {"start": "1.5", "end": "2", "reason": "leaned"}),
        ("synthetic-recordings", ("recording", 1, "strokes", 0), {"start": "0", "end": "2.4", "stroke": "pull"}),
        ("synthetic-recordings", ("tables", "recordings", "prepare", "limits"), {"low": "0", "high": "90", "unit": "N"}),
        ("synthetic-recordings", ("recording", 1, "channels", "input_force"), {"name": "ai0", "unit": "V", "gain": "9.8"}),
    ],
)
def test_lists_and_tables_of_names_are_typed_key_by_key(name, path, entry):
    text = original = (DATASETS / name / "cable.toml").read_text()
    for key, typed in entry.items():
        text = set_field(text, fields_of(text)[*path, key], typed)
    assert find_faults(text) == ()
    assert {key: fields_of(text)[*path, key].value for key in entry} == entry
    for key in entry:
        text = set_field(text, fields_of(text)[*path, key], "")
    assert tomllib.loads(text) == tomllib.loads(original)


def test_of_real_data_sets_nothing_is_typed_as_toml_but_what_has_free_names():
    for path in DATASETS.glob("*/cable.toml"):
        fields = fields_of(path.read_text()).values()
        assert {field.path[-1] for field in fields if field.kind == TOML} <= {"where"}


@pytest.mark.parametrize(("typed", "expected"), [("10 ms", {"value": 10, "unit": "ms"}), ("none", "none")])
def test_a_key_of_words_or_a_quantity_takes_both_and_says_so(typed, expected):
    text = (DATASETS / "synthetic-recordings" / "cable.toml").read_text()
    field = fields_of(text)["tables", "recordings", "prepare", "delay"]
    assert "As estimated, none, or as a number with its unit, such as 10 ms." in field.hint
    changed = set_field(text, field, typed)
    assert tomllib.loads(changed)["tables"]["recordings"]["prepare"]["delay"] == expected
    assert fields_of(changed)[field.path].value == typed and find_faults(changed) == ()
    with pytest.raises(BowdenfitError, match=r"prepare\.delay: input should be .* or a number with its unit"):
        parse_description({**tomllib.loads(text), "tables": {"recordings": {"prepare": {"delay": "late"}}}})


def test_curves_are_a_menu():
    field = fields_of(BENCH)["contact", 0, "wrap_angle", "curve"]
    assert (field.kind, field.options) == (MENU, ("gaussian", "line", "logistic", "smooth"))


@pytest.mark.parametrize(
    ("path", "typed", "words"),
    [
        (("sensors", "input_gain_error_sd"), "much", "is not a number"),
        (("sensors", "force_noise"), "0.5", "not a number with its unit"),
        (("sampler", "max_steps"), "1.5", "is not a whole number"),
        (("route", "range"), "430", "write two numbers"),
        (("route", "choices"), "430,440", "write numbers separated by spaces"),
        (("route", "choices"), "430 long", "write numbers separated by spaces"),
    ],
)
def test_what_cannot_be_read_is_refused(path, typed, words):
    with pytest.raises(UsageError, match=words):
        set_field(BENCH, fields_of(BENCH)[path], typed)


def test_parts_are_added_and_refused_by_the_name_of_others():
    text = add_part(BENCH, "contact", "ferrule")
    assert tomllib.loads(text)["contact"][-1]["name"] == "ferrule"
    assert find_faults(text) == ()
    with pytest.raises(UsageError, match="not in use yet"):
        add_part(text, "contact", "ferrule")
    assert "TOML" in str(find_faults("name = ")[0])
    assert "unknown key 'sampler.walkers'" in str(find_faults(f"{BENCH}\n[sampler]\nwalkers = 3\n")[0])


ONLY_IN_FILES = (
    ("on-body", 'file = "efficiencies.csv"', 'file = "none.csv"', ("tables", "efficiencies", "file")),
    ("on-body", '"efficiencies.csv"', '"efficiencies.csv", exclude = [{ rows = [99], reason = "x" }]',
     ("tables", "efficiencies", "exclude")),
    ("on-body", '"efficiencies.csv"', '"efficiencies.csv", columns = { efficiency = { name = "eff" } }',
     ("tables", "efficiencies", "columns", "efficiency")),
    ("on-body", '"efficiencies.csv"', '"efficiencies.csv", sheet = "x"', ("tables", "efficiencies", "sheet")),
    ("on-body", 'column = "free_sheath_angle"', 'column = "knee"', ("contact", 0, "wrap_angle", "column")),
    ("on-body", 'variable = "cable_length"', 'variable = "depth"', ("route", "variable")),
    ("recorded", 'file = "r1.csv"', 'file = "none.csv"', ("recording", 1, "file")),
    ("recorded", 'run = "m1"', 'channels = { input_force = { name = "ai7" } }', ("recording", 1, "channels", "input_force")),
    ("recorded", "{}", '{ channels = { velocity = { name = "x" } } }', ("tables", "recordings", "channels", "velocity")),
    ("recorded", "{}", '{ files = "*.tdms" }', ("tables", "recordings", "files")),
    ("recorded", "{}", '{ exclude = [{ file = "no.csv", reason = "x" }] }', ("tables", "recordings", "exclude")),
    ("recorded", "{}", '{ exclude = [{ file = "r0.csv", start = 900, end = 901, reason = "x" }] }',
     ("tables", "recordings", "exclude")),
)  # fmt: skip


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A data set of tables, and one of recordings."""
    bench = RecordedBench(rate=100.0, length=30.0, mountings=2)
    return {"on-body": DATASETS / "on-body-exoskeleton", "recorded": write(bench, tmp_path_factory.mktemp("b") / "b", seed=4)}


@pytest.mark.parametrize(("name", "old", "new", "keys"), ONLY_IN_FILES)
def test_what_only_the_files_show_names_its_key(folders, name, old, new, keys):
    text = (folders[name] / "cable.toml").read_text()
    changed = text.replace(old, new, 1)
    assert changed != text and find_data_error(text, folders[name]) is None and find_faults(changed) == ()
    error = find_data_error(changed, folders[name])
    assert keys in {fault.key_path for fault in error.faults or (error,)}


def test_values_are_shown_as_they_are_typed():
    assert show_value({"value": 45, "unit": "deg"}) == "45 deg"
    assert show_value({"value": 45, "unit": "deg", "sd": 2}) == '{ value = 45, unit = "deg", sd = 2 }'
    assert show_value(["a", 'b"', True]) == '["a", "b\\"", true]'
