"""JSON schemas: of descriptions by the models that read them, and of summary.json as it is written."""

import json
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

from bowdenfit.cable.registry import CONTACT_LAWS, CURVES
from bowdenfit.errors import UsageError
from bowdenfit.extensions import SCHEMAS, load_extension
from bowdenfit.kinds.descriptions import CableDescription

_DIALECT = "https://json-schema.org/draft/2020-12/schema"


def make_schema(file: str) -> dict[str, Any]:
    """Return the JSON schema of a file.

    Args:
        file: cable, fleet, summary, or one of an add-on.

    Raises:
        UsageError: The add-on is not installed.
    """
    if file == "summary":
        page: dict[str, Any] = json.loads(files(__package__).joinpath("summary.schema.json").read_text("utf-8"))
        return page
    model = CableDescription if file in ("cable", "fleet") else load_extension(SCHEMAS, file)  # a fleet is described as a cable
    if model is None:
        raise UsageError(f"the add-on that reads {file}.toml is not installed; install bowdenfit again.")
    page = {"$schema": _DIALECT, **model.model_json_schema(), "title": f"{file}.toml"}
    return _describe_keys(page) if model is CableDescription else page


@cache
def load_key_descriptions() -> Mapping[str, Mapping[str, str]]:
    """What each key of cable.toml does, by the name of the class that reads it and by the key."""
    page = tomllib.loads(files(__package__).joinpath("keys.toml").read_text("utf-8"))
    described = {name: {key: " ".join(words.split()) for key, words in keys.items()} for name, keys in page.items()}
    return described | {"FrictionSetting": described["ParameterSetting"]}


def _describe_keys(page: dict[str, Any]) -> dict[str, Any]:
    """Return a schema of cable.toml that says what each key does, and which curves and laws there are."""
    descriptions = load_key_descriptions()
    for name, part in {CableDescription.__name__: page, **page["$defs"]}.items():
        shared = descriptions["Table"] if "exclude" in part.get("properties", {}) else {}
        for key, schema in part.get("properties", {}).items():
            if words := {**shared, **descriptions.get(name, {})}.get(key):
                schema["description"] = words.replace("`", "")
    page["$defs"]["WrapAngle"]["properties"]["curve"] |= {"enum": [*CURVES, None]}
    page["$defs"]["ContactSettings"]["properties"]["law"] |= {"enum": list(CONTACT_LAWS)}
    return page
