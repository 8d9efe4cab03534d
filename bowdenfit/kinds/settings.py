"""Descriptions of cables: a field under [tables] for every kind of measurement, and columns that the command line names."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import create_model

from bowdenfit.description import Description, Table, Tables
from bowdenfit.description.file import check_quantities, read_toml, validate
from bowdenfit.description.placeholders import Place, placeholders_in
from bowdenfit.errors import DescriptionError, Faults
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.kind import Kind
from bowdenfit.units import ColumnSource
from bowdenfit.words import listed

_ASKED_BY_TABLES = {"schema", "friction_model", "group", "cable", "route", "contact", "tables", "recording", "design"}
"""Keys without which tables cannot be read."""


def load_description(
    path: Path,
    overrides: Sequence[str] = (),
    columns: Mapping[str, ColumnSource] | None = None,
    faults: Faults | None = None,
) -> Description:
    """Read `cable.toml`.

    Args:
        path: The file.
        overrides: Settings from the command line, such as `friction.mu1.fixed=0.1`.
        columns: Columns of tables named on the command line.
        faults: Takes what is wrong with keys that no table asks for, so that the tables can be looked at too.

    Raises:
        DescriptionError: The file is missing or no TOML, keys are unknown, or values are impossible or left from the template.
    """
    text, stated = read_toml(path, overrides)
    raw, wrong = with_columns(stated, columns or {}), Faults()
    left = placeholders_in(raw, text, path.name)
    wrong.faults += left.values()
    try:
        description = parse_description(raw, path.name)
    except DescriptionError as error:
        wrong.faults += [each for each in error.faults or (error,) if not _is_about(each.key_path, left)]
        keys = {str(each.key_path[0]) if each.key_path else "schema" for each in wrong.faults}
        if keys & _ASKED_BY_TABLES or not keys <= set(raw):
            wrong.refuse()
        try:
            known = {key: value for key, value in raw.items() if key not in keys}
            description = parse_description({"name": path.stem, **known}, path.name)
        except DescriptionError:
            wrong.refuse()
            raise
    if faults is None:
        wrong.refuse()
    else:
        faults.faults += wrong.faults
    return description


def _is_about(place: Place, left: Mapping[Place, DescriptionError]) -> bool:
    """Whether a fault is one of a placeholder's."""
    return any(bool(place) and place[: len(other)] == other[: len(place)] for other in left)


def parse_description(raw: Mapping[str, Any], file: str = "cable.toml") -> Description:
    """A description from plain data, with errors that name the key.

    Raises:
        DescriptionError: A key is unknown, or a value is missing or impossible.
    """
    kinds = tuple(KINDS.values())
    description = validate(raw, _models(kinds)[0], file)
    faults = Faults()
    for kind in kinds:
        settings = description.tables.stated.get(kind.name)
        with faults.collect(key_path=("tables",)):
            if why := kind.contradiction(settings, description):
                raise DescriptionError(f"{file}: {why}.")
            if settings is not None:
                check_quantities(kind.quantities(settings, description), file)
    faults.refuse()
    return description


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


@lru_cache
def _models(kinds: tuple[Kind[Any], ...]) -> tuple[type[Description], type[Tables]]:
    """A description, and its tables, with a field for each kind."""
    fields: dict[str, Any] = {kind.name: (kind.settings | None, None) for kind in kinds}
    tables = create_model("CableTables", __base__=Tables, __module__=__name__, **fields)
    return create_model("CableDescription", __base__=Description, __module__=__name__, tables=(tables, ...)), tables


CableDescription, CableTables = _models(tuple(KINDS.values()))  # found here by other processes
