"""Where the rows of a recording in a CSV file went."""

from pathlib import Path

from bowdenfit.files.csv_start import Sheet
from bowdenfit.files.row_account import BLANK, RowAccount, account_of
from bowdenfit.files.sheet_columns import SheetColumns
from bowdenfit.files.text_file import lines_between, rows_before

_CUT = "the file breaks off there"


def account_of_csv(path: Path, sheet: Sheet, columns: SheetColumns, quick: tuple[int, int], stop: int) -> RowAccount:
    """The account of a file.

    Args:
        path: The file.
        sheet: What its first lines tell.
        columns: What its last rows hold, which were read one by one.
        quick: Where the rows end that were read at once [bytes], and how many these are.
        stop: Where the last whole row ends [bytes].
    """
    end, rows = quick
    size = path.stat().st_size
    first = rows_before(path, sheet.start) + 1
    reasons = {**sheet.above, **columns.left_out}
    if end > sheet.start and rows_before(path, end) - first + 1 != rows:
        texts = enumerate(lines_between(path, sheet.encoding, sheet.start, end), start=first)
        reasons |= {row: (BLANK, "") for row, text in texts if not text.strip()}
    total = rows_before(path, size) + (0 if _ends(path, size) else 1)
    if stop < size:
        reasons |= dict.fromkeys(range(rows_before(path, stop) + 1, total + 1), (_CUT, ""))
    return account_of(path.name, total, sheet.headings, reasons, columns.beside)


def _ends(path: Path, size: int) -> bool:
    """Whether the last line has an end."""
    with path.open("rb") as file:
        file.seek(max(size - 2, 0))
        return file.read().rstrip(b"\0").endswith((b"\n", b"\r"))
