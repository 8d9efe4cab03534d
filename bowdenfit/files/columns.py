"""From column headings to named quantities: `input_force_N`, `input_force [N]` and `Input force (N)` are one column."""

import difflib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import Cell
from bowdenfit.files.csv_table import RawTable
from bowdenfit.files.headings import split_brackets
from bowdenfit.units import ColumnSource, conversion_factor, is_unit, route_conversion_factor, speed_dimension
from bowdenfit.words import quoted, shown

_LONGEST_HEADING = 200


@dataclass(frozen=True)
class Quantity:
    """A column that a table may have.

    Args:
        name: Canonical name.
        dimension: Kind of quantity (`units.INTERNAL_UNITS`), "route" for the route variable, "speed" for the velocity of
            the rope or of the motor, "text" for labels.
        to: Unit to convert to; the internal one if omitted.
    """

    name: str
    dimension: str
    to: str | None = None


@dataclass(frozen=True)
class Column:
    """The cells of one quantity and the factor to its internal unit."""

    heading: str
    cells: tuple[Cell, ...]
    factor: float
    unit: str | None

    def value(self, cell: Cell) -> float:
        """The number in one of the cells, in the internal unit.

        Raises:
            DatasetError: The cell is blank, is text, or is not finite.
        """
        value = cell.number() * self.factor
        if not math.isfinite(value):
            raise cell.refuse(f"{cell.shown} is too large for a number; correct the value or the unit.")
        return value

    def numbers(self) -> list[float]:
        """All values in the internal unit; every cell must hold one.

        Raises:
            DatasetError: A cell is blank, is text, or is not finite.
        """
        return [self.value(cell) for cell in self.cells]


def find_columns(
    table: RawTable,
    wanted: tuple[Quantity, ...],
    sources: Mapping[str, ColumnSource] | None = None,
    unused: tuple[str, ...] = (),
) -> dict[str, Column]:
    """The wanted quantities that the table has.

    Args:
        table: The file.
        wanted: What to look for.
        sources: Columns the user has named explicitly; these are not searched for.
        unused: Names that the user may give a column although nothing reads it.

    Raises:
        DatasetError: A heading fits two quantities or two headings fit one; a unit is missing, unknown or of the
            wrong dimension; a named column is not there, or is named for what the table cannot have.
    """
    sources = {
        name: ColumnSource(name=_one_space(source.name), unit=source.unit) for name, source in (sources or {}).items()
    }
    _check_sources(table, [*(quantity.name for quantity in wanted), *unused], sources)
    found: dict[str, Column] = {}
    taken = {source.name for source in sources.values()}
    for heading in table.header:
        if heading in taken or not heading:
            continue
        readings = [reading for reading in meanings(heading, wanted) if reading[0].name not in sources]
        if len(readings) > 1:
            names = " and ".join(quantity.name for quantity, _ in readings)
            raise DatasetError(
                f"{table.file}: the column {shown(heading)} can be read as {names}; rename it, or say which under columns "
                f'in cable.toml: columns = {{ {readings[0][0].name} = {{ name = "{heading}", unit = ... }} }}.'
            )
        for quantity, unit in readings:
            if quantity.name in found:
                raise DatasetError(
                    f"{table.file}: the columns {shown(found[quantity.name].heading)} and {shown(heading)} both look like "
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
        f"{table.file} has no column {name}{_nearest(name, table.header)}; it has {quoted(table.header)}. "
        f"Name the column {example}, or map it in cable.toml: columns = {{ {name} = {{ name = ..., unit = ... }} }}."
    )


def _nearest(name: str, header: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(name, [_plain(h) for h in header], n=1, cutoff=0.7)
    match = next((h for h in header if near and _plain(h) == near[0]), None)
    return f" (is it {shown(match)}?)" if match else ""


def _plain(heading: str) -> str:
    """Heading in lower case with underscores for anything between words."""
    return re.sub(r"[\W_]+", "_", heading.lower()).strip("_")


def _one_space(heading: str) -> str:
    """Heading as `read_csv` keeps it, with one space for any run of spaces and line breaks."""
    return " ".join(heading.split())


def meanings(heading: str, wanted: tuple[Quantity, ...]) -> list[tuple[Quantity, str | None]]:
    """Every quantity that the heading can mean, with the unit written in it; exact names win over name and unit."""
    if len(heading) > _LONGEST_HEADING:
        return []
    name, unit = split_brackets(heading)
    exact = [(q, unit or _suffix(name, q.name)) for q in wanted if _plain(name) == _plain(q.name)]
    whole = [(q, None) for q in wanted if _plain(heading) == _plain(q.name)]
    named = exact or whole or [(q, behind) for q in wanted if (behind := _suffix(heading, q.name)) is not None]
    return [(q, unit) for q, unit in named if not (q.dimension == "text" and unit and is_unit(unit))]


def _suffix(heading: str, name: str) -> str | None:
    """Unit behind the name in `input_force_N` or "Input force N", case kept; None where it is no unit."""
    words = re.split(r"[\s_\-]+", heading.strip())
    units = ["_".join(words[i:]) for i in range(1, len(words)) if _plain("_".join(words[:i])) == _plain(name)]
    if not units:
        return None
    candidate = units[-1].replace("_per_", "/").replace("_", "*")
    if candidate.lower() in {"pct", "percent"}:
        return "%"
    return candidate if is_unit(candidate) else None


def _column(table: RawTable, heading: str, quantity: Quantity, unit: str | None) -> Column:
    cells = tuple(row[table.header.index(heading)] for row in table.rows)
    if quantity.dimension in {"text", "ratio"} and unit is None:
        return Column(heading, cells, 1.0, None)
    if unit is None:
        raise DatasetError(
            f"{table.file}: the column {shown(heading)} does not say its unit; rename it to "
            f"{quantity.name}_{quantity.to or _usual(quantity.dimension)} (or the unit it is in), or give the unit in "
            f'cable.toml: columns = {{ {quantity.name} = {{ name = "{heading}", unit = ... }} }}.'
        )
    try:
        if quantity.dimension == "speed":
            factor = conversion_factor(unit, speed_dimension(unit))
        elif quantity.dimension == "route":
            factor = route_conversion_factor(unit, quantity.to or "mm")
        else:
            factor = 1.0 if quantity.dimension == "text" else conversion_factor(unit, quantity.dimension, quantity.to)
    except DatasetError as error:
        raise DatasetError(f"{table.file}, row {table.header_row}, column {shown(heading)}: {error}.") from None
    return Column(heading, cells, factor, unit)


def _usual(dimension: str) -> str:
    return {"force": "N", "angle": "deg", "length": "mm", "speed": "mm/s", "time": "s", "torque": "N_m"}.get(
        dimension, "mm"
    )


def _check_sources(table: RawTable, known: list[str], sources: Mapping[str, ColumnSource]) -> None:
    """Every column that cable.toml names is one of the file's, and serves one known quantity."""
    serves: dict[str, str] = {}
    for name, source in sources.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
            hint = f"did you mean {near[0]}?" if near else f"it can have {', '.join(known)}."
            raise DatasetError(
                f"cable.toml names a column for {shown(name)}, which {table.file} cannot have under columns; {hint}"
            )
        if source.name not in table.header:
            raise DatasetError(
                f"{table.file} has no column {shown(source.name)}, which cable.toml names for {name}; "
                f"its columns are {quoted(table.header)}."
            )
        if source.name in serves:
            raise DatasetError(
                f"cable.toml names the column {shown(source.name)} of {table.file} for both {serves[source.name]} and "
                f"{name}; correct one of them."
            )
        serves[source.name] = name


def _named_column(table: RawTable, quantity: Quantity, source: ColumnSource) -> Column:
    written = next((unit for _, unit in meanings(source.name, (quantity,)) if unit), None)
    return _column(table, source.name, quantity, source.unit or written or split_brackets(source.name)[1] or None)
