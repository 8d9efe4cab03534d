"""Changes to a cable.toml that keep its comments and order: readings and recordings left out, and taken in again."""

import shutil
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import tomlkit
from tomlkit.exceptions import TOMLKitError

from bowdenfit.addons.app.description_values import new_entry
from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.errors import UsageError
from bowdenfit.inputs import refuse_special
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.outputs import refuse_link, replace_atomically

Part: TypeAlias = int | tuple[float, float] | None
"""What is left out of a file: a row by its number, a stretch of a recording by its start and end [s], or None for all of it."""
_LONGEST_REASON = 200  # characters; a judgement


def name_part(part: Part) -> str:
    """Return what a part of a file is called, such as "row 7"."""
    return "all" if part is None else f"row {part}" if isinstance(part, int) else f"{part[0]:.12g} to {part[1]:.12g} s"


def exclude_part(folder: Path, kind: str, file: str, part: Part, reason: str) -> None:
    """Leave a part of a table out, and keep the reason.

    Args:
        folder: The data set.
        kind: Kind of the table.
        file: Its file, as seen from the data set.
        part: What of it.
        reason: Why.

    Raises:
        UsageError: There is no reason, or no such table.
        DescriptionError: The description would be refused.
        StoreError: It cannot be replaced.
    """
    words = " ".join(reason.split())
    if not 0 < len(words) <= _LONGEST_REASON:
        raise UsageError(
            f"write why {name_part(part)} is left out, in {_LONGEST_REASON} characters at most, such as: the rope jumped. It "
            "stands in the report."
        )
    write_description(folder, tomlkit.dumps(_change_table(folder, kind, partial(_add_part, file, part, words))))


def preview_exclusion(folder: Path, kind: str, file: str, part: Part, reason: str) -> str:
    """Return the lines of cable.toml with which a part of a table is left out.

    Args:
        folder, kind, file, part, reason: See `exclude_part`.

    Raises:
        UsageError: There is no such table.
    """
    document = _change_table(folder, kind, partial(_add_part, file, part, " ".join(reason.split())))
    return tomlkit.dumps({"tables": {kind: {"exclude": document["tables"][kind]["exclude"]}}}).strip()


def _add_part(file: str, part: Part, reason: str, settings: Any) -> None:
    """Add a part to those that a table leaves out; a row to those with the same reason."""
    entries = settings.setdefault("exclude", tomlkit.array())
    keys: dict[str, Any] = {"rows": [part]} if isinstance(part, int) else dict(zip(("start", "end"), part or (), strict=False))
    for entry in entries:
        if isinstance(part, int) and entry["reason"] == reason and entry.get("file", file) == file:
            entry["rows"] = sorted({*entry["rows"], part})
            return
    entry = new_entry(entries)
    entry.update(({} if settings.get("file") == file else {"file": file}) | keys | {"reason": reason})
    entries.append(entry)


def include_part(folder: Path, kind: str, file: str, part: Part) -> None:
    """Take a part of a table in again that was left out.

    Args:
        folder, kind, file, part: See `exclude_part`.

    Raises:
        UsageError, DescriptionError, StoreError: See `exclude_part`.
    """

    def change(settings: Any) -> None:
        entries = settings.get("exclude", [])
        for number in reversed(range(len(entries))):
            entry = entries[number]
            rows, span = entry.get("rows", []), (entry.get("start"), entry.get("end"))
            is_meant = part in rows if isinstance(part, int) else not rows and span == (part or (None, None))
            if entry.get("file", file) != file or not is_meant:
                continue
            if other_rows := [row for row in rows if row != part]:
                entry["rows"] = other_rows
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
    except (TOMLKitError, KeyError, TypeError, ValueError, AttributeError):
        raise UsageError(
            f"cable.toml has no table {kind} that can be changed here; it was changed by hand, so load this page again, or "
            "edit the file itself."
        ) from None
    return document
