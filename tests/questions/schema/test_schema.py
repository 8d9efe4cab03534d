"""JSON schemas of files: every file that is shipped follows its own, and what the program refuses is refused by them."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

import bowdenfit as bf

ROOT = Path(__file__).resolve().parents[3]
TOML = {"cable": "cable.toml", "device": "device.toml", "fleet": "fleet.toml"}
SHIPPED = [(kind, path) for kind, name in TOML.items() for path in sorted((ROOT / "datasets").rglob(name))]


def faults(kind, page):
    return [error.message for error in jsonschema.Draft202012Validator(bf.schema(kind)).iter_errors(page)]


@pytest.mark.parametrize("kind", ["cable", "device", "fleet", "summary"])
def test_each_schema_is_one_and_is_printed(kind, run):
    jsonschema.Draft202012Validator.check_schema(bf.schema(kind))
    code, out, _ = run("schema", kind)
    assert code == 0
    assert json.loads(out) == bf.schema(kind)


@pytest.mark.parametrize(("kind", "path"), SHIPPED, ids=[f"{path.parent.name}/{path.name}" for _, path in SHIPPED])
def test_files_that_are_shipped_follow_their_schema_and_one_more_key_does_not(kind, path):
    page = tomllib.loads(path.read_text())
    assert faults(kind, page) == []
    assert "'frictoin' was unexpected" in "".join(faults(kind, page | {"frictoin": {}}))
    assert faults(kind, page | {"name": 3})


def test_a_template_that_is_not_filled_in_does_not_follow_the_schema():
    assert faults("cable", tomllib.loads((ROOT / "bowdenfit" / "templates" / "cable.toml").read_text()))


@pytest.fixture(params=["on-body-exoskeleton", "synthetic-recordings", "synthetic-haptic-loop"])
def summary(request):
    dataset = ROOT / "datasets" / request.param
    return json.loads(json.dumps(dict(bf.fit(dataset, mcmc=False, seed=1).summary())))


@pytest.mark.extended
def test_summaries_without_draws_follow_the_schema(summary):
    assert faults("summary", summary) == []
    assert faults("summary", summary | {"more": 1})
    assert faults("summary", {key: value for key, value in summary.items() if key != "verdict"})


def test_the_published_summary_follows_the_schema():
    page = json.loads((ROOT / "fits" / "published" / "on-body-exoskeleton" / "summary.json").read_text())
    assert faults("summary", page) == []
    names = bf.schema("summary")["properties"].keys()
    assert {"optimal", "sampler"} <= page.keys() <= names
