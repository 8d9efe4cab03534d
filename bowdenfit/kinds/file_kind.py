"""Guess the kind of measurement that a file without a description holds, say why, and find the wrap angle that it states."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.clocks import is_date, names_time, stated_rate
from bowdenfit.files.formats import TEXT, WORKBOOKS
from bowdenfit.files.headings import Quantity, find_candidates, heading_of
from bowdenfit.files.serial_log import is_serial_log
from bowdenfit.files.spellings import parse_heading, without_accents
from bowdenfit.files.tables import RawTable, read_table
from bowdenfit.files.text_file import first_bytes, first_lines
from bowdenfit.kinds.forces.stated_noise import FORCE_SDS
from bowdenfit.kinds.forces.table import count_loads
from bowdenfit.units import conversion_factor, dimension_of, is_unit, measures
from bowdenfit.words import shown

_FIRST_BYTES = 1 << 15  # bytes in which a file may state its wrap angle
_UNIT = r"(?P<{}>degrees|degree|deg|°|º|grad|rad)"
_NUMBER = r"(?P<{}>\d+(?:[.,]\d+)?)"
_WORD = r"(?:wrap\w*|bend\w*|umschling\w*|umlenk\w*|biegewinkel|winkel|enroulement|abraz\w*|avvolgimento|ang[lou]\w*)"
_GAP = r"[^\d\n]{0,24}?"
_IN_TEXT = re.compile(
    rf"\b{_WORD}\b{_GAP}(?:{_NUMBER.format('a')}[\s;,\"]{{0,3}}{_UNIT.format('b')}"
    rf"|[(\[]{_UNIT.format('c')}[)\]][\s:=;,\"]{{0,4}}{_NUMBER.format('d')})",
    re.IGNORECASE,
)
_IN_NAME = re.compile(rf"(?<![\d.]){_NUMBER.format('a')}[\s_-]?{_UNIT.format('b')}(?![a-z])", re.IGNORECASE)


# Limits by which a file is guessed to be a table or a recording: judgements. Where they leave it open, the refusal asks which.
HEAD = 400  # rows that are looked at
_FEW, _LONG = 50, 200  # least rows of a recording with a slow clock, and most rows of a table without one
_SLOW = 1.0  # seconds between rows beyond which a person may have written them
_UNEVEN = 3.0  # largest step of a clock over its smallest
_SMOOTH = 0.02  # von Neumann's ratio: mean square of a force's steps over twice its variance; white noise has 1
FORCES = (Quantity("input_force", "force"), Quantity("output_force", "force"))
BESIDE_FORCES = (
    *(Quantity(name, "text") for name in ("run", "stroke", "group")),
    Quantity("efficiency", "ratio"),
    Quantity("loss", "ratio"),
    Quantity("velocity", "speed"),
    Quantity("wrap_angle", "angle"),
    Quantity("wrap_angle_sd", "angle"),
    Quantity("efficiency_sd", "ratio"),
    *FORCE_SDS,
)
COLUMNS = (*FORCES, *BESIDE_FORCES)
"""Columns that a table without a description may have."""
_ONE_FORCE = (Quantity("force", "force"), *FORCES)
_POSITION = (Quantity("displacement", "length"), Quantity("position", "length"))


def find_stated_angle(path: Path) -> tuple[str, str] | None:
    """Return the wrap angle that a file states, such as "90deg", and where; None if it states none, or several.

    Args:
        path: The file; only the first lines of a text are looked at.
    """
    angles = {_angle(match): "a line of the file" for line in _lines(path) for match in _IN_TEXT.finditer(line)}
    angles = angles or {_angle(match): "its name" for match in _IN_NAME.finditer(path.stem)}
    return next(iter(angles.items())) if len(angles) == 1 else None


def _angle(match: re.Match[str]) -> str:
    groups = match.groupdict()
    number, unit = groups["a"] or groups.get("d") or "", groups["b"] or groups.get("c") or ""
    return number.replace(",", ".") + ("rad" if unit.lower() == "rad" else "deg")


def _lines(path: Path) -> list[str]:
    """Return the first lines of a text file without accents; none of a binary one."""
    if path.suffix.lower() not in TEXT:
        return []
    try:
        _, lines = first_lines(first_bytes(path, _FIRST_BYTES), path.name, whole=False)
    except DatasetError:
        return []
    return [without_accents(line.text) for line in lines]


def columns_of_kind(kind: str) -> tuple[Quantity, ...]:
    """Return the columns that a table of a kind may have, without a description."""
    return (*COLUMNS, _ONE_FORCE[0], *_POSITION) if kind == "displacement" else COLUMNS


@dataclass(frozen=True)
class FileKind:
    """Kind of measurement that a file without a description holds.

    Args:
        kind: Name of the kind of measurement that it holds.
        why: Why it is taken for that, as a clause behind "because".
        other: The kind that it could be as well; empty where there is no doubt.
    """

    kind: str
    why: str
    other: str = ""


def guess_file_kind(
    path: Path, has_channels: bool = False, named: Sequence[str] = (), sheet: str = ""
) -> FileKind:
    """Guess the kind of measurement that a file without a description holds.

    A time column makes a recording, unless a column of runs, strokes or groups says that its rows are readings of their own;
    its number of rows does not.

    Args:
        path: The file.
        has_channels: Whether the user names channels, as recordings have.
        named: Quantities whose columns the user names, as tables have.
        sheet: Title of the sheet of a workbook; that with a table if empty.

    Raises:
        DatasetError: The file is missing or empty, or no text although its ending says so.
    """
    if named:
        is_ratio = "efficiency" in named or "loss" in named
        kind = "efficiencies" if is_ratio else "displacement" if "displacement" in named else "forces"
        return FileKind(kind, "its columns are named with --column")
    if has_channels:
        return FileKind("recordings", "its channels are named with --channel")
    if path.suffix.lower() not in (*TEXT, *WORKBOOKS):
        return FileKind(
            "recordings", f"files with the ending {path.suffix or '(none)'} are those of acquisition programs"
        )
    if path.suffix.lower() in TEXT and is_serial_log(path):
        return FileKind("recordings", "its lines have numbers behind the same keys, as logs of a serial line do")
    try:
        table = read_table(path, HEAD, sheet)
    except DatasetError as error:
        return _guess_without_headings(path, error)
    return _guess_by_columns(path, table)


def _guess_without_headings(path: Path, error: DatasetError) -> FileKind:
    """Guess the kind of a file whose first rows are no table; refuse a short one for what is wrong with them.

    Raises:
        DatasetError: It is short, or no text.
    """
    if path.suffix.lower() in WORKBOOKS:
        return FileKind("recordings", "none of its sheets is a table of readings")
    _, lines = first_lines(first_bytes(path, 1 << 18), path.name, whole=False, most=_LONG + 1)
    if len(lines) <= _LONG:
        raise error
    return FileKind("recordings", "it is long, and its first rows are no headings over columns of readings")


def _guess_by_columns(path: Path, table: RawTable) -> FileKind:
    clock = next((i for i, _ in enumerate(table.header) if _is_time(table, i)), None)
    quantities = {name for name, columns in find_candidates(_headings(table), COLUMNS).items() if columns}
    forces = {quantity.name for quantity in FORCES}
    kind = "efficiencies" if quantities & {"efficiency", "loss"} and not forces <= quantities else "forces"
    rows_alone = next((name for name in ("run", "stroke", "group") if name in quantities), "")
    if _has_one_force_and_a_position(table):
        return FileKind("displacement", "it has one force and a displacement")
    if clock is not None:
        return _guess_with_clock(table, clock, kind, rows_alone)
    rate = None if path.suffix.lower() in WORKBOOKS else stated_rate(_lines_above(path, table))
    if rate is not None:
        return FileKind("recordings", f"the line {shown(rate[1])} states its sampling rate")
    if kind == "efficiencies" or len(table.rows) <= _LONG or not _is_smooth(table):
        return FileKind(kind, "it has no column of time")
    reason = "it has no column of time, but many rows in which the force changes little from one to the next"
    return FileKind(kind, reason, "recordings")


def is_angle_table(table: RawTable) -> bool:
    """Return whether a table has nothing but wrap angles by length, which is read beside others and is no bench alone."""
    units = [heading_of(heading, unit).unit for heading, unit in _headings(table) if heading]
    dimensions = [dimension_of(unit) if unit and is_unit(unit) else "" for unit in units]
    return dimensions.count("length") == 1 and dimensions.count("angle") == len(dimensions) - 1 > 0


def _lines_above(path: Path, table: RawTable) -> list[str]:
    _, above = first_lines(first_bytes(path, 1 << 15), path.name, whole=False, most=table.header_row - 1)
    return [line.text for line in above]


def _has_one_force_and_a_position(table: RawTable) -> bool:
    """Return whether a table has a single column of forces, at the motor if it says where, and one of displacements."""
    headings = _headings(table)
    counts = {name: len(columns) for name, columns in find_candidates(headings, (*_ONE_FORCE, *_POSITION)).items()}
    units = [heading_of(heading, unit).unit for heading, unit in headings]
    forces = sum(unit is not None and measures(unit, "force") for unit in units)
    at_motor = counts["force"] + counts["input_force"] == 1 and not counts["output_force"]
    return at_motor and forces <= 1 and counts["displacement"] + counts["position"] == 1


def _guess_with_clock(table: RawTable, clock: int, kind: str, rows_alone: str) -> FileKind:
    heading, steps, many = shown(table.header[clock]), _steps(table, clock), len(table.rows) >= _FEW
    if (rows_alone or kind == "efficiencies") and not (many and steps and float(np.median(steps)) < _SLOW):
        return FileKind(
            kind, f"its column {rows_alone or 'of efficiencies'} says that each row is a reading of its own"
        )
    if rows_alone or kind == "efficiencies":
        beside = rows_alone or "of efficiencies"
        reason = (
            f"it has a column of time, {heading}, whose steps are those of a sampled force, but also a column {beside}"
        )
        return FileKind("recordings", reason, kind)
    has_dates = not steps and any(is_date(row[clock].text.strip()) for row in table.rows[:_FEW])
    even = bool(steps) and min(steps) > 0 and max(steps) < _UNEVEN * min(steps)
    sampled = bool(steps) and (float(np.median(steps)) < _SLOW or (many and (even or _is_smooth(table))))
    if sampled or (has_dates and many):
        return FileKind("recordings", f"it has a column of time, {heading}")
    apart = f"{float(np.median(steps)):.3g} s apart" if steps else ""
    if many:
        uneven = f"whose rows are uneven, about {apart}" if apart else "that holds no times"
        return FileKind("recordings", f"it has a column of time, {heading}, {uneven}", kind)
    few = f"{len(table.rows)} rows" + (f", {apart}" if apart else "")
    return FileKind("recordings", f"it has a column of time, {heading}, but only {few}", kind)


def _headings(table: RawTable) -> list[tuple[str, str]]:
    return list(zip(table.header, table.units, strict=True))


def _is_time(table: RawTable, column: int) -> bool:
    """Return whether a column is one of time, by its heading, or by a unit of time over rising numbers; T1 is a tension."""
    heading, unit = table.header[column], table.units[column]
    other = parse_heading(heading, unit)
    steps = _steps(table, column)
    if names_time(heading):
        return not (other and (other.unit or other.pair)) and (len(steps) < 2 or float(np.median(steps)) > 0)
    written = heading_of(heading, unit).unit
    if not written or not is_unit(written) or dimension_of(written) != "time":
        return False
    return bool(steps) and min(steps) > 0


def read_numbers(table: RawTable, column: int) -> list[float]:
    """Return the numbers of a column as written; NaN where a cell holds none."""
    numbers = []
    for row in table.rows:
        try:
            numbers.append(row[column].number())
        except DatasetError:
            numbers.append(math.nan)
    return numbers


def _steps(table: RawTable, column: int) -> list[float]:
    """Return the seconds from each of the first rows to the next; empty where these are no numbers."""
    values = read_numbers(table, column)
    finite = [value for value in values if math.isfinite(value)]
    unit = heading_of(table.header[column], table.units[column]).unit
    try:
        factor = conversion_factor(unit, "time") if unit else 1.0
    except DatasetError:
        factor = 1.0
    return [factor * (after - before) for before, after in pairwise(finite)] if len(finite) > len(values) / 2 else []


def _is_smooth(table: RawTable) -> bool:
    """Return whether the first force changes from row to row as a sampled one does, through many values."""
    for i in _columns_of_forces(table):
        values = np.array(read_numbers(table, i))
        values = values[np.isfinite(values)]
        if len(values) < 2 or np.ptp(np.diff(values)) == 0:  # an index
            continue
        spread = float(np.var(values)) if len(values) > _LONG else 0.0
        spreads = len(set(values.tolist())) > len(values) / 4 and (values.min() <= 0 or count_loads(values) is None)
        return spread > 0 and spreads and float(np.mean(np.diff(values) ** 2)) < 2 * _SMOOTH * spread
    return False


def _columns_of_forces(table: RawTable) -> list[int]:
    """Return the columns that are forces by their unit or heading; where none is, those without a unit."""
    units = [heading_of(heading, unit).unit for heading, unit in _headings(table)]
    named = [parse_heading(heading, unit) for heading, unit in _headings(table)]
    forces = [i for i, other in enumerate(named) if units[i] in {"N", "kN", "lbf"} or (other and "force" in other.quantity)]
    return forces or [i for i, unit in enumerate(units) if not unit]
