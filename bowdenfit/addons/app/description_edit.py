"""Changes to a cable.toml that keep its comments and order: readings left out, and taken in again."""

import shutil
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.errors import UsageError
from bowdenfit.inputs import refuse_special
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.outputs import refuse_link, replace_atomically

_LONGEST_REASON = 200  # characters; a judgement


def exclude_row(folder: Path, kind: str, file: str, row: int, reason: str) -> None:
    """Leave a row of a table out, and keep the reason.

    Args:
        folder: The data set.
        kind: Kind of the table.
        file: Its file, as seen from the data set.
        row: Number of the row in it.
        reason: Why.

    Raises:
        UsageError: There is no reason, or no such table.
        DescriptionError: The description would be refused.
        StoreError: It cannot be replaced.
    """
    words = " ".join(reason.split())
    if not 0 < len(words) <= _LONGEST_REASON:
        raise UsageError(
            f"write why row {row} is left out, in {_LONGEST_REASON} characters at most, such as: the rope jumped. It stands in "
            "the report."
        )
    write_description(folder, tomlkit.dumps(_change_table(folder, kind, partial(_add_row, file, row, words))))


def preview_exclusion(folder: Path, kind: str, file: str, row: int, reason: str) -> str:
    """Return the lines of cable.toml with which a row is left out.

    Args:
        folder, kind, file, row, reason: See `exclude_row`.

    Raises:
        UsageError: There is no such table.
    """
    document = _change_table(folder, kind, partial(_add_row, file, row, " ".join(reason.split())))
    return tomlkit.dumps({"tables": {kind: {"exclude": document["tables"][kind]["exclude"]}}}).strip()


def _add_row(file: str, row: int, reason: str, settings: Any) -> None:
    """Add a row to those that a table leaves out."""
    entries = settings.setdefault("exclude", tomlkit.array())
    for entry in entries:
        if entry["reason"] == reason and entry.get("file", file) == file:
            entry["rows"] = sorted({*entry["rows"], row})
            return
    entry = tomlkit.inline_table()
    entry.update(({} if settings.get("file") == file else {"file": file}) | {"rows": [row], "reason": reason})
    entries.append(entry)


def include_row(folder: Path, kind: str, file: str, row: int) -> None:
    """Take a row of a table in again that was left out.

    Args:
        folder, kind, file, row: See `exclude_row`.

    Raises:
        UsageError, DescriptionError, StoreError: See `exclude_row`.
    """

    def change(settings: Any) -> None:
        entries = settings.get("exclude", [])
        for number in reversed(range(len(entries))):
            entry = entries[number]
            if entry.get("file", file) == file and row in entry["rows"]:
                rows = [other for other in entry["rows"] if other != row]
                if rows:
                    entry["rows"] = rows
                else:
                    del entries[number]
        if not len(entries):
            settings.pop("exclude", None)

    write_description(folder, tomlkit.dumps(_change_table(folder, kind, change)))


def write_description(folder: Path, text: str) -> None:
    """Replace a cable.toml, if the new one is not refused by itself.

    Args:
        folder: The data set.
        text: Its new text.

    Raises:
        UsageError: It is no TOML.
        DescriptionError: It is refused.
        StoreError: It cannot be replaced.
    """
    try:
        parse_description(tomllib.loads(text))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise UsageError(
            f"this is no TOML: {error}; the usual cause is a missing quotation mark or bracket there. Correct it; cable.toml "
            "is as it was."
        ) from None
    path = folder / DESCRIPTION_FILE
    refuse_link(path)
    with replace_atomically(path) as temporary:
        shutil.copymode(path, temporary)
        temporary.write_text(text, encoding="utf-8", newline="")


def read_description_text(folder: Path) -> str:
    """Text of a cable.toml.

    Raises:
        UsageError: It cannot be read as text.
    """
    path = folder / DESCRIPTION_FILE
    refuse_special(path)
    try:
        return path.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError):
        raise UsageError("cable.toml cannot be read as UTF-8 text; save it as UTF-8, and load this page again.") from None


def _change_table(folder: Path, kind: str, change: Callable[[Any], None]) -> Any:
    """Return a description in which the settings of a table are changed."""
    try:
        document = tomlkit.parse(read_description_text(folder))
        change(document["tables"][kind])
    except (TOMLKitError, KeyError, TypeError, AttributeError):
        raise UsageError(
            f"cable.toml has no table {kind} that can be changed here; it was changed by hand, so load this page again, or "
            "edit the file itself."
        ) from None
    return document
