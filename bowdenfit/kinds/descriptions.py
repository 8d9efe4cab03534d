"""Descriptions of cables (cable.toml) and designs of plans, with a field under [tables] and [design] for every kind."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError, create_model

from bowdenfit.description import BY_GROUP, Description, Table, Tables
from bowdenfit.description.file import Place, check_quantities, find_placeholders, read_toml, validate
from bowdenfit.description.values import LONGEST_NAME, Frozen
from bowdenfit.description.wrong_keys import explain_validation_error
from bowdenfit.errors import DescriptionError, Faults, suggest_name
from bowdenfit.kinds import KINDS, iterate_tables
from bowdenfit.kinds.kind import Design, FrictionKind, Kind, PlannedKind
from bowdenfit.kinds.tables import Measurements
from bowdenfit.units import ColumnSource
from bowdenfit.words import listed, shown

_NEEDED_BY_TABLES = {"schema", "friction_model", "group", "cable", "motor", "route", "contact", "tables", "recording", "design"}
"""Keys without which tables cannot be read."""


_FITTED_FRICTION = ("friction_model", "reference_force", "reference_velocity")


def load_description(
    path: Path,
    overrides: Sequence[str] = (),
    columns: Mapping[str, ColumnSource] | None = None,
    faults: Faults | None = None,
    missing: Sequence[str] = (),
) -> Description:
    """Read `cable.toml`.

    Args:
        path: The file.
        overrides: Settings from the command line, such as `friction.mu1.fixed=0.1`.
        columns: Columns of tables named on the command line.
        faults: Takes what is wrong with keys that no table asks for, so that the tables can be looked at too.
        missing: Missing-value codes of all tables and recordings, from the command line.

    Raises:
        DescriptionError: The file is missing or no TOML, keys are unknown, or values are impossible or left from the template.
    """
    text, stated = read_toml(path, overrides)
    raw, wrong = add_missing_codes(add_columns(stated, columns or {}), missing), Faults()
    placeholders = find_placeholders(raw, text, path.name)
    wrong.faults += placeholders.values()
    try:
        description = parse_description(raw, path.name)
    except DescriptionError as error:
        wrong.faults += [fault for fault in error.faults or (error,) if not _concerns_placeholder(fault.key_path, placeholders)]
        keys = {str(fault.key_path[0]) if fault.key_path else "schema" for fault in wrong.faults}
        if keys & _NEEDED_BY_TABLES or not keys <= set(raw):
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


def _concerns_placeholder(key_path: Place, placeholders: Mapping[Place, DescriptionError]) -> bool:
    """Return whether the key of a fault is, contains or belongs to a placeholder."""
    return any(bool(key_path) and key_path[: len(placeholder)] == placeholder[: len(key_path)] for placeholder in placeholders)


def parse_description(raw: Mapping[str, Any], file: str = "cable.toml") -> Description:
    """Return a description from plain data; errors name the key.

    Raises:
        DescriptionError: A key is unknown, or a value is missing or impossible.
    """
    kinds = tuple(KINDS.values())
    description = validate(_add_recordings(raw), _description_models(kinds)[0], file)
    faults = Faults()
    for kind in kinds:
        settings = description.tables.stated.get(kind.name)
        with faults.collect(key_path=("tables",)):
            if reason := kind.contradiction(settings, description):
                raise DescriptionError(f"{file}: {reason}.")
            if settings is not None and description.motor is not None and kind.needs_load_cell:
                raise DescriptionError(
                    f"{file}: the table {kind.name} needs the force at the input, and [motor] gives its current or torque in "
                    "tables of forces and recordings alone; fit the table in a data set without [motor]."
                )
            if settings is not None:
                check_quantities(kind.quantities(settings, description), file)
    faults.refuse()
    return description


def _add_recordings(raw: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the description with an empty table of recordings where there is a [[recording]] and nothing is said of all."""
    tables = raw.get("tables", {})
    if not raw.get("recording") or not isinstance(tables, Mapping) or "recordings" in tables:
        return raw
    return {**raw, "tables": {**tables, "recordings": {}}}


def add_columns(raw: dict[str, Any], columns: Mapping[str, ColumnSource]) -> dict[str, Any]:
    """Add the columns that the user names to the plain data of a description.

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


def add_missing_codes(raw: dict[str, Any], codes: Sequence[str]) -> dict[str, Any]:
    """Add the missing-value codes that the user states to all tables and recordings of a description's plain data."""
    if not codes:
        return raw
    tables = _add_recordings(raw).get("tables")
    for name, settings in tables.items() if isinstance(tables, dict) else ():
        if name in KINDS and isinstance(settings, dict) and isinstance(settings.setdefault("missing", []), list):
            settings["missing"] = [*settings["missing"], *codes]
    return {**raw, "tables": tables} if tables else raw


def _has_columns(name: str, settings: Any) -> bool:
    return name in KINDS and issubclass(KINDS[name].settings, Table) and isinstance(settings, dict)


@lru_cache
def _description_models(kinds: tuple[Kind[Any], ...]) -> tuple[type[Description], type[Tables]]:
    """Return the models of a description and of its tables, with a field for each kind."""
    fields: dict[str, Any] = {kind.name: (kind.settings | None, None) for kind in kinds}
    tables = create_model("CableTables", __base__=Tables, __module__=__name__, **fields)
    return create_model("CableDescription", __base__=Description, __module__=__name__, tables=(tables, ...)), tables


CableDescription, CableTables = _description_models(tuple(KINDS.values()))  # found here by other processes


def read_design(page: Mapping[str, Any], description: Description, file: str) -> Design:
    """Read the design of a plan.

    Args:
        page: [design] as read.
        description: The cable.
        file: Its file, for errors.

    Raises:
        DescriptionError: A key or a value is wrong, or this cable cannot have what is asked for.
    """
    design = _parse_design(page, file)
    for kind in _planned_kinds():
        if reason := kind.design_contradiction(design, description):
            raise DescriptionError(f"{file}, design.{reason}")
    return design


def make_design(**measured: Any) -> Design:
    """Return a design from keywords, for any cable; parts that a cable does not have are not measured."""
    return _parse_design(measured, "the design")


def _planned_kinds() -> list[PlannedKind[Any]]:
    return [kind for kind in KINDS.values() if isinstance(kind, PlannedKind)]


def _parse_design(page: Mapping[str, Any], file: str) -> Design:
    model = _design_page_model(tuple(kind.design for kind in _planned_kinds()))
    raw = {"design": dict(page)}
    try:
        return model.model_validate(raw).design  # type: ignore[attr-defined]
    except ValidationError as error:
        raise explain_validation_error(error, raw, model, file, "write it, such as loads = [10, 20, 40]") from None


@lru_cache
def _design_page_model(parts: tuple[type[Design], ...]) -> type[BaseModel]:
    """Return the model of a plan's [design], with the fields of every kind that can be planned."""
    whole = create_model("WholeDesign", __base__=parts, __module__=__name__)
    return create_model("DesignPage", __base__=Frozen, __module__=__name__, design=(whole, ...))


def description_without_recordings(raw: Mapping[str, Any], file: str) -> Description:
    """The cable of a plan without what needs its recordings, whose files do not exist yet: a table of efficiencies stands in
    for them, and [recordings.friction] for a model of friction.

    Args:
        raw: The plan.
        file: Its file, for errors.

    Raises:
        DescriptionError: A table or key is wrong, or cannot be made beside recordings.
    """
    tables = raw.get("tables", {})
    if "recording" in raw:
        raise DescriptionError(f"{file}: a plan has no [[recording]]; these are made from [recordings].")
    for name in tables:
        if name not in {"angles", "recordings"}:
            raise DescriptionError(
                f"{file}, tables.{name}: a plan of recordings makes angles and recordings only; leave it out, or plan it "
                "with [design] in a file of its own."
            )
    kept = {k: v for k, v in raw.items() if k not in {"truth", "recordings", "tables", *_FITTED_FRICTION}}
    angles = {"angles": tables["angles"]} if "angles" in tables else {}
    description = parse_description({**kept, "tables": {**angles, "efficiencies": {"file": "none.csv"}}}, file)
    for contact in description.contact:
        if contact.wrap_angle.constant is None and contact.wrap_angle.curve is None:
            raise DescriptionError(
                f"{file}, contact {contact.name!r}: recordings are simulated from a constant wrap angle or a curve; "
                "this contact has only a column."
            )
    return description


def design_without_recordings(description: Description, angles: Sequence[float]) -> Design:
    """Return the design of the tables that are made beside recordings, at some route values."""
    return make_design(angles=angles, efficiencies=(description.route.middle if description.route else 0.0,))


def order_groups(description: Description, measurements: Measurements) -> tuple[str, ...]:
    """Return the groups in order of appearance, but first the one that predictions are for where that is stated.

    Raises:
        DescriptionError: Groups are to have coefficients of their own, and a table says nothing of groups, or there is one
            group only; or the one that predictions are for is not there.
    """
    tables = [(kind, kind.groups(table)) for kind, table in iterate_tables(measurements) if isinstance(kind, FrictionKind)]
    names = list(dict.fromkeys(name for _, groups in tables for name in groups))
    if description.by_group and (long := next((name for name in names if len(name) > LONGEST_NAME), None)):
        raise DescriptionError(
            f"a group has a name of {len(long)} characters, {shown(long)}; at most {LONGEST_NAME} fit into tables and figures, "
            "and each group's coefficient is called by it: write a shorter one."
        )
    without = [kind.name for kind, groups in tables if not groups]
    if description.by_group and without:
        raise DescriptionError(
            f'friction_model has "{BY_GROUP}", but the tables of {listed(without)} say nothing about groups, so it is '
            "not known whose friction they show; add a column group where the table can have one, or fit them apart."
        )
    if description.by_group and len(names) < 2:
        raise DescriptionError(
            f'friction_model has "{BY_GROUP}", but all readings are of one group ({", ".join(names)}); leave it out, or add '
            "readings of another group."
        )
    if description.group is not None and description.group not in names:
        raise DescriptionError(
            f"cable.toml, group: there is no group {description.group!r}{suggest_name(description.group, names)}",
            key_path=("group",),
        )
    return tuple(sorted(names, key=lambda name: name != description.group))
