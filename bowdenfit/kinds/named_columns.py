"""Columns that the command line names, put where cable.toml would name them."""

from collections.abc import Mapping
from typing import Any

from bowdenfit.description import Table
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds import KINDS
from bowdenfit.units import ColumnSource
from bowdenfit.words import listed


def with_columns(raw: dict[str, Any], columns: Mapping[str, ColumnSource]) -> dict[str, Any]:
    """Plain data of a description whose table has the named columns.

    Args:
        raw: The data; changed in place.
        columns: By quantity, such as input_force; of several tables with the table before it, as forces.input_force.

    Raises:
        DescriptionError: There is no such table, or it is not clear which is meant.
    """
    stated = raw.get("tables")
    tables = [name for name in stated if _has_columns(name, stated[name])] if isinstance(stated, dict) else []
    for named, source in columns.items():
        table, _, quantity = named.rpartition(".")
        if not table and len(tables) > 1:
            raise DescriptionError(
                f"--column {named}=... does not say of which table, and the data set has several; write the table before it, "
                f"such as --column {tables[0]}.{named}=..., of {listed(tables)}."
            )
        if (table and table not in tables) or not tables:
            what = f"no table {table!r}" if table else "no table"
            hint = f"it has {listed(tables)}" if tables else "channels of recordings are named by --channel"
            raise DescriptionError(f"--column {named}=...: the data set has {what} with columns; {hint}.")
        settings = raw["tables"][table or tables[0]]
        settings["columns"] = {**settings.get("columns", {}), quantity: source.model_dump(exclude_none=True)}
    return raw


def _has_columns(name: str, settings: Any) -> bool:
    return name in KINDS and issubclass(KINDS[name].settings, Table) and isinstance(settings, dict)
