"""Data frames: a table in memory is read as the CSV file that its own library writes of it."""

import re
import shlex
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol, TypeVar

from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.words import shown

FILE = "dataframe.csv"  # what refusals call it
Refusal = TypeVar("Refusal", bound=BowdenfitError)
_TOML = r"(?: \(in cable\.toml (?:[^()]|\([^()]*\))*\))?"
_NAMED = re.compile(rf"(?<![\w'\"-])--column (\w[\w.]*=(?:'[^']*'|[^\s,;]*[^\s,;.])){_TOML}")
_CODE = re.compile(rf"(?<![\w'\"-])--missing ([^\s,;]*[^\s,;.]){_TOML}")
_ANGLE = re.compile(r"(?<![\w'\"-])--wrap-angle (\d[^\s,;]*[^\s,;.])")
_OF_FILES = ", or write a cable.toml next to it with `bowdenfit init`; `bowdenfit check` prints the whole command"
_KEYWORDS = {"--column": "columns", "--missing": "missing", "--wrap-angle": "wrap_angle", "--reading-limit": "reading_limit",
             "--set": "settings"}  # fmt: skip


class Frame(Protocol):
    """A table with named columns, such as a DataFrame of pandas or polars; `attrs` of pandas may hold the units of columns."""

    @property
    def columns(self) -> Any:
        """Names of the columns, or the columns themselves."""


def is_frame(value: Any) -> bool:
    """Return whether a value is a table that `write_frame` can write."""
    return hasattr(value, "columns") and any(hasattr(value, method) for method in ("to_csv", "write_csv"))


def write_frame(frame: Any, folder: Path, name: str = FILE) -> Path:
    """Write a data frame as a table with one row of headings, and return the file.

    An index with a name is a column; one without is not. Units that `frame.attrs["units"]` has for columns stand behind their
    names, as in "input force (N)"; those of columns that were dropped since are left alone.

    Args:
        frame: See `Frame`.
        folder: Where the file goes.
        name: Name of the file.

    Raises:
        UsageError: The columns have several levels of names, or the units are no dictionary.
    """
    path = folder / name
    if not hasattr(frame, "to_csv"):  # polars, which has neither an index nor attrs
        frame.write_csv(path)
        return path
    if getattr(frame.columns, "nlevels", 1) > 1:
        raise UsageError(
            "the columns of the data frame have several levels of names; join them to one, such as with "
            "frame.columns = [' '.join(names) for names in frame.columns]."
        )
    units = frame.attrs.get("units", {})
    if not isinstance(units, Mapping):
        raise UsageError(f'attrs["units"] = {shown(units)} must be a dictionary by column, such as {{"input force": "N"}}.')
    headings = [f"{name} ({units[name]})" if name in units else str(name) for name in frame.columns]
    has_index = any(name is not None for name in frame.index.names)
    frame.to_csv(path, index=has_index, header=headings)
    return path


def reword_refusal(error: Refusal) -> Refusal:
    """The same refusal of a data frame in the words of a notebook: keywords of Python in place of options.

    Args:
        error: As a file would be refused.
    """
    reworded = type(error)(say_keywords(str(error)))
    reworded.faults = tuple(reword_refusal(fault) for fault in error.faults)
    reworded.fault_key, reworded.row, reworded.key_path = error.fault_key, error.row, error.key_path
    return reworded


def say_keywords(sentence: str) -> str:
    """A sentence with keywords of Python in place of options of the command line.

    Args:
        sentence: As the command line prints it.
    """
    sentence = sentence.replace(_OF_FILES, "")
    sentence = sentence.replace(f"{FILE} is a file without a description", "the data frame has no description")
    sentence = _NAMED.sub(lambda match: f"columns=[{_unquoted(match[1])!r}]", sentence)
    sentence = _CODE.sub(lambda match: f"missing=[{match[1]}]", sentence)
    sentence = _ANGLE.sub(lambda match: f'wrap_angle="{match[1]}"', sentence)
    for option, keyword in _KEYWORDS.items():
        sentence = re.sub(rf"(?<![\w'\"-]){option}\b", keyword, sentence)
    return sentence


def keyword_of(option: str) -> str:
    """Return the keyword of Python for an option of the command line, such as "columns" for "--column"."""
    return _KEYWORDS.get(option, option.removeprefix("--").replace("-", "_"))


def _unquoted(argument: str) -> str:
    """An argument as a shell would pass it on."""
    with suppress(ValueError):
        return "".join(shlex.split(argument))
    return argument
