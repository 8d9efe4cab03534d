"""The verb `schema`: the JSON schema of a file, for editors and programs."""

import json
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from bowdenfit.arguments import read_first
from bowdenfit.display import Named
from bowdenfit.verb import Reply, Verb

File = Literal["cable", "device", "fleet", "summary"]
_DIALECT = "https://json-schema.org/draft/2020-12/schema"


@read_first
def schema(file: Annotated[File, Parameter("FILE")]) -> Named[Any]:
    """Return the JSON schema of a file, a dictionary of plain data.

    Args:
        file: Such as cable (of cable.toml), device (device.toml), fleet (fleet.toml), or summary (summary.json).
    """
    return Named(_SCHEMAS[file]())


@cache
def _cable_schema() -> dict[str, Any]:
    from bowdenfit.kinds.descriptions import CableDescription

    return {"$schema": _DIALECT, **CableDescription.model_json_schema(), "title": "cable.toml"}


@cache
def _device_schema() -> dict[str, Any]:
    from bowdenfit.description.device import Device

    return {"$schema": _DIALECT, **Device.model_json_schema(), "title": "device.toml"}


@cache
def _summary_schema() -> dict[str, Any]:
    page: dict[str, Any] = json.loads(files(__package__).joinpath("summary.schema.json").read_text("utf-8"))
    return page


def _fleet_schema() -> dict[str, Any]:
    return _cable_schema() | {"title": "fleet.toml"}


_SCHEMAS: dict[File, Callable[[], dict[str, Any]]] = {
    "cable": _cable_schema,
    "device": _device_schema,
    "fleet": _fleet_schema,
    "summary": _summary_schema,
}

VERB = Verb(
    schema,
    lambda answer, _: Reply(json.dumps(answer, indent=1) + "\n"),
    """Print the JSON schema of a file, for editors.

    With it an editor completes and checks the keys while you write. Keep it beside
    the file, bowdenfit schema cable > cable.schema.json, and let the first line of
    cable.toml name it: #:schema ./cable.schema.json (taplo, Even Better TOML).
    """,
    json="",
)
