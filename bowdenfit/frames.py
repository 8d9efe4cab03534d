"""Data frames: a table in memory is read as the CSV file that its own library writes of it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from bowdenfit.errors import UsageError
from bowdenfit.words import shown

FILE = "dataframe.csv"  # what refusals call it


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
