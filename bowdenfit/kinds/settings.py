"""Descriptions of cables with a field under [tables] for every kind of measurement."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import create_model

from bowdenfit.description import Description, Tables
from bowdenfit.description.file import check_quantities, read_toml, validate
from bowdenfit.description.placeholders import Place, placeholders_in
from bowdenfit.errors import DescriptionError, Faults
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.named_columns import with_columns
from bowdenfit.units import ColumnSource

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
    wrong.found += left.values()
    try:
        description = parse_description(raw, path.name)
    except DescriptionError as error:
        wrong.found += [each for each in error.faults or (error,) if not _is_about(each.place, left)]
        keys = {str(each.place[0]) if each.place else "schema" for each in wrong.found}
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
        faults.found += wrong.found
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
        with faults.noted(place=("tables",)):
            if said := kind.contradiction(settings, description):
                raise DescriptionError(f"{file}: {said}.")
            if settings is not None:
                check_quantities(kind.quantities(settings, description), file)
    faults.refuse()
    return description


@lru_cache
def _models(kinds: tuple[Kind[Any], ...]) -> tuple[type[Description], type[Tables]]:
    """A description, and its tables, with a field for each kind."""
    fields: dict[str, Any] = {kind.name: (kind.settings | None, None) for kind in kinds}
    tables = create_model("CableTables", __base__=Tables, __module__=__name__, **fields)
    return create_model("CableDescription", __base__=Description, __module__=__name__, tables=(tables, ...)), tables


CableDescription, CableTables = _models(tuple(KINDS.values()))  # found here by other processes
