"""Tables of readings in whatever file they are kept."""

from pathlib import Path

from bowdenfit.files.csv_table import RawTable, read_csv
from bowdenfit.inputs import refuse_special

WORKBOOKS = (".xlsx", ".xlsm")


def read_table(path: Path, most: int | None = None) -> RawTable:
    """Read one table from a CSV file or an Excel workbook.

    Args:
        path: The file.
        most: Number of its first rows that are enough; all if omitted.

    Raises:
        DatasetError: See `read_csv` and `read_workbook`.
    """
    refuse_special(path)
    if path.suffix.lower() not in WORKBOOKS:
        return read_csv(path, most)
    from bowdenfit.files import checked_ending
    from bowdenfit.files.apart import call_apart

    checked_ending(path)
    table: RawTable = call_apart(path, "bowdenfit.files.workbook_table:read_workbook", most)
    return table
