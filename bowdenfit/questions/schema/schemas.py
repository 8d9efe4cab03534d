"""JSON schemas: of descriptions by the models that read them, and of summary.json as it is written."""

import json
from importlib.resources import files
from typing import Any

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
    return {"$schema": _DIALECT, **model.model_json_schema(), "title": f"{file}.toml"}
