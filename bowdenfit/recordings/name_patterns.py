"""The pattern by which the name of a recording's file says what it was made at."""

import re
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.words import shown

_FIELD = re.compile(r"\{([A-Za-z_]\w*)(?::([^}]*))?\}")


def pattern_fields(pattern: str) -> tuple[tuple[str, str], ...]:
    """Names and units of the quantities in a pattern such as "{at}mm_{velocity:r/min}rpm".

    Raises:
        DatasetError: A name stands there twice.
    """
    fields = tuple(_FIELD.findall(pattern))
    names = [name for name, _ in fields]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise DatasetError(
            f"cable.toml, tables.recordings.pattern: {shown(pattern)} has {{{twice}}} twice; keep one of them, and put * in "
            "the place of the other."
        )
    return fields


def match_name(pattern: str, path: Path) -> dict[str, tuple[str, str]]:
    """What a file's name says by a pattern such as "{at}mm_{velocity:r/min}rpm": text and unit by quantity.

    Raises:
        DatasetError: The name does not follow the pattern.
    """
    fields = pattern_fields(pattern)
    expression = re.escape(pattern).replace(r"\*", ".*")
    for name, unit in fields:
        written = re.escape("{" + name + (f":{unit}" if unit else "") + "}")
        kind = r".+?" if name == "run" else r"[+-]?[0-9]+(?:[.,][0-9]+)?"
        expression = expression.replace(written, f"(?P<{name}>{kind})", 1)
    match = re.fullmatch(expression, path.stem) or re.fullmatch(expression, path.name)
    if match is None:
        raise DatasetError(
            f"{path.name} does not follow the pattern {shown(pattern)} of the recordings in cable.toml; correct one of them, "
            "or describe the file in a [[recording]] of its own."
        )
    return {name: (match[name].replace(",", "."), unit) for name, unit in fields}
