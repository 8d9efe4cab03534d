"""JSON schemas: of descriptions by the models that read them, and of summary.json as it is written."""

import json
from importlib.resources import files
from typing import Any

from bowdenfit.description.device import Device
from bowdenfit.kinds.descriptions import CableDescription

_DIALECT = "https://json-schema.org/draft/2020-12/schema"


def make_schema(file: str) -> dict[str, Any]:
    """Return the JSON schema of a file.

    Args:
        file: cable, device, fleet or summary.
    """
    if file == "summary":
        page: dict[str, Any] = json.loads(files(__package__).joinpath("summary.schema.json").read_text("utf-8"))
        return page
    model = Device if file == "device" else CableDescription  # a fleet is described as a cable is
    return {"$schema": _DIALECT, **model.model_json_schema(), "title": f"{file}.toml"}
