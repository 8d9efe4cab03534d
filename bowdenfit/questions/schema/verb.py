"""The verb `schema`: the JSON schema of a file, for editors and programs."""

import json
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from bowdenfit.arguments import read_first
from bowdenfit.questions import schema as room
from bowdenfit.verb import Reply, Verb

File = Literal["cable", "device", "fleet", "summary"]


@read_first
def schema(file: Annotated[File, Parameter("FILE")]) -> dict[str, Any]:
    """Return the JSON schema of a file, a dictionary of plain data.

    Args:
        file: Such as cable (of cable.toml), device (device.toml), fleet (fleet.toml), or summary (summary.json).
    """
    return room.make_schema(file)


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
