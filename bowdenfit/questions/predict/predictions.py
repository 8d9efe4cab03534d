"""What `bowdenfit predict` prints: sentences and a table with units for people, or the rows as they are as CSV."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from bowdenfit.display import Block, Display, ResultTable, Rows, blocks_of, separate
from bowdenfit.words import decimals, few, percent, significant

Row = Mapping[str, Any]
_UNITS = {"N_m_per_rad": "N*m/rad", "N_per_mm": "N/mm", "N_mm": "N*mm", "N_m": "N*m", "N": "N", "mm": "mm", "deg": "deg"}
ROW = "row"  # of a table of what to predict
_MOUNTING, _PROBABILITY = "mounting", "_probability"
_RATIOS = ("dynamic_range",)  # quantities without a unit


def prediction_blocks(rows: Sequence[Row]) -> list[Block]:
    """Describe predictions: the answer in a sentence, of several places in a table, and what lies outside.

    Args:
        rows: One a place.
    """
    if not rows:
        return ["Nothing was asked for."]
    if ROW in rows[0]:
        return _table_of_rows(rows)
    if "in_words" in rows[0]:
        return [rows[0]["in_words"]]
    if len(rows) == 1:
        return separate(_single_prediction(rows[0]), _note_lines(rows))
    return separate([_highest_and_lowest(rows)], [_prediction_table(rows)], _note_lines(rows))


def column_units(row: Row) -> dict[str, str]:
    """Return units of the columns, "1" of plain numbers; moments and quantiles have that of their quantity."""
    units, unit = dict[str, str](), "1"
    for name, value in row.items():
        if isinstance(value, float):
            own = next((words for ending, words in _UNITS.items() if name.endswith(f"_{ending}")), None)
            unit = own or ("1" if name.endswith("efficiency") else unit)
            units[name] = "1" if name.endswith(_PROBABILITY) else unit
    return units


def _quantities(row: Row) -> list[str]:
    """Return names of what is predicted: the first has its mean under that name, the others after their own."""
    names = list(row)
    return [names[names.index("mean") - 1], *(name for name in names if f"{name}_mean" in row)]


def _position_name(row: Row) -> str | None:
    """Name of where it is predicted; None where a cable has just one place."""
    first = next(iter(row))
    return first if first != _quantities(row)[0] else None


def _name_and_unit(name: str) -> tuple[str, str]:
    """Return a column's name in words, and its unit; efficiencies are shown in percent."""
    if name.endswith("efficiency"):
        return name.replace("_", " "), "%"
    if name in _RATIOS:
        return name.replace("_", " "), ""
    unit = next((unit for unit in _UNITS if name.endswith(f"_{unit}")), None)
    if unit is not None:
        return name.removesuffix(f"_{unit}").replace("_", " "), _UNITS[unit]
    words, _, unit = name.rpartition("_")
    return words.replace("_", " "), unit


def _position_text(row: Row) -> str:
    """Return such as '470 mm'."""
    name = _position_name(row)
    return f"{row[name]:.6g} {_name_and_unit(name)[1]}" if name is not None else "the nominal wrap angles"


def _format_value(row: Row, name: str, variant: str = "") -> tuple[str, str]:
    """Format median and interval of a quantity to the digits that the interval has; or those in one mounting."""
    prefix = "" if name == _quantities(row)[0] else f"{name}_"
    scale = 100.0 if _name_and_unit(name)[1] == "%" else 1.0
    value, low, high = (scale * row[key] for key in (name, f"{variant or prefix}q05", f"{variant or prefix}q95"))
    if not high > low:
        return f"{value:.4g}", f"{low:.4g} to {high:.4g}"
    digits = decimals(high - low)
    return f"{value:z.{digits}f}", f"{low:z.{digits}f} to {high:z.{digits}f}"


def _single_prediction(row: Row) -> list[str]:
    """Describe the predictions at one place in sentences."""
    lines = []
    for name in _quantities(row):
        (words, unit), (value, interval) = _name_and_unit(name), _format_value(row, name)
        lines.append(
            f"{words[0].upper()}{words[1:]} at {_position_text(row)}: {f'{value} {unit}'.strip()} "
            f"(90 % interval {f'{interval} {unit}'.strip()})."
        )
    if f"{_MOUNTING}_q05" in row:
        name = _quantities(row)[0]
        lines.append(
            f"Any one mounting of the cable: {_format_value(row, name, f'{_MOUNTING}_')[1]} {_name_and_unit(name)[1]}."
        )
    lines += [f"Probability that it is slack: {percent(row[name], 0)}." for name in row if name.endswith(_PROBABILITY)]
    return lines


def _highest_and_lowest(rows: Sequence[Row]) -> str:
    """Say where the first quantity is highest and lowest; among places outside the curves only where all are."""
    name, inside = _quantities(rows[0])[0], [row for row in rows if row.get("in_range", True)]
    words, unit = _name_and_unit(name)
    unit = unit and f" {unit}"
    which = "" if len(inside) == len(rows) else ", inside the curves" if inside else ", all outside the curves"
    high, low = (choose(inside or rows, key=lambda row: row[name]) for choose in (max, min))
    sentence = f"{words[0].upper()}{words[1:]}{which}: "
    if high is low:
        sentence += f"{_format_value(high, name)[0]}{unit} at {_position_text(high)}"
    else:
        sentence += f"highest {_format_value(high, name)[0]}{unit} at {_position_text(high)}, "
        sentence += f"lowest {_format_value(low, name)[0]}{unit} at {_position_text(low)}"
    return f"{sentence}. 90 % intervals are in brackets."


def _table_of_rows(rows: Sequence[Row]) -> list[Block]:
    """Return predictions row by row of a table, with what each row states."""
    stated = list(rows[0])[: list(rows[0]).index(_quantities(rows[0])[0])]
    columns = [[_stated_heading(name), *(_stated_text(row[name]) for row in rows)] for name in stated]
    heads, *cells = zip(*columns, *_table_columns(rows), strict=True)
    lines = ["90 % intervals are in brackets."]
    for note in dict.fromkeys(row["note"] for row in rows if row["note"]):
        where = [str(row[ROW]) for row in rows if row["note"] == note]
        lines.append(f"{'Everywhere' if len(where) == len(rows) > 1 else f'Row {few(where, 4)}'}: {note}.")
    return separate([ResultTable(heads, cells, narrow=True)], lines)


def _stated_heading(name: str) -> str:
    words, unit = (name, "") if name in (ROW, "stroke") else _name_and_unit(name)
    return f"{words} ({unit})" if unit else words


def _stated_text(value: Any) -> str:
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def _prediction_table(rows: Sequence[Row]) -> ResultTable:
    """Return the predictions at all places in a table."""
    name = next(iter(rows[0]))  # of several places it is there
    words, unit = _name_and_unit(name)
    heads, *cells = zip([f"{words} ({unit})", *(f"{row[name]:.6g}" for row in rows)], *_table_columns(rows), strict=True)
    return ResultTable(heads, cells, narrow=True)


def _table_columns(rows: Sequence[Row]) -> Iterator[list[str]]:
    """Return the columns with their headings."""
    for name in _quantities(rows[0]):
        words, unit = _name_and_unit(name)
        known = [_format_value(row, name) for row in rows]
        yield [f"{words} ({unit})" if unit else words, *(f"{value} ({interval})" for value, interval in known)]
    if f"{_MOUNTING}_q05" in rows[0]:
        name = _quantities(rows[0])[0]
        yield ["in any one mounting", *(_format_value(row, name, f"{_MOUNTING}_")[1] for row in rows)]
    for name in rows[0]:
        if name.endswith(_PROBABILITY):
            yield [f"{name.removesuffix(_PROBABILITY)}, probability", *(percent(row[name], 0) for row in rows)]


def _note_lines(rows: Sequence[Row]) -> list[str]:
    """Return notes that hold of all places, and what lies outside where."""
    of_load = rows[0].get("at_input_force_N")
    notes = [] if of_load is None else [f"At an input force of {significant(of_load)} N, because friction depends on the load."]
    for note in dict.fromkeys(row["note"] for row in rows if row["note"]):
        where = [_position_text(row) for row in rows if row["note"] == note]
        notes.append(f"{'Everywhere' if len(where) == len(rows) > 1 else few(where, 4)}: {note}.")
    return notes


class Predictions(Display, list[dict[str, Any]]):
    """What `predict` answers; units of forces, lengths and angles stand in the names of the columns."""

    def _table(self) -> Rows:
        return self, column_units(self[0] if self else {})


blocks_of.register(Predictions)(prediction_blocks)
