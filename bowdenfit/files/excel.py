"""Excel workbooks: as recordings, every sheet that holds columns of numbers; as tables, the sheet that holds readings."""

import re
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import Any

from bowdenfit.errors import DatasetError, suggest_name
from bowdenfit.files.channels import Channel, ChannelFile, load_library, refuse_damage, refuse_larger
from bowdenfit.files.headings import Quantity, find_candidates
from bowdenfit.files.layout import find_layout
from bowdenfit.files.row_account import ABOVE, BLANK, RowAccount, make_account
from bowdenfit.files.sheet_columns import SheetRows, cell_text, make_channels, read_arrays
from bowdenfit.files.tables import RawTable, make_table
from bowdenfit.files.text_file import CsvRecord, Line
from bowdenfit.words import listed, quoted, shown

LARGEST_BYTES = 1 << 28
_FIRST_ROWS = 300  # judged: in which headings and the first data must stand
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*")
_PERHAPS_THOUSANDS = re.compile(r"\s*[+-]?[1-9]\d{0,2},\d{3}\s*")
_Cells = Sequence[Any]
_DEFINING = (Quantity("input_force", "force"), Quantity("output_force", "force"), Quantity("efficiency", "ratio"))


def read(path: Path, sheet: str = "") -> ChannelFile:
    """Read the columns of numbers of all sheets; with several such sheets names are "Sheet/heading".

    A sheet that cannot be read as columns of numbers, such as one of remarks or a small evaluation, is left out with a
    remark as long as another one can. Formulas count as what Excel last calculated.

    Limits: workbooks of up to 256 MiB (`LARGEST_BYTES`), about four full sheets; a million rows of two columns take a
    quarter of a minute.

    Args:
        path: The workbook (.xlsx or .xlsm).
        sheet: Title of the only sheet that is read; all if empty.

    Raises:
        DatasetError: There is no such sheet; openpyxl is not installed; the file is missing, too large or damaged; no sheet
            holds columns of numbers, or text stands among the numbers of the only one that does.
    """
    openpyxl = load_library("openpyxl", ".xlsx")
    refuse_larger(path, LARGEST_BYTES, "save the needed sheet as CSV")
    channels: dict[str, tuple[Channel, ...]] = {}
    remarks: list[str] = []
    errors: list[DatasetError] = []
    accounts: list[RowAccount] = []
    for title, rows in iterate_sheets(openpyxl, path, sheet):
        try:
            channels[title], sheet_remarks, account = _read_sheet(f"{path.name}, sheet {shown(title)}", path.name, rows)
            accounts += [account] if account else []
            remarks += [f"Sheet {shown(title)}: {remark[0].lower()}{remark[1:]}" for remark in sheet_remarks]
        except DatasetError as error:
            errors.append(error)
    filled = {title: of_sheet for title, of_sheet in channels.items() if of_sheet}
    if not filled:
        raise errors[0] if errors else _no_numbers_error(path)
    remarks += [f"A sheet was left out: {error}" for error in errors]
    account = accounts[0] if len(accounts) == 1 else None  # rows of several sheets have the same numbers
    return ChannelFile(path, "Excel workbook", tuple(_prefix_sheets(filled)), tuple(remarks), account)


def _prefix_sheets(sheets: dict[str, tuple[Channel, ...]]) -> Iterator[Channel]:
    """Yield all channels, with the sheet before their names where there are several sheets."""
    for title, channels in sheets.items():
        before = f"{title}/" if len(sheets) > 1 else ""
        for channel in channels:
            clock = channel.clock and before + channel.clock
            yield replace(channel, name=before + channel.name, clock=clock)


def _no_numbers_error(path: Path) -> DatasetError:
    return DatasetError(
        f"{path.name} has no sheet with columns of numbers; if they are formulas, open the workbook in Excel and save it, so "
        "that their values stand in the file."
    )


def _read_sheet(
    place: str, file: str, cells: Iterable[_Cells]
) -> tuple[tuple[Channel, ...], list[str], RowAccount | None]:
    iterator = iter(cells)
    first = list(islice(iterator, _FIRST_ROWS))
    remarks = list[str]()
    if _has_decimal_commas(first):
        first, iterator = [_read_decimal_commas(row) for row in first], map(_read_decimal_commas, iterator)
        remarks.append("Numbers that are stored as text with a comma are read as decimals.")
    records = [CsvRecord(i, 0, [cell_text(cell) for cell in row]) for i, row in enumerate(first, start=1)]
    layout = find_layout(records, ".", place)
    if layout is None:
        return (), [], None
    start = layout.first.row - 1
    rows = SheetRows(place, layout, chain(first[start:], iterator), layout.first.row)
    columns = read_arrays(rows)
    channels, left_out = make_channels(layout, columns)
    above = {i + 1: (ABOVE if any(first[i]) else BLANK, "") for i in range(start) if i + 1 not in layout.over}
    account = make_account(file, start + columns.rows, layout.over, above | columns.left_out, columns.beside)
    return channels, [*remarks, *left_out, *columns.remarks], account


def _has_decimal_commas(rows: Iterable[_Cells]) -> bool:
    """Return whether text cells of a sheet are numbers with a decimal comma, of which one at least cannot be thousands."""
    texts = [cell for row in rows for cell in row if isinstance(cell, str)]
    return any(_DECIMAL_COMMA.fullmatch(text) and not _PERHAPS_THOUSANDS.fullmatch(text) for text in texts)


def _read_decimal_commas(row: _Cells) -> _Cells:
    """Return the cells of a row, as numbers where they are text with a decimal comma."""
    matches = [_DECIMAL_COMMA.fullmatch(cell) if isinstance(cell, str) else None for cell in row]
    return [float(match[0].replace(",", ".")) if match else cell for cell, match in zip(row, matches, strict=True)]


def list_sheets(path: Path) -> tuple[str, ...]:
    """Return the titles of the sheets of a workbook on which something stands.

    Raises:
        DatasetError: It cannot be read.
    """
    openpyxl = load_library("openpyxl", ".xlsx")
    refuse_larger(path, LARGEST_BYTES, "save the needed sheet as CSV")
    sheets = iterate_sheets(openpyxl, path)
    return tuple(title for title, rows in sheets if any(cell_text(cell).strip() for row in rows for cell in row))


def read_workbook(path: Path, most: int | None = None, sheet: str = "") -> RawTable:
    """Return the table of a workbook; of several sheets that hold one, that whose headings say what they are.

    Args:
        path: The workbook (.xlsx or .xlsm).
        most: Number of first rows of each sheet that are enough; all if omitted.
        sheet: Title of the sheet that is read; that with the table if empty.

    Raises:
        DatasetError: It cannot be read, has no such sheet, or holds no table, or several that could be meant.
    """
    openpyxl = load_library("openpyxl", ".xlsx")
    refuse_larger(path, LARGEST_BYTES, "save the needed sheet as CSV")
    tables: dict[str, RawTable] = {}
    filled = list[str]()
    errors: list[DatasetError] = []
    place = f"{path.name}, sheet {shown(sheet)}" if sheet else path.name
    for title, rows in iterate_sheets(openpyxl, path, sheet):
        cells = [[cell_text(cell).strip() for cell in row] for row in islice(rows, most)]
        while cells and not any(cells[-1]):
            cells.pop()  # Excel keeps the format of rows that were once filled
        records = [CsvRecord(i, 0, row) for i, row in enumerate(cells, start=1)]
        lines = [Line(record.row, 0, " ".join(record.cells) + "\n") for record in records]
        try:
            if not all(record.blank for record in records):
                filled.append(title)
                tables[title] = make_table(place, lines, records, ";")
        except DatasetError as error:
            errors.append(error)
    if sheet and not filled:
        raise DatasetError(f"{place}: nothing is on this sheet; name another one.")
    by_headings = {title: table for title, table in tables.items() if _has_forces(table)} or tables
    if len(by_headings) == 1:
        ((title, table),) = by_headings.items()
        unread = [shown(other) for other in filled if other != title]
        note = f"of its sheets only {shown(title)} is read, and {listed(unread)} {'is' if len(unread) == 1 else 'are'} not"
        return replace(table, lines=replace(table.lines, note=note)) if unread else table
    if not tables and errors:
        raise errors[0]
    what = (
        f"several sheets that could be meant, {quoted(tuple(by_headings))}" if by_headings else "no sheet with a table"
    )
    remedy = f"state the one with the readings, such as --sheet {quoted(tuple(by_headings)[:1])}" if by_headings else (
        "write the headings, with units, above the columns of the readings"
    )
    raise DatasetError(f"{path.name} has {what}; {remedy}.")


def _has_forces(table: RawTable) -> bool:
    """Return whether two headings say an end of the cable each, or one an efficiency."""
    columns = find_candidates(list(zip(table.header, table.units, strict=True)), _DEFINING)
    return bool(columns["efficiency"] or (columns["input_force"] and columns["output_force"]))


def iterate_sheets(openpyxl: Any, path: Path, only: str = "") -> Iterator[tuple[str, Iterator[_Cells]]]:
    """Yield the title and rows of each sheet, or of the only one; what the library cannot read becomes one sentence.

    Raises:
        DatasetError: There is no such sheet.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # on styles and validations, which do not matter here
        with refuse_damage(path):
            workbook = openpyxl.load_workbook(path, read_only=True, data_only=True)
        try:
            titles = [sheet.title for sheet in workbook.worksheets]
            if only and only not in titles:
                raise DatasetError(f"{path.name} has no sheet {shown(only)}{suggest_name(only, titles)}", key_path=("sheet",))
            for sheet in workbook.worksheets:
                if only and sheet.title != only:
                    continue
                sheet.reset_dimensions()
                yield sheet.title, _rows(path, sheet)
        finally:
            workbook.close()


def _rows(path: Path, sheet: Any) -> Iterator[_Cells]:
    with refuse_damage(path):
        yield from sheet.iter_rows(values_only=True)
