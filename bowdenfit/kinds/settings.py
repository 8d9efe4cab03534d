"""Descriptions of cables with a field under [tables] for every kind of measurement."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import create_model

from bowdenfit.description import Description, Tables
from bowdenfit.description.file import check_quantities, read_toml, validate
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.named_columns import with_columns
from bowdenfit.units import ColumnSource


def load_description(
    path: Path, overrides: Sequence[str] = (), columns: Mapping[str, ColumnSource] | None = None
) -> Description:
    """Read `cable.toml`.

    Args:
        path: The file.
        overrides: Settings from the command line, such as `friction.mu1.fixed=0.1`.
        columns: Columns of tables named on the command line.

    Raises:
        DescriptionError: The file is missing or no TOML, a key is unknown, or a value is impossible.
    """
    return parse_description(with_columns(read_toml(path, overrides), columns or {}), path.name)


def parse_description(raw: Mapping[str, Any], file: str = "cable.toml") -> Description:
    """A description from plain data, with errors that name the key.

    Raises:
        DescriptionError: A key is unknown, or a value is missing or impossible.
    """
    kinds = tuple(KINDS.values())
    description = validate(raw, _models(kinds)[0], file)
    for kind in kinds:
        settings = description.tables.stated.get(kind.name)
        if said := kind.contradiction(settings, description):
            raise DescriptionError(f"{file}: {said}.")
        if settings is not None:
            check_quantities(kind.quantities(settings, description), file)
    return description


@lru_cache
def _models(kinds: tuple[Kind[Any], ...]) -> tuple[type[Description], type[Tables]]:
    """A description, and its tables, with a field for each kind."""
    fields: dict[str, Any] = {kind.name: (kind.settings | None, None) for kind in kinds}
    tables = create_model("CableTables", __base__=Tables, __module__=__name__, **fields)
    return create_model("CableDescription", __base__=Description, __module__=__name__, tables=(tables, ...)), tables


CableDescription, CableTables = _models(tuple(KINDS.values()))  # found here by other processes
