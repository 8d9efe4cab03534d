"""From columns of a table to named quantities with their units: `input_force_N`, `Force input (N)` and `F_in [N]` are one."""

import difflib
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import nan
from typing import TypeVar

import numpy as np

from bowdenfit.errors import DatasetError, Faults
from bowdenfit.files.cells import Cell, is_plain_number
from bowdenfit.files.headings import (
    MatchedColumn,
    find_candidates,
    heading_of,
    meanings,
    option_naming,
    plain_name,
    rank_headings,
    split_brackets,
    unit_to_state,
)
from bowdenfit.files.headings import Quantity as Quantity  # readers of tables take both from here
from bowdenfit.files.measured_cells import split_measured
from bowdenfit.files.pivot import find_pivot_headings
from bowdenfit.files.spellings import parse_heading
from bowdenfit.files.tables import RawTable
from bowdenfit.units import (
    LARGEST,
    ColumnSource,
    contradiction,
    conversion_factor,
    dimension_of,
    is_unit,
    route_conversion_factor,
    speed_dimension,
    weight_of,
)
from bowdenfit.words import few, listed, quoted, shown

Value = TypeVar("Value")
_ALIKE = 0.5  # judged: difflib's likeness from which an unknown quantity is taken for a misspelled one


@dataclass(frozen=True)
class Column:
    """The cells of one quantity and the factor to its internal unit.

    Args:
        heading: Heading of the column.
        cells: From above.
        factor: From its unit to the internal one.
        unit: As written; None without one.
        faults: Where cells that cannot be read are noted.
        known: Whether it is a column of the table; otherwise what is wrong with that is noted already.
        unit_in_cells: Whether only its cells say the unit, so that each must.
    """

    heading: str
    cells: tuple[Cell, ...]
    factor: float
    unit: str | None
    faults: Faults
    known: bool = True
    unit_in_cells: bool = False

    def read_cells(self, read: Callable[[Cell], Value], otherwise: Value) -> list[Value]:
        """Return every cell as read, with `otherwise` in place of those that cannot be; these are noted."""
        return self.faults.read_all(read, self.cells, otherwise) if self.known else [otherwise] * len(self.cells)

    def value(self, cell: Cell) -> float:
        """Return the number in one of the cells, in the internal unit.

        Raises:
            DatasetError: The cell is blank, is text, or is not finite.
        """
        self._check_unit(cell)
        value = cell.number() * self.factor
        if not abs(value) <= LARGEST:
            raise cell.refuse(f"{cell.shown} is too large for a measurement; correct the value or the unit.")
        if 0 < abs(value) < 1 / LARGEST**6:
            raise cell.refuse(f"{cell.shown} is closer to 0 than any measurement; correct the value, or write 0.")
        return value

    def _check_unit(self, cell: Cell) -> None:
        """Refuse a cell in another unit than its column, and one without a unit where only cells have it."""
        if cell.unit and self.unit and cell.unit != self.unit and weight_of(cell.unit) != self.unit:
            if contradiction(self.unit, cell.unit) or dimension_of(cell.unit) != dimension_of(self.unit):
                raise cell.refuse(f"{cell.shown} is in another unit than its column, which is in {self.unit}; use one unit.")
        elif not cell.unit and self.unit_in_cells and not cell.blank and cell.number() != 0:
            raise cell.refuse(f"{cell.shown} has no unit, and others of the column are in {self.unit}; write it there too.")

    def numbers(self) -> list[float]:
        """Return all values in the internal unit; every cell must hold one, and those that hold none are noted."""
        return self.read_cells(self.value, nan)


def find_columns(
    table: RawTable,
    wanted: tuple[Quantity, ...],
    sources: Mapping[str, ColumnSource] | None = None,
    unused: tuple[str, ...] = (),
) -> dict[str, Column]:
    """Return the wanted quantities that the table has; what is wrong with a column is noted among the table's faults.

    That is a heading that fits two quantities, or two headings that fit one; a unit that is missing, unknown or of the wrong
    dimension; a named column that is not there, or is named for what the table cannot have.

    Args:
        table: The file.
        wanted: Quantities to look for.
        sources: Columns the user has named explicitly; these are not searched for.
        unused: Names that the user may give a column although nothing reads it.
    """
    sources = {name: _match_header(table, source) for name, source in (sources or {}).items()}
    wrong = _note_wrong_sources(table, [*(quantity.name for quantity in wanted), *unused], sources)
    by_quantity: dict[str, Column] = {name: _missing_column(table, name) for name in wrong}
    taken = {source.name for source in sources.values()}
    headings = [("" if text in taken else text, unit) for text, unit in zip(table.header, table.units, strict=True)]
    _check_single_meaning(table, headings, wanted, sources)
    _check_known_units(table, headings, wanted, sources)
    can_be = find_candidates(headings, wanted, tuple(sources))
    for quantity in wanted:
        columns = can_be[quantity.name]
        if quantity.name in sources or columns:
            by_quantity[quantity.name] = _missing_column(table, quantity.name)
        with table.faults.collect(("columns", quantity.name) if quantity.name in sources else ()):
            if len(columns) > 1:
                raise _ambiguous_column_error(table, quantity.name, columns)
            if quantity.name in sources and quantity.name not in wrong:
                by_quantity[quantity.name] = _named_column(table, quantity, sources[quantity.name])
            elif columns:
                by_quantity[quantity.name] = _column(table, table.header[columns[0].position], quantity, columns[0].unit)
    return by_quantity | _find_errors_in_cells(table, by_quantity, wanted)


def _find_errors_in_cells(
    table: RawTable, columns: Mapping[str, Column], wanted: tuple[Quantity, ...]
) -> dict[str, Column]:
    """Return the standard deviations that stand behind ± in the cells of the wanted quantities, as columns of their own.

    That a quantity cannot have any, or has a column of them too, is noted among the table's faults.
    """
    can_be = {quantity.name for quantity in wanted}
    by_quantity = dict[str, Column]()
    for quantity in wanted:
        column, name = columns.get(quantity.name), f"{quantity.name}_sd"
        if quantity.dimension == "text" or column is None or column.heading not in table.errors:
            continue
        cell = next(cell for cell in column.cells if (parts := split_measured(cell.text)) and parts.error)
        with table.faults.collect():
            if name not in can_be:
                raise cell.refuse(
                    f"{cell.shown} has an error behind the number, which nothing reads there; write the numbers alone."
                )
            if name in columns:
                raise cell.refuse(
                    f"{cell.shown} has an error behind the number, and the column {shown(columns[name].heading)} has it too; "
                    "leave one of them out."
                )
            by_quantity[name] = replace(column, heading=f"{column.heading} ±", cells=table.errors[column.heading])
    return by_quantity


def remark_on_errors_in_cells(table: RawTable, columns: Mapping[str, Column]) -> list[str]:
    """Return a remark on what stands behind ± in cells, where a column of standard deviations was read from it."""
    with_errors = [column for name, column in columns.items() if f"{name}_sd" in columns and column.heading in table.errors]
    read = [shown(column.heading) for column in with_errors]
    place = f"{table.file}: what follows ± in {listed(read)} is taken for one standard deviation."
    return [place] if read else []


def _missing_column(table: RawTable, name: str) -> Column:
    """Return what stands for a column that is wrong or missing while reading goes on."""
    return Column(name, tuple(Cell(table.file, row[0].row, name, "") for row in table.rows), nan, None, table.faults, False)


def _match_header(table: RawTable, source: ColumnSource) -> ColumnSource:
    """Return a source as `read_csv` keeps headings: one space for any run of spaces; a heading may have a colon itself."""
    name = " ".join(source.name.split())
    whole = f"{name}:{source.unit}"
    return ColumnSource(name=whole) if whole in table.header else ColumnSource(name=name, unit=source.unit)


def _check_single_meaning(
    table: RawTable, headings: Sequence[tuple[str, str]], wanted: tuple[Quantity, ...], sources: Mapping[str, ColumnSource]
) -> None:
    for heading, _ in headings:
        names = [quantity.name for quantity, _ in meanings(heading, wanted) if quantity.name not in sources]
        with table.faults.collect():
            if len(names) > 1:
                raise DatasetError(
                    f"{table.file}: the column {shown(heading)} can be read as {' and '.join(names)}; rename it, or say "
                    f"which: {option_naming(names[0], heading)}, or in cable.toml "
                    f'columns = {{ {names[0]} = {{ name = "{heading}", unit = ... }} }}.'
                )


def _check_known_units(
    table: RawTable, headings: Sequence[tuple[str, str]], wanted: tuple[Quantity, ...], sources: Mapping[str, ColumnSource]
) -> None:
    """Refuse a heading that names a quantity and then says what is not understood: the column would be passed over."""
    names = {plain_name(quantity.name): quantity for quantity in wanted if quantity.dimension != "text"}
    names_of_wanted = {quantity.name for quantity in wanted}
    for heading, _ in headings:
        name, bracket, behind = heading.partition("[" if "[" in heading else "(")
        quantity = names.get(plain_name(name))
        known = meanings(heading, wanted) or ((spelling := parse_heading(heading)) and spelling.quantity in names_of_wanted)
        if not bracket or quantity is None or quantity.name in sources or known:
            continue
        with table.faults.collect():
            raise DatasetError(
                f"{table.file}, row {table.header_row}, column {shown(heading)}: this is {quantity.name}, but what follows "
                f"that, {shown(bracket + behind)}, is not just a unit; state the unit that its numbers are in, "
                f"{option_naming(quantity.name, heading, 'UNIT')}, or rename the column if it is something else."
            )


def _ambiguous_column_error(table: RawTable, quantity: str, columns: Sequence[MatchedColumn]) -> DatasetError:
    names = [table.header[candidate.position] for candidate in columns]
    both = "both" if len(names) == 2 else "all"
    return DatasetError(
        f"{table.file}: the columns {listed([shown(name) for name in names])} {both} look like {quantity}; say which, "
        f'{option_naming(quantity, names[0])}, or in cable.toml columns = {{ {quantity} = {{ name = "{names[0]}" }} }}; or '
        "rename the others."
    )


def read_unused_columns(table: RawTable, columns: Mapping[str, Column]) -> dict[str, np.ndarray]:
    """Return the numbers of the columns that are not used, or their texts, by heading.

    Args:
        table: The file.
        columns: The columns that are used.
    """
    used = {column.heading for column in columns.values()}
    unused = dict[str, np.ndarray]()
    for heading, unit, cells in zip(table.header, table.units, zip(*table.rows, strict=True), strict=False):
        if heading and heading not in used:
            values: list[str] | list[float] = [" ".join(cell.text.split()) for cell in cells]
            if all(cell.is_code or is_plain_number(cell.text) for cell in cells):
                with suppress(DatasetError):  # numbers that can be read in two ways stay texts
                    values = [nan if cell.is_code else cell.number() for cell in cells]
            unused[f"{heading} ({unit})" if unit else heading] = np.array(values)
    return unused


def require_column(
    table: RawTable, columns: Mapping[str, Column], name: str, example: str, key_path: tuple[str | int, ...] = ()
) -> Column:
    """Return the column called `name`; that there is none is noted among the table's faults, with the key that names it."""
    if name in columns:
        return columns[name]
    read = {column.heading for column in columns.values()}
    is_second = name == "output_force" and "input_force" not in columns
    error = _missing_column_error(table, name, example, read, is_second)
    error.key_path = key_path
    table.faults.faults.append(error)
    return _missing_column(table, name)


def _missing_column_error(
    table: RawTable, name: str, example: str, read: Collection[str], is_second: bool = False
) -> DatasetError:
    """Return the refusal of a table without a column; with `is_second` the likeliest heading is that of another one."""
    remaining = [heading for heading in table.header if heading not in read]
    if values := find_pivot_headings(remaining):
        return DatasetError(
            f"{table.file}: {few([shown(value) for value in values])} are above columns, as in a pivot table with a column "
            "for each angle or load. Such a table is read where these headings have their unit, as in 45° or 20 N, the other "
            "column says what it is, as in Input force (N) or Wrap angle (deg), and the cells are output forces; else write "
            "one row for each reading, in the columns wrap_angle_deg, input_force_N and output_force_N."
        )
    _, _, unit = example.partition(" or ")[0].removeprefix(name).partition("_")
    unit = unit.replace("_", "*")
    holds_numbers = [any(is_plain_number(row[i].text) for row in table.rows[:1]) for i, _ in enumerate(table.header)]
    columns = zip(table.header, table.units, holds_numbers, strict=True)
    unread = [(heading, below) for heading, below, holds in columns if heading in remaining and holds]
    likely = [unread[i] for i in rank_headings(unread, dimension_of(unit) if unit and is_unit(unit) else "")]
    options = [option_naming(name, heading, unit_to_state(heading, below, unit)) for heading, below in likely[is_second:][:1]]
    choice = [
        f", or say which it is: {option} (in cable.toml columns = {{ {name} = {{ name = ..., unit = ... }} }})"
        for option in options
    ]
    return DatasetError(
        f"{table.file} has no column {name}{_suggest_heading(name, remaining)}; it has {quoted(table.header)}. Name the "
        f"column {example}{''.join(choice)}."
    )


def describe_paired_headings(table: RawTable, columns: Mapping[str, Column], stated: Collection[str]) -> list[str]:
    """Return what is said of headings that tell the ends of the cable only together, such as T1 and T2."""
    ends = {name: columns[name].heading for name in ("input_force", "output_force") if name in columns}
    spellings = [parse_heading(heading) for name, heading in ends.items() if name not in stated]
    if len(ends) < 2 or not any(spelling and spelling.pair for spelling in spellings):
        return []
    (one, at_input), (other, at_output) = ends.items()
    return [
        f"{table.file}: {shown(at_input)} is taken as {one} and {shown(at_output)} as {other}; if it is the other way round, "
        f"say so: {option_naming(one, at_output)} {option_naming(other, at_input)}."
    ]


def _suggest_heading(name: str, header: Sequence[str]) -> str:
    near = difflib.get_close_matches(name, [plain_name(h) for h in header], n=1, cutoff=0.7)
    match = next((h for h in header if near and plain_name(h) == near[0]), None)
    return f" (is it {shown(match)}?)" if match else ""


def _column(table: RawTable, heading: str, quantity: Quantity, unit: str | None) -> Column:
    cells = tuple(row[table.header.index(heading)] for row in table.rows)
    if quantity.dimension in {"text", "ratio"} and unit is None:
        return Column(heading, cells, 1.0, None, table.faults)
    if unit is None:
        usual = quantity.to or _usual_unit(quantity.dimension)
        raise DatasetError(
            f"{table.file}: the column {shown(heading)} does not state its unit; rename it to {quantity.name}_{usual} (or the "
            f"unit it is in), or give the unit, such as {option_naming(quantity.name, heading, usual.replace('_', '*'))}, in "
            f'cable.toml columns = {{ {quantity.name} = {{ name = "{heading}", unit = ... }} }}.'
        )
    try:
        if quantity.dimension == "speed":
            factor = conversion_factor(unit, speed_dimension(unit))
        elif quantity.dimension == "route":
            factor = route_conversion_factor(unit, quantity.to or "mm")
        else:
            factor = 1.0 if quantity.dimension == "text" else conversion_factor(unit, quantity.dimension, quantity.to)
    except DatasetError as error:
        weight = weight_of(unit) if quantity.dimension == "force" else ""
        option = f": {option_naming(quantity.name, heading, weight)}" if weight else ""
        raise DatasetError(f"{table.file}, row {table.header_row}, column {shown(heading)}: {error}{option}.") from None
    in_cells = unit == table.units[table.header.index(heading)] and any(cell.unit == unit for cell in cells)
    return Column(heading, cells, factor, unit, table.faults, unit_in_cells=in_cells)


def _usual_unit(dimension: str) -> str:
    return {"force": "N", "angle": "deg", "length": "mm", "speed": "mm/s", "time": "s", "torque": "N_m"}.get(
        dimension, "mm"
    )


def _note_wrong_sources(table: RawTable, known: list[str], sources: Mapping[str, ColumnSource]) -> set[str]:
    """Return quantities whose column is missing, used twice or impossible; note faults.

    One that is misspelled is wrong under the name that is meant.
    """
    serves: dict[str, str] = {}
    wrong = set[str]()
    for name, source in sources.items():
        try:
            _check_source(table, known, name, source, serves)
            serves[source.name] = name
        except DatasetError as error:
            error.key_path = ("columns", name)
            table.faults.faults.append(error)
            wrong |= {name, *difflib.get_close_matches(name, known, n=1, cutoff=_ALIKE)}
    return wrong


def _check_source(
    table: RawTable, known: list[str], name: str, source: ColumnSource, serves: Mapping[str, str]
) -> None:
    """A column that cable.toml names is one of the file's, and serves one known quantity."""
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1, cutoff=_ALIKE)
        hint = f"did you mean {near[0]}?" if near else f"it can have {', '.join(known)}."
        raise DatasetError(f"a column is named for {shown(name)}, which {table.file} cannot have under columns; {hint}")
    if source.name not in table.header:
        raise DatasetError(
            f"{table.file} has no column {shown(source.name)}, which --column or cable.toml names for {name}; "
            f"its columns are {quoted(table.header)}."
        )
    if source.name in serves:
        raise DatasetError(
            f"the column {shown(source.name)} of {table.file} is named for both {serves[source.name]} and "
            f"{name}; correct one of them."
        )


def _named_column(table: RawTable, quantity: Quantity, source: ColumnSource) -> Column:
    written = next((unit for _, unit in meanings(source.name, (quantity,)) if unit), None)
    written = written or split_brackets(source.name)[1] or table.units[table.header.index(source.name)]
    written = written or heading_of(source.name).unit or None
    if reason := contradiction(source.unit, written):
        raise DatasetError(f"{table.file}, row {table.header_row}, column {shown(source.name)}: {reason}.")
    return _column(table, source.name, quantity, source.unit or written)
