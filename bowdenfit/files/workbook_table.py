"""Tables in Excel workbooks: the sheet that holds readings, as rows of text."""

from itertools import islice
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.files.csv_rows import CsvRecord
from bowdenfit.files.csv_table import RawTable, raw_table
from bowdenfit.files.excel import LARGEST_BYTES, sheets_of
from bowdenfit.files.libraries import load
from bowdenfit.files.matching import Quantity, find_candidates
from bowdenfit.files.outcome import refuse_larger
from bowdenfit.files.sheet_cells import text_of
from bowdenfit.files.text_file import Line
from bowdenfit.words import quoted

_DEFINING = (Quantity("input_force", "force"), Quantity("output_force", "force"), Quantity("efficiency", "ratio"))


def read_workbook(path: Path, most: int | None = None) -> RawTable:
    """The table of a workbook; of several sheets that hold one, that whose headings say what they are.

    Args:
        path: The workbook (.xlsx or .xlsm).
        most: Number of first rows of each sheet that are enough; all if omitted.

    Raises:
        DatasetError: It cannot be read, or holds no table, or several that could be meant.
    """
    openpyxl = load("openpyxl", ".xlsx")
    refuse_larger(path, LARGEST_BYTES, "save the needed sheet as CSV")
    tables: dict[str, RawTable] = {}
    errors: list[DatasetError] = []
    for title, rows in sheets_of(openpyxl, path):
        cells = [[text_of(cell).strip() for cell in row] for row in islice(rows, most)]
        while cells and not any(cells[-1]):
            cells.pop()  # Excel keeps the format of rows that were once filled
        records = [CsvRecord(i, 0, row) for i, row in enumerate(cells, start=1)]
        lines = [Line(record.row, 0, " ".join(record.cells) + "\n") for record in records]
        try:
            if not all(record.blank for record in records):
                tables[title] = raw_table(path.name, lines, records, ";")
        except DatasetError as error:
            errors.append(error)
    by_headings = {title: table for title, table in tables.items() if _has_forces(table)} or tables
    if len(by_headings) == 1:
        return next(iter(by_headings.values()))
    if not tables and errors:
        raise errors[0]
    what = f"several sheets that could be meant, {quoted(tuple(by_headings))}" if by_headings else "no sheet with a table"
    raise DatasetError(f"{path.name} has {what}; save the one with the readings as CSV, or in a workbook of its own.")


def _has_forces(table: RawTable) -> bool:
    """Whether two headings say an end of the cable each, or one an efficiency."""
    columns = find_candidates(list(zip(table.header, table.units, strict=True)), _DEFINING)
    return bool(columns["efficiency"] or (columns["input_force"] and columns["output_force"]))
