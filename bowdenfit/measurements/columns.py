"""From column headings to named quantities: `input_force_N`, `input_force [N]` and `Input force (N)` are one column."""

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass

from bowdenfit.errors import DatasetError
from bowdenfit.measurements.readers import Cell, RawTable
from bowdenfit.measurements.units import conversion_factor, is_unit, route_conversion_factor

_BRACKETED = re.compile(r"^(?P<name>.*?)[\s_]*[\[(](?P<unit>[^\])]*)[\])]\s*$")


@dataclass(frozen=True)
class Quantity:
    """A column that a table may have.

    Args:
        name: Canonical name.
        dimension: Kind of quantity (`units.INTERNAL_UNITS`), "route" for the route variable, "text" for labels.
        to: Unit to convert to; the internal one if omitted.
    """

    name: str
    dimension: str
    to: str | None = None


@dataclass(frozen=True)
class ColumnSource:
    """Where the user says a quantity stands: the heading as written in the file, and its unit."""

    name: str
    unit: str | None = None


@dataclass(frozen=True)
class Column:
    """The cells of one quantity and the factor to its internal unit."""

    heading: str
    cells: tuple[Cell, ...]
    factor: float
    unit: str | None

    def numbers(self) -> list[float]:
        """All values in the internal unit; every cell must hold one."""
        return [cell.number() * self.factor for cell in self.cells]


def find_columns(
    table: RawTable, wanted: tuple[Quantity, ...], sources: Mapping[str, ColumnSource] | None = None
) -> dict[str, Column]:
    """The wanted quantities that the table has.

    Args:
        table: The file.
        wanted: What to look for.
        sources: Columns the user has named explicitly; these are not searched for.

    Raises:
        DatasetError: A heading fits two quantities or two headings fit one; a unit is missing, unknown or of the
            wrong dimension; a named column is not there.
    """
    sources = sources or {}
    found: dict[str, Column] = {}
    taken = {source.name for source in sources.values()}
    for heading in table.header:
        if heading in taken or not heading:
            continue
        readings = [reading for reading in _readings(heading, wanted) if reading[0].name not in sources]
        if len(readings) > 1:
            names = " and ".join(quantity.name for quantity, _ in readings)
            raise DatasetError(
                f"{table.file}: the column {heading!r} can be read as {names}; rename it, or say which under columns "
                f'in cable.toml: columns = {{ {readings[0][0].name} = {{ name = "{heading}", unit = ... }} }}.'
            )
        for quantity, unit in readings:
            if quantity.name in found:
                raise DatasetError(
                    f"{table.file}: the columns {found[quantity.name].heading!r} and {heading!r} both look like "
                    f"{quantity.name}; rename one, or say which under columns in cable.toml: "
                    f'columns = {{ {quantity.name} = {{ name = "{heading}" }} }}.'
                )
            found[quantity.name] = _column(table, heading, quantity, unit)
    for quantity in wanted:
        if quantity.name in sources:
            found[quantity.name] = _named_column(table, quantity, sources[quantity.name])
    return found


def require(table: RawTable, found: Mapping[str, Column], name: str, example: str) -> Column:
    """The column called `name`.

    Raises:
        DatasetError: The table has no such column.
    """
    if name in found:
        return found[name]
    raise DatasetError(
        f"{table.file} has no column {name}{_nearest(name, table.header)}; it has {', '.join(map(repr, table.header))}. "
        f"Name the column {example}, or map it in cable.toml: columns = {{ {name} = {{ name = ..., unit = ... }} }}."
    )


def _nearest(name: str, header: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(name, [_plain(h) for h in header], n=1, cutoff=0.7)
    match = next((h for h in header if near and _plain(h) == near[0]), None)
    return f" (is it {match!r}?)" if match else ""


def _plain(heading: str) -> str:
    """Heading in lower case with underscores for anything between words."""
    return re.sub(r"[^0-9a-z]+", "_", heading.strip().lower()).strip("_")


def _readings(heading: str, wanted: tuple[Quantity, ...]) -> list[tuple[Quantity, str | None]]:
    """Every quantity that the heading can mean, with the unit written in it; exact names win over name and unit."""
    exact = [(q, None) for q in wanted if _plain(heading) == _plain(q.name)]
    if exact:
        return list(exact)
    match = _BRACKETED.match(heading)
    if match:
        return [(q, match["unit"].strip() or None) for q in wanted if _plain(match["name"]) == _plain(q.name)]
    return [(q, unit) for q in wanted if (unit := _suffix(heading, q.name)) is not None]


def _suffix(heading: str, name: str) -> str | None:
    """Unit behind the name in `input_force_N` or "Input force N", case kept; None where it is no unit."""
    words, unit = re.split(r"[\s_\-]+", heading.strip()), None
    for split in range(1, len(words)):
        if _plain("_".join(words[:split])) == _plain(name):
            unit = "_".join(words[split:])
    if unit is None:
        return None
    candidate = unit.replace("_per_", "/").replace("_", "*")
    if candidate.lower() in {"pct", "percent"}:
        return "%"
    return candidate if is_unit(candidate) else None


def _column(table: RawTable, heading: str, quantity: Quantity, unit: str | None) -> Column:
    cells = tuple(row[table.header.index(heading)] for row in table.rows)
    if quantity.dimension in {"text", "ratio"} and unit is None:
        return Column(heading, cells, 1.0, None)
    if unit is None:
        raise DatasetError(
            f"{table.file}: the column {heading!r} does not say its unit; rename it to "
            f"{quantity.name}_{quantity.to or _usual(quantity.dimension)} (or the unit it is in), or give the unit in "
            f'cable.toml: columns = {{ {quantity.name} = {{ name = "{heading}", unit = ... }} }}.'
        )
    try:
        if quantity.dimension == "route":
            factor = route_conversion_factor(unit, quantity.to or "mm")
        else:
            factor = 1.0 if quantity.dimension == "text" else conversion_factor(unit, quantity.dimension, quantity.to)
    except DatasetError as error:
        raise DatasetError(f"{table.file}, row 1, column {heading!r}: {error}.") from None
    return Column(heading, cells, factor, unit)


def _usual(dimension: str) -> str:
    return {"force": "N", "angle": "deg", "length": "mm", "velocity": "mm/s", "time": "s"}.get(dimension, "mm")


def _named_column(table: RawTable, quantity: Quantity, source: ColumnSource) -> Column:
    if source.name not in table.header:
        raise DatasetError(
            f"{table.file} has no column {source.name!r}, which cable.toml names for {quantity.name}; "
            f"its columns are {', '.join(map(repr, table.header))}."
        )
    readings = _readings(source.name, (quantity,))
    match = _BRACKETED.match(source.name)
    written = next((unit for _, unit in readings if unit), match["unit"].strip() if match else None)
    return _column(table, source.name, quantity, source.unit or written)
